//! Marching an incompressible tissue with rigid bodies that move in it.
//!
//! ```text
//! 1.  W from the twists of the flow so far, of first or second order (`body::motion`)
//! 2.  W as contact leaves it
//! 3.  x ← x + Δt W,  θ ← θ + Δt Ω
//! 4.  the model around the bodies there; a step of its own gives v, Π, p, and from v the twists at the new time
//! ```
//! A step that fails is tried again from where the bodies were, with half Δt. Bodies that did not move keep the factors
//! of Newton's method.

use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::coupling::StepFailure;
use super::march::{Checkpoint, March, MarchError, MarchSettings, Parked, StepReport};
use crate::body::motion::Motion;
use crate::body::stiffness::{DECAY, Stiffness, Stride};
use crate::expression::ExpressionError;
use crate::model::State;
use crate::model::incompressible::Incompressible;
use crate::model::mobility::Mobility;
use crate::model::momentum::MomentumError;
use crate::scheme::adaptive::Refusal;
use crate::shape::{Pose, Twist};

/// What forces that vary with a body's place may change of its way in a step, relative to its size.
const TOLERANCE: f64 = 1e-3;

/// What may change the predicted twists before the bodies move: contact.
pub trait TwistCorrection {
    /// Twists that the bodies may have for a step `dt` from their poses, in place of those that the flow gives them.
    ///
    /// # Errors
    /// The reason why there are none.
    fn correct(&mut self, poses: &[Pose], predicted: Vec<Twist>, dt: f64) -> Result<Vec<Twist>, Refusal>;

    /// The step was taken.
    fn accept(&mut self) {}
}

/// The twists stay what the flow gives.
#[derive(Debug, Clone, Copy)]
pub struct NoCorrection;

impl TwistCorrection for NoCorrection {
    fn correct(&mut self, _: &[Pose], predicted: Vec<Twist>, _: f64) -> Result<Vec<Twist>, Refusal> {
        Ok(predicted)
    }
}

/// All that a restart needs, to continue bit for bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MovingCheckpoint {
    /// Of the tissue.
    pub march: Checkpoint,
    /// Of the bodies.
    pub motion: Motion,
    /// How they move.
    pub twists: Vec<Twist>,
}

/// Why bodies and tissue cannot go on.
#[derive(Debug, Clone, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum MovingError {
    #[error(transparent)]
    March(#[from] MarchError),
    #[error("the bodies cannot be moved at t = {t}: {reason}")]
    Contact { t: f64, reason: String },
    #[error("the bodies cannot be put back at t = {t}: {error}")]
    Lost { t: f64, error: Box<MomentumError> },
}

/// A march of a tissue with bodies in it.
#[derive(Debug)]
pub struct MovingMarch {
    /// Around the bodies where they are now.
    model: Incompressible,
    motion: Motion,
    /// Of the flow now.
    twists: Vec<Twist>,
    stiffness: Stiffness,
    parked: Option<Parked>,
}

impl MovingMarch {
    /// Starts at `t = 0` from a polarity; `order` is that of the motion.
    ///
    /// # Errors
    /// A flow that cannot be solved for; a formula without derivative.
    pub fn start(
        model: Incompressible,
        settings: MarchSettings,
        p: Vec<f64>,
        order: usize,
    ) -> Result<Self, StepFailure> {
        let parked = March::start(&model, settings, p)?.park();
        let motion = Motion::new(model.poses().to_vec(), order);
        let twists = model.twists(&parked.state, parked.time())?;
        let stiffness = stiffness_of(&model)?;
        Ok(Self { model, motion, twists, stiffness, parked: Some(parked) })
    }

    /// Continues from a checkpoint of the same problem, with the bodies anywhere.
    ///
    /// # Errors
    /// Bodies that the mesh or the flow cannot take where they are; a flow whose matrix is singular.
    pub fn resume(
        mut model: Incompressible,
        settings: MarchSettings,
        from: MovingCheckpoint,
    ) -> Result<Self, MomentumError> {
        if model.poses() != from.motion.poses {
            model.place_bodies(&from.motion.poses)?;
        }
        let parked = March::resume(&model, settings, from.march).park();
        let stiffness = stiffness_of(&model)?;
        Ok(Self { model, motion: from.motion, twists: from.twists, stiffness, parked: Some(parked) })
    }

    /// The current state.
    pub fn checkpoint(&self) -> MovingCheckpoint {
        let march = self.parked.as_ref().expect("a march is parked between steps").checkpoint().clone();
        MovingCheckpoint { march, motion: self.motion.clone(), twists: self.twists.clone() }
    }

    /// Around the bodies where they are now.
    pub fn model(&self) -> &Incompressible {
        &self.model
    }

    /// One for each body.
    pub fn poses(&self) -> &[Pose] {
        &self.motion.poses
    }

    /// One for each body.
    pub fn twists(&self) -> &[Twist] {
        &self.twists
    }

    /// As it is now.
    pub fn state(&self) -> &State {
        &self.parked.as_ref().expect("a march is parked between steps").state
    }

    /// Of the state.
    pub fn time(&self) -> f64 {
        self.parked.as_ref().expect("a march is parked between steps").time()
    }

    /// The march as it stands.
    pub fn with<T>(&mut self, visit: impl FnOnce(&mut March) -> T) -> T {
        let parked = self.parked.take().expect("a march is parked between steps");
        let mut march = March::unpark(&self.model, parked, false);
        let result = visit(&mut march);
        self.parked = Some(march.park());
        result
    }

    /// Takes one step, trimmed to land on `landing`: moves the bodies, then solves.
    ///
    /// # Errors
    /// Δt below its minimum, a failure that no smaller step can cure, or twists that `correction` cannot give. The
    /// state is then the last good one.
    pub fn advance(
        &mut self,
        landing: f64,
        interrupt: &AtomicBool,
        correction: &mut dyn TwistCorrection,
    ) -> Result<StepReport, MovingError> {
        let (mut rejected, mut cap) = (0, f64::INFINITY);
        let entry = self.with(|march| march.entry());
        let guide = self.model.bodies.as_ref().expect("a tissue with bodies").guide.clone();
        loop {
            let (now, (t, dt)) = self.with(|march| (march.t, march.aim(cap, landing)));
            let stop = |reason: String| MovingError::Contact { t: now, reason };
            let predicted = guide.predicted(&self.motion, now, dt, &self.twists).map_err(|e| stop(e.to_string()))?;
            let by = self.followed(now, dt, &predicted);
            let by = by.and_then(|()| correction.correct(&self.motion.poses, predicted, dt));
            let moved = match by {
                Ok(by) => {
                    let mut motion = self.motion.clone();
                    motion.advance(dt, &self.twists, &by);
                    self.attempt(&motion.poses, (t, dt), rejected, interrupt).map(|report| (motion, report))
                }
                Err(Refusal::Failure(reason)) => return Err(stop(reason)),
                Err(Refusal::Force(reason) | Refusal::Contact(reason)) => Err(StepFailure::Bodies(reason)),
            };
            match moved {
                Ok((motion, report)) => {
                    correction.accept();
                    self.twists = self.model.twists(self.state(), self.time()).map_err(|e| stop(e.to_string()))?;
                    self.motion = motion;
                    return Ok(report);
                }
                Err(cause) => {
                    if self.model.poses() != self.motion.poses {
                        let back = self.model.place_bodies(&self.motion.poses);
                        back.map_err(|error| MovingError::Lost { t: now, error: Box::new(error) })?;
                    }
                    let step = self.with(|march| march.counts.steps + 1);
                    cap = self.with(|march| march.after_failure(cause, (step, dt), &mut rejected, &entry))?;
                }
            }
        }
    }

    /// Whether a step is short enough for forces that vary with the place of a body.
    fn followed(&self, t: f64, dt: f64, by: &[Twist]) -> Result<(), Refusal> {
        let floating = self.model.bodies.as_ref().expect("a tissue with bodies");
        let poses = &self.motion.poses[..];
        let response = Mobility { momentum: &self.model.momentum, rules: floating.guide.rules_of_change(poses) };
        let stride = Stride { poses, by, t, dt, tolerance: TOLERANCE, bound: DECAY };
        match self.stiffness.strain(stride, &response).map_err(|error| Refusal::Failure(error.to_string()))? {
            Some(strain) if strain.load > 1.0 => Err(Refusal::Force(strain.to_string())),
            Some(_) | None => Ok(()),
        }
    }

    /// One try of a step to `t` with the bodies at `poses`.
    fn attempt(
        &mut self,
        poses: &[Pose],
        (t, dt): (f64, f64),
        rejected: usize,
        interrupt: &AtomicBool,
    ) -> Result<StepReport, StepFailure> {
        let moved = poses != self.model.poses();
        if moved {
            self.model.place_bodies(poses)?;
        }
        let parked = self.parked.take().expect("a march is parked between steps");
        let mut march = March::unpark(&self.model, parked, moved);
        march.interrupt = interrupt;
        let outcome = march.attempt(t, dt, rejected);
        self.parked = Some(march.park());
        outcome
    }
}

fn stiffness_of(model: &Incompressible) -> Result<Stiffness, ExpressionError> {
    model.bodies.as_ref().map_or_else(|| Ok(Stiffness::default()), |floating| Stiffness::new(floating.bodies()))
}
