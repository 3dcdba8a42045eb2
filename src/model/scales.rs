//! The sizes of flow and pressure that increments and residuals are measured by.

use super::Parameters;

/// Rounding of the pressure moves tissue by less than this share of what the pressure could drive.
const PRESSURE: f64 = 1e-3;

/// Of velocity, of pressure, and of the momentum balance. The polarity's is 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    pub velocity: f64,
    pub pressure: f64,
    pub force: f64,
}

impl Scales {
    /// With the root mean square velocity `v` and pressure `Π` of states on a domain of an `area`:
    ///
    /// `V = max(v, (|T_a| + (|S_a| + B)/√|Ω|)/c, 10⁻³ Π/(c√|Ω|))`, `c = C_F + 1/|Ω|`; the force is `c V`, the
    /// pressure `max(Π, c V √|Ω|)`.
    ///
    /// The second velocity is what the polarity can drive, the third what rounding of the pressure may leave. All
    /// change with the units of length and time as the fields themselves do.
    pub fn new(parameters: &Parameters, area: f64, v: f64, pressure: f64) -> Self {
        let (drag, length) = (parameters.friction + 1.0 / area, area.sqrt());
        let driven = parameters.traction.abs() + (parameters.active_stress.abs() + parameters.elasticity) / length;
        let velocity = v.max(driven / drag).max(PRESSURE * pressure / (drag * length));
        Self { velocity, pressure: pressure.max(drag * velocity * length), force: drag * velocity }
    }
}

/// `size/scale`; zero where both are.
pub fn relative(size: f64, scale: f64) -> f64 {
    if size == 0.0 { 0.0 } else { size / scale }
}
