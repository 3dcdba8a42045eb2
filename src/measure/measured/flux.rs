//! The correction that keeps the flux at both ends of a window.

use serde::Serialize;

use super::Binned;
use crate::measure::MeasureError;
use crate::mesh::Point;

/// Means of `v_1` across the band at both ends of the window `[−l, l]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Flux {
    /// `l`
    pub window: f64,
    /// `Q− = Q(−l)`
    pub minus: f64,
    /// `Q+ = Q(l)`
    pub plus: f64,
}

impl Binned {
    /// `Q(x_1)`: mean of `v_1` over the filled bins of a column, linear between the centres of columns. `None` outside
    /// of the box, or without filled bins.
    pub fn flux(&self, x1: f64) -> Option<f64> {
        let [nx, ny] = self.bins.count;
        let corners = self.bins.around(Point::new(x1, self.bins.low.y))?;
        let column = |i: usize| {
            let filled = (0..ny).map(|j| j * nx + i).filter(|bin| self.is_filled(*bin));
            let (sum, n) = filled.fold((0.0, 0), |(sum, n), bin| (sum + self.values[bin].x, n + 1));
            (n > 0).then(|| sum / f64::from(n))
        };
        let (first, last) = (corners[0], corners[1]);
        let share = last.1 / (first.1 + last.1);
        match share {
            0.0 => column(first.0 % nx),
            1.0 => column(last.0 % nx),
            share => Some((1.0 - share) * column(first.0 % nx)? + share * column(last.0 % nx)?),
        }
    }

    /// `ṽ_1 = 2/(Q− + Q+) · (v_1 − (Q+ − Q−) x_1/(2l))`, `ṽ_2 = 2/(Q− + Q+) · v_2`   [11.1–11.3]
    ///
    /// Removes the linear trend that a free front leaves, and makes the flux 1 at both ends. The errors of `Q±` are not
    /// in the variances.
    ///
    /// # Errors
    /// No cells at an end of the window, or no flux.
    pub fn flux_kept(&self, window: f64) -> Result<(Self, Flux), MeasureError> {
        let end = |x1: f64| self.flux(x1).ok_or(MeasureError::NoCells { x1 });
        let flux = Flux { window, minus: end(-window)?, plus: end(window)? };
        let (sum, difference) = (flux.minus + flux.plus, flux.plus - flux.minus);
        if sum.abs() <= 1e-12 * (flux.minus.abs() + flux.plus.abs()) {
            return Err(MeasureError::NoFlux { window, minus: flux.minus, plus: flux.plus });
        }
        let factor = 2.0 / sum;
        let mut kept = self.clone();
        for bin in 0..self.bins.len() {
            let trend = difference * self.bins.centre(bin).x / (2.0 * window);
            kept.values[bin] = factor * (self.values[bin] - Point::new(trend, 0.0));
            kept.variances[bin] *= factor * factor;
        }
        Ok((kept, flux))
    }
}
