//! Viscosity, incompressibility, and what boundaries do to the momentum balance.

use super::Bilinear;
use super::density::Density;
use super::integrate::Faces;
use super::words::{Scalar, Trace, Vector, sym};
use crate::space::{Field, Space};

/// `2(ρD(v)|D(w)) = ∫ 2ρ D(v):D(w)`   [7.11a], [7.34]
pub fn viscosity<'a>(space: &Space, rho: Density<'a>) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(2 * (space.degree - 1) + rho.degree(), move |x| {
        let twice = 2.0 * rho.at(&x.site);
        move |v: Vector, w: Vector| twice * v.sym().dot(&w.sym())
    })
}

/// `2(ρ div v|div w) = ∫ 2ρ div v div w`   [7.34]
pub fn divergence_viscosity<'a>(space: &Space, rho: Density<'a>) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(2 * (space.degree - 1) + rho.degree(), move |x| {
        let twice = 2.0 * rho.at(&x.site);
        move |v: Vector, w: Vector| twice * (v.div() * w.div())
    })
}

/// Derivative of [`viscosity`] at v along ρ: `∫ 2δρ D(v):D(w)`, trial δρ, test w   [7.34]
pub fn viscosity_by_density<'a>(v: &'a Field, density: &Space) -> Bilinear<'a, Scalar, Vector> {
    Bilinear::cells(2 * (v.space.degree - 1) + density.degree, move |x| {
        let stress = sym(&v.vector_gradient(&x.site)) * 2.0;
        move |change: Scalar, w: Vector| change.value * stress.dot(&w.grad)
    })
}

/// Derivative of [`divergence_viscosity`] at v along ρ: `∫ 2δρ div v div w`, trial δρ, test w   [7.34]
pub fn divergence_viscosity_by_density<'a>(v: &'a Field, density: &Space) -> Bilinear<'a, Scalar, Vector> {
    Bilinear::cells(2 * (v.space.degree - 1) + density.degree, move |x| {
        let stress = 2.0 * v.vector_gradient(&x.site).trace();
        move |change: Scalar, w: Vector| change.value * stress * w.div()
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
