//! The linear systems of Newton's method: GMRES with the exact derivative, preconditioned by the factors of the whole
//! coupled matrix at an earlier state, which are made anew only when GMRES has become slow.

use std::cell::RefCell;

use serde::{Deserialize, Serialize};

use super::Phases;
use super::coupling::StepFailure;
use super::equations::{Equations, Trial};
use super::sheet::{Sheet, Tangent, Weights};
use crate::model::lagged::{Lagged, Structure};
use crate::model::momentum::MomentumError;
use crate::solve::krylov::gmres;
use crate::solve::{SolveError, norm};
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
    /// The carried vector that the derivative was taken at.
    y: Vec<f64>,
    /// The velocity before the step.
    before: Vec<f64>,
    /// What the earlier levels gave to the time derivative.
    history: Vec<f64>,
    /// Those of the newest level, and the time.
    weights: Weights,
    t: f64,
    /// GMRES iterations of the first solve with the factors (0 before it), and the surplus over it since.
    fresh: usize,
    surplus: usize,
}

impl Origin {
    /// Whether it has so many unknowns of velocity and of what is carried.
    pub fn fits(&self, velocity: usize, carried: usize) -> bool {
        self.before.len() == velocity && self.y.len() == carried && self.history.len() == carried
    }
}

impl Memory {
    pub(crate) fn factorise(
        &mut self,
        model: &dyn Sheet,
        tangent: &dyn Tangent,
        phases: &mut Phases,
    ) -> Result<(), StepFailure> {
        if self.structure.is_none() {
            self.structure = Some(phases.measure("dissection", || model.structure().cloned())?);
        }
        let structure = self.structure.as_ref().expect("just made");
        let made = phases.measure("factors", || {
            let elements = tangent.elements();
            match self.lagged.take() {
                Some(mut lagged) => lagged.renew(&*elements).map(|()| lagged),
                None => Lagged::new(structure, &*elements),
            }
        });
        self.lagged = Some(made?);
        Ok(())
    }

    /// Whether there are factors that still serve.
    fn serves(&self) -> bool {
        self.lagged.is_some() && self.origin.as_ref().is_some_and(|origin| origin.surplus <= SURPLUS)
    }

    /// The factors, where they are near enough to those of the weight `w = α₀/Δt` that their correction measures the
    /// error.
    pub(super) fn near(&self, w: f64) -> Option<&Lagged> {
        let near = |origin: &Origin| w <= 2.0 * origin.weights.polarity && origin.weights.polarity <= 2.0 * w;
        self.lagged.as_ref().filter(|_| self.serves() && self.origin.as_ref().is_some_and(near))
    }

    /// The factors, whatever they belong to.
    pub(crate) fn factors(&self) -> Option<&Lagged> {
        self.lagged.as_ref()
    }

    /// Makes factors that no time step may use.
    pub(crate) fn borrow_for(
        &mut self,
        model: &dyn Sheet,
        tangent: &dyn Tangent,
        phases: &mut Phases,
    ) -> Result<(), StepFailure> {
        self.origin = None;
        self.factorise(model, tangent, phases)
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
    pub fn restore(model: &dyn Sheet, origin: Origin) -> Self {
        let (mut memory, mut phases) = (Self::default(), Phases::default());
        let Ok(inputs) = model.inputs(origin.t) else { return memory };
        let before = Field::new(model.velocity(), origin.before.clone());
        let (weights, history) = (origin.weights, origin.history.clone());
        let equations = Equations { model, inputs, before, weights, history };
        let Ok(trial) = equations.evaluate(origin.y.clone(), &mut phases) else { return memory };
        let tangent = model.tangent(&equations, &trial, weights);
        if memory.factorise(model, &*tangent, &mut phases).is_ok() {
            memory.origin = Some(origin);
        }
        memory
    }
}

/// GMRES gives up after this many products.
const KRYLOV_LIMIT: usize = 60;

/// Factors are made anew when the iterations in excess of those that fresh factors need reach this number.
const SURPLUS: usize = 40;

/// Solves `(R′ + (w − w₀) N) δ = −R` with the exact derivative of the equations of weight w₀ and `N` what multiplies
/// `∂_t y`.
pub(crate) fn correction(
    equations: &Equations,
    memory: &mut Memory,
    (now, weights): (&Trial, Weights),
    reduction: f64,
    phases: &mut Phases,
) -> Result<(Vec<f64>, usize), StepFailure> {
    let tangent = derivative(equations, now, weights, phases);
    let right: Vec<f64> = now.residual.iter().map(|r| -r).collect();
    solve(equations, &*tangent, memory, (now, weights), &right, reduction, phases)
}

/// The exact derivative at a trial, with weights of its own.
pub(crate) fn derivative<'e>(
    equations: &'e Equations,
    now: &'e Trial,
    weights: Weights,
    phases: &mut Phases,
) -> Box<dyn Tangent + 'e> {
    phases.measure("tangent", || equations.model.tangent(equations, now, weights))
}

/// Solves with a derivative; makes factors anew where there are none or GMRES has become slow.
pub(crate) fn solve(
    equations: &Equations,
    tangent: &dyn Tangent,
    memory: &mut Memory,
    (now, weights): (&Trial, Weights),
    right: &[f64],
    reduction: f64,
    phases: &mut Phases,
) -> Result<(Vec<f64>, usize), StepFailure> {
    let model = equations.model;
    let mut products = 0;
    for attempt in 0..2 {
        if !memory.serves() || attempt == 1 {
            memory.origin = None;
            memory.factorise(model, tangent, phases)?;
            memory.origin = Some(Origin {
                y: now.y.clone(),
                before: equations.before.values.clone(),
                history: equations.history.clone(),
                weights,
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
        let target = reduction * norm(right);
        let outcome = phases.measure("newton solve", || {
            gmres(&apply, &|x: &mut [f64]| lagged.solve(x), right, &mut delta, target, KRYLOV_LIMIT)
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
            let residual = outcome.residual / norm(right);
            let (system, hint) = ("Newton".to_owned(), "take a smaller time step".to_owned());
            return Err(SolveError::Inaccurate { system, residual, hint }.into());
        }
    }
    unreachable!("the second attempt returns")
}
