//! Advection by upwind fluxes.

use super::integrate::{FacePoint, Faces};
use super::words::{Scalar, Trace, Vector, negative};
use super::{Bilinear, Linear};
use crate::mesh::Point;
use crate::space::{Field, Space};

/// `a_upw(φ,χ;v) = ∫ (v·∇_hφ)χ + ∫_Γ (v·n)⊖ φχ + Σ ∫ {½|v·n|[χ] − (v·n){χ}}[φ]`, Γ = `inflow`   [6.13]
pub fn a_upw<'a>(space: &Space, flow: &'a Field, inflow: Faces) -> Bilinear<'a, Scalar, Scalar> {
    let (q, k) = (space.degree, flow.space.degree);
    Bilinear::cells(2 * q - 1 + k, move |x| {
        let v = flow.vector(&x.site);
        move |phi: Scalar, chi: Scalar| v.dot(&phi.grad) * chi.value
    })
    .faces(Faces::INTERIOR, 2 * q + k, move |s| {
        let vn = flow.vector(&s.minus).dot(&s.n);
        move |phi: Trace<Scalar>, chi: Trace<Scalar>| (0.5 * vn.abs() * chi.jump() - vn * chi.mean()) * phi.jump()
    })
    .faces(inflow, 2 * q + k, move |s| {
        let entering = negative(flow.vector(&s.minus).dot(&s.n));
        move |phi: Trace<Scalar>, chi: Trace<Scalar>| entering * phi.minus.value * chi.minus.value
    })
}

/// `∫_Γ (v·n)⊖ g·q`: what flows in with the value `g` of degree `degree`   [7.11c]
pub fn l_upw<'a>(
    space: &Space,
    flow: &'a Field,
    inflow: Faces,
    degree: usize,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    Linear::zero().faces(inflow, space.degree + flow.space.degree + degree, move |s| {
        let g = g(s) * negative(flow.vector(&s.minus).dot(&s.n));
        move |q: Trace<Vector>| g.dot(&q.minus.value)
    })
}
