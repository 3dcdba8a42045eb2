//! A Stokes flow that carries rigid bodies: solve the flow for the bodies' places, let the caller correct how they move, move them.

use std::sync::Arc;

use super::cut::Cover;
use super::motion::Motion;
use super::penalty::{Immersion, Wrench};
use super::{Body, Hold, Pose, Twist};
use crate::form::Integrator;
use crate::form::linear::Linear;
use crate::form::words::Vector;
use crate::mesh::{Mesh, Point};
use crate::model::Conditions;
use crate::model::expression::{Expression, ExpressionError};
use crate::model::immersed::{Carried, Rigidity, Rule};
use crate::model::momentum::{Momentum, MomentumError, SlipTreatment};
use crate::space::{Continuity, Space};

/// How bodies are put into a flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// ε of the penalty, relative to the viscosity of the fluid.
    pub epsilon: f64,
    /// Order of the motion in time, 1 or 2.
    pub order: usize,
}

/// A Stokes flow with bodies, at one time.
#[derive(Debug)]
pub struct Flow {
    pub loops: Integrator,
    pub momentum: Momentum,
    pub conditions: Vec<Conditions>,
    pub bodies: Vec<Body>,
    pub motion: Motion,
    pub t: f64,
    /// Derivatives by t of the bodies that follow a path.
    speeds: Vec<Option<[Expression; 3]>>,
}

impl Flow {
    /// Puts the bodies at their starting poses.
    ///
    /// # Errors
    /// As [`Momentum::with_bodies`]; paths that have no derivative.
    pub fn new(
        mesh: &Arc<Mesh>,
        (velocity, pressure): (usize, usize),
        conditions: &[Conditions],
        (friction, slip): (f64, SlipTreatment),
        bodies: Vec<Body>,
        settings: Settings,
        t: f64,
    ) -> Result<Self, MomentumError> {
        let velocity = Arc::new(Space::new(mesh, Continuity::Continuous, velocity, 2));
        let pressure = Arc::new(Space::new(mesh, Continuity::Continuous, pressure, 1));
        let speeds = bodies.iter().map(|body| speed(&body.hold)).collect::<Result<Vec<_>, _>>()?;
        let poses = bodies.iter().map(|body| start(body, t)).collect::<Result<Vec<Pose>, _>>()?;
        let (loops, immersion) = immerse(mesh, &velocity, &bodies, &poses)?;
        let rigidity =
            Rigidity { epsilon: settings.epsilon, friction: bodies.iter().map(|body| body.friction).collect() };
        let spaces = (&velocity, &pressure);
        let momentum = Momentum::with_bodies(&loops, spaces, conditions, friction, slip, (immersion, rigidity))?;
        let motion = Motion::new(poses, settings.order);
        Ok(Self { loops, momentum, conditions: conditions.to_vec(), bodies, motion, t, speeds })
    }

    /// The flow now, under an outer force and the bodies' own forces, and how the bodies move in it.
    ///
    /// # Errors
    /// As [`Momentum::carry`]; formulas that are not finite.
    pub fn solve(&self, force: &Linear<Vector>) -> Result<Carried, MomentumError> {
        let f = self.loops.vector(force, &self.momentum.velocity);
        let prescribed = self.momentum.frames.prescribed(&self.conditions, self.t)?;
        let (loads, rules) = (self.loads()?, self.rules()?);
        self.momentum.carry(&f, &prescribed, &loads, &rules)
    }

    /// External forces and torques on the bodies now.
    ///
    /// # Errors
    /// A formula that is not finite.
    pub fn loads(&self) -> Result<Vec<Wrench>, ExpressionError> {
        let load = |(body, pose): (&Body, &Pose)| {
            let [x, y] = body.force.each_ref().map(|f| of(body, "force", value(f, pose, self.t)));
            Ok(Wrench { force: Point::new(x?, y?), torque: of(body, "torque", value(&body.torque, pose, self.t))? })
        };
        self.bodies.iter().zip(&self.motion.poses).map(load).collect()
    }

    /// What is prescribed of the bodies' motions now.
    ///
    /// # Errors
    /// A formula that is not finite.
    pub fn rules(&self) -> Result<Vec<Rule>, ExpressionError> {
        let rule = |((body, pose), speed): ((&Body, &Pose), &Option<[Expression; 3]>)| {
            let twist = |formulas: [&Expression; 3]| {
                let [x, y, spin] = formulas.map(|f| of(body, "motion", value(f, pose, self.t)));
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
        self.bodies.iter().zip(&self.motion.poses).zip(&self.speeds).map(rule).collect()
    }

    /// The twists by which the bodies would move in a step `dt`: `x ← x + Δt W`. Contact may correct them before [`Flow::advance`].
    ///
    /// # Errors
    /// A path that is not finite.
    pub fn predicted(&self, dt: f64, now: &[Twist]) -> Result<Vec<Twist>, ExpressionError> {
        let mut by = self.motion.predicted(dt, now);
        for ((body, pose), by) in self.bodies.iter().zip(&self.motion.poses).zip(&mut by) {
            match &body.hold {
                Hold::Path { .. } if dt > 0.0 => {
                    let next = start(body, self.t + dt)?;
                    *by =
                        Twist { velocity: (next.position - pose.position) / dt, spin: (next.angle - pose.angle) / dt };
                }
                Hold::Pinned(point) if dt > 0.0 => {
                    // the pin stays where it is, whatever the order
                    let angle = pose.angle + dt * by.spin;
                    let position = pose.to_space(*point) - super::turned(*point, angle);
                    by.velocity = (position - pose.position) / dt;
                }
                Hold::Fixed => *by = Twist::ZERO,
                Hold::Free | Hold::Held { .. } | Hold::Path { .. } | Hold::Pinned(_) => {}
            }
        }
        Ok(by)
    }

    /// Ends a step: moves the bodies by the twists `by` from where they had the twists `now`.
    ///
    /// # Errors
    /// As [`Momentum::move_bodies`].
    pub fn advance(&mut self, dt: f64, now: &[Twist], by: &[Twist]) -> Result<(), MomentumError> {
        self.motion.advance(dt, now, by);
        self.t += dt;
        if dt > 0.0 {
            self.momentum.move_bodies(&self.loops, &self.motion.poses)?;
        }
        Ok(())
    }
}

/// The loops on a mesh, and bodies in a velocity space on it.
///
/// # Errors
/// As [`Immersion::new`].
pub fn immerse(
    mesh: &Arc<Mesh>,
    velocity: &Arc<Space>,
    bodies: &[Body],
    poses: &[Pose],
) -> Result<(Integrator, Immersion), MomentumError> {
    let loops = Integrator::new(mesh);
    let placed: Vec<_> = bodies.iter().zip(poses).map(|(body, pose)| (body.shape.clone(), *pose)).collect();
    let cover = Arc::new(Cover::new(mesh, None, &placed));
    let names: Vec<String> = bodies.iter().map(|body| body.name.clone()).collect();
    let immersion = Immersion::new(&loops, velocity, cover, &names, poses)?;
    Ok((loops, immersion))
}

/// A formula of a body.
pub(super) fn value(formula: &Expression, pose: &Pose, t: f64) -> Result<f64, ExpressionError> {
    let value = formula.eval_at(pose.position, pose.angle, t);
    if value.is_finite() {
        return Ok(value);
    }
    let (text, at) = (formula.text().to_string(), pose.position);
    Err(ExpressionError::NotFinite { text, value, x: at.x, y: at.y, t })
}

/// Tells of which body a formula is.
pub(super) fn of<T>(body: &Body, what: &'static str, result: Result<T, ExpressionError>) -> Result<T, ExpressionError> {
    result.map_err(|error| ExpressionError::OfBody { body: body.name.clone(), what, error: Box::new(error) })
}

/// Where a body is at time t if it follows a path, and where it starts otherwise.
pub(super) fn start(body: &Body, t: f64) -> Result<Pose, ExpressionError> {
    match &body.hold {
        Hold::Path { position: [x, y], angle } => Ok(Pose {
            position: Point::new(value(x, &body.start, t)?, value(y, &body.start, t)?),
            angle: value(angle, &body.start, t)?,
        }),
        Hold::Free | Hold::Fixed | Hold::Pinned(_) | Hold::Held { .. } => Ok(body.start),
    }
}

pub(super) fn speed(hold: &Hold) -> Result<Option<[Expression; 3]>, ExpressionError> {
    match hold {
        Hold::Path { position: [x, y], angle } => Ok(Some([x.diff("t")?, y.diff("t")?, angle.diff("t")?])),
        Hold::Free | Hold::Fixed | Hold::Pinned(_) | Hold::Held { .. } => Ok(None),
    }
}
