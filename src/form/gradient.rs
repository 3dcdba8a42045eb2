//! Dirichlet forms of continuous fields.

use super::Bilinear;
use super::words::{Scalar, Vector};
use crate::space::Space;

/// `(∇φ|∇χ) = ∫ ∇φ·∇χ`   [B.54]
pub fn gradients<'a>(space: &Space) -> Bilinear<'a, Scalar, Scalar> {
    Bilinear::cells(2 * (space.degree - 1), |_| |phi: Scalar, chi: Scalar| phi.grad.dot(&chi.grad))
}

/// `(∇p|∇q) = ∫ ∇p:∇q`   [10.5]
pub fn vector_gradients<'a>(space: &Space) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(2 * (space.degree - 1), |_| |p: Vector, q: Vector| p.grad.dot(&q.grad))
}
