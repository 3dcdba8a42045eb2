//! What acts on bodies from outside and what is prescribed of their motion, at given poses and times.

use std::sync::Arc;

use super::leaving::Remaining;
use super::motion::Motion;
use super::{Body, Hold};
use crate::expression::{Expression, ExpressionError};
use crate::mesh::Point;
use crate::shape::{Pose, Twist, Wrench, turned};

/// What is prescribed of a body's motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// Nothing.
    Free,
    /// Velocity and spin.
    Held(Twist),
    /// It turns about this point (in space).
    Pinned(Point),
}

/// Bodies with the derivatives of their paths.
#[derive(Debug, Clone)]
pub struct Guide {
    /// The bodies, in the order in which all else is listed.
    pub bodies: Arc<[Body]>,
    speeds: Vec<Option<[Expression; 3]>>,
}

impl Guide {
    /// Prepares the bodies.
    ///
    /// # Errors
    /// A path that has no derivative.
    pub fn new(bodies: Vec<Body>) -> Result<Self, ExpressionError> {
        let speeds = bodies.iter().map(|body| speed(&body.hold)).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { bodies: bodies.into(), speeds })
    }

    /// Of those that are left.
    #[must_use]
    pub fn of(&self, remaining: &Remaining) -> Self {
        Self { bodies: remaining.of(&self.bodies).into(), speeds: remaining.of(&self.speeds) }
    }

    /// Where bodies on paths are at `t`, and the others at their start.
    ///
    /// # Errors
    /// A formula that is not finite.
    pub fn starts(&self, t: f64) -> Result<Vec<Pose>, ExpressionError> {
        self.bodies.iter().map(|body| start(body, t)).collect()
    }

    /// External forces and torques.
    ///
    /// # Errors
    /// A formula that is not finite.
    pub fn loads(&self, poses: &[Pose], t: f64) -> Result<Vec<Wrench>, ExpressionError> {
        let load = |(body, pose): (&Body, &Pose)| {
            let [x, y] = body.force.each_ref().map(|f| of(body, "force", value(f, pose, t)));
            Ok(Wrench { force: Point::new(x?, y?), torque: of(body, "torque", value(&body.torque, pose, t))? })
        };
        self.bodies.iter().zip(poses).map(load).collect()
    }

    /// What is prescribed of the motions.
    ///
    /// # Errors
    /// A formula that is not finite.
    pub fn rules(&self, poses: &[Pose], t: f64) -> Result<Vec<Rule>, ExpressionError> {
        let rule = |((body, pose), speed): ((&Body, &Pose), &Option<[Expression; 3]>)| {
            let twist = |formulas: [&Expression; 3]| {
                let [x, y, spin] = formulas.map(|f| of(body, "motion", value(f, pose, t)));
                Ok(Rule::Held(Twist { velocity: Point::new(x?, y?), spin: spin? }))
            };
            match (&body.hold, speed) {
                (Hold::Free, _) => Ok(Rule::Free),
                (Hold::Fixed, _) => Ok(Rule::Held(Twist::ZERO)),
                (Hold::Pinned(point), _) => Ok(Rule::Pinned(pose.to_space(*point))),
                (Hold::Held { velocity: [x, y], spin }, _) => twist([x, y, spin]),
                (Hold::Path { .. }, speed) => twist(speed.as_ref().expect("a path has a speed").each_ref()),
            }
        };
        self.bodies.iter().zip(poses).zip(&self.speeds).map(rule).collect()
    }

    /// The same rules of a change of the flow: what is prescribed does not change.
    pub fn rules_of_change(&self, poses: &[Pose]) -> Vec<Rule> {
        let rule = |(body, pose): (&Body, &Pose)| match &body.hold {
            Hold::Free => Rule::Free,
            Hold::Pinned(point) => Rule::Pinned(pose.to_space(*point)),
            Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => Rule::Held(Twist::ZERO),
        };
        self.bodies.iter().zip(poses).map(rule).collect()
    }

    /// The twists W by which bodies with the twists `now` move from `t` in a step: `x ← x + Δt W`.
    ///
    /// # Errors
    /// A path that is not finite.
    pub fn predicted(&self, motion: &Motion, t: f64, dt: f64, now: &[Twist]) -> Result<Vec<Twist>, ExpressionError> {
        let mut by = motion.predicted(dt, now);
        for ((body, pose), by) in self.bodies.iter().zip(&motion.poses).zip(&mut by) {
            match &body.hold {
                Hold::Path { .. } if dt > 0.0 => {
                    let next = start(body, t + dt)?;
                    let (velocity, spin) = (next.position - pose.position, next.angle - pose.angle);
                    *by = Twist { velocity: velocity / dt, spin: spin / dt };
                }
                Hold::Pinned(point) if dt > 0.0 => {
                    // the pin stays where it is, whatever the order
                    let position = pose.to_space(*point) - turned(*point, pose.angle + dt * by.spin);
                    by.velocity = (position - pose.position) / dt;
                }
                Hold::Fixed => *by = Twist::ZERO,
                Hold::Free | Hold::Held { .. } | Hold::Path { .. } | Hold::Pinned(_) => {}
            }
        }
        Ok(by)
    }
}

/// A formula of a body.
fn value(formula: &Expression, pose: &Pose, t: f64) -> Result<f64, ExpressionError> {
    let value = formula.eval_at(pose.position, pose.angle, t);
    if value.is_finite() {
        return Ok(value);
    }
    Err(formula.not_finite(value, pose.position, t))
}

/// Tells of which body a formula is.
fn of<T>(body: &Body, what: &'static str, result: Result<T, ExpressionError>) -> Result<T, ExpressionError> {
    result.map_err(|error| ExpressionError::OfBody { place: body.formula(what), error: Box::new(error) })
}

/// Where a body is at time t if it follows a path, and where it starts otherwise.
fn start(body: &Body, t: f64) -> Result<Pose, ExpressionError> {
    match &body.hold {
        Hold::Path { position: [x, y], angle } => {
            let [x, y, angle] = [x, y, angle].map(|f| of(body, "motion.path", value(f, &body.start, t)));
            Ok(Pose { position: Point::new(x?, y?), angle: angle? })
        }
        Hold::Free | Hold::Fixed | Hold::Pinned(_) | Hold::Held { .. } => Ok(body.start),
    }
}

fn speed(hold: &Hold) -> Result<Option<[Expression; 3]>, ExpressionError> {
    match hold {
        Hold::Path { position: [x, y], angle } => Ok(Some([x.diff("t")?, y.diff("t")?, angle.diff("t")?])),
        Hold::Free | Hold::Fixed | Hold::Pinned(_) | Hold::Held { .. } => Ok(None),
    }
}
