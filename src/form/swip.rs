//! Diffusion by the symmetric weighted interior penalty method.

use super::integrate::{FacePoint, Faces};
use super::words::{Scalar, Trace, Vector, penalty_constant};
use super::{Bilinear, Linear};
use crate::mesh::Point;
use crate::space::Space;

/// `a_swip(φ,χ) = ∫ ∇_hφ·∇_hχ + Σ ∫ C ϖ [φ][χ] − Σ ∫ ({∂_nφ}[χ] + [φ]{∂_nχ})`, faces interior and Dirichlet   [6.24]
pub fn a_swip<'a>(space: &Space, dirichlet: Faces) -> Bilinear<'a, Scalar, Scalar> {
    let q = space.degree;
    let c = penalty_constant(q);
    Bilinear::cells(2 * (q - 1), |_| |phi: Scalar, chi: Scalar| phi.grad.dot(&chi.grad)).faces(
        Faces::INTERIOR | dirichlet,
        2 * q,
        move |s| {
            let (n, penalty) = (s.n, c * s.varpi);
            move |phi: Trace<Scalar>, chi: Trace<Scalar>| {
                penalty * phi.jump() * chi.jump() - phi.mean_dn(n) * chi.jump() - phi.jump() * chi.mean_dn(n)
            }
        },
    )
}

/// `l_swip(q) = Σ_SD ∫ C ϖ g·q − Σ_SD ∫ g·∂_n q` for Dirichlet data `g` of degree `degree`   [6.25]
pub fn l_swip<'a>(
    space: &Space,
    dirichlet: Faces,
    degree: usize,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    let c = penalty_constant(space.degree);
    Linear::zero().faces(dirichlet, space.degree + degree, move |s| {
        let (g, n, penalty) = (g(s), s.n, c * s.varpi);
        move |q: Trace<Vector>| penalty * g.dot(&q.minus.value) - g.dot(&(q.minus.grad * n))
    })
}
