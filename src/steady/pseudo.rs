//! Pseudo-transient continuation: implicit Euler steps whose length grows as the residual falls, until they are
//! Newton's.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::model::Residuals;
use crate::model::fields::VELOCITY;
use crate::model::parameters::ElasticForce;
use crate::time::equations::{Equations, Trial};
use crate::time::kept_factors::{KeptFactors, correction};
use crate::time::{Phases, Sheet, StepFailure, Weights};

/// How pseudo-time is stepped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pseudo {
    /// Bound on the total residual of the stationary equations [9.8–9.10].
    pub residual: f64,
    /// First pseudo-step, in units of time.
    pub step: f64,
    /// Longest pseudo-step as long as the residual is above `release` times its largest value so far; up to it a
    /// growing residual does not shorten the step, so that instabilities can unfold.
    pub most: f64,
    /// See `most`.
    pub release: f64,
    /// A residual that grows by more than this factor rejects a pseudo-step.
    pub growth: f64,
    /// Most pseudo-steps, rejected ones included.
    pub max_steps: usize,
}

/// One accepted pseudo-step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PseudoStep {
    /// Its number, from 1.
    pub step: usize,
    /// Pseudo-time passed.
    pub t: f64,
    /// Its length.
    pub dt: f64,
    /// Total residual after it.
    pub residual: f64,
    /// Largest `|δy|` at a node.
    pub change: f64,
    /// GMRES products.
    pub products: usize,
    /// Pseudo-steps that were tried longer before it.
    pub rejected: usize,
}

/// Why no steady state was reached; what was carried last is kept.
#[derive(Debug, Clone, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum Stall {
    #[error("{steps} pseudo-steps were not enough: the residual is {residual:.1e}")]
    Steps { steps: usize, residual: f64 },
    #[error("the pseudo-step fell to {dt:.1e} at residual {residual:.1e}: {cause}")]
    Step { dt: f64, residual: f64, cause: String },
    #[error("stopped from outside")]
    Interrupted,
    #[error(transparent)]
    Failed(#[from] StepFailure),
}

/// A pseudo-step that changes what is carried anywhere by more than this, relative to its largest value or 1, is
/// rejected.
const LARGEST_CHANGE: f64 = 1.0;

/// A pseudo-step that changes it by less may grow even where the residual does not fall.
const SMALL_CHANGE: f64 = 0.1;

/// Pseudo-steps grow at most by this factor.
const LARGEST_RATIO: f64 = 4.0;

/// Below this share of the first pseudo-step, the continuation has failed.
const SHORTEST: f64 = 1e-4;

/// What is at work: the model, the linear systems, and the clock.
#[derive(Debug)]
pub struct Work<'w> {
    /// The factors that are at hand.
    pub kept: &'w mut KeptFactors,
    /// Where time is booked.
    pub phases: &'w mut Phases,
    /// Set from outside to stop.
    pub interrupt: &'w AtomicBool,
}

impl Work<'_> {
    pub(super) fn check_interrupt(&self) -> Result<(), Stall> {
        if self.interrupt.load(Ordering::Relaxed) { Err(Stall::Interrupted) } else { Ok(()) }
    }
}

/// Steps from `start` until the residual is below its bound. `seen` is told of every accepted step.
///
/// Pseudo-step n solves `N (y − yⁿ)/Δτ + R(y) = 0` (`N = Pe M` in the incompressible sheet) by one Newton correction,
/// and `Δτ` follows the residual: `Δτⁿ⁺¹ = Δτⁿ ‖Rⁿ⁻¹‖/‖Rⁿ‖` (switched evolution relaxation, Mulder and van Leer 1985;
/// Kelley and Keyes 1998).
///
/// # Errors
/// Too many or too short pseudo-steps, a stop from outside, or a failure that no shorter one can cure; in `start` is
/// then the last carried vector.
pub fn relax(
    model: &dyn Sheet,
    start: &mut Vec<f64>,
    settings: &Pseudo,
    work: &mut Work,
    seen: &mut dyn FnMut(&PseudoStep, &Trial),
) -> Result<Trial, Stall> {
    let scale = model.area().sqrt();
    let flow = model.state_of(start, 0.0)?.into_field(VELOCITY);
    let mut equations = Equations::stationary(model, &flow, 0.0)?;
    let mut now = equations.evaluate(start.clone(), work.phases)?;
    let (mut dt, mut t, mut rejected, mut taken, mut accepted) = (settings.step, 0.0, 0, 0, 0);
    let (mut cause, mut peak) = (String::new(), 0.0_f64);
    loop {
        let residual = now.size / scale;
        peak = peak.max(residual);
        if residual < settings.residual {
            *start = now.state.carried();
            return Ok(now);
        }
        if let Err(stall) = work.check_interrupt() {
            *start = now.state.carried();
            return Err(stall);
        }
        if taken == settings.max_steps {
            *start = now.state.carried();
            return Err(Stall::Steps { steps: taken, residual });
        }
        if dt < SHORTEST * settings.step {
            *start = now.state.carried();
            return Err(Stall::Step { dt, residual, cause });
        }
        taken += 1;
        match attempt(&equations, &now, dt, residual / peak, settings, work) {
            Ok((next, change, products)) => {
                accepted += 1;
                t += dt;
                let ratio = now.size / next.size;
                now = next;
                let residual = now.size / scale;
                seen(&PseudoStep { step: accepted, t, dt, residual, change, products, rejected }, &now);
                rejected = 0;
                let least = if change < SMALL_CHANGE { 1.5 } else { 0.5 };
                let free = dt * ratio.clamp(least, LARGEST_RATIO);
                let bound = residual > settings.release * peak;
                dt = if bound { free.clamp(dt.min(settings.most), settings.most) } else { free };
                if model.parameters().elastic_force == ElasticForce::Energy {
                    equations.before = now.state[VELOCITY].clone();
                    now = equations.evaluate(now.y, work.phases)?;
                }
            }
            Err(why) => {
                if !why.may_be_cured_by_a_smaller_step() {
                    return Err(why.into());
                }
                cause = why.to_string();
                rejected += 1;
                dt *= 0.25;
            }
        }
    }
}

/// One correction of length `dt`: the new state, the largest change, and the products it took.
fn attempt(
    equations: &Equations,
    now: &Trial,
    dt: f64,
    progress: f64,
    settings: &Pseudo,
    work: &mut Work,
) -> Result<(Trial, f64, usize), StepFailure> {
    let model = equations.model;
    let scale = model.area().sqrt();
    // quadratic convergence at the end, but no more than the bound needs
    let reduction = progress.clamp(1e-6, 1e-2).max(0.1 * settings.residual * scale / now.size).min(0.1);
    // what is conserved has to be held by the time derivative
    let longest = if model.conserves() { 1e6 } else { 1e10 };
    let weight = if dt < longest {
        1.0 / dt
    } else if model.conserves() {
        1.0 / longest
    } else {
        0.0
    };
    let (delta, products) = correction(equations, work.kept, (now, Weights::both(weight)), reduction, work.phases)?;
    let largest = |x: &[f64]| x.iter().fold(0.0_f64, |m, v| if v.is_nan() { f64::NAN } else { m.max(v.abs()) });
    let change = largest(&delta);
    let too_much = StepFailure::Diverged { scheme: "pseudo-transient", iterations: 1, increment: change };
    if change.is_nan() || change > LARGEST_CHANGE * largest(&now.y).max(1.0) {
        return Err(too_much);
    }
    // from what the limiter left, as a time step goes on from there
    let mut y = now.state.carried();
    crate::solve::axpy(1.0, &delta, &mut y);
    let next = equations.evaluate_near(y, &now.state[VELOCITY], work.phases)?;
    if next.size.is_nan() || next.size > settings.growth * now.size {
        return Err(too_much);
    }
    Ok((next, change, products))
}

/// The residuals of a trial as [`Sheet::residuals`] has them.
///
/// # Errors
/// A formula that is not finite; a mass matrix that cannot be solved with.
pub fn residuals(model: &dyn Sheet, trial: &Trial) -> Result<Residuals, StepFailure> {
    Ok(model.residuals(&trial.state, 0.0)?)
}
