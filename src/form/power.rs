//! The elastic force of the energy-consistent variant: the power of advection as a functional of the velocity.
//!
//! `X(w) = ∫ (w·∇_hp)·ℓ + Σ_Si ∫ {½ s (w·n)[ℓ] − (w·n){ℓ}}·[p] − ∫_{ΓD, s<0} (w·n)(p−p_D)·ℓ` with `s = sgn(v·n)` equals
//! `a_upw(p,ℓ;v) − ∫_ΓD (v·n)⊖ p_D·ℓ` at `w = v`, quadrature point by quadrature point. Where the velocity condition is
//! natural, [`natural_traction`] keeps `n·σ` what the condition says. Quadrature degrees are those of the advection.

use super::integrate::{FacePoint, Faces};
use super::upwind::Carrier;
use super::words::{Trace, Vector};
use super::{Bilinear, Linear};
use crate::mesh::Point;
use crate::space::{Field, Space};

/// Fields and faces of the functional X.
#[derive(Debug, Clone, Copy)]
pub struct Power<'a, G> {
    /// The polarity.
    pub p: &'a Field,
    /// `ℓ = L_h`, or `L_h/B`.
    pub l: &'a Field,
    /// The flow, and the directions that pick the upwind side: those of the advection. The density is one.
    pub carrier: Carrier<'a>,
    /// Faces with a Dirichlet polarity, and its value there.
    pub inflow: Faces,
    /// What is prescribed of it on Dirichlet faces.
    pub data: G,
}

impl<'a, G: Fn(&FacePoint) -> Point + Sync + Copy + 'a> Power<'a, G> {
    fn degrees(&self) -> (usize, usize) {
        (
            2 * self.p.space.degree - 1 + self.carrier.flow.space.degree,
            2 * self.p.space.degree + self.carrier.flow.space.degree,
        )
    }

    /// `½ sgn(v·n)[ℓ] − {ℓ}` and `[p]` on an interior face.
    fn on_face(&self, s: &FacePoint) -> (Point, Point) {
        let plus = s.plus.as_ref().expect("an interior face");
        let side = self.carrier.side(s);
        let (inner, outer) = (self.l.vector(&s.minus), self.l.vector(plus));
        let flux = inner * (0.5 * (side - 1.0)) - outer * (0.5 * (side + 1.0));
        (flux, self.p.vector(&s.minus) - self.p.vector(plus))
    }

    /// 1 where the flow enters.
    fn enters(&self, s: &FacePoint) -> f64 {
        f64::from(u8::from(self.carrier.side(s) < 0.0))
    }

    /// `X(w)`, test w.
    pub fn force(self) -> Linear<'a, Vector> {
        let (cell, face) = self.degrees();
        let (p, l, inflow) = (self.p, self.l, self.inflow);
        Linear::cells(cell, move |x| {
            let pull = p.vector_gradient(&x.site).transpose() * l.vector(&x.site);
            move |w: Vector| pull.dot(&w.value)
        })
        .faces(Faces::INTERIOR, face, move |s| {
            let (flux, jump) = self.on_face(s);
            let pull = s.n * flux.dot(&jump);
            move |w: Trace<Vector>| pull.dot(&w.minus.value)
        })
        .faces(inflow, face, move |s| {
            let defect = p.vector(&s.minus) - (self.data)(s);
            let pull = s.n * (self.enters(s) * defect.dot(&l.vector(&s.minus)));
            move |w: Trace<Vector>| -pull.dot(&w.minus.value)
        })
    }

    /// Derivative of X along p for a given ℓ: trial φ, test w.
    pub fn by_polarity(self) -> Bilinear<'a, Vector, Vector> {
        let (cell, face) = self.degrees();
        let (l, inflow) = (self.l, self.inflow);
        Bilinear::cells(cell, move |x| {
            let l = l.vector(&x.site);
            move |phi: Vector, w: Vector| (phi.grad * w.value).dot(&l)
        })
        .faces(Faces::INTERIOR, face, move |s| {
            let ((flux, _), n) = (self.on_face(s), s.n);
            move |phi: Trace<Vector>, w: Trace<Vector>| {
                w.minus.value.dot(&n) * flux.dot(&(phi.minus.value - phi.plus.value))
            }
        })
        .faces(inflow, face, move |s| {
            let (pull, n) = (l.vector(&s.minus) * self.enters(s), s.n);
            move |phi: Trace<Vector>, w: Trace<Vector>| -w.minus.value.dot(&n) * pull.dot(&phi.minus.value)
        })
    }

    /// Derivative of X along ℓ: trial λ, test w.
    pub fn by_field(self) -> Bilinear<'a, Vector, Vector> {
        let (cell, face) = self.degrees();
        let (p, inflow) = (self.p, self.inflow);
        Bilinear::cells(cell, move |x| {
            let gradient = p.vector_gradient(&x.site);
            move |lambda: Vector, w: Vector| (gradient * w.value).dot(&lambda.value)
        })
        .faces(Faces::INTERIOR, face, move |s| {
            let ((_, jump), n, side) = (self.on_face(s), s.n, self.carrier.side(s));
            let (inner, outer) = (jump * (0.5 * (side - 1.0)), jump * (0.5 * (side + 1.0)));
            move |lambda: Trace<Vector>, w: Trace<Vector>| {
                w.minus.value.dot(&n) * (inner.dot(&lambda.minus.value) - outer.dot(&lambda.plus.value))
            }
        })
        .faces(inflow, face, move |s| {
            let (defect, n) = ((p.vector(&s.minus) - (self.data)(s)) * self.enters(s), s.n);
            move |lambda: Trace<Vector>, w: Trace<Vector>| -w.minus.value.dot(&n) * defect.dot(&lambda.minus.value)
        })
    }
}

/// `Ψ/B = ¼(|p|²−1)² + ½κ²|∇p|²` at a point   [5.38]
pub fn energy_density(p: &Field, site: &crate::space::field::Site, kappa: f64) -> f64 {
    let well = p.vector(site).norm_squared() - 1.0;
    0.25 * well * well + 0.5 * kappa * kappa * p.vector_gradient(site).norm_squared()
}

/// `∫ (Ψ/B)(w·n) − κ² ∫ (∂_np)·(w·∇p)`, test w: what X shifts the traction by. The first part lives on `open` faces,
/// where `w·n` is free; the second on `dirichlet`, because `∂_np = 0` elsewhere.
pub fn natural_traction<'a>(
    velocity: &Space,
    p: &'a Field,
    kappa: f64,
    open: Faces,
    dirichlet: Faces,
) -> Linear<'a, Vector> {
    let degree = velocity.degree + 4 * p.space.degree;
    Linear::zero()
        .faces(open, degree, move |s| {
            let push = s.n * energy_density(p, &s.minus, kappa);
            move |w: Trace<Vector>| push.dot(&w.minus.value)
        })
        .faces(dirichlet, degree, move |s| {
            let g = p.vector_gradient(&s.minus);
            let pull = g.transpose() * (g * s.n) * (kappa * kappa);
            move |w: Trace<Vector>| -pull.dot(&w.minus.value)
        })
}

/// Derivative of [`natural_traction`] along p, trial φ, test w.
pub fn natural_traction_tangent<'a>(
    velocity: &Space,
    p: &'a Field,
    kappa: f64,
    open: Faces,
    dirichlet: Faces,
) -> Bilinear<'a, Vector, Vector> {
    let (degree, kappa2) = (velocity.degree + 4 * p.space.degree, kappa * kappa);
    Bilinear::zero()
        .faces(open, degree, move |s| {
            let (value, g, n) = (p.vector(&s.minus), p.vector_gradient(&s.minus), s.n);
            let slope = value * (value.norm_squared() - 1.0);
            move |phi: Trace<Vector>, w: Trace<Vector>| {
                w.minus.value.dot(&n) * (slope.dot(&phi.minus.value) + kappa2 * g.dot(&phi.minus.grad))
            }
        })
        .faces(dirichlet, degree, move |s| {
            let (g, n) = (p.vector_gradient(&s.minus), s.n);
            let across = g * n;
            move |phi: Trace<Vector>, w: Trace<Vector>| {
                let w = w.minus.value;
                -kappa2 * ((phi.minus.grad * n).dot(&(g * w)) + across.dot(&(phi.minus.grad * w)))
            }
        })
}
