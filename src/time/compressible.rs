//! The compressible sheet in a time step: its residual, its derivative, and its equations solved in turn [8.36–8.38].

use std::sync::Arc;

use super::Phases;
use super::coupling::StepFailure;
use super::equations::{Equations, Trial};
use super::incompressible::{LINEAR_REDUCTION, scaled};
use super::sheet::{OwnedSheet, Passes, Settled, Sheet, SheetKind, Tangent, Weights};
use crate::expression::ExpressionError;
use crate::form::Integrator;
use crate::model::compressible::{self, Compressible, Evaluated};
use crate::model::fields::{DENSITY, POLARITY, VELOCITY};
use crate::model::incompressible::Inputs;
use crate::model::lagged::{Elements, Layout, Structure};
use crate::model::momentum::MomentumError;
use crate::model::polarity::Polarity;
use crate::model::scales::relative;
use crate::model::{Conditions, FieldId, Parameters, Reactions, Residuals, Sources, State};
use crate::solve::blocks::Incomplete;
use crate::solve::sparse::Matrix;
use crate::solve::{SolveError, axpy, dot, root};
use crate::space::{Field, Space};

impl Sheet for Compressible {
    fn kind(&self) -> SheetKind<'_> {
        SheetKind::Compressible(self)
    }

    fn owned(self: Box<Self>) -> OwnedSheet {
        OwnedSheet::Compressible(self)
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
        vec![(VELOCITY, &self.velocity), (DENSITY, &self.density.space), (POLARITY, &self.polarity.space)]
    }

    fn polarity(&self) -> &Polarity {
        &self.polarity
    }

    fn velocity_mass(&self) -> &Matrix {
        &self.velocity_mass
    }

    fn flow_unknowns(&self) -> usize {
        self.frames.free
    }

    fn layout(&self) -> Layout<'_> {
        Compressible::layout(self)
    }

    fn mass_times(&self, y: &[f64]) -> Vec<f64> {
        let (rho, p) = y.split_at(self.density.space.dof_count());
        self.stacked(&self.density.mass_times(rho), &self.polarity.mass_times(p))
    }

    fn mass_solve(&self, f: &[f64]) -> Vec<f64> {
        let (rho, p) = f.split_at(self.density.space.dof_count());
        self.stacked(&self.density.mass_solve(rho), &self.polarity.mass_solve(p))
    }

    fn inertia_times(&self, state: &State, y: &[f64]) -> Vec<f64> {
        let (rho, p) = self.split(y);
        self.stacked(&self.density.mass_times(&rho.values), &self.inertia(&state[DENSITY], &p))
    }

    fn without_conserved(&self, y: &mut [f64]) {
        self.sealed().take_off_means(&mut y[..self.density.space.dof_count()], &self.density.weights);
    }

    fn conserves(&self) -> bool {
        self.sealed().count() > 0
    }

    fn state_of(&self, y: &[f64], t: f64) -> Result<State, StepFailure> {
        Ok(Compressible::state_of(self, y, t)?)
    }

    fn with_carried(&self, state: &State, y: &[f64]) -> Option<State> {
        let (u, p) = self.split(y);
        let limited = self.density.limiter.limit(&u).ok()?;
        Some(State::compressible(state[VELOCITY].clone(), limited.rho, p))
    }

    fn inputs(&self, t: f64) -> Result<Inputs, ExpressionError> {
        Compressible::inputs(self, t)
    }

    fn evaluate(
        &self,
        equations: &Equations,
        y: Vec<f64>,
        _: Option<&Field>,
        phases: &mut Phases,
    ) -> Result<Trial, StepFailure> {
        let inputs = &equations.inputs;
        let (u, p) = self.split(&y);
        let limited = phases.measure("limiter", || self.density.limiter.limit_on_the_way(&u))?;
        let rho = &limited.rho;
        let well = phases.measure("residual", || self.molecular_functional(rho, &p, inputs.t));
        let molecular = self.molecular(&well);
        let force = phases.measure("force", || self.force(rho, &p, molecular.as_ref(), inputs));
        let viscous = phases.measure("momentum factors", || compressible::Viscous::new(self, rho))?;
        let v = phases.measure("momentum", || viscous.solve(self, &force, &inputs.prescribed))?;
        let v = Field::new(&self.velocity, v);
        let residual = phases.measure("residual", || {
            let (mut r_rho, r) = self.rates(equations, &u, &p);
            axpy(1.0, &self.transport(rho, &v, inputs), &mut r_rho);
            let mut r_p = self.inertia(rho, &r);
            axpy(1.0, &self.polarity_residual(rho, &p, &v, &well, inputs), &mut r_p);
            self.stacked(&r_rho, &r_p)
        });
        let state = State::compressible(v, rho.clone(), p);
        let trial = equations.trial(y, state, residual)?;
        Ok(Trial { evaluated: Some(Arc::new(Evaluated { u, limited, viscous, molecular })), ..trial })
    }

    fn tangent<'t>(&'t self, equations: &'t Equations, at: &'t Trial, weights: Weights) -> Box<dyn Tangent + 't> {
        let evaluated = at.evaluated.as_ref().expect("its own evaluation made the trial");
        let (_, rate) = self.rates(equations, &evaluated.u, &at.state[POLARITY]);
        let w = [weights.density, weights.polarity];
        Box::new(compressible::Tangent::new(self, evaluated, &at.state, &rate, w, &equations.inputs))
    }

    fn passes<'e>(&'e self, equations: &'e Equations) -> Result<Box<dyn Passes + 'e>, StepFailure> {
        Ok(Box::new(InTurn { model: self, equations, factors: None }))
    }

    fn settle(&self, equations: &Equations, state: State, phases: &mut Phases) -> Result<Settled, StepFailure> {
        let mut u = state[DENSITY].clone();
        phases.measure("density solve", || self.transported(equations, &state[VELOCITY], &mut u))?;
        let limited = self.density.limiter.limit(&u)?;
        let state = state.with(DENSITY, limited.rho);
        let gain = Compressible::gain(self, &state, &equations.inputs);
        Ok(Settled { state, limited: limited.cells, gain })
    }

    fn density_rate(&self, state: &State, t: f64) -> Result<Vec<f64>, ExpressionError> {
        Ok(Compressible::density_rate(self, state, t)?.values)
    }

    fn stiffness(&self, state: &State) -> f64 {
        Compressible::stiffness(self, state)
    }

    fn mass(&self, y: &[f64]) -> f64 {
        self.density.total(&y[..self.density.space.dof_count()])
    }

    fn gain(&self, state: &State, inputs: &Inputs) -> f64 {
        Compressible::gain(self, state, inputs)
    }

    fn increment(&self, from: &State, to: &State) -> f64 {
        let minus = |a: &Field, b: &Field| -> Vec<f64> { a.values.iter().zip(&b.values).map(|(a, b)| a - b).collect() };
        let mean = |squares: f64| root(squares / self.area);
        let density = |rho: &[f64]| mean(dot(rho, &self.density.mass_times(rho)));
        let speed = |v: &Field| mean(self.velocity_mass.quadratic(&v.values));
        let rho = density(&from[DENSITY].values).max(density(&to[DENSITY].values));
        let scales = self.scales(speed(&from[VELOCITY]).max(speed(&to[VELOCITY])), rho);
        let dv = mean(self.velocity_mass.quadratic(&minus(&to[VELOCITY], &from[VELOCITY])));
        let drho = density(&minus(&to[DENSITY], &from[DENSITY]));
        let dp = minus(&to[POLARITY], &from[POLARITY]);
        let dp = mean(dot(&dp, &self.polarity.mass_times(&dp)));
        relative(dv, scales.velocity).hypot(relative(drho, rho)).hypot(dp)
    }

    fn residuals(&self, state: &State, t: f64) -> Result<Residuals, MomentumError> {
        Compressible::residuals(self, state, t)
    }

    fn free_energy(&self, state: &State, t: f64) -> f64 {
        Compressible::free_energy(self, state, t)
    }

    fn energy_rate(&self, state: &State, rate_of_p: &[f64], t: f64) -> f64 {
        Compressible::energy_rate(self, state, rate_of_p, t)
    }

    fn check_formulas(&self, t: f64) -> Result<(), ExpressionError> {
        Compressible::check_formulas(self, t)
    }

    fn changed(
        &self,
        parameters: &Parameters,
        conditions: &[Conditions],
        sources: &Sources,
    ) -> Result<Box<dyn Sheet>, MomentumError> {
        Ok(Box::new(Compressible::changed(self, parameters, conditions, sources)?))
    }

    fn structure(&self) -> Result<&Structure, SolveError> {
        Compressible::structure(self)
    }

    fn know_structure(&self, structure: Structure) {
        Compressible::know_structure(self, structure);
    }

    fn molecular_field(&self, state: &State, t: f64) -> Field {
        let well = self.molecular_functional(&state[DENSITY], &state[POLARITY], t);
        scaled(Field::new(&self.polarity.space, self.polarity.mass_solve(&well)), self.parameters.elasticity)
    }

    fn polarity_laplacian(&self, state: &State, t: f64) -> Field {
        scaled(self.diffused(&state[DENSITY], &state[POLARITY], t), self.parameters.coherence.powi(2))
    }

    fn reactions(&self, state: &State, t: f64) -> Result<Reactions, MomentumError> {
        Ok(Reactions::of_compressible(self, state, t))
    }

    fn pressure(&self, state: &State) -> Result<Field, SolveError> {
        Ok(Compressible::pressure(self, state))
    }
}

impl Compressible {
    /// `(w_ρ u + h_ρ|z)` as a functional, and `w_p p + h_p`.
    fn rates(&self, equations: &Equations, u: &Field, p: &Field) -> (Vec<f64>, Field) {
        let (mut rho, mut r) = self.split(&equations.history);
        axpy(equations.weights.density, &u.values, &mut rho.values);
        axpy(equations.weights.polarity, &p.values, &mut r.values);
        (self.density.mass_times(&rho.values), r)
    }

    /// The density that a flow leads to, before the limiter, to rounding.
    fn transported(&self, equations: &Equations, v: &Field, u: &mut Field) -> Result<usize, SolveError> {
        let transport = self.transport_by_density(u, v, equations.inputs.t);
        let (history, _) = self.split(&equations.history);
        let mut right: Vec<f64> = self.density.mass_times(&history.values).iter().map(|h| -h).collect();
        // what enters does not depend on the density
        let none = Field::zero(&self.density.space);
        axpy(-1.0, &self.transport(&none, v, &equations.inputs), &mut right);
        self.density.solve(equations.weights.density, &transport, &right, u)
    }
}

impl Tangent for compressible::Tangent<'_> {
    fn times(&self, y: &[f64], out: &mut [f64]) -> Result<(), MomentumError> {
        compressible::Tangent::times(self, y, out)
    }

    fn elements(&self) -> Box<dyn Elements + '_> {
        Box::new(self)
    }

    fn factors_are_exact(&self) -> bool {
        compressible::Tangent::factors_are_exact(self)
    }
}

/// `L_h` and the velocity from the last density and polarity; the density by that velocity, limited; then the polarity,
/// with `|p|²` and the `−ρp` term from the last iterate   [8.36], [8.37], [8.38]
struct InTurn<'e> {
    model: &'e Compressible,
    equations: &'e Equations<'e>,
    factors: Option<Incomplete>,
}

impl Passes for InTurn<'_> {
    fn image(&mut self, state: &State, phases: &mut Phases) -> Result<(State, usize), StepFailure> {
        let (model, equations) = (self.model, self.equations);
        let inputs = &equations.inputs;
        let last = &state[POLARITY];
        let force = phases.measure("force", || {
            let well = model.molecular_functional(&state[DENSITY], last, inputs.t);
            model.force(&state[DENSITY], last, model.molecular(&well).as_ref(), inputs)
        });
        let viscous = phases.measure("momentum factors", || compressible::Viscous::new(model, &state[DENSITY]))?;
        let v = phases.measure("momentum", || viscous.solve(model, &force, &inputs.prescribed))?;
        let v = Field::new(&model.velocity, v);
        let mut u = state[DENSITY].clone();
        let steps = phases.measure("density solve", || model.transported(equations, &v, &mut u))?;
        let rho = model.density.limiter.limit_on_the_way(&u)?.rho;
        let (_, history) = model.split(&equations.history);
        let weighted = (equations.weights.polarity, &history);
        let (operator, right) = phases.measure("polarity assembly", || model.relaxed(&rho, &v, weighted, last, inputs));
        // factors of the first iterate serve the whole step: later ones differ little
        if self.factors.is_none() {
            self.factors = Some(phases.measure("polarity factors", || model.polarity.precondition(&operator))?);
        }
        let factors = self.factors.as_ref().expect("just made");
        let mut p = last.values.clone();
        let iterations = phases
            .measure("polarity solve", || model.polarity.solve(&operator, factors, &right, &mut p, LINEAR_REDUCTION))?;
        Ok((State::compressible(v, rho, Field::new(&model.polarity.space, p)), steps + iterations))
    }
}
