//! Why a flow could not be found.

use super::SlipTreatment;
use crate::expression::ExpressionError;
use crate::model::immersed::penalty::BodyError;
use crate::solve::SolveError;

/// Why the momentum balance could not be set up or solved.
#[derive(Debug, Clone, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum MomentumError {
    #[error(transparent)]
    Solve(#[from] SolveError),
    #[error(transparent)]
    Formula(#[from] ExpressionError),
    #[error(transparent)]
    Body(#[from] BodyError),
    #[error(
        "`model.friction` = 0 and the boundary conditions leave a rigid motion{part} free: nothing holds the tissue \
         in place; hint: \
         give a friction, or a Dirichlet velocity on one tag{}", of_every(.part)
    )]
    Unheld { part: String },
    #[error(
        "the density vanishes, and with `model.friction` = 0 nothing but viscosity, which vanishes with it, holds the tissue: its \
         velocity is not determined there; hint: give a friction, or keep the density away from 0"
    )]
    Vacuum,
    /// A matrix that depends on the density.
    #[error("{0}")]
    Weighted(SolveError),
    #[error(
        "the prescribed velocities carry a net flux of {flux:.3e} through the closed boundary{part}, but div v = 0; \
         hint: make \
         inflow and outflow equal, or give one tag `velocity = \"traction\"`"
    )]
    Flux { flux: f64, part: String },
    #[error(
        "the energy-consistent elastic force has no traction on the body `{body}`, which may move; hint: take \
         `model.elastic_force = \"stress\"`, or fix the body"
    )]
    NoTraction { body: String },
}

/// Where there are several parts.
fn of_every(part: &str) -> &'static str {
    if part.is_empty() { "" } else { " of every part" }
}

/// Rounding weighs a penalty against the rest of the balance: a system that is not solved well is blamed on it.
pub(super) fn blame_penalty(slip: SlipTreatment, mut error: SolveError) -> SolveError {
    if let (SlipTreatment::Penalty { epsilon }, SolveError::Inaccurate { hint, .. }) = (slip, &mut error) {
        *hint = format!(
            "`space.penalty` = {epsilon:e} may leave too few digits to the rest of the balance: raise it, 1e-8 is usual, or \
             take `space.walls = \"rotated\"`"
        );
    }
    error
}
