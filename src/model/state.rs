//! The fields of a sheet at one time.

use crate::space::Field;

/// What keeps account of the volume.
#[derive(Debug, Clone)]
pub enum Volume {
    /// Π, which keeps the flow free of divergence.
    Pressure(Field),
    /// ρ, which the flow carries and compresses.
    Density(Field),
}

/// Velocity, pressure or density, and polarity at one time.
#[derive(Debug, Clone)]
pub struct State {
    /// Velocity.
    pub v: Field,
    /// Pressure or density.
    pub volume: Volume,
    /// Polarity.
    pub p: Field,
}

impl State {
    /// Of an incompressible sheet.
    pub fn incompressible(v: Field, pi: Field, p: Field) -> Self {
        Self { v, volume: Volume::Pressure(pi), p }
    }

    /// Of a compressible sheet.
    pub fn compressible(v: Field, rho: Field, p: Field) -> Self {
        Self { v, volume: Volume::Density(rho), p }
    }

    /// Π, or ρ.
    pub fn volume(&self) -> &Field {
        match &self.volume {
            Volume::Pressure(field) | Volume::Density(field) => field,
        }
    }

    /// Π of an incompressible sheet.
    ///
    /// # Panics
    /// Where the sheet is compressible.
    pub fn pressure(&self) -> &Field {
        match &self.volume {
            Volume::Pressure(pi) => pi,
            Volume::Density(_) => panic!("a compressible sheet has no pressure of its own"),
        }
    }

    /// ρ of a compressible sheet.
    pub fn density(&self) -> Option<&Field> {
        match &self.volume {
            Volume::Pressure(_) => None,
            Volume::Density(rho) => Some(rho),
        }
    }
}

/// Residuals of the stationary equations, each `(rᵀMr/|Ω|)^½`   [9.8], [9.9], [9.10]; that of the momentum balance by
/// the force of `model::scales`.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Residuals {
    /// Of the momentum balance.
    pub velocity: f64,
    /// Of `div v = 0`, or of the transport of the density.
    pub volume: f64,
    /// Of the polarity's equation.
    pub polarity: f64,
}

impl Residuals {
    /// Root of the sum of squares.
    pub fn total(&self) -> f64 {
        self.velocity.hypot(self.volume).hypot(self.polarity)
    }
}
