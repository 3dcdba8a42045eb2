//! Rigid bodies in the flow, by penalty or as boundaries of the fluid.

use std::sync::Arc;

use super::factors::System;
use super::{Momentum, MomentumError};
use crate::body::guide::Rule;
use crate::cut::Cover;
use crate::form::Integrator;
use crate::form::traction::Outline;
use crate::model::Conditions;
use crate::model::immersed::nitsche::{Forms, Moved, Nitsche};
use crate::model::immersed::{Embedding, FlowWithBodies, Ground, Immersed};
use crate::shape::{Pose, Twist, Wrench};

impl Momentum {
    /// The rigid bodies in the flow, where they are there by penalty.
    pub fn bodies(&self) -> Option<&Immersed> {
        match &self.system {
            System::Open(_) | System::Closed(_) | System::Nitsche(_) => None,
            System::Immersed(bodies) => Some(bodies),
        }
    }

    /// Those by Nitsche's method.
    pub fn boundaries(&self) -> Option<&Nitsche> {
        match &self.system {
            System::Open(_) | System::Closed(_) | System::Immersed(_) => None,
            System::Nitsche(bodies) => Some(bodies),
        }
    }

    /// How bodies lie in the flow.
    pub fn cover(&self) -> Option<&Arc<Cover>> {
        match &self.system {
            System::Open(_) | System::Closed(_) => None,
            System::Immersed(bodies) => Some(&bodies.immersion.cover),
            System::Nitsche(bodies) => Some(bodies.cover()),
        }
    }

    /// The boundaries of bodies by Nitsche's method.
    pub fn outline(&self) -> Option<Outline<'_>> {
        self.boundaries().map(Nitsche::outline)
    }

    pub(super) fn ground(&self) -> Ground<'_> {
        Ground { velocity: &self.velocity, pressure: &self.pressure, frames: &self.frames, closed: &self.closed }
    }

    /// Moves the bodies: only cells that one of them enters, leaves or cuts anew are integrated, and only the part of
    /// the factors above them is made anew. The result does not depend on where the bodies were before.
    ///
    /// # Errors
    /// As [`Momentum::with_bodies`]; after an error the bodies are nowhere.
    ///
    /// # Panics
    /// Without bodies.
    pub fn place_bodies(&mut self, loops: &Integrator, poses: &[Pose]) -> Result<(), MomentumError> {
        let (velocity, pressure) = (&self.velocity, &self.pressure);
        let ground = Ground { velocity, pressure, frames: &self.frames, closed: &self.closed };
        match &mut self.system {
            System::Open(_) | System::Closed(_) => panic!("there are no bodies to move"),
            System::Immersed(bodies) => bodies.move_to(ground, loops, poses),
            System::Nitsche(bodies) => bodies.move_to(ground, Forms { loops, velocity: &self.made_of }, poses),
        }
    }

    /// The same flow around other bodies.
    ///
    /// # Errors
    /// As [`Momentum::with_bodies`].
    pub fn around(
        &self,
        loops: &Integrator,
        conditions: &[Conditions],
        bodies: Embedding,
    ) -> Result<Self, MomentumError> {
        let spaces = (&self.velocity, &self.pressure);
        Self::with_bodies(loops, spaces, conditions, &self.made_of.terms, self.slip, bodies)
    }

    /// Solves for the flow with the force `f` and prescribed nodal values, and for the bodies, with external loads
    /// about their centres and rules of their motion.
    ///
    /// # Errors
    /// As [`Momentum::solve`]; rules that contradict the boundary or each other.
    ///
    /// # Panics
    /// Without bodies, or with other numbers of loads and rules.
    pub fn carry(
        &self,
        f: &[f64],
        prescribed: &[f64],
        loads: &[Wrench],
        rules: &[Rule],
    ) -> Result<FlowWithBodies, MomentumError> {
        let bodies = match &self.system {
            System::Nitsche(bodies) => return bodies.solve(self.ground(), (f, prescribed), loads, rules),
            System::Immersed(bodies) => bodies,
            System::Open(_) | System::Closed(_) => panic!("there are no bodies to carry"),
        };
        let count = bodies.immersion.parts.len();
        assert!(loads.len() == count && rules.len() == count, "every body has a load and a rule");
        self.check_flux(&self.divergence.times(prescribed), prescribed)?;
        bodies.solve(self.ground(), (f, prescribed), loads, rules)
    }

    /// Adds to the balance of a fluid around bodies what these add to it by Nitsche's method.
    pub(in crate::model) fn add_surfaces(&self, flow: &FlowWithBodies, residual: &mut [f64]) {
        if let System::Nitsche(bodies) = &self.system {
            bodies.add_residual(self.ground(), flow, residual);
        }
    }

    /// How bodies move in a flow that was solved for under loads on them and rules of their motion, with prescribed
    /// nodal values.
    ///
    /// # Errors
    /// Velocities of walls that a body in them cannot have.
    ///
    /// # Panics
    /// As [`Momentum::carry`].
    pub fn twists(
        &self,
        (v, pi): (&[f64], &[f64]),
        prescribed: &[f64],
        loads: &[Wrench],
        rules: &[Rule],
    ) -> Result<Vec<Twist>, MomentumError> {
        match &self.system {
            System::Nitsche(bodies) => Ok(bodies.twists_in(self.ground(), (v, pi), prescribed, loads, rules)?),
            System::Immersed(bodies) => Ok(bodies.immersion.means.iter().map(|means| means.twist(v)).collect()),
            System::Open(_) | System::Closed(_) => panic!("there are no bodies that move"),
        }
    }

    /// Adds forces and torques on the bodies to a functional.
    ///
    /// # Panics
    /// Without bodies by penalty: other ones have unknowns of their own.
    pub fn add_body_loads(&self, loads: &[Wrench], f: &mut [f64]) {
        let bodies = self.bodies().expect("there are bodies to load");
        bodies.immersion.means.iter().zip(loads).for_each(|(means, load)| means.add_load(*load, f));
    }

    /// Dense blocks of `2(D(v)|D(w)) + C_F(v|w)` and of `b(w,ξ)`, cell after cell, rows w.
    ///
    /// Bodies add a penalty that is soft enough for factors without their rigid motions; those are no exact inverse
    /// then.
    pub fn element_blocks(&self, loops: &Integrator) -> (Vec<f64>, Vec<f64>) {
        let mut blocks = self.made_of.blocks(loops, (&self.velocity, &self.pressure));
        match &self.system {
            System::Open(_) | System::Closed(_) => {}
            System::Immersed(bodies) => bodies.add_soft_blocks(&mut blocks.0),
            System::Nitsche(bodies) => {
                bodies.add_soft_blocks(&self.velocity, self.made_of.terms.friction(), &mut blocks.0);
            }
        }
        blocks
    }

    /// Adds to a functional on the velocity space what the boundaries of bodies by Nitsche's method have in the balance
    /// of a flow, in which they move with some twists.
    pub fn add_boundaries(&self, (v, pi): (&[f64], &[f64]), twists: &[Twist], out: &mut [f64]) {
        if let Some(bodies) = self.boundaries() {
            bodies.add_boundaries(self.ground(), Moved { v, pi, twists }, out);
        }
    }

    /// What every body by Nitsche's method takes of a flow, see [`nitsche`](crate::model::immersed::nitsche); empty
    /// without.
    pub fn powers_of_boundaries(&self, (v, pi): (&[f64], &[f64]), twists: &[Twist]) -> Vec<f64> {
        self.boundaries().map_or_else(Vec::new, |bodies| bodies.powers(self.ground(), Moved { v, pi, twists }))
    }
}
