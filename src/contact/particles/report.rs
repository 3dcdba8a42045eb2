//! What a step of particles did.

use crate::contact::{Contact, Effort};
use crate::mesh::Point;

/// What a step did.
#[derive(Debug, Clone, Default)]
pub struct StepReport {
    /// Time after the step.
    pub time: f64,
    /// Pairs that are close or touch.
    pub contacts: Vec<Contact>,
    /// Contact force and torque on each body.
    pub forces: Vec<[f64; 3]>,
    /// Contact force on all walls.
    pub wall_force: Point,
    /// Least gap of near pairs, infinite when none is near.
    pub gap: f64,
    /// `½ Σ m|V|² + ½ Σ Iω²` over all bodies.
    pub kinetic_energy: f64,
    /// What the projection took.
    pub effort: Effort,
}

impl StepReport {
    /// Number of contacts that carry a force.
    pub fn touching(&self) -> usize {
        self.contacts.iter().filter(|c| c.force != 0.0).count()
    }

    /// Largest overlap, 0 without one.
    pub fn overlap(&self) -> f64 {
        (-self.gap).max(0.0)
    }
}
