//! What acts on the flow and on the bodies in it: by Nitsche's method the stress of the polarity has a traction on
//! their boundaries, which pulls at both.
//!
//! ```text
//! F(w, w_B) = (f|w) − (σ|∇w) + ∫_∂B (σn)·(w − w_B)
//! ```
//! over the tissue, n out of it, with all of the stress σ that does not depend on the flow. The energy-consistent
//! elastic force X is no stress; its multiplier is `Π + Ψ`, and what Ψ pushes a body by is not the fluid's:
//! `−∫_∂B Ψ n·w_B`.

use super::Incompressible;
use crate::body::{Body, Hold};
use crate::form::traction::Pull;
use crate::form::words::Vector;
use crate::form::{Linear, power, traction};
use crate::mesh::Point;
use crate::model::momentum::MomentumError;
use crate::model::parameters::{ElasticForce, Parameters};
use crate::shape::{Wrench, rigid_motion};
use crate::space::{Field, Space};

/// Bodies that may move feel a stress; the energy-consistent elastic force is none.
///
/// # Errors
/// [`MomentumError::NoTraction`]
pub(super) fn check_tractions(m: &Parameters, bodies: &[Body]) -> Result<(), MomentumError> {
    let has_traction = m.elastic_force == ElasticForce::Stress || m.elasticity == 0.0;
    let moving = bodies.iter().find(|body| !matches!(body.hold, Hold::Fixed));
    match moving.filter(|_| !has_traction) {
        None => Ok(()),
        Some(body) => Err(MomentumError::NoTraction { body: body.name.clone() }),
    }
}

/// A functional on the velocity space, and forces and torques on bodies.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Force {
    /// Tested with w.
    pub flow: Vec<f64>,
    /// One for each body about its centre, tested with `w_B`; empty without bodies by Nitsche's method.
    pub bodies: Vec<Wrench>,
}

impl Force {
    /// Adds what a body's boundary in a cell has of a functional: of the cell's velocities, then of the body's motion.
    pub(in crate::model) fn add(&mut self, velocity: &Space, (cell, body): (usize, usize), values: &[f64]) {
        let (flow, motion) = values.split_at(velocity.cell_dof_count());
        for (k, value) in flow.iter().enumerate() {
            self.flow[velocity.dof(cell, k / velocity.n, k % velocity.n)] += value;
        }
        let pull = Wrench { force: Point::new(motion[0], motion[1]), torque: motion[2] };
        self.bodies[body] = self.bodies[body] + pull;
    }

    /// What acts on the bodies together with loads from outside.
    pub(super) fn loads(&self, outer: Vec<Wrench>) -> Vec<Wrench> {
        match self.bodies.is_empty() {
            true => outer,
            false => outer.into_iter().zip(&self.bodies).map(|(load, own)| load + *own).collect(),
        }
    }
}

impl Incompressible {
    /// The tractions of the stress in a form with the side of the equations' residual, as a force: none without bodies
    /// by Nitsche's method.
    pub(in crate::model) fn tractions(&self, form: &Linear<Vector>) -> Force {
        let velocity = &*self.momentum.velocity;
        let mut force = Force { flow: vec![0.0; velocity.dof_count()], bodies: Vec::new() };
        let Some(outline) = self.momentum.outline() else { return force };
        force.bodies = vec![Wrench::ZERO; outline.poses.len()];
        for pull in traction::of_form(&self.loops, form, velocity, outline) {
            force.add(velocity, (pull.cell, pull.body), &pull.rows);
        }
        force
    }

    /// What the tractions of the stress in a form do with a velocity, body by body.
    pub(super) fn powers_of_tractions(&self, form: &Linear<Vector>, v: &Field) -> Vec<f64> {
        let Some(outline) = self.momentum.outline() else { return Vec::new() };
        let (mut powers, velocity) = (vec![0.0; outline.poses.len()], &*self.momentum.velocity);
        for Pull { cell, body, rows } in traction::of_form(&self.loops, form, velocity, outline) {
            let value = |k: usize| v.values[velocity.dof(cell, k / velocity.n, k % velocity.n)];
            powers[body] +=
                rows[..velocity.cell_dof_count()].iter().enumerate().map(|(k, f)| f * value(k)).sum::<f64>();
        }
        powers
    }

    /// As a force what a form of the residual is, with the tractions of its stress.
    pub(super) fn with_tractions(&self, form: &Linear<Vector>) -> Force {
        let mut force = self.tractions(form);
        self.tissue().vector(form, &self.momentum.velocity).iter().zip(&mut force.flow).for_each(|(r, f)| *f -= r);
        force
    }

    /// Adds `−∫_∂B Ψ n·w_B` where the elastic force is the energy-consistent one; bodies are fixed then, so that no
    /// derivative has it.
    pub(super) fn add_push(&self, p: &Field, force: &mut Force) {
        let m = &self.parameters;
        let Some(outline) = self.momentum.outline() else { return };
        if m.elastic_force == ElasticForce::Stress || m.elasticity == 0.0 {
            return;
        }
        for (body, wrench) in force.bodies.iter_mut().enumerate() {
            let push = |k: usize| {
                let degree = 4 * p.space.degree + 1;
                let motion = |x: Point| rigid_motion(k, outline.poses[body].position, x);
                -m.elasticity
                    * self.loops.sum_outline(outline.surface, body, degree, |x| {
                        power::energy_density(p, &x.site, m.coherence) * x.n.dot(&motion(x.site.x))
                    })
            };
            *wrench = *wrench + Wrench { force: Point::new(push(0), push(1)), torque: push(2) };
        }
    }
}
