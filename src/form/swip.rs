//! Diffusion by the symmetric weighted interior penalty method (Ern, Stephansen and Zunino 2009).

use super::density::Density;
use super::integrate::{FacePoint, Faces};
use super::words::{Scalar, Trace, Vector, penalty_constant};
use super::{Bilinear, Linear};
use crate::mesh::Point;
use crate::space::{Field, Space};

/// `a_swip(φ,χ;ρ) = ∫ ρ∇_hφ·∇_hχ + Σ ∫ C ϖ η [φ][χ] − Σ ∫ η ({∂_nφ}[χ] + [φ]{∂_nχ})`, faces interior and Dirichlet  
/// [6.24]
///
/// η is not a polynomial; the faces are integrated as if it had the degree of ρ, which it has where ρ is continuous.
pub fn a_swip<'a>(space: &Space, dirichlet: Faces, rho: Density<'a>) -> Bilinear<'a, Scalar, Scalar> {
    let (q, r) = (space.degree, rho.degree());
    let c = penalty_constant(q);
    Bilinear::cells(2 * (q - 1) + r, move |x| {
        let rho = rho.at(&x.site);
        move |phi: Scalar, chi: Scalar| rho * phi.grad.dot(&chi.grad)
    })
    .faces(Faces::INTERIOR | dirichlet, 2 * q + r, move |s| {
        let (n, penalty, eta) = (s.n, c * s.varpi, rho.harmonic(s));
        move |phi: Trace<Scalar>, chi: Trace<Scalar>| {
            eta * (penalty * phi.jump() * chi.jump() - phi.mean_dn(n) * chi.jump() - phi.jump() * chi.mean_dn(n))
        }
    })
}

/// `l_swip(q;ρ) = Σ_SD ∫ C ϖ ρ g·q − Σ_SD ∫ ρ g·∂_n q` for Dirichlet data `g` of degree `degree`   [6.25]
pub fn l_swip<'a>(
    space: &Space,
    dirichlet: Faces,
    rho: Density<'a>,
    degree: usize,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    let c = penalty_constant(space.degree);
    Linear::zero().faces(dirichlet, space.degree + rho.degree() + degree, move |s| {
        let (g, n, penalty) = (g(s) * rho.mean(s), s.n, c * s.varpi);
        move |q: Trace<Vector>| penalty * g.dot(&q.minus.value) - g.dot(&(q.minus.grad * n))
    })
}

/// `a_swip(p,q;ρ) − l_swip(q;ρ)` for Dirichlet data `g` of degree `degree`, as a functional of q   [6.24], [6.25]
pub fn diffusion<'a>(
    p: &'a Field,
    dirichlet: Faces,
    rho: Density<'a>,
    degree: usize,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    let (q, r) = (p.space.degree, rho.degree());
    let c = penalty_constant(q);
    let inner = Linear::cells(2 * (q - 1) + r, move |x| {
        let gradient = p.vector_gradient(&x.site) * rho.at(&x.site);
        move |q: Vector| gradient.dot(&q.grad)
    })
    .faces(Faces::INTERIOR | dirichlet, 2 * q + r, move |s| {
        let (n, eta, (jump, slope)) = (s.n, rho.harmonic(s), jump_and_slope(p, s));
        let (pull, jump) = ((jump * (c * s.varpi) - slope) * eta, jump * eta);
        move |q: Trace<Vector>| pull.dot(&q.jump()) - jump.dot(&q.mean_dn(n))
    });
    inner - l_swip(&p.space, dirichlet, rho, degree, g)
}

/// Derivative of `a_swip(p,q;ρ) − l_swip(q;ρ)` along ρ, trial δρ, test q:
///
/// `∫ δρ ∇_hp:∇_hq + Σ ∫ δη {Cϖ [p]·[q] − {∂_np}·[q] − [p]·{∂_nq}} − Σ_SD ∫ δρ (Cϖ g·q − g·∂_nq)`,
/// `δη = 2(ρ+² δρ− + ρ−² δρ+)/(ρ− + ρ+)²`, and `δη = δρ` on Dirichlet faces   [7.34]
pub fn by_density<'a>(
    p: &'a Field,
    rho: &'a Field,
    dirichlet: Faces,
    degree: usize,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Bilinear<'a, Scalar, Vector> {
    let (q, r) = (p.space.degree, rho.space.degree);
    let c = penalty_constant(q);
    Bilinear::cells(2 * (q - 1) + r, move |x| {
        let gradient = p.vector_gradient(&x.site);
        move |change: Scalar, q: Vector| change.value * gradient.dot(&q.grad)
    })
    .faces(Faces::INTERIOR | dirichlet, 2 * q + r, move |s| {
        let (n, [inner, outer]) = (s.n, Density::Of(rho).harmonic_slopes(s));
        let (jump, slope) = jump_and_slope(p, s);
        let pull = jump * (c * s.varpi) - slope;
        move |change: Trace<Scalar>, q: Trace<Vector>| {
            let change = inner * change.minus.value + outer * change.plus.value;
            change * (pull.dot(&q.jump()) - jump.dot(&q.mean_dn(n)))
        }
    })
    .faces(dirichlet, q + r + degree, move |s| {
        let (g, n, penalty) = (g(s), s.n, c * s.varpi);
        move |change: Trace<Scalar>, q: Trace<Vector>| {
            change.minus.value * (g.dot(&(q.minus.grad * n)) - penalty * g.dot(&q.minus.value))
        }
    })
}

/// `[p]` and `{∂_np}`; the inner traces on the boundary.
pub(super) fn jump_and_slope(p: &Field, s: &FacePoint) -> (Point, Point) {
    let (value, slope) = (p.vector(&s.minus), p.vector_gradient(&s.minus) * s.n);
    match &s.plus {
        Some(plus) => (value - p.vector(plus), (slope + p.vector_gradient(plus) * s.n) * 0.5),
        None => (value, slope),
    }
}
