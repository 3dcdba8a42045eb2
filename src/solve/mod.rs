//! Algebra: sparse factorisations, bordered systems, block operators of discontinuous spaces, Krylov and fixed points.
//!
//! Every solve is checked: the solution must be finite and its relative residual small, or the error names the system.

pub mod anderson;
pub mod arnoldi;
pub mod blocks;
pub mod bordered;
pub mod dissection;
mod front;
pub mod gram;
pub mod krylov;
pub mod multifrontal;
pub(crate) mod rows;
mod separator;
pub mod sparse;
pub mod symbolic;
pub mod wide;

/// Why a linear system was not solved.
#[derive(Debug, Clone, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum SolveError {
    #[error("the {system} matrix could not be factorised: {reason}; hint: {hint}")]
    Factorise { system: String, reason: String, hint: String },
    #[error("the {system} system has a right-hand side that is not finite (entry {index})")]
    NotFiniteInput { system: String, index: usize },
    #[error("the solution of the {system} system is not finite: the matrix is singular to rounding; hint: {hint}")]
    NotFinite { system: String, hint: String },
    #[error("the {system} system was solved with relative residual {residual:.1e} only; hint: {hint}")]
    Inaccurate { system: String, residual: f64, hint: String },
}

/// Largest relative residual that a direct solve may leave.
pub const DIRECT_TOLERANCE: f64 = 1e-8;

/// Euclidean norm, summed in order.
pub fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}

/// Scalar product, summed in a fixed order of eight lanes.
pub fn dot(x: &[f64], y: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let (xs, ys) = (x.chunks_exact(8), y.chunks_exact(8));
    let tail: f64 = xs.remainder().iter().zip(ys.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in xs.zip(ys) {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += a * b;
        }
    }
    lanes.iter().sum::<f64>() + tail
}

/// Root of a sum that rounding may leave below zero; NaN stays NaN.
pub fn root(sum: f64) -> f64 {
    if sum.is_nan() { sum } else { sum.max(0.0).sqrt() }
}

/// `y += a x`.
pub fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}
