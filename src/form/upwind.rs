//! Advection by upwind fluxes.

use super::density::Density;
use super::integrate::{FacePoint, Faces};
use super::words::{Scalar, Trace, Vector};
use super::{Bilinear, Linear};
use crate::mesh::Point;
use crate::space::{Field, Space};

/// A flow, the density that it carries along, and the flow whose direction decides on every face which side is
/// upstream.
///
/// Usually they are the same, and `s (v·n) = |v·n|` for `s = sgn(v·n)`. The energy-consistent force freezes the
/// directions for the length of a step, so that it is linear in v.
#[derive(Debug, Clone, Copy)]
pub struct Carrier<'a> {
    /// The velocity that carries.
    pub flow: &'a Field,
    /// The velocity whose direction decides which side of a face is upstream.
    pub sides: &'a Field,
    /// ρ of `a_upw(φ,χ;ρv)`: the carrier is ρv in the cells and `{ρ}v` on the faces.
    pub density: Density<'a>,
}

impl<'a> From<&'a Field> for Carrier<'a> {
    fn from(flow: &'a Field) -> Self {
        Self { flow, sides: flow, density: Density::One }
    }
}

impl Carrier<'_> {
    /// Polynomial degree of ρv.
    pub fn degree(&self) -> usize {
        self.flow.space.degree + self.density.degree()
    }

    /// `{ρ}(v·n)`; ρ is the inner trace on the boundary.
    pub fn flux(&self, s: &FacePoint) -> f64 {
        self.flow.vector(&s.minus).dot(&s.n) * self.density.mean(s)
    }

    /// `s = sgn(v·n)`, zero at zero.
    pub fn side(&self, s: &FacePoint) -> f64 {
        let vn = self.sides.vector(&s.minus).dot(&s.n);
        if vn == 0.0 { 0.0 } else { vn.signum() }
    }

    /// `ρ(v·n)⊖` on the boundary.
    pub fn entering(&self, s: &FacePoint) -> f64 {
        if self.side(s) < 0.0 { -self.flux(s) } else { 0.0 }
    }

    /// `ρ(v·n)⊕` on the boundary.
    pub fn leaving(&self, s: &FacePoint) -> f64 {
        if self.side(s) > 0.0 { self.flux(s) } else { 0.0 }
    }
}

/// `a_upw(φ,χ;v) = ∫ (v·∇_hφ)χ + ∫_Γ (v·n)⊖ φχ + Σ ∫ {½|v·n|[χ] − (v·n){χ}}[φ]`, Γ = `inflow`   [6.13]
///
/// With a density, ρv takes the place of v in the cells and `{ρ}v` on the faces (6.2.I in the source).
pub fn a_upw<'a>(space: &Space, carrier: impl Into<Carrier<'a>>, inflow: Faces) -> Bilinear<'a, Scalar, Scalar> {
    let carrier = carrier.into();
    let flow = carrier.flow;
    let (q, k) = (space.degree, carrier.degree());
    Bilinear::cells(2 * q - 1 + k, move |x| {
        let v = flow.vector(&x.site) * carrier.density.at(&x.site);
        move |phi: Scalar, chi: Scalar| v.dot(&phi.grad) * chi.value
    })
    .faces(Faces::INTERIOR, 2 * q + k, move |s| {
        let vn = carrier.flux(s);
        let upstream = 0.5 * carrier.side(s) * vn;
        move |phi: Trace<Scalar>, chi: Trace<Scalar>| (upstream * chi.jump() - vn * chi.mean()) * phi.jump()
    })
    .faces(inflow, 2 * q + k, move |s| {
        let entering = carrier.entering(s);
        move |phi: Trace<Scalar>, chi: Trace<Scalar>| entering * phi.minus.value * chi.minus.value
    })
}

/// `∫_Γ ρ(v·n)⊖ g·q`: what flows in with the value `g` of degree `degree`   [7.11c]
pub fn l_upw<'a>(
    space: &Space,
    carrier: impl Into<Carrier<'a>>,
    inflow: Faces,
    degree: usize,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    let carrier = carrier.into();
    Linear::zero().faces(inflow, space.degree + carrier.degree() + degree, move |s| {
        let g = g(s) * carrier.entering(s);
        move |q: Trace<Vector>| g.dot(&q.minus.value)
    })
}

/// `a_upw(p,q;ρv) − ∫_Γ ρ(v·n)⊖ g·q`: advection of `p` with what flows in, as a functional of q   [6.13], [7.11c]
pub fn advection<'a>(
    p: &'a Field,
    carrier: impl Into<Carrier<'a>>,
    inflow: Faces,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    let carrier = carrier.into();
    let flow = carrier.flow;
    let (q, k) = (p.space.degree, carrier.degree());
    Linear::cells(2 * q - 1 + k, move |x| {
        let carried = p.vector_gradient(&x.site) * flow.vector(&x.site) * carrier.density.at(&x.site);
        move |q: Vector| carried.dot(&q.value)
    })
    .faces(Faces::INTERIOR, 2 * q + k, move |s| {
        let (vn, upstream, jump) = (carrier.flux(s), carrier.side(s) * carrier.flux(s), jump_of(p, s));
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
/// `∫ ρ(w·∇_hp)·q + Σ_Si ∫ {ρ}{½ sgn(v·n)(w·n)[q] − (w·n){q}}·[p] − ∫_{Γ, v·n<0} ρ(w·n)(p−g)·q`   [6.13]
///
/// Each side of a face sees w by its own trace, so that every block belongs to one cell.
pub fn advection_by_flow<'a>(
    p: &'a Field,
    carrier: impl Into<Carrier<'a>>,
    inflow: Faces,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Bilinear<'a, Vector, Vector> {
    let carrier = carrier.into();
    let (q, k, rho) = (p.space.degree, carrier.degree(), carrier.density);
    Bilinear::cells(2 * q - 1 + k, move |x| {
        let gradient = p.vector_gradient(&x.site) * rho.at(&x.site);
        move |w: Vector, q: Vector| (gradient * w.value).dot(&q.value)
    })
    .faces(Faces::INTERIOR, 2 * q + k, move |s| {
        let (jump, n, side) = (jump_of(p, s) * rho.mean(s), s.n, carrier.side(s));
        let (inner, outer) = (jump * (0.5 * (side - 1.0)), jump * (0.5 * (side + 1.0)));
        move |w: Trace<Vector>, q: Trace<Vector>| {
            w.minus.value.dot(&n) * inner.dot(&q.minus.value) - w.plus.value.dot(&n) * outer.dot(&q.plus.value)
        }
    })
    .faces(inflow, 2 * q + k, move |s| {
        let enters = if carrier.side(s) < 0.0 { rho.mean(s) } else { 0.0 };
        let (defect, n) = ((p.vector(&s.minus) - g(s)) * enters, s.n);
        move |w: Trace<Vector>, q: Trace<Vector>| -w.minus.value.dot(&n) * defect.dot(&q.minus.value)
    })
}

/// Derivative of [`advection`] along the density, trial δρ in the space `density`, test q:
///
/// `∫ δρ (v·∇_hp)·q + Σ_Si ∫ {δρ}{½|v·n|[q] − (v·n){q}}·[p] + ∫_Γ δρ (v·n)⊖ (p−g)·q`   [7.34]
///
/// The advection is linear in ρ, so the carrier's own density does not matter.
pub fn advection_by_density<'a>(
    p: &'a Field,
    carrier: impl Into<Carrier<'a>>,
    density: &Space,
    inflow: Faces,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Bilinear<'a, Scalar, Vector> {
    let carrier = Carrier { density: Density::One, ..carrier.into() };
    let flow = carrier.flow;
    let (q, k) = (p.space.degree, carrier.degree() + density.degree);
    Bilinear::cells(2 * q - 1 + k, move |x| {
        let carried = p.vector_gradient(&x.site) * flow.vector(&x.site);
        move |change: Scalar, q: Vector| change.value * carried.dot(&q.value)
    })
    .faces(Faces::INTERIOR, 2 * q + k, move |s| {
        let (vn, jump) = (carrier.flux(s), jump_of(p, s));
        let upstream = 0.5 * carrier.side(s) * vn;
        move |change: Trace<Scalar>, q: Trace<Vector>| change.mean() * (upstream * q.jump() - vn * q.mean()).dot(&jump)
    })
    .faces(inflow, 2 * q + k, move |s| {
        let entering = (p.vector(&s.minus) - g(s)) * carrier.entering(s);
        move |change: Trace<Scalar>, q: Trace<Vector>| change.minus.value * entering.dot(&q.minus.value)
    })
}

/// `[p]` on an interior face.
fn jump_of(p: &Field, s: &FacePoint) -> Point {
    s.plus.as_ref().map_or_else(Point::zeros, |plus| p.vector(&s.minus) - p.vector(plus))
}
