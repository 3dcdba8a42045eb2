//! Marching an incompressible tissue with rigid bodies that move in it.
//!
//! ```text
//! 1.  U* = V^n                                      order 1
//!     U* = V^n + (Δt/2Δt_n)(V^n − V^{n−1})          order 2, Δt_n the last step
//! 2.  U = what contact leaves of U*
//! 3.  x^{n+1} = x^n + Δt U,  θ^{n+1} = θ^n + Δt Ω
//! 4.  the model around the bodies there, and a step of its own: v, Π, p, and V^{n+1} from v
//! ```
//! A step that fails is tried again from where the bodies were, with half Δt. Bodies that nothing moves keep the model.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::coupling::StepFailure;
use super::march::{March, MarchError, Parked, StepReport};
use crate::body::{Pose, Twist};
use crate::model::incompressible::Incompressible;

/// Where bodies are and how they moved: what a restart needs of them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    pub poses: Vec<Pose>,
    /// Of the flow at the poses.
    pub twists: Vec<Twist>,
    /// One step earlier, and the length of the step since.
    pub earlier: Option<(Vec<Twist>, f64)>,
}

impl Motion {
    /// The twists that take the bodies over a step `dt`, by the formula of order 1 or 2.
    pub fn predicted(&self, order: usize, dt: f64) -> Vec<Twist> {
        let Some((earlier, last)) = self.earlier.as_ref().filter(|(_, last)| order > 1 && *last > 0.0) else {
            return self.twists.clone();
        };
        let r = 0.5 * dt / last;
        let between = |(now, old): (&Twist, &Twist)| Twist {
            velocity: now.velocity + (now.velocity - old.velocity) * r,
            spin: now.spin + (now.spin - old.spin) * r,
        };
        self.twists.iter().zip(earlier).map(between).collect()
    }
}

/// `x + Δt U`, `θ + Δt Ω`
pub fn carried(pose: &Pose, twist: &Twist, dt: f64) -> Pose {
    Pose { position: pose.position + twist.velocity * dt, angle: pose.angle + twist.spin * dt }
}

/// What may change the predicted twists before the bodies move: contact.
pub trait Referee {
    /// Twists that the bodies may have for a step `dt` from their poses, in place of those that the flow gives them.
    fn correct(&mut self, poses: &[Pose], predicted: Vec<Twist>, dt: f64) -> Vec<Twist>;
}

/// Nobody objects.
#[derive(Debug, Clone, Copy)]
pub struct NoReferee;

impl Referee for NoReferee {
    fn correct(&mut self, _: &[Pose], predicted: Vec<Twist>, _: f64) -> Vec<Twist> {
        predicted
    }
}

/// A march of a tissue with bodies in it.
#[derive(Debug)]
pub struct MovingMarch {
    /// Around the bodies where they are now.
    pub model: Arc<Incompressible>,
    pub motion: Motion,
    /// Of the motion, 1 or 2.
    pub order: usize,
    parked: Option<Parked>,
}

impl MovingMarch {
    /// Goes on with a march of `model`; without `motion` the bodies are where the model has them and move with its flow.
    pub fn new(model: Arc<Incompressible>, march: March, order: usize, motion: Option<Motion>) -> Self {
        let parked = march.park();
        let motion = motion.unwrap_or_else(|| Motion {
            poses: model.poses().to_vec(),
            twists: model.twists(&parked.state.v),
            earlier: None,
        });
        Self { model, motion, order, parked: Some(parked) }
    }

    /// The march as it stands, for outputs.
    pub fn with<T>(&mut self, interrupt: &AtomicBool, visit: impl FnOnce(&mut March) -> T) -> T {
        let model = self.model.clone();
        let parked = self.parked.take().expect("a march is parked between steps");
        let mut march = March::unpark(&*model, parked, interrupt, false);
        let result = visit(&mut march);
        self.parked = Some(march.park());
        result
    }

    /// Takes one step, trimmed to land on `landing`: moves the bodies, then solves.
    ///
    /// # Errors
    /// As [`March::advance`]; the state is then the last good one.
    pub fn advance(
        &mut self,
        landing: f64,
        interrupt: &AtomicBool,
        referee: &mut dyn Referee,
    ) -> Result<StepReport, MarchError> {
        let (mut rejected, mut cap) = (0, f64::INFINITY);
        let entry = self.with(interrupt, |march| march.entry());
        loop {
            let old = self.model.clone();
            let (t, dt) = self.with(interrupt, |march| march.aim(cap, landing));
            let predicted = self.motion.predicted(self.order, dt);
            let twists = referee.correct(&self.motion.poses, predicted, dt);
            let free = self.motion.poses.iter().zip(&twists).map(|(pose, twist)| carried(pose, twist, dt)).collect();
            let poses = old.bodies.as_ref().map_or_else(Vec::new, |bodies| bodies.guided(free, t));
            let moved = poses != self.motion.poses;
            let model = if moved { old.at(&poses).map(Arc::new) } else { Ok(old.clone()) };
            let parked = self.parked.take().expect("a march is parked between steps");
            let outcome = match model {
                Ok(model) => {
                    let mut march = March::unpark(&*model, parked, interrupt, moved);
                    let outcome = march.attempt(t, dt, rejected);
                    self.parked = Some(march.park());
                    outcome.map(|report| (report, model.clone()))
                }
                Err(error) => {
                    self.parked = Some(parked);
                    Err(StepFailure::from(error))
                }
            };
            match outcome {
                Ok((report, model)) => {
                    let found = self.parked.as_ref().map(|parked| model.twists(&parked.state.v)).unwrap_or_default();
                    let earlier = std::mem::replace(&mut self.motion.twists, found);
                    self.motion.earlier = Some((earlier, dt));
                    self.motion.poses = poses;
                    self.model = model;
                    return Ok(report);
                }
                Err(cause) => {
                    let step = self.with(interrupt, |march| march.counts.steps + 1);
                    cap = self.with(interrupt, |march| march.after_failure(cause, (step, dt), &mut rejected, &entry))?;
                }
            }
        }
    }
}
