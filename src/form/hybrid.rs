//! Diffusion and advection in hybrid form: a trace `p̂`, a polynomial on every inner face, stands between the cells.
//!
//! ```text
//! κ² [∫ ∇p·∇q − Σ_K ∫_∂K (∂_np·(q−q̂) + (p−p̂)·∂_nq)] + Σ_K ∫_∂K τ (p−p̂)·(q−q̂)
//!     + Pe ∫ (v·∇p)·q − Pe Σ_K ∫_∂K (v·n)(p−p̂)·q,      τ = 2κ²Cϖ + Pe|v·n|
//! ```
//! n outwards from K; the part of τ with κ² belongs to diffusion, the other to advection. The rows of q̂ give
//! `p̂ = {p} − κ²[∂_np]/(2τ)`; put back, the interior penalty method and upwind fluxes have one more consistent term
//! each, so the orders are the same. Faces of the boundary are those of [`super::swip`] and [`super::upwind`]. A
//! hybridised method in the sense of Cockburn, Gopalakrishnan and Lazarov (2009), doi:10.1137/070706616.

use super::integrate::{FacePoint, Faces};
use super::side::{Side, SidePoint};
use super::upwind::Carrier;
use super::words::{Scalar, Trace, Vector, penalty_constant};
use super::{Bilinear, Linear};
use crate::form::Density;
use crate::form::swip::l_swip;
use crate::mesh::Point;
use crate::space::{Field, Space, Traces};

/// `∫ ∇φ·∇χ − Σ_K ∫_∂K [∂_nφ (χ−χ̂) + (φ−φ̂) ∂_nχ − 2Cϖ (φ−φ̂)(χ−χ̂)]`; on Dirichlet faces as in
/// [`super::swip::a_swip`].
pub fn a_diffusion<'a>(space: &Space, dirichlet: Faces) -> Bilinear<'a, Scalar, Scalar> {
    let q = space.degree;
    let c = penalty_constant(q);
    Bilinear::cells(2 * (q - 1), move |_| move |phi: Scalar, chi: Scalar| phi.grad.dot(&chi.grad))
        .faces(dirichlet, 2 * q, move |s| {
            let (n, penalty) = (s.n, c * s.varpi);
            move |phi: Trace<Scalar>, chi: Trace<Scalar>| {
                penalty * phi.jump() * chi.jump() - phi.mean_dn(n) * chi.jump() - phi.jump() * chi.mean_dn(n)
            }
        })
        .sides(2 * q, move |s| {
            let (n, tau) = (s.n(), 2.0 * c * s.s.varpi);
            move |phi: Side<Scalar>, chi: Side<Scalar>| {
                let (jump, test) = (phi.inner.value - phi.trace.value, chi.inner.value - chi.trace.value);
                tau * jump * test - phi.inner.grad.dot(&n) * test - jump * chi.inner.grad.dot(&n)
            }
        })
}

/// [`a_diffusion`] at p, less `l_swip(q)` for Dirichlet data `g` of degree `degree`, as a functional of q and q̂.
pub fn diffusion<'a>(
    (p, traces): (&'a Field, &'a Traces),
    dirichlet: Faces,
    degree: usize,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    let q = p.space.degree;
    let c = penalty_constant(q);
    let inner = Linear::cells(2 * (q - 1), move |x| {
        let gradient = p.vector_gradient(&x.site);
        move |q: Vector| gradient.dot(&q.grad)
    })
    .faces(dirichlet, 2 * q, move |s| {
        let (n, value, slope) = (s.n, p.vector(&s.minus), p.vector_gradient(&s.minus) * s.n);
        let pull = value * (c * s.varpi) - slope;
        move |q: Trace<Vector>| pull.dot(&q.jump()) - value.dot(&q.mean_dn(n))
    })
    .sides(2 * q, move |s| {
        let (n, jump) = (s.n(), jump_of(p, traces, s));
        let pull = jump * (2.0 * c * s.s.varpi) - p.vector_gradient(s.own()) * n;
        move |q: Side<Vector>| pull.dot(&(q.inner.value - q.trace.value)) - jump.dot(&(q.inner.grad * n))
    });
    inner - l_swip(&p.space, dirichlet, Density::One, degree, g)
}

/// `F_h` of diffusion over κ²B: `½∫|∇p|² − Σ_K ∫_∂K ∂_np·(p−p̂) + Σ_K ∫_∂K Cϖ|p−p̂|²` over a side of an inner face.
pub fn energy_of_side(p: &Field, traces: &Traces, s: &SidePoint) -> f64 {
    let jump = jump_of(p, traces, s);
    let c = penalty_constant(p.space.degree);
    c * s.s.varpi * jump.norm_squared() - (p.vector_gradient(s.own()) * s.n()).dot(&jump)
}

/// `∫ (v·∇φ)χ + ∫_Γ (v·n)⊖ φχ + Σ_K ∫_∂K [|v·n| (φ−φ̂)(χ−χ̂) − (v·n)(φ−φ̂)χ]`, Γ = `inflow`.
pub fn a_advection<'a>(space: &Space, carrier: impl Into<Carrier<'a>>, inflow: Faces) -> Bilinear<'a, Scalar, Scalar> {
    let carrier = carrier.into();
    let flow = carrier.flow;
    let (q, k) = (space.degree, carrier.degree());
    Bilinear::cells(2 * q - 1 + k, move |x| {
        let v = flow.vector(&x.site);
        move |phi: Scalar, chi: Scalar| v.dot(&phi.grad) * chi.value
    })
    .faces(inflow, 2 * q + k, move |s| {
        let entering = carrier.entering(s);
        move |phi: Trace<Scalar>, chi: Trace<Scalar>| entering * phi.minus.value * chi.minus.value
    })
    .sides(2 * q + k, move |s| {
        let [inner, trace] = weights(&carrier, s);
        move |phi: Side<Scalar>, chi: Side<Scalar>| {
            (phi.inner.value - phi.trace.value) * (inner * chi.inner.value - trace * chi.trace.value)
        }
    })
}

/// [`a_advection`] at p, less `∫_Γ (v·n)⊖ g·q`, as a functional of q and q̂.
pub fn advection<'a>(
    (p, traces): (&'a Field, &'a Traces),
    carrier: impl Into<Carrier<'a>>,
    inflow: Faces,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    let carrier = carrier.into();
    let flow = carrier.flow;
    let (q, k) = (p.space.degree, carrier.degree());
    Linear::cells(2 * q - 1 + k, move |x| {
        let carried = p.vector_gradient(&x.site) * flow.vector(&x.site);
        move |q: Vector| carried.dot(&q.value)
    })
    .faces(inflow, 2 * q + k, move |s| {
        let entering = (p.vector(&s.minus) - g(s)) * carrier.entering(s);
        move |q: Trace<Vector>| entering.dot(&q.minus.value)
    })
    .sides(2 * q + k, move |s| {
        let ([inner, trace], jump) = (weights(&carrier, s), jump_of(p, traces, s));
        move |q: Side<Vector>| jump.dot(&(inner * q.inner.value - trace * q.trace.value))
    })
}

/// Derivative of [`advection`] along the flow, trial w, tests q and q̂:
///
/// `∫ (w·∇p)·q − ∫_{Γ, v·n<0} (w·n)(p−g)·q + Σ_K ∫_∂K (w·n)(p−p̂)·[sgn(v·n)(q−q̂) − q]`
pub fn advection_by_flow<'a>(
    (p, traces): (&'a Field, &'a Traces),
    carrier: impl Into<Carrier<'a>>,
    inflow: Faces,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Bilinear<'a, Vector, Vector> {
    let carrier = carrier.into();
    let (q, k) = (p.space.degree, carrier.degree());
    Bilinear::cells(2 * q - 1 + k, move |x| {
        let gradient = p.vector_gradient(&x.site);
        move |w: Vector, q: Vector| (gradient * w.value).dot(&q.value)
    })
    .faces(inflow, 2 * q + k, move |s| {
        let enters = if carrier.side(s) < 0.0 { 1.0 } else { 0.0 };
        let (defect, n) = ((p.vector(&s.minus) - g(s)) * enters, s.n);
        move |w: Trace<Vector>, q: Trace<Vector>| -w.minus.value.dot(&n) * defect.dot(&q.minus.value)
    })
    .sides(2 * q + k, move |s| {
        let (n, jump, sign) = (s.n(), jump_of(p, traces, s), sign_of(&carrier, s));
        move |w: Side<Vector>, q: Side<Vector>| {
            w.inner.value.dot(&n) * jump.dot(&((sign - 1.0) * q.inner.value - sign * q.trace.value))
        }
    })
}

/// `p − p̂` on a side.
fn jump_of(p: &Field, traces: &Traces, s: &SidePoint) -> Point {
    p.vector(s.own()) - traces.at(s.s.face, s.s.along)
}

/// `sgn(v·n)`, n outwards.
fn sign_of(carrier: &Carrier, s: &SidePoint) -> f64 {
    if s.is_plus { -carrier.side(s.s) } else { carrier.side(s.s) }
}

/// `|v·n| − v·n` and `|v·n|`, n outwards: what `(φ−φ̂)χ` and `−(φ−φ̂)χ̂` are weighed with.
fn weights(carrier: &Carrier, s: &SidePoint) -> [f64; 2] {
    let through = if s.is_plus { -carrier.flux(s.s) } else { carrier.flux(s.s) };
    let size = sign_of(carrier, s) * through;
    [size - through, size]
}
