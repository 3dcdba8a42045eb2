//! The density as the weight of a form.

use super::integrate::FacePoint;
use crate::space::Field;
use crate::space::field::Site;

/// The weight ρ of a form: one in the incompressible sheet, a discontinuous scalar field in the compressible one.
#[derive(Debug, Clone, Copy)]
pub enum Density<'a> {
    /// That of an incompressible sheet.
    One,
    /// A field.
    Of(&'a Field),
}

impl Density<'_> {
    /// Polynomial degree of ρ.
    pub fn degree(&self) -> usize {
        match self {
            Density::One => 0,
            Density::Of(rho) => rho.space.degree,
        }
    }

    /// ρ at a point of a cell.
    pub fn at(&self, site: &Site) -> f64 {
        match self {
            Density::One => 1.0,
            Density::Of(rho) => rho.scalar(site),
        }
    }

    /// `{ρ} = ½(ρ− + ρ+)`; the inner trace on the boundary.
    pub fn mean(&self, s: &FacePoint) -> f64 {
        match (self, &s.plus) {
            (Density::One, _) => 1.0,
            (Density::Of(rho), None) => rho.scalar(&s.minus),
            (Density::Of(rho), Some(plus)) => 0.5 * (rho.scalar(&s.minus) + rho.scalar(plus)),
        }
    }

    /// `η = 2ρ−ρ+/(ρ− + ρ+)`, 0 where both vanish; the inner trace on the boundary.
    ///
    /// `η{φ} = {ρφ}_ω`, the mean with the weights `ω∓ = ρ±/(ρ− + ρ+)`.
    pub fn harmonic(&self, s: &FacePoint) -> f64 {
        match (self, &s.plus) {
            (Density::One, _) => 1.0,
            (Density::Of(rho), None) => rho.scalar(&s.minus),
            (Density::Of(rho), Some(plus)) => {
                let (inner, outer) = (rho.scalar(&s.minus), rho.scalar(plus));
                let sum = inner + outer;
                if sum == 0.0 { 0.0 } else { 2.0 * inner * outer / sum }
            }
        }
    }

    /// `∂η/∂ρ∓ = 2ρ±²/(ρ− + ρ+)²`, 0 where both vanish; 1 and 0 on the boundary.
    pub fn harmonic_slopes(&self, s: &FacePoint) -> [f64; 2] {
        let Some(plus) = &s.plus else { return [1.0, 0.0] };
        match self {
            Density::One => [0.5; 2],
            Density::Of(rho) => {
                let (inner, outer) = (rho.scalar(&s.minus), rho.scalar(plus));
                let sum = inner + outer;
                if sum == 0.0 { [0.0; 2] } else { [outer, inner].map(|other| 2.0 * (other / sum).powi(2)) }
            }
        }
    }
}
