//! Newton's method for one step, velocity, pressure and polarity together.
//!
//! The Stokes problem is linear and its factors are at hand, so velocity and pressure are solved exactly for every
//! polarity, and Newton's method acts on what remains, `R(p) = R_p(p, v(p)) = 0`. Each correction comes from GMRES with
//! the exact derivative `J_pp + D S⁻¹ F′` and, as preconditioner, the factors of the whole coupled matrix at an earlier
//! state. They are made anew only when GMRES has become slow. A line search guards the first corrections; near the
//! tolerance they come from the lagged factors alone, as long as each of them lowers the residual enough.

use super::Phases;
use super::coupling::{Step, StepFailure, StepOutcome, rate};
use super::equations::{Equations, Trial};
use super::kept_factors::{KeptFactors, correction};
use crate::model::fields::VELOCITY;
use crate::solve::{axpy, dot, root};

/// Corrections by the lagged factors alone are tried below so many tolerances.
const NEAR: f64 = 1000.0;

/// Most halvings of a correction.
const HALVINGS: usize = 12;

/// The polynomial through the past at the new time.
fn predict(step: &Step) -> Vec<f64> {
    let times: Vec<f64> = step.known.iter().map(|(t, _)| *t).collect();
    let mut y = vec![0.0; step.model.carried_len()];
    for (i, (ti, known)) in step.known.iter().enumerate() {
        let others = times.iter().enumerate().filter(|(j, _)| *j != i);
        let weight: f64 = others.map(|(_, tj)| (step.t - tj) / (ti - tj)).product();
        axpy(weight, known, &mut y);
    }
    y
}

/// Solves a step from the polynomial through the past or, where that leads nowhere, from the last state. An iteration
/// is one correction, by GMRES or by the lagged factors alone.
///
/// # Errors
/// Too slow, diverged, a linear solve that failed, or a flow that cannot be solved for.
pub(super) fn iterate(step: &Step, kept: &mut KeptFactors, phases: &mut Phases) -> Result<StepOutcome, StepFailure> {
    match iterate_from(step, predict(step), kept, phases) {
        Err(failure) if step.known.len() > 1 && failure.may_be_cured_by_a_smaller_step() => {
            iterate_from(step, step.guess.carried(), kept, phases)
        }
        other => other,
    }
}

fn iterate_from(
    step: &Step,
    start: Vec<f64>,
    kept: &mut KeptFactors,
    phases: &mut Phases,
) -> Result<StepOutcome, StepFailure> {
    let (model, settings) = (step.model, step.settings);
    let scheme = settings.kind.name();
    let equations = step.equations(phases)?;
    let weights = equations.weights;
    let mut now = equations.evaluate(start, phases)?;
    let (mut first, mut linear_iterations) = (0.0, 0);
    let mut last_size = f64::INFINITY;
    for k in 1..=settings.max_iterations {
        step.check_interrupt()?;
        if !now.size.is_finite() {
            return Err(StepFailure::Diverged { scheme, iterations: k, increment: now.size });
        }
        let found = match quick_correction(&equations, kept, &now, settings.tolerance, phases)? {
            Some((next, change)) => Search::Found(Box::new(next), change),
            None => {
                let reduction = forcing(now.size, last_size);
                let (delta, products) = correction(&equations, kept, (&now, weights), reduction, phases)?;
                linear_iterations += products;
                search(&equations, &now, &delta, settings.tolerance, phases)?
            }
        };
        let (change, stuck) = match found {
            Search::Found(next, change) => {
                last_size = std::mem::replace(&mut now, *next).size;
                (change, false)
            }
            // no correction lowers the residual any more, usually because of rounding
            Search::Stuck(change) => (change, true),
        };
        if k == 1 {
            first = change;
        }
        if change >= settings.diverged || change.is_nan() {
            return Err(StepFailure::Diverged { scheme, iterations: k, increment: change });
        }
        let converged = change < settings.tolerance;
        let ends = stuck || k == settings.max_iterations;
        if converged || (ends && change < settings.accept) {
            let settled = model.settle(&equations, now.state, phases)?;
            return Ok(StepOutcome {
                rate_of_p: equations.rate_of_p(&settled.state),
                settled,
                iterations: k,
                linear_iterations,
                first_increment: first,
                increment: change,
                rate: rate(change, first),
                converged,
            });
        }
        if ends {
            return Err(StepFailure::Slow { scheme, iterations: k, increment: change });
        }
    }
    unreachable!("max_iterations is at least one")
}

/// Reduction asked of GMRES: tight enough for the quadratic convergence that the last correction promises.
fn forcing(size: f64, last: f64) -> f64 {
    if last.is_finite() { (size / last).powi(2).clamp(1e-6, 1e-2) } else { 1e-3 }
}

/// The correction of the lagged factors alone, if it is near the tolerance and lowers the residual enough to be worth
/// its price, which is below that of a correction by GMRES.
fn quick_correction(
    equations: &Equations,
    kept: &KeptFactors,
    now: &Trial,
    tolerance: f64,
    phases: &mut Phases,
) -> Result<Option<(Trial, f64)>, StepFailure> {
    let Some(lagged) = kept.near(equations.weights.polarity) else { return Ok(None) };
    let model = equations.model;
    let mut delta: Vec<f64> = now.residual.iter().map(|r| -r).collect();
    phases.measure("factored solve", || lagged.solve(&mut delta));
    let size = root(dot(&delta, &model.mass_times(&delta)) / model.area());
    if size.is_nan() || size >= NEAR * tolerance {
        return Ok(None);
    }
    let Some(next) = moved(equations, now, &delta, 1.0, phases)? else { return Ok(None) };
    let change = model.increment(&now.state, &next.state);
    // a residual that falls by less would mean that the correction is not the error
    Ok((next.size < 0.3 * now.size).then_some((next, change)))
}

/// The state after the correction `scale · δ`; `None` where it is so far off that nothing can be evaluated.
fn moved(
    equations: &Equations,
    now: &Trial,
    delta: &[f64],
    scale: f64,
    phases: &mut Phases,
) -> Result<Option<Trial>, StepFailure> {
    let mut y = now.y.clone();
    axpy(scale, delta, &mut y);
    match equations.evaluate_near(y, &now.state[VELOCITY], phases) {
        Ok(trial) => Ok(Some(trial)),
        Err(failure) if failure.may_be_cured_by_a_smaller_step() => Ok(None),
        Err(failure) => Err(failure),
    }
}

/// What a line search found.
enum Search {
    /// The longest of the corrections δ, δ/2, δ/4, … that lowers the residual, and the increment that δ stands for.
    Found(Box<Trial>, f64),
    /// None does; the increment of δ itself.
    Stuck(f64),
}

fn search(
    equations: &Equations,
    now: &Trial,
    delta: &[f64],
    tolerance: f64,
    phases: &mut Phases,
) -> Result<Search, StepFailure> {
    let (mut scale, mut whole) = (1.0, f64::INFINITY);
    for _ in 0..=HALVINGS {
        if let Some(next) = moved(equations, now, delta, scale, phases)? {
            let change = equations.model.increment(&now.state, &next.state);
            whole = whole.min(change / scale);
            // at the end rounding hides whether the residual still falls
            let last = scale == 1.0 && change < tolerance && next.size <= 2.0 * now.size;
            if next.size <= (1.0 - 1e-4 * scale) * now.size || last {
                return Ok(Search::Found(Box::new(next), change / scale));
            }
        }
        scale *= 0.5;
    }
    Ok(Search::Stuck(whole))
}
