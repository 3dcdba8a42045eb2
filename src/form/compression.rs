//! The isotropic stress of the compressible sheet: what it costs to crowd, and the isotropic part of the activity.

use super::words::{Scalar, Vector};
use super::{Bilinear, Linear};
use crate::element::quadrature::MAX_TRIANGLE_DEGREE;
use crate::space::{Field, Space};

/// `c_0 ρ^(γ+1) − ½Bρ_min|p|² + S_a'ρ|p|²`, the pressure `ρΠ` and the isotropic active stress   [5.50], [7.34]
///
/// Terms whose parameter is zero are not evaluated. The quadrature is exact where γ is an integer, as long as the rules
/// allow (degree 30 at most with the test function); other powers are integrated as the next integer one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compression {
    /// `c_0`, the density penalty.
    pub penalty: f64,
    /// `γ ≥ 0`.
    pub exponent: f64,
    /// `B`
    pub elasticity: f64,
    /// `ρ_min`, the critical density.
    pub critical: f64,
    /// `S_a'`, the isotropic active stress.
    pub active: f64,
}

impl Compression {
    /// `c_0 ρ^(γ+1) − ½Bρ_min|p|² + S_a'ρ|p|²`, given ρ and `|p|²`.
    pub fn stress(&self, rho: f64, p2: f64) -> f64 {
        let crowding = if self.penalty == 0.0 { 0.0 } else { self.penalty * rho.powf(self.exponent + 1.0) };
        crowding + (self.active * rho - 0.5 * self.elasticity * self.critical) * p2
    }

    /// Its derivative along ρ, `c_0 (γ+1) ρ^γ + S_a'|p|²`.
    pub fn stress_by_density(&self, rho: f64, p2: f64) -> f64 {
        let power = self.exponent + 1.0;
        let crowding = if self.penalty == 0.0 { 0.0 } else { self.penalty * power * rho.powf(self.exponent) };
        crowding + self.active * p2
    }

    /// `(c_0/γ) ρ^(γ+1)`, or `c_0 ρ ln ρ` for γ = 0: the energy `e(ρ)` of crowding.
    ///
    /// Either one has the pressure `ρe′ − e = c_0 ρ^(γ+1)`; this is `(c_0/γ)(ρ^(γ+1) − ρ)` in the limit γ → 0, where
    /// the term linear in ρ, which has no pressure, is what keeps the limit finite.
    pub fn potential(&self, rho: f64) -> f64 {
        if self.penalty == 0.0 || rho == 0.0 {
            return 0.0;
        }
        if self.exponent == 0.0 {
            return self.penalty * rho * rho.ln();
        }
        self.penalty / self.exponent * rho.powf(self.exponent + 1.0)
    }

    /// `e′(ρ)`, finite also where there is no tissue.
    pub fn potential_by_density(&self, rho: f64) -> f64 {
        match (self.penalty, self.exponent) {
            (0.0, _) => 0.0,
            (c, 0.0) => c * (rho.max(f64::MIN_POSITIVE).ln() + 1.0),
            (c, gamma) => c * (gamma + 1.0) / gamma * rho.powf(gamma),
        }
    }

    /// Degree of `ρ^(γ+1)` for a ρ of degree `r`, with room for a factor of degree `test`.
    pub fn power_degree(&self, r: usize, test: usize) -> usize {
        let degree = if self.penalty == 0.0 { 0.0 } else { (self.exponent + 1.0).ceil() * r as f64 };
        // the conversion saturates, and the rules end far below
        (degree as usize).min(MAX_TRIANGLE_DEGREE - test)
    }

    /// Degree of the stress times that of `div w`.
    fn degree(&self, velocity: &Space, rho: &Space, p: &Space) -> usize {
        let test = velocity.degree - 1;
        let of_polarity = if self.active != 0.0 {
            rho.degree + 2 * p.degree
        } else if self.elasticity * self.critical != 0.0 {
            2 * p.degree
        } else {
            0
        };
        test + self.power_degree(rho.degree, test).max(of_polarity)
    }

    /// `b(w, c_0 ρ^(γ+1) − ½Bρ_min|p|² + S_a'ρ|p|²) = −∫ (…) div w`, test w   [7.34]
    pub fn force<'a>(self, velocity: &Space, rho: &'a Field, p: &'a Field) -> Linear<'a, Vector> {
        Linear::cells(self.degree(velocity, &rho.space, &p.space), move |x| {
            let stress = self.stress(rho.scalar(&x.site), p.vector(&x.site).norm_squared());
            move |w: Vector| -stress * w.div()
        })
    }

    /// Derivative of [`Compression::force`] along ρ: `−∫ δρ [c_0 (γ+1) ρ^γ + S_a'|p|²] div w`, trial δρ, test w  
    /// [7.34]
    pub fn by_density<'a>(self, velocity: &Space, rho: &'a Field, p: &'a Field) -> Bilinear<'a, Scalar, Vector> {
        Bilinear::cells(self.degree(velocity, &rho.space, &p.space), move |x| {
            let slope = self.stress_by_density(rho.scalar(&x.site), p.vector(&x.site).norm_squared());
            move |change: Scalar, w: Vector| -slope * change.value * w.div()
        })
    }

    /// Derivative of [`Compression::force`] along p: `−∫ (2S_a'ρ − Bρ_min) p·φ div w`, trial φ, test w   [7.34]
    pub fn by_polarity<'a>(self, velocity: &Space, rho: &'a Field, p: &'a Field) -> Bilinear<'a, Vector, Vector> {
        Bilinear::cells(self.degree(velocity, &rho.space, &p.space), move |x| {
            let weight = 2.0 * self.active * rho.scalar(&x.site) - self.elasticity * self.critical;
            let slope = p.vector(&x.site) * weight;
            move |phi: Vector, w: Vector| -slope.dot(&phi.value) * w.div()
        })
    }
}
