//! What time stepping, Newton's method and the search for steady states need of a model.
//!
//! A *carried* vector `y` holds the coefficients of what has a time derivative: the polarity of an incompressible
//! sheet, density and polarity, one after the other, of a compressible one. The flow follows from it without delay.

use std::cell::RefCell;
use std::fmt::Debug;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::Phases;
use super::coupling::StepFailure;
use super::equations::{Equations, Trial};
use crate::expression::ExpressionError;
use crate::form::Integrator;
use crate::model::compressible::Compressible;
use crate::model::fields::Role;
use crate::model::incompressible::{Incompressible, Inputs};
use crate::model::lagged::{Elements, Lagged, Layout, Structure};
use crate::model::momentum::MomentumError;
use crate::model::polarity::Polarity;
use crate::model::{Conditions, FieldId, Parameters, Reactions, Residuals, Sources, State};
use crate::solve::krylov::{Outcome, gmres};
use crate::solve::sparse::Matrix;
use crate::solve::{SolveError, norm};
use crate::space::{Field, Space};

/// Weights of the newest level in the time derivatives; zero for the stationary equations.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Weights {
    /// Of the density: `1/(Δt β̃₀)`.
    pub density: f64,
    /// Of the polarity: `α₀/Δt`.
    pub polarity: f64,
}

impl Weights {
    /// The same for both.
    pub fn both(w: f64) -> Self {
        Self { density: w, polarity: w }
    }
}

/// What a step is accepted with.
#[derive(Debug, Clone)]
pub struct Settled {
    /// Its fields.
    pub state: State,
    /// Cells whose density was limited.
    pub limited: usize,
    /// Net mass that enters per time.
    pub gain: f64,
}

/// A model, by its kind.
#[derive(Debug, Clone, Copy)]
pub enum SheetKind<'m> {
    /// Of density 1.
    Incompressible(&'m Incompressible),
    /// With a density of its own.
    Compressible(&'m Compressible),
}

/// A model of its own, by its kind.
#[derive(Debug)]
pub enum OwnedSheet {
    /// Of constant density.
    Incompressible(Box<Incompressible>),
    /// Whose density is a field.
    Compressible(Box<Compressible>),
}

/// GMRES gives up after this many products.
pub(super) const KRYLOV_LIMIT: usize = 60;

/// What GMRES has found.
#[derive(Debug)]
pub struct Solved {
    /// The solution.
    pub delta: Vec<f64>,
    /// Products that it took.
    pub products: usize,
    /// Size of the residual over that of the right side.
    pub residual: f64,
    /// Whether the residual was reached, and the solution is finite.
    pub converged: bool,
}

impl Solved {
    /// As GMRES ended with a right side of this size.
    pub fn new(delta: Vec<f64>, outcome: &Outcome, size: f64) -> Self {
        let converged = outcome.converged && delta.iter().all(|d| d.is_finite());
        Self { delta, products: outcome.iterations, residual: outcome.residual / size, converged }
    }
}

/// The exact derivative of the equations of one step with the flow eliminated, `R′`.
pub trait Tangent: Sync {
    /// `out = R′ y`
    ///
    /// # Errors
    /// A flow that cannot be solved for.
    fn times(&self, y: &[f64], out: &mut [f64]) -> Result<(), MomentumError>;

    /// `δ` with `‖R′ δ − r‖ ≤ reduction ‖r‖` for the right side r, by GMRES with factors of a derivative close by.
    ///
    /// # Errors
    /// A flow that cannot be solved for; a cell of its own whose derivative is singular.
    fn solve(&self, lagged: &Lagged, right: &[f64], reduction: f64) -> Result<Solved, MomentumError> {
        let failure: RefCell<Option<MomentumError>> = RefCell::new(None);
        let apply = |x: &[f64], y: &mut [f64]| {
            if let Err(error) = self.times(x, y) {
                failure.borrow_mut().get_or_insert(error);
                y.fill(f64::NAN);
            }
        };
        let mut delta = vec![0.0; right.len()];
        let size = norm(right);
        let precondition = |x: &mut [f64]| lagged.solve(x);
        let outcome = gmres(&apply, &precondition, right, &mut delta, reduction * size, KRYLOV_LIMIT);
        failure.into_inner().map_or(Ok(Solved::new(delta, &outcome, size)), Err)
    }

    /// The elements of the whole coupled matrix, flow included.
    fn elements(&self) -> Box<dyn Elements + '_>;

    /// Whether the factors of those elements invert `R′` exactly.
    fn factors_are_exact(&self) -> bool;
}

/// The solution of a step's equations in turn, one after the other.
pub trait Passes {
    /// The image of a state, and the iterations of its linear solves.
    ///
    /// # Errors
    /// A linear solve that failed.
    fn image(&mut self, state: &State, phases: &mut Phases) -> Result<(State, usize), StepFailure>;
}

/// A model of a thin sheet.
pub trait Sheet: Debug + Sync {
    /// Which one it is.
    fn kind(&self) -> SheetKind<'_>;
    /// The model itself, by its kind.
    fn owned(self: Box<Self>) -> OwnedSheet;
    /// The numbers of the model.
    fn parameters(&self) -> &Parameters;
    /// One per mesh tag.
    fn conditions(&self) -> &[Conditions];
    /// What enters the equations from outside.
    fn sources(&self) -> &Sources;
    /// The loops over the mesh.
    fn loops(&self) -> &Integrator;
    /// `|Ω|`
    fn area(&self) -> f64;
    /// Its fields and their spaces, the carried ones in the order of a carried vector.
    fn fields(&self) -> Vec<(FieldId, &Arc<Space>)>;
    /// The space of a field.
    ///
    /// # Panics
    /// Where the model does not have the field.
    fn space(&self, id: FieldId) -> &Arc<Space> {
        let found = self.fields().into_iter().find(|(known, _)| *known == id);
        found.unwrap_or_else(|| panic!("the model has no {id}")).1
    }
    /// What never changes in the polarity equation.
    fn polarity(&self) -> &Polarity;
    /// Mass matrix of the velocity.
    fn velocity_mass(&self) -> &Matrix;
    /// Unknowns of the linear system of the flow.
    fn flow_unknowns(&self) -> usize;
    /// How the unknowns of the coupled matrix hang together.
    fn layout(&self) -> Layout<'_>;

    /// Length of a carried vector.
    fn carried_len(&self) -> usize {
        let carried = self.fields().into_iter().filter(|(id, _)| id.role == Role::Carried);
        carried.map(|(_, space)| space.dof_count()).sum()
    }
    /// The state of a carried vector and the coefficients of all other fields.
    ///
    /// # Panics
    /// Coefficients that do not fit the spaces.
    fn joined(&self, carried: &[f64], other: &dyn Fn(FieldId) -> Vec<f64>) -> State {
        let mut rest = carried;
        State::of(self.fields().into_iter().map(|(id, space)| {
            let values = match id.role {
                Role::Carried => rest.split_off(..space.dof_count()).expect("as many as there are").to_vec(),
                Role::Flow | Role::Auxiliary => other(id),
            };
            (id, Field::new(space, values))
        }))
    }
    /// `M y` with the mass matrix of the carried fields.
    fn mass_times(&self, y: &[f64]) -> Vec<f64>;
    /// `M⁻¹ f`
    fn mass_solve(&self, f: &[f64]) -> Vec<f64>;
    /// What multiplies `∂_t y` at a state: `Pe M`, or `(M, Pe M(ρ))`.
    fn inertia_times(&self, state: &State, y: &[f64]) -> Vec<f64>;
    /// Takes from a direction what the equations conserve; no steady state can be left along it.
    fn without_conserved(&self, y: &mut [f64]);
    /// Whether something is conserved, so that the stationary equations alone do not determine the state.
    fn conserves(&self) -> bool;

    /// The flow that follows from a carried vector at time `t`.
    ///
    /// # Errors
    /// A flow that cannot be solved for; a density that is negative.
    fn state_of(&self, y: &[f64], t: f64) -> Result<State, StepFailure>;
    /// `state` with another carried vector and the same flow; `None` where its density cannot be.
    fn with_carried(&self, state: &State, y: &[f64]) -> Option<State>;
    /// All that is given from outside at time `t`.
    ///
    /// # Errors
    /// A formula that is not finite.
    fn inputs(&self, t: f64) -> Result<Inputs, ExpressionError>;
    /// The flow of `y` and the residual of its equations. The values of a polarity in hybrid form on the faces depend on
    /// the flow, so both are found in turn: from the flow before the step until they agree to rounding, or, within an
    /// iteration that brings them together, from the flow `near` by.
    ///
    /// # Errors
    /// A residual that is not finite; a flow that cannot be solved for; a density that is negative.
    fn evaluate(
        &self,
        equations: &Equations,
        y: Vec<f64>,
        near: Option<&Field>,
        phases: &mut Phases,
    ) -> Result<Trial, StepFailure>;
    /// The derivative at a trial, with other weights than those of the equations.
    fn tangent<'t>(&'t self, equations: &'t Equations, at: &'t Trial, weights: Weights) -> Box<dyn Tangent + 't>;
    /// The solution in turn.
    ///
    /// # Errors
    /// What cannot be assembled.
    fn passes<'e>(&'e self, equations: &'e Equations) -> Result<Box<dyn Passes + 'e>, StepFailure>;
    /// What a converged step is accepted with.
    ///
    /// # Errors
    /// A density that is negative or cannot be solved for.
    fn settle(&self, equations: &Equations, state: State, phases: &mut Phases) -> Result<Settled, StepFailure>;
    /// `∂_t` of the density that follows from the flow; empty without density.
    ///
    /// # Errors
    /// A formula that is not finite.
    fn density_rate(&self, state: &State, t: f64) -> Result<Vec<f64>, ExpressionError>;
    /// A bound on `|λ|` of what the density's equation brings, per time.
    fn stiffness(&self, state: &State) -> f64;
    /// The mass `∫ρ` of a carried vector; zero without density.
    fn mass(&self, y: &[f64]) -> f64;
    /// Net mass that enters per time; zero without density.
    fn gain(&self, state: &State, inputs: &Inputs) -> f64;
    /// `(‖δv‖²/V² + ‖δΠ‖²/P² + ‖δp‖²)^½/|Ω|^½` with the `Scales` V, P of both states;
    /// for `Π/P` in a compressible sheet ρ by its root mean square   [9.1]
    fn increment(&self, from: &State, to: &State) -> f64;
    /// Residuals of the stationary equations   [9.8], [9.9], [9.10]
    ///
    /// # Errors
    /// A formula that is not finite; a mass matrix that cannot be solved with.
    fn residuals(&self, state: &State, t: f64) -> Result<Residuals, MomentumError>;
    /// The free energy `F_h`   [7.2]
    fn free_energy(&self, state: &State, t: f64) -> f64;
    /// `dF_h/dt` for the given rate of the polarity.
    fn energy_rate(&self, state: &State, rate_of_p: &[f64], t: f64) -> f64;
    /// Evaluates every formula at time `t` where it is used.
    ///
    /// # Errors
    /// One that is not finite.
    fn check_formulas(&self, t: f64) -> Result<(), ExpressionError>;
    /// The same sheet with other parameters, conditions and sources.
    ///
    /// # Errors
    /// Conditions that leave a motion free or let in a mass that nothing lets out, a matrix that is singular, a formula
    /// that is not finite.
    fn changed(
        &self,
        parameters: &Parameters,
        conditions: &[Conditions],
        sources: &Sources,
    ) -> Result<Box<dyn Sheet>, MomentumError>;
    /// The structure of the coupled matrix, found once.
    ///
    /// # Errors
    /// A structure that contradicts itself.
    fn structure(&self) -> Result<&Structure, SolveError>;
    /// Keeps a structure that was found from the same layout.
    fn know_structure(&self, structure: Structure);
    /// `L_h` at a state.
    fn molecular_field(&self, state: &State, t: f64) -> Field;
    /// `κ²Δ_h p` at a state, `κ² div_h(ρ∇p)` of a compressible sheet: what diffusion adds to `−L_h/B`.
    fn polarity_laplacian(&self, state: &State, t: f64) -> Field;
    /// The forces on the boundary at a state.
    ///
    /// # Errors
    /// Forces on bodies that cannot be solved for.
    fn reactions(&self, state: &State, t: f64) -> Result<Reactions, MomentumError>;
    /// The pressure Π at a state, ρΠ of a compressible sheet, for output.
    ///
    /// # Errors
    /// A projection that cannot be solved for.
    fn pressure(&self, state: &State) -> Result<Field, SolveError>;
}
