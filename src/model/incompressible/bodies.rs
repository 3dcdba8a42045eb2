//! Rigid bodies in the incompressible tissue.

use std::sync::Arc;

use super::{Description, Force, Incompressible, Inputs, State};
use crate::body::guide::Guide;
use crate::body::leaving::Remaining;
use crate::form::Integrator;
use crate::mesh::Mesh;
use crate::model::fields::{POLARITY, PRESSURE, VELOCITY};
use crate::model::floating::{Floating, embed};
use crate::model::immersed::flow::{Method, Penalty};
use crate::model::immersed::leaving::without_those_outside;
use crate::model::immersed::nitsche::Placement;
use crate::model::immersed::{Embedding, FlowWithBodies, Immersed};
use crate::model::momentum::{Momentum, MomentumError};
use crate::model::polarity::Polarity;
use crate::model::terms::FlowTerms;
use crate::shape::{Pose, Twist, Wrench};
use crate::space::{Continuity, Space};

impl Incompressible {
    /// As [`Incompressible::new`] with rigid bodies in the tissue.
    ///
    /// # Errors
    /// As [`Incompressible::new`] and [`Momentum::with_bodies`].
    pub fn around(
        mesh: &Arc<Mesh>,
        description: &Description,
        guide: &Arc<Guide>,
        poses: &[Pose],
        method: Method,
    ) -> Result<Self, MomentumError> {
        let Description { parameters, degrees, conditions, sources, slip } = description;
        let velocity = Arc::new(Space::new(mesh, Continuity::Continuous, degrees.velocity, 2));
        let pressure = Arc::new(Space::new(mesh, Continuity::Continuous, degrees.pressure, 1));
        let space = Arc::new(Space::new(mesh, Continuity::Discontinuous, degrees.polarity, 2));
        let loops = Integrator::new(mesh);
        let bodies = embed(&loops, &velocity, guide, poses, method)?;
        let floating = Arc::new(Floating::new(&loops, guide, bodies.cover(), poses));
        let (spaces, terms) = ((&velocity, &pressure), FlowTerms::of(parameters));
        let momentum = Momentum::with_bodies(&loops, spaces, conditions, &terms, *slip, bodies)?;
        Self::assemble(loops, Some(floating), Arc::new(momentum), &space, (parameters, conditions, sources))
    }

    /// The bodies where they are, as another flow may have them.
    pub(super) fn embedding(&self) -> Option<Embedding> {
        let floating = self.bodies.as_ref()?;
        Some(match self.momentum.bodies() {
            Some(bodies) => Embedding::Penalty(bodies.immersion.clone(), bodies.rigidity.clone()),
            None => {
                let (cover, poses) = (floating.covered.cover.clone(), floating.poses.clone());
                Embedding::Nitsche(Placement { cover, bodies: floating.guide.bodies.clone(), poses })
            }
        })
    }

    /// The same tissue without a body of which nothing is left in the mesh, and without others that lie outside as
    /// well, with those that are left at their new places.
    ///
    /// # Errors
    /// As [`Incompressible::around`].
    ///
    /// # Panics
    /// Without bodies.
    pub fn without(&self, first: usize, poses: &[Pose]) -> Result<(Self, Remaining), MomentumError> {
        without_those_outside(poses.len(), first, |remaining| self.with_fewer(remaining, &remaining.of(poses)))
    }

    /// The same tissue with fewer bodies, at these places.
    ///
    /// # Errors
    /// As [`Incompressible::around`].
    ///
    /// # Panics
    /// Without bodies.
    pub fn with_fewer(&self, remaining: &Remaining, poses: &[Pose]) -> Result<Self, MomentumError> {
        let old = self.bodies.as_ref().expect("a tissue with bodies");
        let guide = Arc::new(old.guide.of(remaining));
        let method = match self.momentum.bodies() {
            Some(Immersed { immersion, rigidity, .. }) => {
                Method::Penalty(Penalty { epsilon: rigidity.epsilon, strength: immersion.strength() })
            }
            None => Method::Nitsche,
        };
        let bodies = embed(&self.loops, &self.momentum.velocity, &guide, poses, method)?;
        let floating = Arc::new(Floating::new(&self.loops, &guide, bodies.cover(), poses));
        let momentum = Arc::new(self.momentum.around(&self.loops, &self.conditions, bodies)?);
        let given = (&self.parameters, &self.conditions[..], &self.sources);
        let (loops, space) = (self.loops.clone(), &self.polarity.space);
        let mut fewer = Self::assemble(loops, Some(floating), momentum, space, given)?;
        fewer.pushes = remaining.of(&self.pushes);
        Ok(fewer)
    }

    /// Moves the bodies: keeps the mesh, the spaces, the structure of the coupled matrix, and of the flow's factors
    /// what lies away from the bodies.
    ///
    /// # Errors
    /// As [`Momentum::place_bodies`].
    ///
    /// # Panics
    /// Without bodies.
    pub fn place_bodies(&mut self, poses: &[Pose]) -> Result<(), MomentumError> {
        let guide = self.bodies.as_ref().expect("a tissue with bodies").guide.clone();
        let momentum = Arc::get_mut(&mut self.momentum).expect("nobody else holds a flow whose bodies move");
        momentum.place_bodies(&self.loops, poses)?;
        let cover = momentum.cover().expect("a flow with bodies");
        let floating = Arc::new(Floating::new(&self.loops, &guide, cover, poses));
        let (m, slopes) = (&self.parameters, self.sources.boundary().cloned());
        let covered = &floating.covered;
        let (space, passive) = (&self.polarity.space, Some(&covered.passive));
        self.polarity = Polarity::around(&covered.tissue, space, &self.conditions, m, slopes, passive)?;
        self.bodies = Some(floating);
        Ok(())
    }

    /// Where the bodies are.
    pub fn poses(&self) -> &[Pose] {
        self.bodies.as_ref().map_or(&[], |bodies| &bodies.poses)
    }

    /// How the flow of a state moves the bodies.
    ///
    /// # Errors
    /// A load or a motion of a body that is not finite.
    pub fn twists(&self, state: &State, t: f64) -> Result<Vec<Twist>, MomentumError> {
        let Some(floating) = &self.bodies else { return Ok(Vec::new()) };
        let (v, pi) = (&state[VELOCITY].values, &state[PRESSURE].values);
        let force = match self.momentum.boundaries() {
            Some(_) => {
                let (p, sides) = (&state[POLARITY], &state[VELOCITY]);
                self.inner_force(p, self.molecular(p, sides, t).as_ref(), sides, t)
            }
            None => Force::default(),
        };
        let rules = floating.guide.rules(&floating.poses, t)?;
        let prescribed = self.momentum.frames.prescribed(&self.conditions, t)?;
        self.momentum.twists((v, pi), &prescribed, &self.loads(&force, t)?, &rules)
    }

    /// The flow that follows from a change of the force, where all that is prescribed stays.
    ///
    /// # Errors
    /// As [`Momentum::solve`].
    pub fn change_of_flow(&self, force: &Force) -> Result<(Vec<f64>, Vec<f64>), MomentumError> {
        let rest = vec![0.0; self.momentum.velocity.dof_count()];
        let Some(floating) = &self.bodies else { return self.momentum.solve(&force.flow, &rest) };
        let rules = floating.guide.rules_of_change(&floating.poses);
        let loads = force.loads(vec![Wrench::ZERO; rules.len()]);
        let carried = self.momentum.carry(&force.flow, &rest, &loads, &rules)?;
        Ok((carried.v, carried.pi))
    }

    /// What contact does to the bodies, from now on; nothing where `pushes` is empty.
    pub fn push_bodies(&mut self, pushes: Vec<Wrench>) {
        self.pushes = pushes;
    }

    /// Forces and torques of contact on the bodies; empty where nothing is pushed.
    pub fn pushes(&self) -> &[Wrench] {
        &self.pushes
    }

    /// Norms of what a state leaves of the balance of momentum and of `div v = 0`.
    pub(super) fn balance(&self, state: &State, inputs: &Inputs) -> Result<[f64; 2], MomentumError> {
        let (v, pi) = (&state[VELOCITY].values[..], &state[PRESSURE].values[..]);
        let force = self.force(&state[POLARITY], &state[VELOCITY], inputs);
        let Some(floating) = &self.bodies else { return Ok(self.momentum.residual_norms(&force.flow, v, pi)?) };
        let (loads, rules) = (self.loads(&force, inputs.t)?, floating.guide.rules(&floating.poses, inputs.t)?);
        self.momentum.residual_norms_around((&force.flow, &inputs.prescribed), (v, pi), &loads, &rules)
    }

    /// What acts on the bodies besides the viscous stress and the pressure: from outside, of contact, and of the tissue.
    pub(super) fn loads(&self, force: &Force, t: f64) -> Result<Vec<Wrench>, MomentumError> {
        let Some(floating) = &self.bodies else { return Ok(Vec::new()) };
        let mut loads = floating.guide.loads(&floating.poses, t)?;
        loads.iter_mut().zip(&self.pushes).for_each(|(load, push)| *load = *load + *push);
        Ok(force.loads(loads))
    }

    /// The flow with the forces that hold the bodies to what is prescribed of them.
    ///
    /// # Errors
    /// As [`Momentum::carry`].
    ///
    /// # Panics
    /// Without bodies.
    pub fn carry(&self, force: &Force, inputs: &Inputs) -> Result<FlowWithBodies, MomentumError> {
        let floating = self.bodies.as_ref().expect("a tissue with bodies");
        let rules = floating.guide.rules(&floating.poses, inputs.t)?;
        let mut carried =
            self.momentum.carry(&force.flow, &inputs.prescribed, &self.loads(force, inputs.t)?, &rules)?;
        // the traction of all of the stress
        carried.wrenches = force.loads(carried.wrenches);
        Ok(carried)
    }

    /// The flow of a state with what it does to the bodies, and with the forces and torques that hold them to what is
    /// prescribed of them, zero of a free body.
    ///
    /// # Errors
    /// As [`Momentum::carry`].
    ///
    /// # Panics
    /// Without bodies.
    pub fn carried(&self, state: &State, t: f64) -> Result<FlowWithBodies, MomentumError> {
        let inputs = self.inputs(t)?;
        self.carry(&self.force(&state[POLARITY], &state[VELOCITY], &inputs), &inputs)
    }
}
