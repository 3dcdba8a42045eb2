//! The equations of what is carried with the flow eliminated: `R(y) = R_y(y, v(y))`, of a time step or stationary.

use std::sync::Arc;

use super::Phases;
use super::coupling::StepFailure;
use super::sheet::{Sheet, Weights};
use crate::model::State;
use crate::model::compressible::Evaluated;
use crate::model::fields::POLARITY;
use crate::model::incompressible::Inputs;
use crate::solve::{SolveError, axpy, dot, root};
use crate::space::Field;

/// A carried vector with the flow that follows from it, and the residual of its equations.
#[derive(Debug, Clone)]
pub struct Trial {
    /// What the equations were evaluated at; the density as it was before the limiter.
    pub y: Vec<f64>,
    /// Its fields.
    pub state: State,
    /// As a functional on the spaces of what is carried.
    pub residual: Vec<f64>,
    /// `(R|M⁻¹R)^½`
    pub size: f64,
    /// The flow of the iterate before, if it was found from that.
    pub near: Vec<f64>,
    /// What the derivative of a compressible sheet needs of the evaluation.
    pub evaluated: Option<Arc<Evaluated>>,
}

/// `R(y)`: `Pe (w p + h) + Pe [a_upw − ω − a δ](p; v(p)) + (1/B) L_h(p) − inputs` in the incompressible sheet   [7.11c]
#[derive(Debug)]
pub struct Equations<'m> {
    /// Whose equations they are.
    pub model: &'m dyn Sheet,
    /// What is given at the new time.
    pub inputs: Inputs,
    /// The flow whose directions the energy-consistent force keeps.
    pub before: Field,
    /// Those of the newest level; 0 for the stationary equations.
    pub weights: Weights,
    /// What the earlier levels give to the time derivative, `h`; 0 for the stationary equations.
    pub history: Vec<f64>,
}

impl<'m> Equations<'m> {
    /// The stationary equations at time `t`, upwind directions from `before`.
    ///
    /// # Errors
    /// A formula that is not finite at `t`.
    pub fn stationary(model: &'m dyn Sheet, before: &Field, t: f64) -> Result<Self, StepFailure> {
        let history = vec![0.0; model.carried_len()];
        Ok(Self { model, inputs: model.inputs(t)?, before: before.clone(), weights: Weights::default(), history })
    }

    /// The flow of `y`, then the residual of its equations.
    ///
    /// # Errors
    /// A residual that is not finite; a flow that cannot be solved for; a density that is negative.
    pub fn evaluate(&self, y: Vec<f64>, phases: &mut Phases) -> Result<Trial, StepFailure> {
        self.model.evaluate(self, y, None, phases)
    }

    /// As [`Equations::evaluate`] within an iteration whose last flow is `near`.
    ///
    /// # Errors
    /// As [`Equations::evaluate`].
    pub fn evaluate_near(&self, y: Vec<f64>, near: &Field, phases: &mut Phases) -> Result<Trial, StepFailure> {
        self.model.evaluate(self, y, Some(near), phases)
    }

    /// `∂_t p` at a state by the formula of the step.
    pub fn rate_of_p(&self, state: &State) -> Vec<f64> {
        let p = &state[POLARITY].values;
        let mut rate = self.history[self.history.len() - p.len()..].to_vec();
        axpy(self.weights.polarity, p, &mut rate);
        rate
    }

    /// A trial of its parts.
    ///
    /// # Errors
    /// A residual that is not finite.
    pub(super) fn trial(&self, y: Vec<f64>, state: State, residual: Vec<f64>) -> Result<Trial, StepFailure> {
        if let Some(index) = residual.iter().position(|r| !r.is_finite()) {
            return Err(SolveError::NotFiniteInput { system: "polarity".to_owned(), index }.into());
        }
        let size = root(dot(&residual, &self.model.mass_solve(&residual)));
        Ok(Trial { y, state, residual, size, near: Vec::new(), evaluated: None })
    }
}
