//! One time step: velocity, pressure and polarity brought to agree by a fixed point, plain or accelerated
//! [8.33–8.35], or by Newton's method.

use std::sync::atomic::{AtomicBool, Ordering};

use super::equations::Equations;
use super::sheet::{Settled, Sheet, Weights};
use super::{Phases, newton};
use crate::expression::ExpressionError;
use crate::model::State;
use crate::model::compressible::FlowError;
use crate::model::fields::{POLARITY, VELOCITY};
use crate::model::limiter::NegativeMean;
use crate::model::momentum::MomentumError;
use crate::scheme::{abdf, bdf};
use crate::solve::SolveError;
use crate::solve::anderson::Anderson;

/// How a step is solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CouplingSettings {
    /// δ_fp, bound on the increment of the last iteration.
    pub tolerance: f64,
    /// At k_max a step is accepted when its increment is below this (thesis: `δ_fp^½`).
    pub accept: f64,
    /// An increment above this is divergence [9.1] (thesis: 10⁴).
    pub diverged: f64,
    /// k_max.
    pub max_iterations: usize,
    /// How the next iterate follows from the last ones.
    pub kind: CouplingKind,
}

impl Default for CouplingSettings {
    /// Newton's method to 1e-8, the thesis' bounds else.
    fn default() -> Self {
        let tolerance: f64 = 1e-8;
        let accept = tolerance.sqrt();
        Self { tolerance, accept, diverged: 1e4, max_iterations: 100, kind: CouplingKind::Newton }
    }
}

/// How the next iterate follows from the last ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CouplingKind {
    /// It is the image of the last one [8.33–8.35].
    FixedPoint,
    /// Anderson acceleration over up to `depth` differences.
    Anderson {
        /// At least 1.
        depth: usize,
    },
    /// All fields together by Newton's method, see `time::newton`.
    Newton,
}

impl CouplingKind {
    /// What to try when steps fail.
    pub fn hint(self) -> &'static str {
        match self {
            CouplingKind::FixedPoint => "take a smaller `time.step`, `coupling.kind = \"newton\"`, or a finer mesh",
            CouplingKind::Anderson { .. } | CouplingKind::Newton => {
                "take a smaller `time.step`, a finer mesh, or milder parameters; check the start for very large values"
            }
        }
    }

    /// What messages call it.
    pub fn name(self) -> &'static str {
        match self {
            CouplingKind::FixedPoint => "fixed-point",
            CouplingKind::Anderson { .. } => "Anderson",
            CouplingKind::Newton => "Newton",
        }
    }
}

/// A step that was solved.
#[derive(Debug, Clone)]
pub struct StepOutcome {
    /// The state that was reached.
    pub settled: Settled,
    /// `∂_t p` by the BDF.
    pub rate_of_p: Vec<f64>,
    /// k
    pub iterations: usize,
    /// Of all linear solves of the polarity.
    pub linear_iterations: usize,
    /// `e_1`, the first increment.
    pub first_increment: f64,
    /// `e_k`, the last increment.
    pub increment: f64,
    /// `η_k = −log10(e_k/e_1)`
    pub rate: f64,
    /// Whether `e_k < δ_fp`; otherwise the step was accepted at k_max with a larger increment.
    pub converged: bool,
}

/// Why a step was not solved.
#[derive(Debug, Clone, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum StepFailure {
    #[error("the {scheme} iteration reached {iterations} iterations with increment {increment:.1e}")]
    Slow { scheme: &'static str, iterations: usize, increment: f64 },
    #[error("the {scheme} iteration diverged: increment {increment:.1e} after {iterations} iterations")]
    Diverged { scheme: &'static str, iterations: usize, increment: f64 },
    #[error(transparent)]
    Polarity(#[from] SolveError),
    #[error(transparent)]
    Momentum(#[from] MomentumError),
    #[error(transparent)]
    Density(#[from] NegativeMean),
    #[error(transparent)]
    Formula(#[from] ExpressionError),
    /// Bodies cannot move so far at once.
    #[error("{0}")]
    Bodies(String),
    #[error("stopped from outside")]
    Interrupted,
}

impl From<FlowError> for StepFailure {
    fn from(error: FlowError) -> Self {
        match error {
            FlowError::Density(error) => StepFailure::Density(error),
            FlowError::Momentum(error) => StepFailure::Momentum(error),
        }
    }
}

impl StepFailure {
    /// Whether a smaller step may help: not when the constant Stokes problem or a formula fails.
    pub fn may_be_cured_by_a_smaller_step(&self) -> bool {
        match self {
            StepFailure::Slow { .. }
            | StepFailure::Diverged { .. }
            | StepFailure::Polarity(_)
            | StepFailure::Bodies(_)
            | StepFailure::Density(_) => true,
            // a force that is not finite comes from a polarity that is not
            StepFailure::Momentum(MomentumError::Solve(SolveError::NotFiniteInput { .. })) => true,
            // so does a density that an iterate has made too thin
            StepFailure::Momentum(MomentumError::Vacuum | MomentumError::Weighted(_)) => true,
            StepFailure::Momentum(
                MomentumError::Solve(_)
                | MomentumError::Formula(_)
                | MomentumError::Body(_)
                | MomentumError::Unheld { .. }
                | MomentumError::Flux { .. }
                | MomentumError::NoTraction { .. },
            )
            | StepFailure::Formula(_)
            | StepFailure::Interrupted => false,
        }
    }
}

/// A step of the density.
#[derive(Debug, Clone, PartialEq)]
pub struct DensityStep {
    /// Its coefficients.
    pub formula: abdf::Formula,
    /// `∂_t ρ` at the last step; empty where the formula does not use it.
    pub rate: Vec<f64>,
}

/// One step to be solved: `past` holds `(t_{n−i}, y^{n−i})`, newest first, as many as the order asks for.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// What is solved.
    pub model: &'a dyn Sheet,
    /// The time that is stepped to.
    pub t: f64,
    /// Known levels that the order asks for.
    pub past: &'a [(f64, &'a [f64])],
    /// The same and possibly one more, for a prediction.
    pub known: &'a [(f64, &'a [f64])],
    /// How the density gets to `t`, where there is one.
    pub density: Option<&'a DensityStep>,
    /// The state at the last step.
    pub guess: &'a State,
    /// How it is solved.
    pub settings: &'a CouplingSettings,
    /// Set from outside to give up.
    pub interrupt: &'a AtomicBool,
}

impl<'a> Step<'a> {
    /// The equations of the step.
    pub(super) fn equations(&self, phases: &mut Phases) -> Result<Equations<'a>, StepFailure> {
        let inputs = phases.measure("inputs", || self.model.inputs(self.t))?;
        let (weights, history) = self.differences();
        Ok(Equations { model: self.model, inputs, before: self.guess[VELOCITY].clone(), weights, history })
    }

    /// `1/(Δt β̃₀)`, and `−[Σ_{i≥1} α̃_i ρ^{n−i}/Δt + β̃₁ ∂_t ρ^{n−1}]/β̃₀` in place of the density's history   [8.23]
    fn density_differences(&self, step: &DensityStep, history: &mut [f64]) -> f64 {
        let DensityStep { formula, rate } = step;
        let (count, dt) = (history.len() - self.guess[POLARITY].values.len(), self.t - self.past[0].0);
        let weight = 1.0 / (dt * formula.beta[0]);
        let history = &mut history[..count];
        history.fill(0.0);
        for (alpha, (_, y)) in formula.alpha.iter().zip(self.known) {
            crate::solve::axpy(-alpha * weight, &y[..count], history);
        }
        crate::solve::axpy(-formula.beta[1] / formula.beta[0], rate, history);
        weight
    }

    /// `α₀/Δt`, and `Σ_{i≥1} α_i p^{n−i}/Δt`; what they are for the density.
    fn differences(&self) -> (Weights, Vec<f64>) {
        let times: Vec<f64> = std::iter::once(self.t).chain(self.past.iter().map(|(t, _)| *t)).collect();
        let weights = bdf::derivative_weights(&times);
        let mut history = vec![0.0; self.model.carried_len()];
        for (d, (_, y)) in weights[1..].iter().zip(self.past) {
            crate::solve::axpy(*d, y, &mut history);
        }
        let density = self.density.map_or(0.0, |step| self.density_differences(step, &mut history));
        (Weights { density, polarity: weights[0] }, history)
    }

    /// Gives up where the caller asks for it.
    pub(super) fn check_interrupt(&self) -> Result<(), StepFailure> {
        if self.interrupt.load(Ordering::Relaxed) { Err(StepFailure::Interrupted) } else { Ok(()) }
    }
}

/// Solves a step by the coupling that the settings name; `kept` is what Newton's method keeps from one step to the
/// next.
///
/// # Errors
/// Too slow, diverged, a linear solve that failed, or a formula of the scene that is not finite at `t`.
pub fn solve_step(
    step: &Step,
    kept: &mut super::kept_factors::KeptFactors,
    phases: &mut Phases,
) -> Result<StepOutcome, StepFailure> {
    let solved = match step.settings.kind {
        CouplingKind::FixedPoint => fixed_point(step, 0, phases),
        CouplingKind::Anderson { depth } => fixed_point(step, depth, phases),
        CouplingKind::Newton => newton::iterate(step, kept, phases),
    };
    solved.map_err(|failure| match step.model.check_formulas(step.t) {
        // a formula that is not finite shows first as a system that cannot be solved
        Err(formula) => StepFailure::Formula(formula),
        Ok(()) => failure,
    })
}

/// The model's equations in turn, again and again; Anderson acceleration of depth `depth`.
fn fixed_point(step: &Step, depth: usize, phases: &mut Phases) -> Result<StepOutcome, StepFailure> {
    let Step { model, guess, settings, .. } = *step;
    let equations = step.equations(phases)?;
    let mut passes = model.passes(&equations)?;
    let scheme = settings.kind.name();
    let mut anderson = Anderson::new(depth);
    let mut state = guess.clone();
    let (mut first, mut linear_iterations) = (0.0, 0);
    for k in 1..=settings.max_iterations {
        step.check_interrupt()?;
        let (image, iterations) = passes.image(&state, phases)?;
        linear_iterations += iterations;
        let increment = model.increment(&state, &image);
        if k == 1 {
            first = increment;
        }
        let rate = rate(increment, first);
        let converged = increment < settings.tolerance;
        let late = k == settings.max_iterations && increment < settings.accept;
        if increment >= settings.diverged || increment.is_nan() {
            return Err(StepFailure::Diverged { scheme, iterations: k, increment });
        }
        // what is accepted is the image, whose increment was measured, never an extrapolation
        if converged || late {
            let settled = model.settle(&equations, image, phases)?;
            return Ok(StepOutcome {
                rate_of_p: equations.rate_of_p(&settled.state),
                settled,
                iterations: k,
                linear_iterations,
                first_increment: first,
                increment,
                rate,
                converged,
            });
        }
        if k == settings.max_iterations {
            return Err(StepFailure::Slow { scheme, iterations: k, increment });
        }
        let y = anderson.next(&state.carried(), &image.carried());
        state = model.with_carried(&image, &y).unwrap_or(image);
    }
    unreachable!("max_iterations is at least one")
}

/// `η_k = −log10(e_k/e_1)`
pub(super) fn rate(increment: f64, first: f64) -> f64 {
    if increment > 0.0 { -(increment / first).log10() } else { f64::INFINITY }
}
