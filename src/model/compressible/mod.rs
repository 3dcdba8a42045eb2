//! The compressible sheet: a density that the flow carries and squeezes, and a velocity that follows from density and
//! polarity.
//!
//! ```text
//! −div(ρσᵀ) + C_F v = T_a p + f_v,   ∂_t ρ + div(ρ v) = f_ρ
//! Pe ρ p□ + [ρ|p|² − (ρ − ρ_min)] p − κ² div(ρ∇p) = f_p
//! ```
//! The semi-discrete system is [7.34]; density and polarity are what is carried, and in this order.

mod density;
mod energy;
mod polarity;
mod tangent;
mod viscous;

use std::sync::Arc;

pub use density::Density;
pub use tangent::{Evaluated, Tangent};
pub use viscous::Viscous;

use super::closed::ClosedParts;
use super::description::Description;
use super::fields::{Residuals, State};
use super::formulas::{check_formulas, check_inflow};
use super::frames::Frames;
use super::incompressible::Inputs;
use super::lagged::{Found, Layout, Structure};
use super::limiter::NegativeMean;
use super::momentum::{MomentumError, SlipTreatment, check_held, outer_force, tagged};
use super::parameters::DensityLaw;
use super::polarity::{FORMULA_DEGREE, Polarity};
use super::scales::{Scales, relative};
use super::terms::{At, Given, MASS, MOMENTUM, Sum};
use super::walls::Walls;
use super::{Conditions, Parameters, Sources};
use crate::expression::ExpressionError;
use crate::form::upwind::Carrier;
use crate::form::{CellPoint, Integrator, mass};
use crate::mesh::Mesh;
use crate::model::fields::{DENSITY, POLARITY, VELOCITY};
use crate::solve::rows::Rows;
use crate::solve::sparse::{Factored, Matrix};
use crate::solve::{SolveError, axpy, dot, root};
use crate::space::{Continuity, Field, Space};

/// Added to the density where it weighs the polarity's rate, so that the polarity has an equation where there is no
/// tissue: it stays.
pub const VACUUM: f64 = 1e-12;

/// The semi-discrete compressible system   [7.34]
#[derive(Debug)]
pub struct Compressible {
    /// The numbers of the model.
    pub parameters: Parameters,
    /// One for each tag.
    pub conditions: Vec<Conditions>,
    /// What enters from outside.
    pub sources: Sources,
    /// Over the mesh.
    pub loops: Integrator,
    /// Continuous, with two components.
    pub velocity: Arc<Space>,
    /// Where `v·n` is an unknown of its own.
    pub frames: Frames,
    /// How `v·n = 0` is imposed.
    pub slip: SlipTreatment,
    /// What walls add to the viscous form.
    pub walls: Walls,
    /// `(v|w)`
    pub velocity_mass: Matrix,
    /// Of the free velocities, for the stationary residuals.
    residual_mass: Factored,
    /// The equation of the density.
    pub density: Density,
    /// The equation of the polarity.
    pub polarity: Polarity,
    /// `|Ω|`
    pub area: f64,
    sealed: ClosedParts,
    flow_structure: Structure,
    structure: Found,
}

/// Why there is no flow for a density and a polarity.
#[derive(Debug, Clone, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum FlowError {
    #[error(transparent)]
    Density(#[from] NegativeMean),
    #[error(transparent)]
    Momentum(#[from] MomentumError),
}

impl State {
    /// Of a compressible sheet.
    pub fn compressible(v: Field, rho: Field, p: Field) -> Self {
        Self::of([(VELOCITY, v), (DENSITY, rho), (POLARITY, p)])
    }
}

impl Compressible {
    /// Builds spaces and assembles what is constant.
    ///
    /// # Errors
    /// A rigid motion that nothing holds; a degenerate cell.
    ///
    /// # Panics
    /// Where the description has no density.
    pub fn new(mesh: &Arc<Mesh>, description: &Description) -> Result<Self, MomentumError> {
        let Description { parameters, degrees, conditions, sources, slip } = description;
        let velocity = Arc::new(Space::new(mesh, Continuity::Continuous, degrees.velocity, 2));
        let density = Arc::new(Space::new(mesh, Continuity::Discontinuous, degrees.density, 1));
        let polarity = Arc::new(Space::new(mesh, Continuity::Discontinuous, degrees.polarity, 2));
        let spaces = [&velocity, &density, &polarity];
        Self::assemble(Integrator::new(mesh), spaces, parameters, conditions, sources, *slip)
    }

    /// The same sheet with other parameters, conditions and sources.
    ///
    /// # Errors
    /// As [`Compressible::new`].
    pub fn changed(
        &self,
        parameters: &Parameters,
        conditions: &[Conditions],
        sources: &Sources,
    ) -> Result<Self, MomentumError> {
        let spaces = [&self.velocity, &self.density.space, &self.polarity.space];
        let other = Self::assemble(self.loops.clone(), spaces, parameters, conditions, sources, self.slip)?;
        if let (Some(known), true) = (self.structure.known(), conditions == self.conditions) {
            other.know_structure(known.clone());
        }
        Ok(other)
    }

    fn assemble(
        loops: Integrator,
        [velocity, density, polarity]: [&Arc<Space>; 3],
        parameters: &Parameters,
        conditions: &[Conditions],
        sources: &Sources,
        slip: SlipTreatment,
    ) -> Result<Self, MomentumError> {
        assert!(parameters.density.is_some(), "a compressible sheet has a density");
        let frames = Frames::new(velocity, conditions, slip.points());
        if parameters.friction == 0.0 {
            check_held(velocity, conditions)?;
        }
        let polarity = Polarity::new(&loops, polarity, conditions, parameters, sources.boundary().cloned())?;
        let walls = Walls::new(&loops, conditions, slip)?;
        let open = tagged(conditions, |c| !c.is_impermeable());
        let density = Density::new(&loops, density, open, polarity.sweep())?;
        let count = velocity.dof_count();
        let products = loops.triplets(&mass::vector_mass(velocity), velocity, velocity);
        let velocity_mass = Matrix::from_triplets(count, count, &products);
        let reduced = Matrix::from_triplets(frames.free, frames.free, &frames.reduce(&velocity_mass));
        let sealed = match sources.has_density() {
            true => ClosedParts::default(),
            false => ClosedParts::without(&density.space, |face| density.open.holds(face)),
        };
        let flow_structure = Structure::new("momentum", &flow_layout(velocity, &frames, &polarity))?;
        Ok(Self {
            parameters: *parameters,
            conditions: conditions.to_vec(),
            sources: sources.clone(),
            area: loops.mesh.area(),
            loops,
            velocity: velocity.clone(),
            frames,
            slip,
            walls,
            velocity_mass,
            residual_mass: Factored::new("velocity mass", reduced)?,
            density,
            polarity,
            sealed,
            flow_structure,
            structure: Found::default(),
        })
    }

    pub(super) fn flow_layout(&self) -> Layout<'_> {
        flow_layout(&self.velocity, &self.frames, &self.polarity)
    }

    pub(super) fn flow_structure(&self) -> &Structure {
        &self.flow_structure
    }

    /// How the unknowns of the coupled matrix hang together.
    pub fn layout(&self) -> Layout<'_> {
        Layout { carried: [Some(&self.density.space), Some(&self.polarity.space)], ..self.flow_layout() }
    }

    /// The structure of the coupled matrix, found once.
    ///
    /// # Errors
    /// As [`Structure::new`].
    pub fn structure(&self) -> Result<&Structure, SolveError> {
        self.structure.of(&self.layout())
    }

    /// Keeps a structure that was found from the same layout; a later one changes nothing.
    pub fn know_structure(&self, structure: Structure) {
        self.structure.know(structure);
    }

    /// Parts of the mesh whose mass is conserved: none can leave or enter, and none is made.
    pub fn sealed(&self) -> &ClosedParts {
        &self.sealed
    }

    /// Density and polarity of a carried vector.
    pub fn split(&self, y: &[f64]) -> (Field, Field) {
        let (rho, p) = y.split_at(self.density.space.dof_count());
        (Field::new(&self.density.space, rho.to_vec()), Field::new(&self.polarity.space, p.to_vec()))
    }

    /// The carried vector of density and polarity.
    pub fn stacked(&self, rho: &[f64], p: &[f64]) -> Vec<f64> {
        [rho, p].concat()
    }

    /// What the boundary gives at time `t`.
    pub fn given(&self, t: f64) -> Given<'_> {
        self.polarity.given(t).with_open(self.density.open)
    }

    /// Density, polarity and a flow.
    pub fn at<'a>(&'a self, rho: &'a Field, p: &'a Field, flow: &'a Field, given: &'a Given<'a>) -> At<'a> {
        At::new(&self.parameters, p, given).with_flow(&self.velocity, Carrier::from(flow)).with_density(rho)
    }

    /// All that is given at time `t`: computed once, used by every iteration of a step.
    ///
    /// # Errors
    /// A Dirichlet formula that is not finite at a node; a density of inflow that is negative.
    pub fn inputs(&self, t: f64) -> Result<Inputs, ExpressionError> {
        check_inflow(&self.loops, &self.conditions, t)?;
        let sources = self.sources.at_time(t);
        let form = outer_force(&self.velocity, &self.parameters, &self.conditions, &sources, t);
        let force = self.loops.vector(&form, &self.velocity);
        let prescribed = self.frames.prescribed(&self.conditions, t)?;
        let of_density = |x: &CellPoint| sources.density(&self.parameters, x.site.x, t);
        let density = if sources.has_density() {
            self.loops.vector(&mass::scalar_load(&self.density.space, FORMULA_DEGREE, of_density), &self.density.space)
        } else {
            vec![0.0; self.density.space.dof_count()]
        };
        let of_polarity = |x: &CellPoint| sources.polarity(&self.parameters, x.site.x, t);
        let source = if sources.has_polarity() {
            self.loops.vector(&mass::load(&self.polarity.space, FORMULA_DEGREE, of_polarity), &self.polarity.space)
        } else {
            vec![0.0; self.polarity.space.dof_count()]
        };
        Ok(Inputs { t, force, source, density, prescribed })
    }

    /// `c_0`, `γ`, `ρ_min`, `S_a'`
    pub fn law(&self) -> DensityLaw {
        self.parameters.density.expect("a compressible sheet has a density")
    }

    /// The terms of the momentum balance that are not linear in the flow [7.34], and what is given from outside; `l` is
    /// `L_h/B`.
    pub fn force(&self, rho: &Field, p: &Field, l: Option<&Field>, inputs: &Inputs) -> Vec<f64> {
        let (given, rest) = (self.given(inputs.t), Field::zero(&self.velocity));
        let form = -Sum::of(&[MOMENTUM]).value(&self.at(rho, p, &rest, &given).with_field(l));
        let mut force = self.loops.vector(&form, &self.velocity);
        axpy(1.0, &inputs.force, &mut force);
        force
    }

    /// `L_h/B` of `(1/B)(L_h|q)`, where the model has elasticity.
    pub fn molecular(&self, well: &[f64]) -> Option<Field> {
        (self.parameters.elasticity != 0.0).then(|| Field::new(&self.polarity.space, self.polarity.mass_solve(well)))
    }

    /// The velocity of density and polarity, with the factors that gave it.
    ///
    /// # Errors
    /// As [`Viscous::new`] and [`Viscous::solve`].
    pub fn flow(
        &self,
        rho: &Field,
        p: &Field,
        l: Option<&Field>,
        inputs: &Inputs,
    ) -> Result<(Field, Viscous), MomentumError> {
        let force = self.force(rho, p, l, inputs);
        let viscous = Viscous::new(self, rho)?;
        let v = viscous.solve(self, &force, &inputs.prescribed)?;
        Ok((Field::new(&self.velocity, v), viscous))
    }

    /// The state of a carried vector at time `t`; its density is limited.
    ///
    /// # Errors
    /// A density whose mean is negative in a cell; a velocity that cannot be solved for.
    pub fn state_of(&self, y: &[f64], t: f64) -> Result<State, FlowError> {
        let (u, p) = self.split(y);
        let rho = self.density.limiter.limit(&u)?.rho;
        let inputs = self.inputs(t).map_err(MomentumError::from)?;
        let well = self.molecular_functional(&rho, &p, t);
        let (v, _) = self.flow(&rho, &p, self.molecular(&well).as_ref(), &inputs)?;
        Ok(State::compressible(v, rho, p))
    }

    /// `a_mass(ρ,z;v) − l_mass(z;v) − (f_ρ|z)`, a functional of z   [7.32]
    pub fn transport(&self, u: &Field, v: &Field, inputs: &Inputs) -> Vec<f64> {
        let (given, p) = (self.given(inputs.t), Field::zero(&self.polarity.space));
        let form = Sum::of(&[MASS]).value(&self.at(u, &p, v, &given));
        let mut out = self.loops.vector(&form, &self.density.space);
        axpy(-1.0, &inputs.density, &mut out);
        out
    }

    /// The derivative of [`Compressible::transport`] along the density.
    pub fn transport_by_density(&self, u: &Field, v: &Field, t: f64) -> Rows {
        let (space, n) = (&*self.density.space, self.density.space.n);
        let (given, p) = (self.given(t), Field::zero(&self.polarity.space));
        let form = Sum::of(&[MASS]).by_density(&self.at(u, &p, v, &given));
        let mut rows = Rows::zero(self.polarity.neighbours(), (n, n), true);
        self.loops.add_rows(&form, (space, space), &mut rows.own, &mut rows.off);
        rows
    }

    /// Net mass that enters per time: through the boundary and from sources.
    pub fn gain(&self, state: &State, inputs: &Inputs) -> f64 {
        -self.transport(&state[DENSITY], &state[VELOCITY], inputs).iter().sum::<f64>()
    }

    /// Residuals of the stationary equations   [9.8], [9.9], [9.10]
    ///
    /// # Errors
    /// Formulas that are not finite; as [`Factored::solve`].
    pub fn residuals(&self, state: &State, t: f64) -> Result<Residuals, MomentumError> {
        let scale = self.area.sqrt();
        let (rho, p) = (&state[DENSITY], &state[POLARITY]);
        let inputs = self.inputs(t)?;
        let well = self.molecular_functional(rho, p, t);
        let mut momentum = Viscous::new(self, rho)?.times(self, &state[VELOCITY].values);
        axpy(-1.0, &self.force(rho, p, self.molecular(&well).as_ref(), &inputs), &mut momentum);
        let momentum = self.frames.restrict(&momentum);
        let velocity = match crate::solve::norm(&momentum) {
            0.0 => 0.0,
            _ => root(dot(&momentum, &self.residual_mass.solve(&momentum)?)),
        };
        let transport = self.transport(rho, &state[VELOCITY], &inputs);
        let volume = root(dot(&transport, &self.density.mass_solve(&transport)));
        let r = self.polarity_residual(rho, p, &state[VELOCITY], &well, &inputs);
        let polarity = root(dot(&r, &self.polarity.mass_solve(&r)));
        let speed = root(self.velocity_mass.quadratic(&state[VELOCITY].values)) / scale;
        let mass = root(dot(&rho.values, &self.density.mass_times(&rho.values))) / scale;
        let velocity = relative(velocity / scale, self.scales(speed, mass).force);
        Ok(Residuals::of([(VELOCITY, velocity), (DENSITY, volume / scale), (POLARITY, polarity / scale)]))
    }

    /// The scales of states with the root mean square velocity `v` and density `rho`.
    pub fn scales(&self, v: f64, rho: f64) -> Scales {
        let law = self.parameters.density.expect("a compressible sheet has a density");
        Scales::new(&self.parameters, self.area, v, law.penalty * rho.powf(law.exponent + 1.0))
    }

    /// Evaluates every formula at time `t` where it is used.
    ///
    /// # Errors
    /// One that is not finite.
    pub fn check_formulas(&self, t: f64) -> Result<(), ExpressionError> {
        let degree = self.velocity.degree.max(self.polarity.space.degree);
        check_formulas(&self.loops, degree, &self.conditions, &self.sources, &self.parameters, t)
    }
}

fn flow_layout<'m>(velocity: &'m Space, frames: &'m Frames, polarity: &'m Polarity) -> Layout<'m> {
    Layout {
        velocity,
        pressure: None,
        carried: [None, None],
        traces: None,
        frames,
        closed: ClosedParts::NONE,
        neighbours: polarity.neighbours(),
    }
}
