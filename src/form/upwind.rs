//! Advection by upwind fluxes.

use super::integrate::{FacePoint, Faces};
use super::words::{Scalar, Trace, Vector};
use super::{Bilinear, Linear};
use crate::mesh::Point;
use crate::space::{Field, Space};

/// A flow, and the flow whose direction decides on every face which side is upstream.
///
/// Usually they are the same, and `s (v·n) = |v·n|` for `s = sgn(v·n)`. The energy-consistent force freezes the directions for
/// the length of a step, so that it is linear in v.
#[derive(Debug, Clone, Copy)]
pub struct Carrier<'a> {
    pub flow: &'a Field,
    pub sides: &'a Field,
}

impl<'a> From<&'a Field> for Carrier<'a> {
    fn from(flow: &'a Field) -> Self {
        Self { flow, sides: flow }
    }
}

impl Carrier<'_> {
    /// `v·n`
    pub fn speed(&self, s: &FacePoint) -> f64 {
        self.flow.vector(&s.minus).dot(&s.n)
    }

    /// `s = sgn(v·n)`, zero at zero.
    pub fn side(&self, s: &FacePoint) -> f64 {
        let vn = self.sides.vector(&s.minus).dot(&s.n);
        if vn == 0.0 { 0.0 } else { vn.signum() }
    }

    /// `(v·n)⊖` on the boundary.
    pub fn entering(&self, s: &FacePoint) -> f64 {
        if self.side(s) < 0.0 { -self.speed(s) } else { 0.0 }
    }
}

/// `a_upw(φ,χ;v) = ∫ (v·∇_hφ)χ + ∫_Γ (v·n)⊖ φχ + Σ ∫ {½|v·n|[χ] − (v·n){χ}}[φ]`, Γ = `inflow`   [6.13]
pub fn a_upw<'a>(space: &Space, carrier: impl Into<Carrier<'a>>, inflow: Faces) -> Bilinear<'a, Scalar, Scalar> {
    let carrier = carrier.into();
    let flow = carrier.flow;
    let (q, k) = (space.degree, flow.space.degree);
    Bilinear::cells(2 * q - 1 + k, move |x| {
        let v = flow.vector(&x.site);
        move |phi: Scalar, chi: Scalar| v.dot(&phi.grad) * chi.value
    })
    .faces(Faces::INTERIOR, 2 * q + k, move |s| {
        let vn = carrier.speed(s);
        let upstream = 0.5 * carrier.side(s) * vn;
        move |phi: Trace<Scalar>, chi: Trace<Scalar>| (upstream * chi.jump() - vn * chi.mean()) * phi.jump()
    })
    .faces(inflow, 2 * q + k, move |s| {
        let entering = carrier.entering(s);
        move |phi: Trace<Scalar>, chi: Trace<Scalar>| entering * phi.minus.value * chi.minus.value
    })
}

/// `∫_Γ (v·n)⊖ g·q`: what flows in with the value `g` of degree `degree`   [7.11c]
pub fn l_upw<'a>(
    space: &Space,
    carrier: impl Into<Carrier<'a>>,
    inflow: Faces,
    degree: usize,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    let carrier = carrier.into();
    Linear::zero().faces(inflow, space.degree + carrier.flow.space.degree + degree, move |s| {
        let g = g(s) * carrier.entering(s);
        move |q: Trace<Vector>| g.dot(&q.minus.value)
    })
}

/// `a_upw(p,q;v) − ∫_Γ (v·n)⊖ g·q`: advection of `p` with what flows in, as a functional of q   [6.13], [7.11c]
pub fn advection<'a>(
    p: &'a Field,
    carrier: impl Into<Carrier<'a>>,
    inflow: Faces,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    let carrier = carrier.into();
    let flow = carrier.flow;
    let (q, k) = (p.space.degree, flow.space.degree);
    Linear::cells(2 * q - 1 + k, move |x| {
        let carried = p.vector_gradient(&x.site) * flow.vector(&x.site);
        move |q: Vector| carried.dot(&q.value)
    })
    .faces(Faces::INTERIOR, 2 * q + k, move |s| {
        let (vn, upstream, jump) = (carrier.speed(s), carrier.side(s) * carrier.speed(s), jump_of(p, s));
        let (inner, outer) = (jump * (0.5 * (upstream - vn)), jump * (0.5 * (upstream + vn)));
        move |q: Trace<Vector>| inner.dot(&q.minus.value) - outer.dot(&q.plus.value)
    })
    .faces(inflow, 2 * q + k, move |s| {
        let entering = (p.vector(&s.minus) - g(s)) * carrier.entering(s);
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
    carrier: impl Into<Carrier<'a>>,
    inflow: Faces,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Bilinear<'a, Vector, Vector> {
    let carrier = carrier.into();
    let (q, k) = (p.space.degree, carrier.flow.space.degree);
    Bilinear::cells(2 * q - 1 + k, move |x| {
        let gradient = p.vector_gradient(&x.site);
        move |w: Vector, q: Vector| (gradient * w.value).dot(&q.value)
    })
    .faces(Faces::INTERIOR, 2 * q + k, move |s| {
        let (jump, n, side) = (jump_of(p, s), s.n, carrier.side(s));
        let (inner, outer) = (jump * (0.5 * (side - 1.0)), jump * (0.5 * (side + 1.0)));
        move |w: Trace<Vector>, q: Trace<Vector>| {
            w.minus.value.dot(&n) * inner.dot(&q.minus.value) - w.plus.value.dot(&n) * outer.dot(&q.plus.value)
        }
    })
    .faces(inflow, 2 * q + k, move |s| {
        let enters = f64::from(u8::from(carrier.side(s) < 0.0));
        let (defect, n) = ((p.vector(&s.minus) - g(s)) * enters, s.n);
        move |w: Trace<Vector>, q: Trace<Vector>| -w.minus.value.dot(&n) * defect.dot(&q.minus.value)
    })
}

/// `[p]` on an interior face.
fn jump_of(p: &Field, s: &FacePoint) -> Point {
    s.plus.as_ref().map_or_else(Point::zeros, |plus| p.vector(&s.minus) - p.vector(plus))
}
