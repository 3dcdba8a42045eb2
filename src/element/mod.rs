//! The reference triangle `K̂ = {(ξ, η): ξ ≥ 0, η ≥ 0, ξ + η ≤ 1}`: Lagrange bases, quadrature, and tables of both.

pub mod basis;
pub mod lobatto;
pub mod quadrature;
pub mod tables;

/// Highest polynomial degree of a Lagrange space.
pub const MAX_DEGREE: usize = 5;
