//! What the matrix of a flow is made of.

use super::{FlowMatrix, Weak};
use crate::form::words::Vector;
use crate::form::{Bilinear, Density};
use crate::model::numbers::Numbers;
use crate::space::Space;

/// The terms of a balance of momentum that are linear in the flow, each with what multiplies its matrix: all that the
/// matrix of a flow depends on besides its spaces and conditions. Two of equal weights have the same matrix.
#[derive(Debug, Clone)]
pub struct FlowTerms {
    terms: Vec<(&'static str, f64, FlowMatrix)>,
    friction: f64,
}

impl FlowTerms {
    /// Of a model.
    pub fn of<'a>(numbers: impl Into<Numbers<'a>>) -> Self {
        let numbers = numbers.into();
        let linear = numbers.momentum().iter().filter(|term| term.is_on(numbers)).filter_map(|term| match &term.weak {
            Weak::Flow { weight, matrix, .. } => Some((term.name, term.scale(numbers) * weight(numbers), *matrix)),
            Weak::Functional(_) | Weak::With(_) | Weak::Frame => None,
        });
        Self { terms: linear.collect(), friction: numbers.friction() }
    }

    /// `C_F`, which holds a flow where its boundary does not.
    pub fn friction(&self) -> f64 {
        self.friction
    }

    /// Their sum, trial v, test w.
    pub fn matrix<'a>(&self, velocity: &Space, rho: Density<'a>) -> Bilinear<'a, Vector, Vector> {
        self.terms.iter().fold(Bilinear::zero(), |sum, (_, weight, matrix)| sum + *weight * matrix(velocity, rho))
    }

    fn weights(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.terms.iter().map(|(name, weight, _)| (*name, *weight))
    }
}

impl PartialEq for FlowTerms {
    fn eq(&self, other: &Self) -> bool {
        self.weights().eq(other.weights())
    }
}
