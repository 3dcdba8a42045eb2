//! Stress, diffusion and density source of exact fields with a density.

use super::{Elastic, Matrix, Vector, add_entries};
use crate::model::expression::Taylor;
use crate::model::parameters::{DensityLaw, Parameters};

/// `div(ρ∇p)`, up to degree 1.
#[inline(always)]
pub(super) fn diffusion(density: Taylor, p: &Vector) -> Vector {
    p.map(|p| ((density * p.dx()).dx() + (density * p.dy()).dy()).linear())
}

/// `f_ρ = ∂_tρ + v·∇ρ + ρ div v`
pub(super) fn density_source(v: &Vector, density: &Taylor, rate: f64) -> f64 {
    let (along, across) = (v[0].gradient(), v[1].gradient());
    let advection = v[0].value() * density.gradient().x + v[1].value() * density.gradient().y;
    rate + advection + density.value() * (along.x + across.y)
}

/// `ρΠ = c_0 ρ^(γ+1) − ½Bρ_min|p|²`, up to degree 1. Without a penalty no power is taken: it need not exist.
#[inline(always)]
fn pressure(elasticity: f64, law: &DensityLaw, density: Taylor, square: Taylor) -> Taylor {
    let polar = 0.5 * elasticity * law.critical * square;
    if law.penalty == 0.0 { -polar } else { (law.penalty * density.powf(law.exponent + 1.0) - polar).linear() }
}

/// `ρσ` up to degree 1:
///
/// `ρσ = −ρΠ I + 2ρ[D(v) + (div v) I] + (a+1)/2 p⊗ℓ + (a−1)/2 ℓ⊗p − κ²Bρ ∇pᵀ·∇p − ρ[S_a p⊗p + S_a'|p|² I]`,
/// `ℓ = B{[ρ|p|² − (ρ−ρ_min)] p − κ² div(ρ∇p)}`
pub(super) fn stress(parameters: &Parameters, law: &DensityLaw, v: &Vector, density: Taylor, p: &Vector) -> Matrix {
    let (b, kappa2) = (parameters.elasticity, parameters.coherence * parameters.coherence);
    let rho = density.linear();
    let square = (p[0] * p[0] + p[1] * p[1]).linear();
    let divergence = (v[0].dx() + v[1].dy()).linear();
    let isotropic = rho * (2.0 * divergence - law.active_stress_iso * square) - pressure(b, law, density, square);
    let shear = (rho * (v[0].dy() + v[1].dx())).linear();
    let stretch = |slope: Taylor| (2.0 * (rho * slope) + isotropic).linear();
    let mut sigma = [[stretch(v[0].dx()), shear], [shear, stretch(v[1].dy())]];
    if b != 0.0 {
        let relaxation = (rho * square - rho + law.critical).linear();
        let spread = diffusion(density, p);
        let l = |c: usize| (b * (relaxation * p[c] - kappa2 * spread[c])).linear();
        let elastic = Elastic::new(parameters.alignment, p, [l(0), l(1)]);
        let slope = (kappa2 * b * rho).linear();
        add_entries(&mut sigma, |i, j| (elastic.torque(i, j) - slope * elastic.squares(i, j)).linear());
    }
    if parameters.active_stress != 0.0 {
        add_entries(&mut sigma, |i, j| (-parameters.active_stress * rho * (p[i] * p[j])).linear());
    }
    sigma
}
