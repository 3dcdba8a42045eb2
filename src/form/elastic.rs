//! The elastic stress of polarity gradients, and the discrete molecular field and free energy behind it.

use nalgebra::Matrix2;

use super::compression::Compression;
use super::density::Density;
use super::hybrid::energy_of_side;
use super::integrate::{FacePoint, Faces, Integrator};
use super::side::SidePoint;
use super::swip::jump_and_slope;
use super::words::{Scalar, Vector, penalty_constant};
use super::{Bilinear, Linear, mass};
use crate::mesh::Point;
use crate::space::field::Site;
use crate::space::{Field, Space, Traces};

/// `c_h(p,p,w;ρ) = ∫ ρ(∇_hpᵀ·∇_hp) : D(w)`, test w   [7.6d]
pub fn ericksen<'a>(velocity: &Space, p: &'a Field, rho: Density<'a>) -> Linear<'a, Vector> {
    Linear::cells(velocity.degree - 1 + 2 * (p.space.degree - 1) + rho.degree(), move |x| {
        let g = p.vector_gradient(&x.site);
        let product = g.transpose() * g * rho.at(&x.site);
        move |w: Vector| product.dot(&w.sym())
    })
}

/// Derivative of [`ericksen`] along p: `∫ ρ(∇_hφᵀ·∇_hp + ∇_hpᵀ·∇_hφ) : D(w)`, trial φ, test w   [7.6d]
pub fn ericksen_tangent<'a>(velocity: &Space, p: &'a Field, rho: Density<'a>) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(velocity.degree - 1 + 2 * (p.space.degree - 1) + rho.degree(), move |x| {
        let (g, twice) = (p.vector_gradient(&x.site), 2.0 * rho.at(&x.site));
        move |phi: Vector, w: Vector| twice * (phi.grad.transpose() * g).dot(&w.sym())
    })
}

/// Derivative of [`ericksen`] along ρ: `∫ δρ(∇_hpᵀ·∇_hp) : D(w)`, trial δρ, test w   [7.34]
pub fn ericksen_by_density<'a>(velocity: &Space, p: &'a Field, density: &Space) -> Bilinear<'a, Scalar, Vector> {
    Bilinear::cells(velocity.degree - 1 + 2 * (p.space.degree - 1) + density.degree, move |x| {
        let g = p.vector_gradient(&x.site);
        let product = g.transpose() * g;
        move |change: Scalar, w: Vector| change.value * product.dot(&w.sym())
    })
}

/// Derivative of [`double_well`] along p: `∫ q·{[ρ|p|² − (ρ − ρ_min)] I + 2ρ p⊗p}·φ`, trial φ, test q   [7.10]
pub fn double_well_tangent<'a>(
    space: &Space,
    p: &'a Field,
    rho: Density<'a>,
    critical: f64,
) -> Bilinear<'a, Vector, Vector> {
    mass::matrix_mass(space, 2 * p.space.degree + rho.degree(), move |x| {
        let (p, rho) = (p.vector(&x.site), rho.at(&x.site));
        Matrix2::identity() * (rho * p.norm_squared() - (rho - critical)) + p * p.transpose() * (2.0 * rho)
    })
}

/// `∫ [ρ|p|² − (ρ − ρ_min)] p·q`, test q: the double-well part of `(1/B)(L_h|q)`; `critical` is ρ_min   [7.10]
pub fn double_well<'a>(space: &Space, p: &'a Field, rho: Density<'a>, critical: f64) -> Linear<'a, Vector> {
    mass::load(space, 3 * p.space.degree + rho.degree(), move |x| {
        let (p, rho) = (p.vector(&x.site), rho.at(&x.site));
        p * (rho * p.norm_squared() - (rho - critical))
    })
}

/// Derivative of [`double_well`] along ρ: `∫ δρ (|p|²−1) p·q`, trial δρ, test q   [7.34]
pub fn double_well_by_density<'a>(p: &'a Field, density: &Space) -> Bilinear<'a, Scalar, Vector> {
    mass::load_by_density(&p.space, density, 3 * p.space.degree, |x| {
        let p = p.vector(&x.site);
        p * (p.norm_squared() - 1.0)
    })
}

/// `F_h/B = ∫ [¼(|p|²−1)² + ½κ²|∇_hp|²] + κ² Σ_Si∪SD ∫ (½ C ϖ |[p]|² − {∂_np}·[p])`, with `[p] = p − p_D` on Dirichlet
/// faces   [5.38], [7.2]
///
/// In hybrid form `Σ_K ∫_∂K (C ϖ |p−p̂|² − ∂_np·(p−p̂))` over inner faces, and the derivative is that at fixed traces.
/// Dimensionless; multiply by B for the free energy. Its derivative along q is `(1/B)(L_h|q)`.
pub fn energy_over_b(
    loops: &Integrator,
    (p, traces): (&Field, Option<&Traces>),
    kappa: f64,
    dirichlet: Faces,
    data: impl Fn(&FacePoint) -> Point + Sync,
) -> f64 {
    let q = p.space.degree;
    // the degrees are those of the forms of L_h, so that it is the derivative on curved cells, too
    let well = loops.sum(4 * q, |x| 0.25 * (p.vector(&x.site).norm_squared() - 1.0).powi(2));
    let slope = loops.sum(2 * (q - 1), |x| 0.5 * p.vector_gradient(&x.site).norm_squared());
    let c = penalty_constant(q);
    let face = loops.sum_faces(Faces::INTERIOR | dirichlet, 2 * q, |s| {
        if let (Some(_), Some(traces)) = (&s.plus, traces) {
            return [false, true].map(|is_plus| energy_of_side(p, traces, &SidePoint { s, is_plus })).iter().sum();
        }
        let inner = p.vector_gradient(&s.minus) * s.n;
        let (jump, slope) = match &s.plus {
            Some(plus) => (p.vector(&s.minus) - p.vector(plus), (inner + p.vector_gradient(plus) * s.n) * 0.5),
            None => (p.vector(&s.minus) - data(s), inner),
        };
        0.5 * c * s.varpi * jump.norm_squared() - slope.dot(&jump)
    });
    well + kappa * kappa * (slope + face)
}

/// The polarity's part of the free energy of the compressible sheet: κ, and its Dirichlet faces with data of degree
/// `degree`   [5.39]
///
/// `∫ (ρ ¼(|p|²−1)² + ½ρ_min|p|² + ½κ²ρ|∇_hp|²) + κ² Σ_Si∪SD ∫ η (½Cϖ|[p]|² − {∂_np}·[p])`, with `[p] = p − g` on
/// Dirichlet faces. It is linear in the weights ρ, η and ρ_min: others give its derivative along ρ.
#[derive(Debug, Clone, Copy)]
pub struct PolarEnergy<'a, G> {
    /// Over the tissue.
    pub loops: &'a Integrator,
    /// The polarity.
    pub p: &'a Field,
    /// κ
    pub kappa: f64,
    /// Faces where the polarity is prescribed.
    pub dirichlet: Faces,
    /// Polynomial degree of what is prescribed.
    pub degree: usize,
    /// What is prescribed.
    pub data: G,
}

impl<G: Fn(&FacePoint) -> Point + Sync> PolarEnergy<'_, G> {
    /// With weights of degree `r`: in the cells, on the faces, and of `½|p|²`. Every term has the quadrature of its
    /// form in `L_h`, that of `l_swip` for what the data multiply.
    fn weighed(
        &self,
        r: usize,
        cell: impl Fn(&Site) -> f64 + Sync,
        face: impl Fn(&FacePoint) -> f64 + Sync,
        critical: f64,
    ) -> f64 {
        let (p, loops, q) = (self.p, self.loops, self.p.space.degree);
        let well = loops.sum(4 * q + r, |x| {
            let p2 = p.vector(&x.site).norm_squared();
            0.25 * cell(&x.site) * (p2 - 1.0).powi(2) + 0.5 * critical * p2
        });
        let slope = loops.sum(2 * (q - 1) + r, |x| 0.5 * cell(&x.site) * p.vector_gradient(&x.site).norm_squared());
        let c = penalty_constant(q);
        let jumps = loops.sum_faces(Faces::INTERIOR | self.dirichlet, 2 * q + r, |s| {
            let (jump, slope) = jump_and_slope(p, s);
            face(s) * (0.5 * c * s.varpi * jump.norm_squared() - slope.dot(&jump))
        });
        let imposed = loops.sum_faces(self.dirichlet, q + r + self.degree, |s| {
            let (g, (value, slope)) = ((self.data)(s), jump_and_slope(p, s));
            face(s) * (c * s.varpi * (0.5 * g - value) + slope).dot(&g)
        });
        well + self.kappa * self.kappa * (slope + jumps + imposed)
    }

    /// The free energy `∫ e(ρ)` and B times the polarity's part, `e(ρ)` that of [`Compression::potential`]   [5.39]
    ///
    /// Its derivative along q is `B∫[ρ|p|² − (ρ−ρ_min)] p·q + κ²B [a_swip(p,q;ρ) − l_swip(q;ρ)]` to rounding.
    pub fn with(&self, rho: &Field, compression: &Compression) -> f64 {
        let r = rho.space.degree;
        let crowding = match compression.penalty {
            0.0 => 0.0,
            _ => self.loops.sum(compression.power_degree(r, 0), |x| compression.potential(rho.scalar(&x.site))),
        };
        if compression.elasticity == 0.0 {
            return crowding;
        }
        let weight = Density::Of(rho);
        let polar = self.weighed(r, |x| weight.at(x), |s| weight.harmonic(s), compression.critical);
        crowding + compression.elasticity * polar
    }

    /// Derivative of [`PolarEnergy::with`] along ρ in the direction `rate`   [5.39]
    pub fn along(&self, rho: &Field, rate: &Field, compression: &Compression) -> f64 {
        let r = rho.space.degree;
        let crowding = match compression.penalty {
            0.0 => 0.0,
            _ => self.loops.sum(compression.power_degree(r, 0), |x| {
                compression.potential_by_density(rho.scalar(&x.site)) * rate.scalar(&x.site)
            }),
        };
        if compression.elasticity == 0.0 {
            return crowding;
        }
        let change = |s: &FacePoint| {
            let [inner, outer] = Density::Of(rho).harmonic_slopes(s);
            inner * rate.scalar(&s.minus) + s.plus.as_ref().map_or(0.0, |plus| outer * rate.scalar(plus))
        };
        crowding + compression.elasticity * self.weighed(r, |x| rate.scalar(x), change, 0.0)
    }
}
