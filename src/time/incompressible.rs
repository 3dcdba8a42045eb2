//! The incompressible sheet in a time step: its residual, its derivative, and its equations solved in turn [8.33–8.35].

use std::sync::Arc;

mod hybrid;

use self::hybrid::InHybridForm;
use super::Phases;
use super::coupling::StepFailure;
use super::equations::{Equations, Trial};
use super::sheet::{OwnedSheet, Passes, Settled, Sheet, SheetKind, Tangent, Weights};
use crate::expression::ExpressionError;
use crate::form::Integrator;
use crate::model::fields::{POLARITY, PRESSURE, VELOCITY};
use crate::model::incompressible::{Incompressible, Inputs};
use crate::model::lagged::{Elements, Layout, Parts, Structure};
use crate::model::momentum::{Momentum, MomentumError};
use crate::model::parameters::ElasticForce;
use crate::model::polarity::Polarity;
use crate::model::scales::{Scales, relative};
use crate::model::terms::At;
use crate::model::{Conditions, FieldId, Parameters, Reactions, Residuals, Sources, State, tangent};
use crate::solve::blocks::{Incomplete, VectorBlocks};
use crate::solve::sparse::Matrix;
use crate::solve::{SolveError, dot, root};
use crate::space::{Field, Space, Traces};

/// Each polarity solve reduces its residual by this factor: the iteration around it corrects what is left.
pub(super) const LINEAR_REDUCTION: f64 = 1e-2;

impl Sheet for Incompressible {
    fn kind(&self) -> SheetKind<'_> {
        SheetKind::Incompressible(self)
    }

    fn owned(self: Box<Self>) -> OwnedSheet {
        OwnedSheet::Incompressible(self)
    }

    fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    fn conditions(&self) -> &[Conditions] {
        &self.conditions
    }

    fn sources(&self) -> &Sources {
        &self.sources
    }

    fn loops(&self) -> &Integrator {
        &self.loops
    }

    fn area(&self) -> f64 {
        self.area
    }

    fn fields(&self) -> Vec<(FieldId, &Arc<Space>)> {
        let Momentum { velocity, pressure, .. } = &*self.momentum;
        vec![(VELOCITY, velocity), (PRESSURE, pressure), (POLARITY, &self.polarity.space)]
    }

    fn polarity(&self) -> &Polarity {
        &self.polarity
    }

    fn velocity_mass(&self) -> &Matrix {
        &self.momentum.velocity_mass
    }

    fn flow_unknowns(&self) -> usize {
        self.momentum.unknowns()
    }

    fn layout(&self) -> Layout<'_> {
        Incompressible::layout(self)
    }

    fn mass_times(&self, y: &[f64]) -> Vec<f64> {
        self.polarity.mass_times(y)
    }

    fn mass_solve(&self, f: &[f64]) -> Vec<f64> {
        self.polarity.mass_solve(f)
    }

    fn inertia_times(&self, _: &State, y: &[f64]) -> Vec<f64> {
        let pe = self.parameters.peclet;
        self.polarity.inertia_times(y).into_iter().map(|v| pe * v).collect()
    }

    fn without_conserved(&self, _: &mut [f64]) {}

    fn conserves(&self) -> bool {
        false
    }

    fn state_of(&self, y: &[f64], t: f64) -> Result<State, StepFailure> {
        let p = Field::new(&self.polarity.space, y.to_vec());
        let (v, pi) = self.flow(&p, t)?;
        Ok(State::incompressible(v, pi, p))
    }

    fn with_carried(&self, state: &State, y: &[f64]) -> Option<State> {
        Some(state.clone().with(POLARITY, Field::new(&self.polarity.space, y.to_vec())))
    }

    fn inputs(&self, t: f64) -> Result<Inputs, ExpressionError> {
        Incompressible::inputs(self, t)
    }

    fn evaluate(
        &self,
        equations: &Equations,
        y: Vec<f64>,
        near: Option<&Field>,
        phases: &mut Phases,
    ) -> Result<Trial, StepFailure> {
        let (inputs, before) = (&equations.inputs, &equations.before);
        let p = Field::new(&self.polarity.space, y.clone());
        if let Some(hybrid) = self.polarity.hybrid() {
            return self.evaluate_hybrid(hybrid, equations, p, near, phases);
        }
        let well = phases.measure("residual", || self.molecular_functional(&p, before, inputs.t));
        let force = phases.measure("force", || {
            let l = (self.parameters.elasticity != 0.0).then(|| self.projected(&well));
            self.force_of(&p, l.as_ref(), before, inputs)
        });
        let (v, pi) = phases.measure("stokes", || self.flow_of(&force, inputs))?;
        let residual = phases.measure("residual", || {
            let carrier = self.carrier(&v, before);
            let mut r = self.polarity_residual_of(carrier, (&p, None), &well, &inputs.source, inputs.t);
            self.add_rate(equations, &p, &mut r);
            r
        });
        equations.trial(y, State::incompressible(v, pi, p), residual)
    }

    fn tangent<'t>(&'t self, equations: &'t Equations, at: &'t Trial, weights: Weights) -> Box<dyn Tangent + 't> {
        let (before, t) = (&equations.before, equations.inputs.t);
        if self.polarity.hybrid().is_some() {
            return Box::new(InHybridForm::new(self, &at.state, weights.polarity, t));
        }
        Box::new(tangent::Tangent::new(self, &at.state, before, weights.polarity, t))
    }

    fn passes<'e>(&'e self, equations: &'e Equations) -> Result<Box<dyn Passes + 'e>, StepFailure> {
        Ok(Box::new(InTurn::new(self, equations)))
    }

    fn settle(&self, _: &Equations, state: State, _: &mut Phases) -> Result<Settled, StepFailure> {
        Ok(Settled { state, limited: 0, gain: 0.0 })
    }

    fn density_rate(&self, _: &State, _: f64) -> Result<Vec<f64>, ExpressionError> {
        Ok(Vec::new())
    }

    fn stiffness(&self, _: &State) -> f64 {
        0.0
    }

    fn mass(&self, _: &[f64]) -> f64 {
        0.0
    }

    fn gain(&self, _: &State, _: &Inputs) -> f64 {
        0.0
    }

    fn increment(&self, from: &State, to: &State) -> f64 {
        let minus = |a: &Field, b: &Field| -> Vec<f64> { a.values.iter().zip(&b.values).map(|(a, b)| a - b).collect() };
        let mean = |squares: f64| root(squares / self.area);
        let speed = |v: &Field| mean(self.momentum.velocity_mass.quadratic(&v.values));
        let stress = |pi: &Field| mean(self.momentum.pressure_mass.quadratic(&pi.values));
        let v = speed(&from[VELOCITY]).max(speed(&to[VELOCITY]));
        let pi = stress(&from[PRESSURE]).max(stress(&to[PRESSURE]));
        let scales = Scales::new(&self.parameters, self.area, v, pi);
        let dv = mean(self.momentum.velocity_mass.quadratic(&minus(&to[VELOCITY], &from[VELOCITY])));
        let dpi = mean(self.momentum.pressure_mass.quadratic(&minus(&to[PRESSURE], &from[PRESSURE])));
        let dp = minus(&to[POLARITY], &from[POLARITY]);
        let dp = mean(dot(&dp, &self.polarity.mass_times(&dp)));
        relative(dv, scales.velocity).hypot(relative(dpi, scales.pressure)).hypot(dp)
    }

    fn residuals(&self, state: &State, t: f64) -> Result<Residuals, MomentumError> {
        Incompressible::residuals(self, state, t)
    }

    fn free_energy(&self, state: &State, t: f64) -> f64 {
        Incompressible::free_energy(self, &state[POLARITY], &state[VELOCITY], t)
    }

    fn energy_rate(&self, state: &State, rate_of_p: &[f64], t: f64) -> f64 {
        match self.parameters.elasticity {
            0.0 => 0.0,
            b => b * dot(&self.molecular_functional(&state[POLARITY], &state[VELOCITY], t), rate_of_p),
        }
    }

    fn check_formulas(&self, t: f64) -> Result<(), ExpressionError> {
        Incompressible::check_formulas(self, t)
    }

    fn changed(
        &self,
        parameters: &Parameters,
        conditions: &[Conditions],
        sources: &Sources,
    ) -> Result<Box<dyn Sheet>, MomentumError> {
        Ok(Box::new(Incompressible::changed(self, parameters, conditions, sources)?))
    }

    fn structure(&self) -> Result<&Structure, SolveError> {
        Incompressible::structure(self)
    }

    fn know_structure(&self, structure: Structure) {
        Incompressible::know_structure(self, structure);
    }

    fn molecular_field(&self, state: &State, t: f64) -> Field {
        let well = self.molecular_functional(&state[POLARITY], &state[VELOCITY], t);
        scaled(self.projected(&well), self.parameters.elasticity)
    }

    fn polarity_laplacian(&self, state: &State, t: f64) -> Field {
        scaled(self.laplacian(state, t), self.parameters.coherence.powi(2))
    }

    fn reactions(&self, state: &State, t: f64) -> Result<Reactions, MomentumError> {
        Reactions::of_incompressible(self, state, t)
    }

    fn pressure(&self, state: &State) -> Result<Field, SolveError> {
        Incompressible::pressure(self, state)
    }
}

pub(super) fn scaled(mut field: Field, factor: f64) -> Field {
    field.values.iter_mut().for_each(|v| *v *= factor);
    field
}

impl Tangent for tangent::Tangent<'_> {
    fn times(&self, y: &[f64], out: &mut [f64]) -> Result<(), MomentumError> {
        tangent::Tangent::times(self, y, out)
    }

    fn elements(&self) -> Box<dyn Elements + '_> {
        Box::new(Parts::new(self))
    }

    fn factors_are_exact(&self) -> bool {
        // forces see no fields of other cells but by faces
        let local = self.force.by_field.as_ref().is_none_or(|rows| rows.off.is_empty());
        local && self.model.parameters.elastic_force == ElasticForce::Stress && self.model.bodies.is_none()
    }
}

/// `L_h` and the force from the last p; velocity and pressure from them; then the polarity, with `|p|²` and the `−p`
/// term from the last iterate and everything else implicit   [8.33], [8.34], [8.35]
struct InTurn<'e> {
    model: &'e Incompressible,
    equations: &'e Equations<'e>,
    /// What no iterate changes on the right side.
    fixed: Vec<f64>,
    operator: VectorBlocks,
    factors: Option<Incomplete>,
}

impl<'e> InTurn<'e> {
    fn new(model: &'e Incompressible, equations: &'e Equations<'e>) -> Self {
        let mut fixed = model.polarity_inputs(&equations.inputs);
        let pe = model.parameters.peclet;
        for (f, h) in fixed.iter_mut().zip(model.polarity.inertia_times(&equations.history)) {
            *f -= pe * h;
        }
        Self { model, equations, fixed, operator: model.polarity.empty_operator(), factors: None }
    }
}

impl Passes for InTurn<'_> {
    fn image(&mut self, state: &State, phases: &mut Phases) -> Result<(State, usize), StepFailure> {
        let Equations { inputs, before, weights, .. } = self.equations;
        let model = self.model;
        // the values on faces are those in the last iterate's flow
        let sides = if model.polarity.hybrid().is_some() { &state[VELOCITY] } else { before };
        let force = phases.measure("force", || model.force(&state[POLARITY], sides, inputs));
        let (v, pi) = phases.measure("stokes", || model.flow_of(&force, inputs))?;
        let carrier = model.carrier(&v, before);
        let given = model.given(inputs.t);
        let none = model.polarity.hybrid().map(|hybrid| Traces::zero(&hybrid.skeleton));
        let at = At::new(&model.parameters, &state[POLARITY], &given)
            .with_flow(&model.momentum.velocity, carrier)
            .with_traces(none.as_ref());
        let mut b = phases.measure("polarity assembly", || {
            model.polarity.pass(model.tissue(), weights.polarity, &at, &mut self.operator)
        });
        b.iter_mut().zip(&self.fixed).for_each(|(b, fixed)| *b = fixed - *b);
        // factors of the first iterate serve the whole step: later ones differ little
        if self.factors.is_none() {
            self.factors = Some(phases.measure("polarity factors", || model.polarity.precondition(&self.operator))?);
        }
        let factors = self.factors.as_ref().expect("just made");
        let mut image = state[POLARITY].values.clone();
        let iterations = phases.measure("polarity solve", || {
            model.polarity.solve(&self.operator, factors, &b, &mut image, LINEAR_REDUCTION)
        })?;
        let p = Field::new(&model.polarity.space, image);
        Ok((State::incompressible(v, pi, p), iterations))
    }
}
