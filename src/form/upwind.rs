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

/// `a_upw(p,q;v) − ∫_Γ (v·n)⊖ g·q`: advection of `p` with what flows in, as a functional of q   [6.13], [7.11c]
pub fn advection<'a>(
    p: &'a Field,
    flow: &'a Field,
    inflow: Faces,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    let (q, k) = (p.space.degree, flow.space.degree);
    Linear::cells(2 * q - 1 + k, move |x| {
        let carried = p.vector_gradient(&x.site) * flow.vector(&x.site);
        move |q: Vector| carried.dot(&q.value)
    })
    .faces(Faces::INTERIOR, 2 * q + k, move |s| {
        let vn = flow.vector(&s.minus).dot(&s.n);
        let jump = jump_of(p, s);
        let (inner, outer) = (jump * (0.5 * (vn.abs() - vn)), jump * (0.5 * (vn.abs() + vn)));
        move |q: Trace<Vector>| inner.dot(&q.minus.value) - outer.dot(&q.plus.value)
    })
    .faces(inflow, 2 * q + k, move |s| {
        let entering = (p.vector(&s.minus) - g(s)) * negative(flow.vector(&s.minus).dot(&s.n));
        move |q: Trace<Vector>| entering.dot(&q.minus.value)
    })
}

/// Derivative of [`advection`] along the flow, trial w, test q:
///
/// `∫ (w·∇_hp)·q + Σ_Si ∫ {½ sgn(v·n)(w·n)[q] − (w·n){q}}·[p] − ∫_{Γ, v·n<0} (w·n)(p−g)·q`   [6.13]
///
/// Each side of a face sees w by its own trace, so that every block belongs to one cell.
pub fn advection_by_flow<'a>(
    p: &'a Field,
    flow: &'a Field,
    inflow: Faces,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Bilinear<'a, Vector, Vector> {
    let (q, k) = (p.space.degree, flow.space.degree);
    Bilinear::cells(2 * q - 1 + k, move |x| {
        let gradient = p.vector_gradient(&x.site);
        move |w: Vector, q: Vector| (gradient * w.value).dot(&q.value)
    })
    .faces(Faces::INTERIOR, 2 * q + k, move |s| {
        let (jump, n, side) = (jump_of(p, s), s.n, sign(flow.vector(&s.minus).dot(&s.n)));
        let (inner, outer) = (jump * (0.5 * (side - 1.0)), jump * (0.5 * (side + 1.0)));
        move |w: Trace<Vector>, q: Trace<Vector>| {
            w.minus.value.dot(&n) * inner.dot(&q.minus.value) - w.plus.value.dot(&n) * outer.dot(&q.plus.value)
        }
    })
    .faces(inflow, 2 * q + k, move |s| {
        let enters = f64::from(u8::from(flow.vector(&s.minus).dot(&s.n) < 0.0));
        let (defect, n) = ((p.vector(&s.minus) - g(s)) * enters, s.n);
        move |w: Trace<Vector>, q: Trace<Vector>| -w.minus.value.dot(&n) * defect.dot(&q.minus.value)
    })
}

/// `[p]` on an interior face.
fn jump_of(p: &Field, s: &FacePoint) -> Point {
    s.plus.as_ref().map_or_else(Point::zeros, |plus| p.vector(&s.minus) - p.vector(plus))
}

/// `sgn x`, zero at zero.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}
