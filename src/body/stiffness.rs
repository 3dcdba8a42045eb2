//! How long a step can follow forces that vary with the place of a body, and velocities that are prescribed by it.
//!
//! Steps take forces at their beginning. With `ΔF = F(x + Δt W) − F(x)` at the twist W that is predicted, and `Y ΔF`
//! the change of the twists that ΔF causes, a step is followed where for every body of size r
//!
//! ```text
//! ½ Δt |Y ΔF| ≤ tolerance r       what the second order would change of the way
//! Δt |Y ∂F/∂x| ≤ bound            so that a force that draws back does not overshoot, however near its rest
//! ```
//! and a path is followed where a step's chord is nearly as long as the way.

use super::{Body, Hold};
use crate::expression::{Expression, ExpressionError};
use crate::mesh::Point;
use crate::shape::{Pose, Twist, Wrench};

/// Largest `Δt |Y ∂F/∂x|` of bodies without inertia: a quarter of what makes them overshoot.
pub const DECAY: f64 = 0.25;

/// A change of the twists of all bodies by a change of the wrenches on them.
pub trait Response {
    /// Why there is none.
    type Error;

    /// # Errors
    /// A flow that cannot be solved for.
    fn twists(&self, wrenches: &[Wrench]) -> Result<Vec<Twist>, Self::Error>;
}

/// A step that bodies would make.
#[derive(Debug, Clone, Copy)]
pub struct Stride<'a> {
    pub poses: &'a [Pose],
    /// Predicted: `x ← x + Δt W`.
    pub by: &'a [Twist],
    pub t: f64,
    pub dt: f64,
    /// Of the first condition, relative to the size.
    pub tolerance: f64,
    /// Of the second condition.
    pub bound: f64,
}

/// What makes a step the hardest to follow.
#[derive(Debug, Clone, PartialEq)]
pub struct Strain {
    pub body: String,
    pub what: &'static str,
    /// Above 1 the step is too long.
    pub load: f64,
}

impl std::fmt::Display for Strain {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the {} of `{}` changes too much in a step", self.what, self.body)
    }
}

/// A body whose force, torque or prescribed velocity varies with where it is.
#[derive(Debug, Clone)]
struct Varying {
    body: usize,
    name: String,
    what: &'static str,
    size: f64,
    /// Force and torque, or velocity and spin.
    formulas: [Expression; 3],
    /// By x, y and θ.
    slopes: [[Expression; 3]; 3],
    /// Whether the formulas are those of the velocity.
    held: bool,
}

/// The bodies of a scene that need to be looked at; in most scenes there are none.
#[derive(Debug, Clone, Default)]
pub struct Stiffness {
    varying: Vec<Varying>,
    /// Bodies on paths.
    paths: Vec<Body>,
}

impl Stiffness {
    /// Looks for formulas of the place.
    ///
    /// # Errors
    /// A formula without derivative.
    pub fn new(bodies: &[Body]) -> Result<Self, ExpressionError> {
        let mut found = Self::default();
        for (at, body) in bodies.iter().enumerate() {
            let (formulas, what, held) = match &body.hold {
                Hold::Free | Hold::Pinned(_) => ([&body.force[0], &body.force[1], &body.torque], "force", false),
                Hold::Held { velocity: [x, y], spin } => ([x, y, spin], "velocity", true),
                Hold::Fixed => continue,
                Hold::Path { .. } => {
                    found.paths.push(body.clone());
                    continue;
                }
            };
            if formulas.iter().all(|f| f.depends_on_time_alone()) {
                continue;
            }
            let by = |variable: &str| -> Result<[Expression; 3], ExpressionError> {
                Ok([formulas[0].diff(variable)?, formulas[1].diff(variable)?, formulas[2].diff(variable)?])
            };
            let slopes = [by("x")?, by("y")?, by("theta")?];
            let size = body.shape.circumradius();
            let formulas = formulas.map(Clone::clone);
            found.varying.push(Varying { body: at, name: body.name.clone(), what, size, formulas, slopes, held });
        }
        Ok(found)
    }

    /// Whether there is nothing to look at.
    pub fn is_idle(&self) -> bool {
        self.varying.is_empty() && self.paths.is_empty()
    }

    /// Whether the force or torque on a body varies with where it is.
    pub fn has_varying_force(&self, body: usize) -> bool {
        self.varying.iter().any(|varying| varying.body == body && !varying.held)
    }

    /// What strains a step the most; `None` where nothing varies.
    ///
    /// # Errors
    /// A flow that cannot be solved for.
    pub fn strain<R: Response>(&self, step: Stride, response: &R) -> Result<Option<Strain>, R::Error> {
        let mut worst = self.worst_path(step);
        if self.varying.is_empty() {
            return Ok(worst);
        }
        let mut note = |varying: &Varying, load: f64| {
            // what is not finite cannot be followed at all
            let load = if load.is_nan() { f64::INFINITY } else { load };
            if worst.as_ref().is_none_or(|worst| load > worst.load) {
                worst = Some(Strain { body: varying.name.clone(), what: varying.what, load });
            }
        };
        let change = |varying: &Varying| {
            let (pose, by) = (step.poses[varying.body], step.by[varying.body]);
            let next = Pose { position: pose.position + step.dt * by.velocity, angle: pose.angle + step.dt * by.spin };
            let at = |pose: &Pose, f: &Expression| f.eval_at(pose.position, pose.angle, step.t);
            varying.formulas.each_ref().map(|f| at(&next, f) - at(&pose, f))
        };
        let caused = self.caused(step.poses.len(), change, response)?;
        for (varying, size) in self.varying.iter().zip(caused) {
            note(varying, 0.5 * step.dt * size / (step.tolerance * varying.size));
        }
        let mut rates = vec![0.0; self.varying.len()];
        for direction in 0..3 {
            let slope = |varying: &Varying| {
                let pose = step.poses[varying.body];
                // a turn that moves the boundary by one
                let unit = if direction == 2 { 1.0 / varying.size } else { 1.0 };
                varying.slopes[direction].each_ref().map(|f| unit * f.eval_at(pose.position, pose.angle, step.t))
            };
            let caused = self.caused(step.poses.len(), slope, response)?;
            rates.iter_mut().zip(caused).for_each(|(rate, size)| *rate += size * size);
        }
        for (varying, rate) in self.varying.iter().zip(rates) {
            let bound = if varying.held { DECAY } else { step.bound };
            note(varying, step.dt * rate.sqrt() / bound);
        }
        Ok(worst)
    }

    /// How fast points of the boundaries of the varying bodies become by changes of their formulas.
    fn caused<R: Response>(
        &self,
        count: usize,
        change: impl Fn(&Varying) -> [f64; 3],
        response: &R,
    ) -> Result<Vec<f64>, R::Error> {
        let changes: Vec<[f64; 3]> = self.varying.iter().map(change).collect();
        let fast = |[x, y, spin]: [f64; 3], size: f64| x.hypot(y) + size * spin.abs();
        let mut wrenches = vec![Wrench::ZERO; count];
        let mut loaded = false;
        for (varying, [x, y, z]) in self.varying.iter().zip(&changes).filter(|(varying, _)| !varying.held) {
            wrenches[varying.body] = Wrench { force: Point::new(*x, *y), torque: *z };
            loaded |= [x, y, z].iter().any(|v| **v != 0.0);
        }
        let finite = changes.iter().flatten().all(|v| v.is_finite());
        let twists = match loaded && finite {
            true => response.twists(&wrenches)?,
            false => vec![Twist::ZERO; count],
        };
        let one = |(varying, change): (&Varying, &[f64; 3])| {
            let Twist { velocity, spin } = twists[varying.body];
            match (change.iter().all(|v| v.is_finite()), varying.held) {
                (false, _) => f64::INFINITY,
                (true, true) => fast(*change, varying.size),
                (true, false) => fast([velocity.x, velocity.y, spin], varying.size),
            }
        };
        Ok(self.varying.iter().zip(&changes).map(one).collect())
    }

    /// The path whose chord is shortest for its way.
    fn worst_path(&self, step: Stride) -> Option<Strain> {
        const PARTS: usize = 7;
        // of the way, and of the size beside it
        const LONGER: f64 = 1.2;
        const WIDER: f64 = 0.1;
        let load = |body: &Body| {
            let Hold::Path { position: [x, y], angle } = &body.hold else { unreachable!("only paths are kept") };
            let size = body.shape.circumradius();
            let pose = |part: usize| {
                let t = step.t + step.dt * part as f64 / PARTS as f64;
                (Point::new(x.eval(Point::zeros(), t), y.eval(Point::zeros(), t)), angle.eval(Point::zeros(), t))
            };
            let apart = |a: (Point, f64), b: (Point, f64)| (b.0 - a.0).norm() + size * (b.1 - a.1).abs();
            let way: f64 = (1..=PARTS).map(|part| apart(pose(part - 1), pose(part))).sum();
            let chord = apart(pose(0), pose(PARTS));
            let load = way / (LONGER * chord + WIDER * size);
            Strain { body: body.name.clone(), what: "path", load }
        };
        // a path that is not finite is told by the step
        let worst = self.paths.iter().map(load).filter(|strain| !strain.load.is_nan());
        worst.reduce(|worst, next| if next.load > worst.load { next } else { worst })
    }
}
