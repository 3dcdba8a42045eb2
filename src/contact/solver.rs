//! Contact of many bodies in one step: from predicted velocities to those that create no overlap.

use super::bonds::Bonds;
use super::gap::{Placed, Touch};
use super::mobility::FlowMetric;
use super::mover::{Mover, check_mover, range};
use super::pairs::{self, Pair, Range};
use super::projection::Method;
use super::step::Step;
use super::walls::Walls;
use super::{Contact, ContactError, Law, Partner, Wall};
use crate::mesh::Point;
use crate::shape::{Pose, Twist};

/// More friction cannot be told from bodies that never slide.
pub const MOST_FRICTION: f64 = 1e3;

/// Overlap that the next step must take from one before, in tolerances: twice what gaps may miss.
const LEFT: f64 = 8.0;

/// In which metric velocities are projected.
#[derive(Debug, Clone, Copy)]
pub enum Metric<'a> {
    /// Masses: `M (W − V*) = Δt Σ λ G`.
    Mass,
    /// Resistances of bodies without inertia: `R (W − V*) = Σ λ G`.
    Resistance,
    /// The inverse of the mobility of bodies in a flow, `W − U* = Y Σ λ G`: contact acts on the flow.
    Mobility(FlowMetric<'a>),
}

impl Metric<'_> {
    /// Whether bodies have inertia.
    pub(super) fn has_inertia(self) -> bool {
        matches!(self, Self::Mass)
    }
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
    /// Overlap that a step accepts at its beginning, relative to the radius of the smaller body, and then removes; what
    /// a larger tolerance may leave is accepted too. More is refused.
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

/// When contacts are those that are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shown {
    /// At the beginning of the step.
    Before,
    /// At its end.
    After,
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
        let (projected, bonds) = self.solve(movers, dt, metric, Shown::After)?;
        self.bonds = bonds;
        Ok(projected)
    }

    /// What contact does now, at the beginning of a step that is not made yet: as [`Solver::project`], but with the gaps
    /// and γ of the poses as they are.
    ///
    /// # Errors
    /// As [`Solver::project`].
    pub fn act(&self, movers: &[Mover], dt: f64, metric: Metric) -> Result<Projected, ContactError> {
        Ok(self.solve(movers, dt, metric, Shown::Before)?.0)
    }

    fn solve(
        &self,
        movers: &[Mover],
        dt: f64,
        metric: Metric,
        shown: Shown,
    ) -> Result<(Projected, Bonds), ContactError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(ContactError::Step { dt });
        }
        movers.iter().try_for_each(check_mover)?;
        let mut step = Step::new(self, movers, dt, metric);
        let projected = step.solve(shown)?;
        for (mover, (pose, twist)) in movers.iter().zip(projected.poses.iter().zip(&projected.twists)) {
            let values = [pose.position.x, pose.position.y, pose.angle, twist.velocity.x, twist.velocity.y, twist.spin];
            if let Some(&value) = values.iter().find(|v| !v.is_finite()) {
                let (body, at) = (mover.name.to_owned(), " after the step".to_owned());
                return Err(ContactError::NotFinite { body, what: "state", value, at });
            }
        }
        let bonds = step.bonds();
        Ok((projected, bonds))
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
        let most = self.settings.overlap.max(LEFT * self.settings.tolerance);
        if touch.gap >= -(most * size + rounding(movers, pair)) {
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
