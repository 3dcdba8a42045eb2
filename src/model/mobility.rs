//! What a flow makes of a change of the forces on its bodies.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::momentum::{Momentum, MomentumError};
use crate::body::guide::Rule;
use crate::body::stiffness::Response;
use crate::mesh::Point;
use crate::shape::{Twist, Wrench};

/// The twists that wrenches cause, where nothing else acts on the flow; one solve with the factors that are there.
#[derive(Debug)]
pub struct Mobility<'m> {
    /// The flow around the bodies.
    pub momentum: &'m Momentum,
    /// Of a change: what is prescribed stays.
    pub rules: Vec<Rule>,
    /// Those of units that are known.
    pub columns: &'m Columns,
}

/// Twists of all bodies by unit wrenches on one of them, for one placement of the bodies.
#[derive(Debug, Default)]
pub struct Columns(Mutex<Known>);

/// By body and part of its wrench.
type Known = BTreeMap<(usize, usize), Arc<[Twist]>>;

impl Columns {
    /// Forgets them: the bodies have moved.
    pub fn clear(&mut self) {
        self.0.get_mut().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

impl Mobility<'_> {
    /// Twists of all bodies that a unit force along an axis (`k` 0 or 1) or a unit torque (2) on one of them causes;
    /// solved for once.
    ///
    /// # Errors
    /// As [`Momentum::carry`].
    pub fn column(&self, body: usize, k: usize) -> Result<Arc<[Twist]>, MomentumError> {
        let known = || self.columns.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(column) = known().get(&(body, k)) {
            return Ok(column.clone());
        }
        let mut wrenches = vec![Wrench::ZERO; self.rules.len()];
        let unit = |on: usize| f64::from(u8::from(on == k));
        wrenches[body] = Wrench { force: Point::new(unit(0), unit(1)), torque: unit(2) };
        let column: Arc<[Twist]> = self.twists(&wrenches)?.into();
        known().insert((body, k), column.clone());
        Ok(column)
    }
}

impl Response for Mobility<'_> {
    type Error = MomentumError;

    fn twists(&self, wrenches: &[Wrench]) -> Result<Vec<Twist>, MomentumError> {
        let rest = vec![0.0; self.momentum.velocity.dof_count()];
        Ok(self.momentum.carry(&rest, &rest, wrenches, &self.rules)?.twists)
    }
}
