//! The incompressible tissue: velocity and pressure that follow the polarity, and a polarity that the flow carries.

mod bodies;
mod force;
mod hybrid;
mod law;

use std::sync::{Arc, OnceLock};

pub use self::force::Force;
use self::force::check_tractions;
pub use self::hybrid::{PASSES, Settling};
use super::boundary::{Conditions, Held};
use super::condensed::Frame;
pub use super::description::{Degrees, Description};
pub use super::fields::{Residuals, State};
use super::floating::Floating;
use super::formulas::check_formulas;
use super::lagged::{Found, Layout, Structure};
use super::momentum::{Momentum, MomentumError, outer_force};
use super::parameters::{ElasticForce, Parameters};
use super::polarity::{FORMULA_DEGREE, Polarity, data_of};
use super::scales::{Scales, relative};
use super::sources::Sources;
use super::terms::{self, At, FlowTerms, Given, MOMENTUM, Sum};
use crate::expression::ExpressionError;
use crate::form::power;
use crate::form::upwind::Carrier;
use crate::form::{CellPoint, Density, FacePoint, Faces, Integrator, elastic, mass};
use crate::mesh::Mesh;
use crate::model::fields::{POLARITY, PRESSURE, VELOCITY};
use crate::shape::Wrench;
use crate::solve::{SolveError, axpy, dot};
use crate::space::{Continuity, Field, Space, Traces};

/// All that is given from outside at one time.
#[derive(Debug, Clone)]
pub struct Inputs {
    /// The time.
    pub t: f64,
    /// `(f_v|w) + ∫_Γ g·w`
    pub force: Vec<f64>,
    /// `(f_p|q)`
    pub source: Vec<f64>,
    /// `(f_ρ|z)`; empty in an incompressible sheet.
    pub density: Vec<f64>,
    /// `v_D` at the nodes.
    pub prescribed: Vec<f64>,
}

/// The semi-discrete incompressible system   [7.11]
#[derive(Debug)]
pub struct Incompressible {
    /// The numbers of the model.
    pub parameters: Parameters,
    /// One for each tag.
    pub conditions: Vec<Conditions>,
    /// What enters from outside.
    pub sources: Sources,
    /// Over the whole mesh.
    pub loops: Integrator,
    /// What covers a part of it.
    pub bodies: Option<Arc<Floating>>,
    /// Forces and torques of contact on them; empty where nothing is pushed.
    pushes: Vec<Wrench>,
    /// The Stokes system, factorised.
    pub momentum: Arc<Momentum>,
    /// The equation of the polarity.
    pub polarity: Polarity,
    /// `|Ω|`
    pub area: f64,
    /// Where the energy-consistent force needs its boundary terms: faces where `w·n` is free, and those of them or of
    /// slip where the polarity is prescribed.
    pub natural_faces: [Faces; 2],
    /// That of the coupled matrix, once somebody has asked for it.
    structure: Found,
    /// What elements in hybrid form have in all states, once somebody has asked for it.
    frame: OnceLock<Arc<Frame>>,
}

impl State {
    /// Of an incompressible sheet.
    pub fn incompressible(v: Field, pi: Field, p: Field) -> Self {
        Self::of([(VELOCITY, v), (PRESSURE, pi), (POLARITY, p)])
    }
}

impl Incompressible {
    /// Builds spaces, assembles what is constant and factorises the Stokes matrix.
    ///
    /// # Errors
    /// As [`Momentum::new`] and [`Polarity::new`]; boundary formulas that are not finite at the start.
    pub fn new(mesh: &Arc<Mesh>, description: &Description) -> Result<Self, MomentumError> {
        let Description { parameters, degrees, conditions, sources, slip } = description;
        let velocity = Arc::new(Space::new(mesh, Continuity::Continuous, degrees.velocity, 2));
        let pressure = Arc::new(Space::new(mesh, Continuity::Continuous, degrees.pressure, 1));
        let space = Arc::new(Space::new(mesh, Continuity::Discontinuous, degrees.polarity, 2));
        let loops = Integrator::new(mesh);
        let momentum = Momentum::new(&loops, &velocity, &pressure, conditions, &FlowTerms::of(parameters), *slip)?;
        Self::assemble(loops, None, Arc::new(momentum), &space, (parameters, conditions, sources))
    }

    /// The same tissue with other parameters, and conditions and sources that may depend on them: keeps the mesh, the
    /// spaces and, where the flow's matrix and conditions stay, the Stokes factors.
    ///
    /// # Errors
    /// As [`Incompressible::new`].
    pub fn changed(
        &self,
        parameters: &Parameters,
        conditions: &[Conditions],
        sources: &Sources,
    ) -> Result<Self, MomentumError> {
        let old = &self.momentum;
        let terms = FlowTerms::of(parameters);
        let same = terms == FlowTerms::of(&self.parameters) && conditions == self.conditions;
        let momentum = if same {
            old.clone()
        } else {
            let spaces = (&old.velocity, &old.pressure);
            Arc::new(match self.embedding() {
                None => Momentum::new(&self.loops, spaces.0, spaces.1, conditions, &terms, old.slip)?,
                Some(bodies) => Momentum::with_bodies(&self.loops, spaces, conditions, &terms, old.slip, bodies)?,
            })
        };
        Self::assemble(
            self.loops.clone(),
            self.bodies.clone(),
            momentum,
            &self.polarity.space,
            (parameters, conditions, sources),
        )
    }

    fn assemble(
        loops: Integrator,
        bodies: Option<Arc<Floating>>,
        momentum: Arc<Momentum>,
        space: &Arc<Space>,
        (parameters, conditions, sources): (&Parameters, &[Conditions], &Sources),
    ) -> Result<Self, MomentumError> {
        let slopes = sources.boundary().cloned();
        let polarity = match &bodies {
            None => Polarity::new(&loops, space, conditions, parameters, slopes)?,
            Some(floating) => {
                check_tractions(parameters, floating.bodies())?;
                let covered = &floating.covered;
                let passive = Some(&covered.passive);
                Polarity::around(&covered.tissue, space, conditions, parameters, slopes, passive)?
            }
        };
        let both = |free: &dyn Fn(&Conditions) -> bool| {
            let of_kind = conditions.iter().enumerate().filter(|(_, c)| free(c));
            of_kind.fold(Faces::NONE, |faces, (tag, _)| faces | Faces::tag(tag))
        };
        let open = both(&|c| c.velocity.fixes_pressure());
        let moving = |c: &Conditions| c.velocity.holds() != Held::Both;
        // elsewhere the polarity has no slope, unless exact fields give it one
        let sloped = |c: &Conditions| data_of(c).is_some() || sources.boundary().is_some();
        let natural_faces = [open, both(&|c| moving(c) && sloped(c))];
        Ok(Self {
            natural_faces,
            parameters: *parameters,
            conditions: conditions.to_vec(),
            sources: sources.clone(),
            area: loops.mesh.area(),
            loops,
            bodies,
            pushes: Vec::new(),
            momentum,
            polarity,
            structure: Found::default(),
            frame: OnceLock::new(),
        })
    }

    /// Loops over the tissue: all of the mesh that no body covers.
    pub fn tissue(&self) -> &Integrator {
        self.bodies.as_ref().map_or(&self.loops, |bodies| &bodies.covered.tissue)
    }

    /// The state of rest.
    pub fn zero(&self) -> State {
        State::incompressible(
            Field::zero(&self.momentum.velocity),
            Field::zero(&self.momentum.pressure),
            Field::zero(&self.polarity.space),
        )
    }

    /// All that is given at time `t`: computed once, used by every iteration of a step.
    ///
    /// # Errors
    /// A Dirichlet formula that is not finite at a node.
    pub fn inputs(&self, t: f64) -> Result<Inputs, ExpressionError> {
        let sources = self.sources.at_time(t);
        let form = outer_force(&self.momentum.velocity, &self.parameters, &self.conditions, &sources, t);
        let force = if form.is_zero() {
            vec![0.0; self.momentum.velocity.dof_count()]
        } else {
            self.tissue().vector(&form, &self.momentum.velocity)
        };
        let prescribed = self.momentum.frames.prescribed(&self.conditions, t)?;
        Ok(Inputs { t, force, source: self.polarity_source(&sources, t), density: Vec::new(), prescribed })
    }

    /// What the boundary gives at time `t`.
    pub fn given(&self, t: f64) -> Given<'_> {
        self.polarity.given(t).with_natural(self.natural_faces)
    }

    /// `F(w)`, the terms of the momentum balance that are not linear in the flow, but for what is given from outside  
    /// [7.11a]
    ///
    /// `molecular` is `L_h/B`, and `sides` is the flow that picks the upwind sides of the energy-consistent force X.
    pub fn inner_force(&self, p: &Field, molecular: Option<&Field>, sides: &Field, t: f64) -> Force {
        let (velocity, given) = (&*self.momentum.velocity, self.given(t));
        let at = At::new(&self.parameters, p, &given).with_flow(velocity, Carrier::from(sides)).with_field(molecular);
        let mut force = self.with_tractions(&Sum::of(&[MOMENTUM]).value(&at));
        self.add_push(p, &mut force);
        force
    }

    /// All forces of the polarity `p` and from outside   [7.11a]
    pub fn force(&self, p: &Field, sides: &Field, inputs: &Inputs) -> Force {
        self.force_of(p, self.molecular(p, sides, inputs.t).as_ref(), sides, inputs)
    }

    /// As [`Incompressible::force`] with `L_h/B` at hand.
    pub fn force_of(&self, p: &Field, molecular: Option<&Field>, sides: &Field, inputs: &Inputs) -> Force {
        let mut force = self.inner_force(p, molecular, sides, inputs.t);
        axpy(1.0, &inputs.force, &mut force.flow);
        force
    }

    /// `(f_p|q)` at time `t`.
    fn polarity_source(&self, sources: &Sources, t: f64) -> Vec<f64> {
        let space = &self.polarity.space;
        if !sources.has_polarity() {
            return vec![0.0; space.dof_count()];
        }
        let value = |x: &CellPoint| sources.polarity(&self.parameters, x.site.x, t);
        self.tissue().vector(&mass::load(space, FORMULA_DEGREE, value), space)
    }

    /// Evaluates every source and boundary formula wherever the forms do.
    ///
    /// # Errors
    /// The first one that is not finite, with its place and time.
    pub fn check_formulas(&self, t: f64) -> Result<(), ExpressionError> {
        let degree = self.momentum.velocity.degree.max(self.polarity.space.degree);
        check_formulas(&self.loops, degree, &self.conditions, &self.sources, &self.parameters, t)
    }

    /// Velocity and pressure of the polarity `p` at time `t`   [8.34]
    ///
    /// # Errors
    /// As [`Momentum::solve`].
    pub fn flow(&self, p: &Field, t: f64) -> Result<(Field, Field), MomentumError> {
        let inputs = self.inputs(t)?;
        let mut flow = Field::zero(&self.momentum.velocity);
        if self.parameters.elasticity == 0.0 {
            return self.flow_of(&self.force(p, &flow, &inputs), &inputs);
        }
        // the energy-consistent force looks upstream, so the flow has to be known; a few passes settle the directions.
        // Traces depend on the flow, though little
        let passes = match (self.parameters.elastic_force, self.polarity.hybrid()) {
            (ElasticForce::Energy, _) => 4,
            (ElasticForce::Stress, Some(_)) => PASSES,
            (ElasticForce::Stress, None) => 1,
        };
        let (mut pi, mut settling) = (Field::zero(&self.momentum.pressure), Settling::new());
        for _ in 0..passes {
            let last;
            (last, (flow, pi)) = (flow.clone(), self.flow_of(&self.force(p, &flow, &inputs), &inputs)?);
            if settling.is_over(&last.values, &flow.values) {
                break;
            }
        }
        Ok((flow, pi))
    }

    /// Velocity and pressure under a given force   [8.34]
    ///
    /// # Errors
    /// As [`Momentum::solve`].
    pub fn flow_of(&self, force: &Force, inputs: &Inputs) -> Result<(Field, Field), MomentumError> {
        let (v, pi) = match &self.bodies {
            None => self.momentum.solve(&force.flow, &inputs.prescribed)?,
            Some(_) => {
                let carried = self.carry(force, inputs)?;
                (carried.v, carried.pi)
            }
        };
        Ok((Field::new(&self.momentum.velocity, v), Field::new(&self.momentum.pressure, pi)))
    }

    /// Residuals of the stationary equations at `state`   [9.8], [9.9], [9.10]
    ///
    /// # Errors
    /// As [`Momentum::residual_norms`]; formulas that are not finite.
    pub fn residuals(&self, state: &State, t: f64) -> Result<Residuals, MomentumError> {
        let root = self.area.sqrt();
        let inputs = self.inputs(t)?;
        let [velocity, pressure] = self.balance(state, &inputs)?;
        let r = self.polarity_residual(state, t);
        let polarity = crate::solve::root(dot(&r, &self.polarity.mass_solve(&r)));
        let speed = crate::solve::root(self.momentum.velocity_mass.quadratic(&state[VELOCITY].values)) / root;
        let stress = crate::solve::root(self.momentum.pressure_mass.quadratic(&state[PRESSURE].values)) / root;
        let velocity = relative(velocity / root, Scales::new(&self.parameters, self.area, speed, stress).force);
        Ok(Residuals::of([(VELOCITY, velocity), (PRESSURE, pressure / root), (POLARITY, polarity / root)]))
    }

    /// `Pe a_upw(p,q;v) − Pe [ω + a δ](p,q,v) + (1/B)(L_h|q) − Pe ∫_ΓDp (v·n)⊖ p_D·q − (f_p|q)` as a functional  
    /// [7.11c]
    pub fn polarity_residual(&self, state: &State, t: f64) -> Vec<f64> {
        let (v, p) = (&state[VELOCITY], &state[POLARITY]);
        let traces = self.traces(p, v, t);
        let molecular = self.polarity.molecular_functional(self.tissue(), p, traces.as_ref(), t);
        let source = self.polarity_source(&self.sources.at_time(t), t);
        self.polarity_residual_of(Carrier::from(v), (p, traces.as_ref()), &molecular, &source, t)
    }

    /// As [`Incompressible::polarity_residual`] with `(1/B)(L_h|q)` and `(f_p|q)` at hand, and directions of its own
    /// for upwinding.
    pub fn polarity_residual_of(
        &self,
        carrier: Carrier,
        (p, traces): (&Field, Option<&Traces>),
        molecular: &[f64],
        source: &[f64],
        t: f64,
    ) -> Vec<f64> {
        let given = self.given(t);
        let at = At::new(&self.parameters, p, &given).with_flow(&self.momentum.velocity, carrier).with_traces(traces);
        let mut r = self.tissue().vector(&Sum::of(&[terms::POLARITY]).value(&at), &self.polarity.space);
        axpy(1.0, molecular, &mut r);
        axpy(-1.0, source, &mut r);
        r
    }

    /// `κ² l_swip(q) + (f_p|q)`: the inputs of the polarity that do not depend on the flow   [7.11c]
    pub fn polarity_inputs(&self, inputs: &Inputs) -> Vec<f64> {
        let mut out = self.polarity.constant_data(self.tissue(), inputs.t);
        axpy(1.0, &inputs.source, &mut out);
        out
    }

    /// The flow with the directions that decide what is upstream during a step: its own, or, with the energy-consistent
    /// force, those of the flow before the step.
    pub fn carrier<'a>(&self, flow: &'a Field, before: &'a Field) -> Carrier<'a> {
        match self.parameters.elastic_force {
            ElasticForce::Stress => Carrier::from(flow),
            ElasticForce::Energy => Carrier { flow, sides: before, density: Density::One },
        }
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

    /// How the unknowns of the coupled matrix hang together.
    pub fn layout(&self) -> Layout<'_> {
        let traces = self.polarity.hybrid().map(|hybrid| &*hybrid.skeleton);
        Layout {
            velocity: &self.momentum.velocity,
            pressure: Some(&self.momentum.pressure),
            carried: [None, Some(&self.polarity.space)],
            traces,
            frames: &self.momentum.frames,
            closed: &self.momentum.closed,
            neighbours: self.polarity.neighbours(),
        }
    }

    /// The pressure Π: in the energy-consistent form the multiplier is Π + Ψ, and the L² projection of Ψ is taken off.
    ///
    /// # Errors
    /// As [`crate::solve::sparse::Factored::solve`].
    pub fn pressure(&self, state: &State) -> Result<Field, SolveError> {
        let m = &self.parameters;
        match m.elastic_force {
            ElasticForce::Energy if m.elasticity != 0.0 => {
                let p = &state[POLARITY];
                let density = |x: &CellPoint| m.elasticity * power::energy_density(p, &x.site, m.coherence);
                let mut shift = self.momentum.project_pressure(self.tissue(), 4 * p.space.degree, density)?;
                self.momentum.take_off_means(&mut shift);
                shift.iter_mut().zip(&state[PRESSURE].values).for_each(|(s, pi)| *s = pi - *s);
                Ok(Field::new(&self.momentum.pressure, shift))
            }
            ElasticForce::Energy | ElasticForce::Stress => Ok(state[PRESSURE].clone()),
        }
    }

    /// `F_h(p)` [7.2]: the free energy whose derivative is `L_h`, in hybrid form at the values on the faces in that
    /// flow; zero without elasticity.
    pub fn free_energy(&self, p: &Field, flow: &Field, t: f64) -> f64 {
        let m = &self.parameters;
        if m.elasticity == 0.0 {
            return 0.0;
        }
        let given = self.polarity.given(t);
        let data = |s: &FacePoint| given.polarity(s);
        let traces = self.traces(p, flow, t);
        let polarity = (p, traces.as_ref());
        let tissue = elastic::energy_over_b(self.tissue(), polarity, m.coherence, self.polarity.dirichlet, data);
        m.elasticity * (tissue + self.polarity.ghost_energy(p))
    }
}
