//! Newton's method for one step, velocity, pressure and polarity together.
//!
//! The Stokes problem is linear and its factors are at hand, so velocity and pressure are solved exactly for every polarity,
//! and Newton's method acts on what remains, `R(p) = R_p(p, v(p)) = 0`. Each correction comes from GMRES with the exact
//! derivative `J_pp + D S⁻¹ F′` and, as preconditioner, the factors of the whole coupled matrix at an earlier state. They
//! are made anew only when GMRES has become slow. A line search guards the first corrections; near the tolerance they come from the
//! lagged factors alone, as long as each of them lowers the residual enough.

use std::cell::RefCell;

use serde::{Deserialize, Serialize};

use super::Phases;
use super::coupling::{Step, StepFailure, StepOutcome, increment, rate};
use crate::model::incompressible::{Incompressible, Inputs, State};
use crate::model::lagged::{Lagged, Structure};
use crate::model::momentum::MomentumError;
use crate::model::tangent::Tangent;
use crate::solve::krylov::gmres;
use crate::solve::{SolveError, axpy, dot, norm, root};
use crate::space::Field;

/// What is kept from step to step: factors of an earlier derivative.
#[derive(Debug, Default)]
pub struct Memory {
    structure: Option<Structure>,
    lagged: Option<Lagged>,
    origin: Option<Origin>,
}

/// Where the factors come from: enough to make them anew, bit for bit, and to know when they are worn out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Coefficients of the polarity and the velocity that the derivative was taken at.
    p: Vec<f64>,
    v: Vec<f64>,
    /// The velocity before the step.
    before: Vec<f64>,
    /// `α₀/Δt`, and the time.
    weight: f64,
    t: f64,
    /// GMRES iterations of the first solve with the factors (0 before it), and the surplus over it since.
    fresh: usize,
    surplus: usize,
}

impl Origin {
    /// Whether it has so many unknowns of velocity and polarity.
    pub fn fits(&self, velocity: usize, polarity: usize) -> bool {
        self.v.len() == velocity && self.before.len() == velocity && self.p.len() == polarity
    }
}

impl Memory {
    fn factorise(&mut self, model: &Incompressible, tangent: &Tangent, phases: &mut Phases) -> Result<(), StepFailure> {
        if self.structure.is_none() {
            self.structure = Some(phases.measure("dissection", || Structure::new(&model.layout()))?);
        }
        let structure = self.structure.as_ref().expect("just made");
        let made = phases.measure("factors", || match self.lagged.take() {
            Some(mut lagged) => lagged.renew(tangent).map(|()| lagged),
            None => Lagged::new(structure, tangent),
        });
        self.lagged = Some(made?);
        Ok(())
    }

    /// Whether there are factors that still serve.
    fn serves(&self) -> bool {
        self.lagged.is_some() && self.origin.as_ref().is_some_and(|origin| origin.surplus <= SURPLUS)
    }

    /// Whether the factors are near enough to those of the weight `w = α₀/Δt` that their correction measures the error.
    fn serves_at(&self, w: f64) -> bool {
        let near = |origin: &Origin| w <= 2.0 * origin.weight && origin.weight <= 2.0 * w;
        self.serves() && self.origin.as_ref().is_some_and(near)
    }

    /// Books a solve of so many iterations.
    fn book(&mut self, iterations: usize) {
        if let Some(origin) = &mut self.origin {
            if origin.fresh == 0 {
                origin.fresh = iterations.max(1);
            }
            origin.surplus += iterations.saturating_sub(origin.fresh);
        }
    }

    /// Goes back to factors of an earlier origin; they are made anew when they are needed.
    pub fn rewind(&mut self, origin: Option<Origin>) {
        (self.lagged, self.origin) = (None, origin);
    }

    /// What a checkpoint has to keep.
    pub fn origin(&self) -> Option<&Origin> {
        self.origin.as_ref()
    }

    /// The memory that a checkpoint kept, with the factors made anew; an empty one where that fails.
    pub fn restore(model: &Incompressible, origin: Origin) -> Self {
        let mut memory = Self::default();
        let state = State {
            v: Field::new(&model.momentum.velocity, origin.v.clone()),
            pi: Field::zero(&model.momentum.pressure),
            p: Field::new(&model.polarity.space, origin.p.clone()),
        };
        let before = Field::new(&model.momentum.velocity, origin.before.clone());
        let tangent = Tangent::new(model, &state, &before, origin.weight, origin.t);
        if memory.factorise(model, &tangent, &mut Phases::default()).is_ok() {
            memory.origin = Some(origin);
        }
        memory
    }
}

/// GMRES gives up after this many products.
const KRYLOV_LIMIT: usize = 60;

/// Factors are made anew when the iterations in excess of those that fresh factors need reach this number.
const SURPLUS: usize = 40;

/// Corrections by the lagged factors alone are tried below so many tolerances.
const NEAR: f64 = 1000.0;

/// Most halvings of a correction.
const HALVINGS: usize = 12;

/// A polarity with the flow that follows from it, and the residual of its equation.
struct Trial {
    state: State,
    residual: Vec<f64>,
    /// `(R|M⁻¹R)^½`
    size: f64,
}

struct Equations<'s> {
    step: &'s Step<'s>,
    inputs: Inputs,
    weight: f64,
    history: Vec<f64>,
}

impl Equations<'_> {
    fn model(&self) -> &Incompressible {
        self.step.model
    }

    /// Velocity and pressure of `p`, then the residual of the polarity equation [7.11c].
    fn evaluate(&self, p: Field, phases: &mut Phases) -> Result<Trial, StepFailure> {
        let (model, inputs, before) = (self.model(), &self.inputs, &self.step.guess.v);
        let well = phases.measure("residual", || model.polarity.molecular_functional(&model.loops, &p, inputs.t));
        let force = phases.measure("force", || {
            let l = (model.parameters.elasticity != 0.0)
                .then(|| Field::new(&model.polarity.space, model.polarity.mass_solve(&well)));
            model.force_of(&p, l.as_ref(), before, inputs)
        });
        let (v, pi) = phases.measure("stokes", || model.flow_of(&force, inputs))?;
        let residual = phases.measure("residual", || {
            let mut rate = self.history.clone();
            axpy(self.weight, &p.values, &mut rate);
            let carrier = model.carrier(&v, before);
            let mut r = model.polarity_residual_of(carrier, &p, &well, &inputs.source, inputs.t);
            axpy(model.parameters.peclet, &model.polarity.mass_times(&rate), &mut r);
            r
        });
        if let Some(index) = residual.iter().position(|r| !r.is_finite()) {
            return Err(SolveError::NotFiniteInput { system: "polarity".to_owned(), index }.into());
        }
        let size = root(dot(&residual, &model.polarity.mass_solve(&residual)));
        Ok(Trial { state: State { v, pi, p }, residual, size })
    }
}

/// The polynomial through the past polarities at the new time.
fn predict(step: &Step) -> Field {
    let times: Vec<f64> = step.known.iter().map(|(t, _)| *t).collect();
    let mut p = vec![0.0; step.guess.p.values.len()];
    for (i, (ti, field)) in step.known.iter().enumerate() {
        let others = times.iter().enumerate().filter(|(j, _)| *j != i);
        let weight: f64 = others.map(|(_, tj)| (step.t - tj) / (ti - tj)).product();
        axpy(weight, &field.values, &mut p);
    }
    Field::new(&step.guess.p.space, p)
}

/// Solves a step from the polynomial through the past or, where that leads nowhere, from the last state. An iteration is one
/// correction, by GMRES or by the lagged factors alone.
///
/// # Errors
/// As [`super::coupling::solve_step`].
pub(super) fn iterate(step: &Step, memory: &mut Memory, phases: &mut Phases) -> Result<StepOutcome, StepFailure> {
    match iterate_from(step, predict(step), memory, phases) {
        Err(failure) if step.known.len() > 1 && failure.may_be_cured_by_a_smaller_step() => {
            iterate_from(step, step.guess.p.clone(), memory, phases)
        }
        other => other,
    }
}

fn iterate_from(
    step: &Step,
    start: Field,
    memory: &mut Memory,
    phases: &mut Phases,
) -> Result<StepOutcome, StepFailure> {
    let (model, settings) = (step.model, step.settings);
    let scheme = settings.kind.name();
    let inputs = phases.measure("inputs", || model.inputs(step.t))?;
    let (weight, history) = step.differences();
    let equations = Equations { step, inputs, weight, history };
    let mut now = equations.evaluate(start, phases)?;
    let (mut first, mut linear_iterations) = (0.0, 0);
    let mut last_size = f64::INFINITY;
    for k in 1..=settings.max_iterations {
        step.check_interrupt()?;
        if !now.size.is_finite() {
            return Err(StepFailure::Diverged { scheme, iterations: k, increment: now.size });
        }
        let quick = quick_correction(&equations, memory, &now, settings.tolerance, phases)?;
        // no correction lowers the residual any more, usually because of rounding
        let mut stuck = false;
        let change = match quick {
            Some((next, change)) => {
                last_size = std::mem::replace(&mut now, next).size;
                change
            }
            None => {
                let reduction = forcing(now.size, last_size);
                let (delta, products) = correction(&equations, memory, &now, reduction, phases)?;
                linear_iterations += products;
                match search(&equations, &now, &delta, settings.tolerance, phases)? {
                    Search::Found(next, change) => {
                        last_size = std::mem::replace(&mut now, *next).size;
                        change
                    }
                    Search::Stuck(change) => {
                        stuck = true;
                        change
                    }
                }
            }
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
            let mut rate_of_p = equations.history;
            axpy(weight, &now.state.p.values, &mut rate_of_p);
            return Ok(StepOutcome {
                state: now.state,
                rate_of_p,
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

/// The correction of the lagged factors alone, if it is near the tolerance and lowers the residual enough to be worth its price: a
/// third of that of a correction by GMRES.
fn quick_correction(
    equations: &Equations,
    memory: &Memory,
    now: &Trial,
    tolerance: f64,
    phases: &mut Phases,
) -> Result<Option<(Trial, f64)>, StepFailure> {
    let Some(lagged) = memory.lagged.as_ref().filter(|_| memory.serves_at(equations.weight)) else { return Ok(None) };
    let model = equations.model();
    let mut delta: Vec<f64> = now.residual.iter().map(|r| -r).collect();
    phases.measure("factored solve", || lagged.solve(&mut delta));
    let size = root(dot(&delta, &model.polarity.mass_times(&delta)));
    if size.is_nan() || size >= NEAR * tolerance {
        return Ok(None);
    }
    let Some(next) = moved(equations, now, &delta, 1.0, phases)? else { return Ok(None) };
    let change = increment(model, &now.state, &next.state.v, &next.state.pi, &next.state.p.values);
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
    let mut p = now.state.p.clone();
    axpy(scale, delta, &mut p.values);
    match equations.evaluate(p, phases) {
        Ok(trial) => Ok(Some(trial)),
        Err(failure) if failure.may_be_cured_by_a_smaller_step() => Ok(None),
        Err(failure) => Err(failure),
    }
}

/// Solves with the exact derivative; makes factors anew where there are none or GMRES has become slow.
fn correction(
    equations: &Equations,
    memory: &mut Memory,
    now: &Trial,
    reduction: f64,
    phases: &mut Phases,
) -> Result<(Vec<f64>, usize), StepFailure> {
    let model = equations.model();
    let tangent = phases.measure("tangent", || {
        Tangent::new(model, &now.state, &equations.step.guess.v, equations.weight, equations.inputs.t)
    });
    let right: Vec<f64> = now.residual.iter().map(|r| -r).collect();
    let mut products = 0;
    for attempt in 0..2 {
        if !memory.serves() || attempt == 1 {
            memory.origin = None;
            memory.factorise(model, &tangent, phases)?;
            memory.origin = Some(Origin {
                p: now.state.p.values.clone(),
                v: now.state.v.values.clone(),
                before: equations.step.guess.v.values.clone(),
                weight: equations.weight,
                t: equations.inputs.t,
                fresh: 0,
                surplus: 0,
            });
        }
        let lagged = memory.lagged.as_ref().expect("just made");
        let failure: RefCell<Option<MomentumError>> = RefCell::new(None);
        let apply = |x: &[f64], y: &mut [f64]| {
            if let Err(error) = tangent.times(x, y) {
                failure.borrow_mut().get_or_insert(error);
                y.fill(f64::NAN);
            }
        };
        let mut delta = vec![0.0; right.len()];
        let target = reduction * norm(&right);
        let outcome = phases.measure("newton solve", || {
            gmres(&apply, &|x: &mut [f64]| lagged.solve(x), &right, &mut delta, target, KRYLOV_LIMIT)
        });
        products += outcome.iterations;
        if let Some(error) = failure.into_inner() {
            return Err(error.into());
        }
        memory.book(outcome.iterations);
        if outcome.converged && delta.iter().all(|d| d.is_finite()) {
            return Ok((delta, products));
        }
        if attempt == 1 {
            let residual = outcome.residual / norm(&right);
            let (system, hint) = ("Newton".to_owned(), "take a smaller time step".to_owned());
            return Err(SolveError::Inaccurate { system, residual, hint }.into());
        }
    }
    unreachable!("the second attempt returns")
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
            let change = increment(equations.model(), &now.state, &next.state.v, &next.state.pi, &next.state.p.values);
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
