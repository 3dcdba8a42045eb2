//! Viscosity, incompressibility, and what boundaries do to the momentum balance.

use nalgebra::Matrix2;

use super::Bilinear;
use super::integrate::{FacePoint, Faces};
use super::words::{Scalar, Trace, Vector, sym};
use crate::space::{Field, Space};

/// `2(D(v)|D(w)) = ∫ 2 D(v):D(w)`   [7.11a]
pub fn viscosity<'a>(space: &Space) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(2 * (space.degree - 1), |_| |v: Vector, w: Vector| 2.0 * v.sym().dot(&w.sym()))
}

/// `2(ρD(v)|D(w)) + 2(ρ div v|div w) = ∫ 2ρ [D(v):D(w) + div v div w]`   [7.34]
pub fn weighted_viscosity<'a>(space: &Space, rho: &'a Field) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(2 * (space.degree - 1) + rho.space.degree, move |x| {
        let twice = 2.0 * rho.scalar(&x.site);
        move |v: Vector, w: Vector| twice * (v.sym().dot(&w.sym()) + v.div() * w.div())
    })
}

/// Derivative of [`weighted_viscosity`] at v along ρ: `∫ 2δρ [D(v):D(w) + div v div w]`, trial δρ, test w   [7.34]
pub fn viscosity_by_density<'a>(v: &'a Field, density: &Space) -> Bilinear<'a, Scalar, Vector> {
    Bilinear::cells(2 * (v.space.degree - 1) + density.degree, move |x| {
        let g = v.vector_gradient(&x.site);
        let stress = (sym(&g) + Matrix2::identity() * g.trace()) * 2.0;
        move |change: Scalar, w: Vector| change.value * stress.dot(&w.grad)
    })
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

/// `∫_Γ β (v·t)(w·t) ds` with the exact normal, β of degree `degree`: walls that resist   [N.1]
pub fn wall_friction<'a>(
    space: &Space,
    walls: Faces,
    degree: usize,
    beta: impl Fn(&FacePoint) -> f64 + Sync + 'a,
) -> Bilinear<'a, Vector, Vector> {
    Bilinear::zero().faces(walls, 2 * space.degree + degree, move |s| {
        let (n, beta) = (s.exact_n, beta(s));
        move |v: Trace<Vector>, w: Trace<Vector>| beta * n.perp(&v.minus.value) * n.perp(&w.minus.value)
    })
}
