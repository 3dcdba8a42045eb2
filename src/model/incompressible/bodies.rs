//! Rigid bodies in the incompressible tissue.

use std::sync::Arc;

use super::{Description, Incompressible, Inputs, State};
use crate::body::guide::Guide;
use crate::expression::ExpressionError;
use crate::form::Integrator;
use crate::mesh::Mesh;
use crate::model::fields::{POLARITY, VELOCITY};
use crate::model::floating::{Floating, immerse};
use crate::model::immersed::penalty::Penalty;
use crate::model::immersed::{Embedding, FlowWithBodies, Rigidity};
use crate::model::momentum::{Momentum, MomentumError};
use crate::model::polarity::Polarity;
use crate::model::terms::FlowTerms;
use crate::shape::{Pose, Twist, Wrench};
use crate::space::{Continuity, Field, Space};

impl Incompressible {
    /// As [`Incompressible::new`] with rigid bodies in the tissue   [L1.13]
    ///
    /// # Errors
    /// As [`Incompressible::new`] and [`Momentum::with_bodies`].
    pub fn around(
        mesh: &Arc<Mesh>,
        description: &Description,
        guide: &Arc<Guide>,
        poses: &[Pose],
        penalty: Penalty,
    ) -> Result<Self, MomentumError> {
        let Description { parameters, degrees, conditions, sources, slip } = description;
        let velocity = Arc::new(Space::new(mesh, Continuity::Continuous, degrees.velocity, 2));
        let pressure = Arc::new(Space::new(mesh, Continuity::Continuous, degrees.pressure, 1));
        let space = Arc::new(Space::new(mesh, Continuity::Discontinuous, degrees.polarity, 2));
        let loops = Integrator::new(mesh);
        let immersion = immerse(&loops, &velocity, &guide.bodies, (poses, penalty.strength))?;
        let floating = Arc::new(Floating::new(&loops, guide, &immersion));
        let friction = guide.bodies.iter().map(|body| body.friction).collect();
        let rigidity = Rigidity { epsilon: penalty.epsilon, friction };
        let (spaces, bodies) = ((&velocity, &pressure), Embedding::Penalty(immersion, rigidity));
        let momentum = Momentum::with_bodies(&loops, spaces, conditions, &FlowTerms::of(parameters), *slip, bodies)?;
        Self::assemble(loops, Some(floating), Arc::new(momentum), &space, (parameters, conditions, sources))
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
        let immersion = &momentum.bodies().expect("a flow with bodies").immersion;
        let floating = Arc::new(Floating::new(&self.loops, &guide, immersion));
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

    /// How a flow moves the bodies.
    pub fn twists(&self, v: &Field) -> Vec<Twist> {
        let means = self.momentum.bodies().map_or(&[][..], |bodies| &bodies.immersion.means);
        means.iter().map(|means| means.twist(&v.values)).collect()
    }

    /// The flow that follows from a change of the force, where all that is prescribed stays.
    ///
    /// # Errors
    /// As [`Momentum::solve`].
    pub fn change_of_flow(&self, force: &[f64]) -> Result<(Vec<f64>, Vec<f64>), MomentumError> {
        let rest = vec![0.0; self.momentum.velocity.dof_count()];
        let Some(floating) = &self.bodies else { return self.momentum.solve(force, &rest) };
        let rules = floating.guide.rules_of_change(&floating.poses);
        let carried = self.momentum.carry(force, &rest, &vec![Wrench::ZERO; rules.len()], &rules)?;
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

    /// Forces and torques from outside and of contact.
    fn loads(&self, floating: &Floating, t: f64) -> Result<Vec<Wrench>, ExpressionError> {
        let mut loads = floating.guide.loads(&floating.poses, t)?;
        loads.iter_mut().zip(&self.pushes).for_each(|(load, push)| *load = *load + *push);
        Ok(loads)
    }

    /// Adds the forces on the bodies, from outside and those that hold them to what is prescribed of them.
    pub(super) fn add_body_forces(&self, force: &mut [f64], inputs: &Inputs) -> Result<(), MomentumError> {
        let Some(floating) = &self.bodies else { return Ok(()) };
        let holding = self.carry(force, inputs)?.holding;
        self.momentum.add_body_loads(&self.loads(floating, inputs.t)?, force);
        self.momentum.add_body_loads(&holding, force);
        Ok(())
    }

    /// The flow with the forces that hold the bodies to what is prescribed of them.
    ///
    /// # Errors
    /// As [`Momentum::carry`].
    ///
    /// # Panics
    /// Without bodies.
    pub fn carry(&self, force: &[f64], inputs: &Inputs) -> Result<FlowWithBodies, MomentumError> {
        let floating = self.bodies.as_ref().expect("a tissue with bodies");
        let (guide, poses) = (&floating.guide, &floating.poses);
        let (loads, rules) = (self.loads(floating, inputs.t)?, guide.rules(poses, inputs.t)?);
        self.momentum.carry(force, &inputs.prescribed, &loads, &rules)
    }

    /// The forces and torques that hold the bodies in a state to what is prescribed of them; zero of a free body.
    ///
    /// # Errors
    /// As [`Momentum::carry`].
    ///
    /// # Panics
    /// Without bodies.
    pub fn holding(&self, state: &State, t: f64) -> Result<Vec<Wrench>, MomentumError> {
        let inputs = self.inputs(t)?;
        Ok(self.carry(&self.force(&state[POLARITY], &state[VELOCITY], &inputs), &inputs)?.holding)
    }
}
