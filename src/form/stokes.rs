//! Viscosity, incompressibility, and what boundaries do to the momentum balance.

use super::Bilinear;
use super::integrate::Faces;
use super::words::{Scalar, Trace, Vector};
use crate::space::Space;

/// `2(D(v)|D(w)) = ∫ 2 D(v):D(w)`   [7.11a]
pub fn viscosity<'a>(space: &Space) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(2 * (space.degree - 1), |_| |v: Vector, w: Vector| 2.0 * v.sym().dot(&w.sym()))
}

/// `b(w,ξ) = −∫ ξ div w`, trial ξ, test w   [7.11b]
pub fn divergence<'a>(velocity: &Space, pressure: &Space) -> Bilinear<'a, Scalar, Vector> {
    Bilinear::cells(velocity.degree - 1 + pressure.degree, |_| |xi: Scalar, w: Vector| -xi.value * w.div())
}

/// `(1/ε) ∫_Γ (v·n)(w·n) ds` with the exact normal: slip by penalty   [10.3]
pub fn slip_penalty<'a>(space: &Space, slip: Faces, epsilon: f64) -> Bilinear<'a, Vector, Vector> {
    Bilinear::zero().faces(slip, 2 * space.degree, move |s| {
        let n = s.exact_n;
        move |v: Trace<Vector>, w: Trace<Vector>| v.minus.value.dot(&n) * w.minus.value.dot(&n) / epsilon
    })
}
