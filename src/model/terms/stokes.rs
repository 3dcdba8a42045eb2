//! The terms of a Stokes flow of viscosity 1, test w: those of the sheet's balance of momentum that it shares.

use super::Term;
use super::momentum::{FRICTION, MULTIPLIER, VISCOSITY};
use crate::form::words::Vector;

/// In the order of the model page.
pub const STOKES: &[Term<Vector>] = &[VISCOSITY, FRICTION, MULTIPLIER];
