//! Diffusion by the symmetric weighted interior penalty method.

use super::density::Density;
use super::integrate::{FacePoint, Faces};
use super::words::{Scalar, Trace, Vector, penalty_constant};
use super::{Bilinear, Linear};
use crate::mesh::Point;
use crate::space::Space;

/// `a_swip(φ,χ;ρ) = ∫ ρ∇_hφ·∇_hχ + Σ ∫ C ϖ η [φ][χ] − Σ ∫ η ({∂_nφ}[χ] + [φ]{∂_nχ})`, faces interior and Dirichlet   [6.24]
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
