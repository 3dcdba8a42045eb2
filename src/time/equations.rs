//! The polarity's equation with velocity and pressure eliminated: `R(p) = R_p(p, v(p))`, of a time step or stationary.

use super::Phases;
use super::coupling::StepFailure;
use crate::model::incompressible::{Incompressible, Inputs, State};
use crate::solve::{SolveError, axpy, dot, root};
use crate::space::Field;

/// A polarity with the flow that follows from it, and the residual of its equation.
#[derive(Debug, Clone)]
pub struct Trial {
    pub state: State,
    /// As a functional on the polarity space.
    pub residual: Vec<f64>,
    /// `(R|M⁻¹R)^½`
    pub size: f64,
}

/// `R(p) = Pe (w p + h) + Pe [a_upw − ω − a δ](p; v(p)) + (1/B) L_h(p) − inputs`   [7.11c]
#[derive(Debug)]
pub struct Equations<'m> {
    pub model: &'m Incompressible,
    pub inputs: Inputs,
    /// The flow whose directions the energy-consistent force keeps.
    pub before: Field,
    /// `w = α₀/Δt`; 0 for the stationary equation.
    pub weight: f64,
    /// `h = Σ_{i≥1} α_i p^{n−i}/Δt`; 0 for the stationary equation.
    pub history: Vec<f64>,
}

impl<'m> Equations<'m> {
    /// The stationary equation at time `t`, upwind directions from `before`.
    ///
    /// # Errors
    /// A formula that is not finite at `t`.
    pub fn stationary(model: &'m Incompressible, before: &Field, t: f64) -> Result<Self, StepFailure> {
        let history = vec![0.0; model.polarity.space.dof_count()];
        Ok(Self { model, inputs: model.inputs(t)?, before: before.clone(), weight: 0.0, history })
    }

    /// Velocity and pressure of `p`, then the residual of the polarity equation [7.11c].
    ///
    /// # Errors
    /// A residual that is not finite; a flow that cannot be solved for.
    pub fn evaluate(&self, p: Field, phases: &mut Phases) -> Result<Trial, StepFailure> {
        let (model, inputs, before) = (self.model, &self.inputs, &self.before);
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
