//! Contact of many bodies in one step: from predicted velocities to those that create no overlap.

use super::bonds::Bonds;
use super::gap::{Placed, Touch};
use super::pairs::{self, Pair, Range};
use super::projection::Method;
use super::step::Step;
use super::walls::Walls;
use super::{Contact, ContactError, Law, Partner, Wall};
use crate::body::{Body, Hold};
use crate::mesh::Point;
use crate::shape::{Pose, Shape, Twist, perpendicular, turned};

/// What contact can change about the motion of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Freedom {
    /// Everything; mass and moment of inertia, or the resistances to velocity and spin. Both > 0.
    Free {
        /// Or the resistance to translation.
        mass: f64,
        /// Or the resistance to rotation.
        inertia: f64,
    },
    /// The spin about a point given in the body's frame; inertia, or resistance, *about this point*.
    Pinned {
        /// The point that stays, in the body's frame.
        pivot: Point,
        /// About the pivot.
        inertia: f64,
    },
    /// Nothing: it will be at `next`.
    Given {
        /// Where it will be at the end of the step.
        next: Pose,
    },
}

/// A body that takes part in a step.
#[derive(Debug, Clone, Copy)]
pub struct Mover<'a> {
    /// What messages call it.
    pub name: &'a str,
    /// Its outline, in its own frame.
    pub shape: &'a Shape,
    /// Where it is at the beginning of the step.
    pub pose: Pose,
    /// What it would do without contact; of pinned bodies only the spin counts, of given ones nothing.
    pub predicted: Twist,
    /// How contact may change its step.
    pub freedom: Freedom,
    /// What it did before the step; counts where bodies rub or bounce.
    pub last: Twist,
}

impl<'a> Mover<'a> {
    /// A body without inertia in a fluid with friction `C_F`, that would have the motion `predicted` for the time `dt`.
    ///
    /// The projection weighs such bodies by resistances: `4π + C_F|B|` against translation and `4πr²` against rotation,
    /// r the largest radius. The forces of contact are then forces in the units of the fluid.
    pub fn in_fluid(body: &'a Body, pose: Pose, predicted: Twist, dt: f64, friction: f64) -> Self {
        let four_pi = 4.0 * std::f64::consts::PI;
        let mass = four_pi + friction * body.shape.area();
        let inertia = four_pi * body.shape.circumradius().powi(2);
        let freedom = match &body.hold {
            Hold::Free => Freedom::Free { mass, inertia },
            Hold::Pinned(pivot) => Freedom::Pinned { pivot: *pivot, inertia: inertia + mass * pivot.norm_squared() },
            Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => {
                let (position, angle) = (pose.position + predicted.velocity * dt, pose.angle + predicted.spin * dt);
                Freedom::Given { next: Pose { position, angle } }
            }
        };
        Self { name: &body.name, shape: &body.shape, pose, predicted, freedom, last: predicted }
    }
}

/// More friction cannot be told from bodies that never slide.
pub const MOST_FRICTION: f64 = 1e3;

/// In which metric velocities are projected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// Masses: `M (W − V*) = Δt Σ λ G`.
    Mass,
    /// Resistances of bodies without inertia: `R (W − V*) = Σ λ G`.
    Resistance,
}

/// How contact is solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// How bodies part again.
    pub law: Law,
    /// Gap η that bodies keep: `D + Δt G·V ≥ η`.
    pub margin: f64,
    /// What a gap may miss, relative to the radius of the smaller body; rounding of the positions comes on top.
    pub tolerance: f64,
    /// Coefficient μ of Coulomb's friction, in inelastic contact: `|λ_t| ≤ μ λ`.
    pub friction: f64,
    /// Restitution e of bodies with inertia, in inelastic contact: `u_n⁺ ≥ −e u_n⁻`.
    pub restitution: f64,
    /// How the quadratic programme is solved.
    pub method: Method,
    /// Overlap that a step accepts at its beginning, relative to the radius of the smaller body, and then removes. More
    /// is refused.
    pub overlap: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            law: Law::Inelastic,
            margin: 0.0,
            tolerance: 1e-12,
            friction: 0.0,
            restitution: 0.0,
            method: Method::Newton,
            overlap: 1e-9,
        }
    }
}

impl Settings {
    /// # Errors
    /// A value that breaks its rule.
    pub fn check(&self) -> Result<(), ContactError> {
        let error = |key, value, rule, hint| Err(ContactError::Setting { key, value, rule, hint });
        if !(self.margin >= 0.0 && self.margin.is_finite()) {
            return error("margin", self.margin, "must be finite and at least 0", "0 lets bodies touch");
        }
        if !(1e-14..=1e-3).contains(&self.tolerance) {
            return error("tolerance", self.tolerance, "must lie between 1e-14 and 1e-3", "1e-12 is the default");
        }
        if !(0.0..=MOST_FRICTION).contains(&self.friction) {
            return error("friction", self.friction, "must lie between 0 and 1e3", "0.3 is that of many solids");
        }
        if !(0.0..=1.0).contains(&self.restitution) {
            return error(
                "restitution",
                self.restitution,
                "must lie between 0 and 1",
                "0 is inelastic, 1 loses nothing",
            );
        }
        if self.law != Law::Inelastic && (self.friction, self.restitution) != (0.0, 0.0) {
            let (key, value) = match self.friction {
                0.0 => ("restitution", self.restitution),
                friction => ("friction", friction),
            };
            return error(key, value, "needs inelastic contact", "bodies that stick neither rub nor bounce");
        }
        if !(self.overlap >= 0.0 && self.overlap.is_finite()) {
            return error("overlap", self.overlap, "must be finite and at least 0", "1e-9 is the default");
        }
        if let Law::Gluey { gamma_min } = self.law
            && (gamma_min > 0.0 || gamma_min.is_nan())
        {
            return error(
                "gamma_min",
                gamma_min,
                "must be at most 0",
                "0 is contact without glue, -inf are smooth bodies",
            );
        }
        Ok(())
    }
}

/// What a projection took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effort {
    /// Pairs that could meet.
    pub pairs: usize,
    /// Rows of the quadratic programme.
    pub rows: usize,
    /// Linear solves, or steps of Uzawa's method.
    pub iterations: usize,
    /// Factorisations of the matrix of Newton's method.
    pub factorisations: usize,
    /// Projections: more than one when bodies turn, or roll inside of a wall, so far that the straight prediction of a
    /// gap is not enough.
    pub rounds: usize,
}

/// The step that bodies make.
#[derive(Debug, Clone, Default)]
pub struct Projected {
    /// Velocities and spins that create no overlap.
    pub twists: Vec<Twist>,
    /// Where the bodies are after the step.
    pub poses: Vec<Pose>,
    /// Contact force and torque on each body.
    pub forces: Vec<[f64; 3]>,
    /// Pairs that are close or touch, in ascending order, with their gaps after the step; of those whose motion is
    /// given, all that overlap.
    pub contacts: Vec<Contact>,
    /// Contact force on all walls.
    pub wall_force: Point,
    /// Least gap after the step of all pairs that were near, infinite when none was.
    pub gap: f64,
    /// What it took.
    pub effort: Effort,
}

/// Contact between bodies and with walls, with what it remembers from step to step.
#[derive(Debug, Clone)]
pub struct Solver {
    pub(super) walls: Walls,
    pub(super) settings: Settings,
    pub(super) bonds: Bonds,
}

impl Solver {
    /// # Errors
    /// A setting that breaks its rule.
    pub fn new(walls: &[Wall], settings: Settings) -> Result<Self, ContactError> {
        settings.check()?;
        Ok(Self { walls: Walls::new(walls), settings, bonds: Bonds::default() })
    }

    /// No walls, and settings that count for nothing.
    pub(super) fn empty() -> Self {
        Self { walls: Walls::new(&[]), settings: Settings::default(), bonds: Bonds::default() }
    }

    /// How contact is solved.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What bodies cannot enter and that never moves.
    pub fn walls(&self) -> &[Wall] {
        self.walls.all()
    }

    /// What must be kept to go on to the bit: γ and the last multipliers.
    pub fn bonds(&self) -> &Bonds {
        &self.bonds
    }

    /// Goes on from [`Solver::bonds`].
    pub fn restore(&mut self, bonds: Bonds) {
        self.bonds = bonds;
    }

    /// Refuses bodies that overlap each other or walls; two given ones may, they never push each other.
    ///
    /// # Errors
    /// The first pair that overlaps by more than the settings accept.
    pub fn check(&self, movers: &[Mover]) -> Result<(), ContactError> {
        let ranges: Vec<Range> = movers.iter().map(|m| range(m, 0.0)).collect();
        let mut found = Vec::new();
        for pair in pairs::find(&ranges, self.walls.all()).pushed {
            found.clear();
            self.touches(movers, pair, |k| movers[k].pose, 0.0, &mut found);
            for touch in &found {
                self.refuse_overlap(movers, pair, touch)?;
            }
        }
        Ok(())
    }

    /// The velocities nearest to the predicted ones that create no overlap, and the step with them:
    /// `W = argmin |W − V*|²_M` over `D(x) + Δt G·W ≥ η`; then γ is renewed.
    ///
    /// # Errors
    /// Overlap at the beginning; predictions that are not finite; bodies that cannot move without overlap.
    pub fn project(&mut self, movers: &[Mover], dt: f64, metric: Metric) -> Result<Projected, ContactError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(ContactError::Step { dt });
        }
        movers.iter().try_for_each(check_mover)?;
        let (projected, bonds) = {
            let mut step = Step::new(self, movers, dt, metric);
            (step.solve()?, step.bonds())
        };
        for (mover, (pose, twist)) in movers.iter().zip(projected.poses.iter().zip(&projected.twists)) {
            let values = [pose.position.x, pose.position.y, pose.angle, twist.velocity.x, twist.velocity.y, twist.spin];
            if let Some(&value) = values.iter().find(|v| !v.is_finite()) {
                let (body, at) = (mover.name.to_owned(), " after the step".to_owned());
                return Err(ContactError::NotFinite { body, what: "state", value, at });
            }
        }
        self.bonds = bonds;
        Ok(projected)
    }

    /// Touches of a pair where `pose` puts the bodies.
    pub(super) fn touches(
        &self,
        movers: &[Mover],
        pair: Pair,
        pose: impl Fn(usize) -> Pose,
        reach: f64,
        out: &mut Vec<Touch>,
    ) {
        let first = Placed::new(movers[pair.body].shape, &pose(pair.body));
        match pair.partner {
            Partner::Body(other) => {
                super::gap::touches(&first, &Placed::new(movers[other].shape, &pose(other)), reach, out);
            }
            Partner::Wall(index) => self.walls.touches(index, &first, reach, out),
        }
    }

    /// The radius that a tolerance is relative to.
    pub(super) fn size(&self, movers: &[Mover], pair: Pair) -> f64 {
        let own = movers[pair.body].shape.circumradius();
        match pair.partner {
            Partner::Body(other) => own.min(movers[other].shape.circumradius()),
            Partner::Wall(index) => match &self.walls.all()[index] {
                Wall::Segment(_) | Wall::Hollow { .. } => own,
                Wall::Disc { radius, .. } => own.min(*radius),
            },
        }
    }

    pub(super) fn refuse_overlap(&self, movers: &[Mover], pair: Pair, touch: &Touch) -> Result<(), ContactError> {
        let Pair { body, partner } = pair;
        let size = self.size(movers, pair);
        // NaN is no gap either
        if touch.gap >= -(self.settings.overlap * size + rounding(movers, pair)) {
            return Ok(());
        }
        let (first, second) = (movers[body].name.to_owned(), partner_name(movers, partner));
        match partner {
            Partner::Body(other) if movers[other].pose.position == movers[body].pose.position => {
                Err(ContactError::Coincident { first, second })
            }
            Partner::Body(_) | Partner::Wall(_) => Err(ContactError::Overlap { first, second, depth: -touch.gap }),
        }
    }
}

/// Rounding of a gap: that of the positions and sizes it is computed from.
pub(super) fn rounding(movers: &[Mover], Pair { body, partner }: Pair) -> f64 {
    let one = |m: &Mover| m.pose.position.norm() + m.shape.circumradius();
    let other = match partner {
        Partner::Body(other) => one(&movers[other]),
        Partner::Wall(_) => one(&movers[body]),
    };
    4.0 * f64::EPSILON * (one(&movers[body]) + other)
}

/// How messages call a partner.
pub(super) fn partner_name(movers: &[Mover], partner: Partner) -> String {
    match partner {
        Partner::Body(other) => format!("body \"{}\"", movers[other].name),
        Partner::Wall(index) => format!("wall {}", index + 1),
    }
}

/// The square that a body does not leave when none of its points moves farther than `reach`.
pub(super) fn range(mover: &Mover, reach: f64) -> Range {
    let moves = match mover.freedom {
        Freedom::Free { .. } | Freedom::Pinned { .. } => true,
        Freedom::Given { .. } => false,
    };
    Range { centre: mover.pose.position, half: mover.shape.circumradius() + reach, moves }
}

fn check_mover(mover: &Mover) -> Result<(), ContactError> {
    let body = || mover.name.to_owned();
    let Pose { position, angle } = mover.pose;
    let Twist { velocity, spin } = mover.predicted;
    let mut values = vec![("position", position.x), ("position", position.y), ("angle", angle)];
    let predicted = [("predicted velocity", velocity.x), ("predicted velocity", velocity.y), ("predicted spin", spin)];
    match mover.freedom {
        Freedom::Given { next } => {
            values.extend([
                ("next position", next.position.x),
                ("next position", next.position.y),
                ("next angle", next.angle),
            ]);
        }
        Freedom::Free { .. } | Freedom::Pinned { .. } => values.extend(predicted),
    }
    if let Some(&(what, value)) = values.iter().find(|v| !v.1.is_finite()) {
        return Err(ContactError::NotFinite { body: body(), what, value, at: String::new() });
    }
    let inertias = match mover.freedom {
        Freedom::Free { mass, inertia } => {
            vec![("mass or resistance", mass), ("inertia or resistance to spin", inertia)]
        }
        Freedom::Pinned { inertia, .. } => vec![("inertia or resistance to spin about the pin", inertia)],
        Freedom::Given { .. } => Vec::new(),
    };
    match inertias.into_iter().find(|(_, m)| !(*m > 0.0 && m.is_finite())) {
        Some((what, value)) => Err(ContactError::Inertia { body: body(), what, value }),
        None => Ok(()),
    }
}

impl Mover<'_> {
    /// Where it is after a step with `twist`.
    pub fn after(&self, twist: &Twist, dt: f64) -> Pose {
        let Pose { position, angle } = self.pose;
        match self.freedom {
            Freedom::Free { .. } => Pose { position: position + dt * twist.velocity, angle: angle + dt * twist.spin },
            Freedom::Pinned { pivot, .. } => {
                let angle = angle + dt * twist.spin;
                Pose { position: self.pose.to_space(pivot) - turned(pivot, angle), angle }
            }
            Freedom::Given { next } => next,
        }
    }

    /// The twist of the body as a whole, whose free part is `twist`.
    pub(super) fn whole(&self, twist: &Twist, dt: f64) -> Twist {
        match self.freedom {
            Freedom::Free { .. } => *twist,
            Freedom::Pinned { pivot, .. } => {
                let arm = -turned(pivot, self.pose.angle);
                Twist { velocity: twist.spin * perpendicular(arm), spin: twist.spin }
            }
            Freedom::Given { next } => {
                Twist { velocity: (next.position - self.pose.position) / dt, spin: (next.angle - self.pose.angle) / dt }
            }
        }
    }

    /// How far its centre moves in a step with `twist`, and a bound of how far its turning carries points of its
    /// boundary beside that.
    pub(super) fn strides(&self, twist: &Twist, dt: f64) -> (Point, f64) {
        let round = if self.shape.is_round() { 0.0 } else { self.shape.circumradius() };
        let after = self.after(twist, dt);
        let turn = (after.angle - self.pose.angle).abs();
        match self.freedom {
            Freedom::Free { .. } | Freedom::Given { .. } => (after.position - self.pose.position, turn * round),
            // its centre moves on a circle about the pin
            Freedom::Pinned { pivot, .. } => (Point::zeros(), turn * (round + pivot.norm())),
        }
    }

    /// A bound of how far a point of it moves in a step with `twist`.
    pub(super) fn travel(&self, twist: &Twist, dt: f64) -> f64 {
        let size = self.shape.circumradius();
        match self.freedom {
            Freedom::Free { .. } => dt * (twist.velocity.norm() + size * twist.spin.abs()),
            Freedom::Pinned { pivot, .. } => dt * twist.spin.abs() * (pivot.norm() + size),
            Freedom::Given { next } => {
                (next.position - self.pose.position).norm() + size * (next.angle - self.pose.angle).abs()
            }
        }
    }
}
