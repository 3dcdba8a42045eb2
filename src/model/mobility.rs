//! What a flow makes of a change of the forces on its bodies.

use super::momentum::{Momentum, MomentumError};
use crate::body::guide::Rule;
use crate::body::stiffness::Response;
use crate::shape::Twist;
use crate::shape::Wrench;

/// The twists that wrenches cause, where nothing else acts on the flow; one solve with the factors that are there.
#[derive(Debug)]
pub struct Mobility<'m> {
    pub momentum: &'m Momentum,
    /// Of a change: what is prescribed stays.
    pub rules: Vec<Rule>,
}

impl Response for Mobility<'_> {
    type Error = MomentumError;

    fn twists(&self, wrenches: &[Wrench]) -> Result<Vec<Twist>, MomentumError> {
        let rest = vec![0.0; self.momentum.velocity.dof_count()];
        Ok(self.momentum.carry(&rest, &rest, wrenches, &self.rules)?.twists)
    }
}
