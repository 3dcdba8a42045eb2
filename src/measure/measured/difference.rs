//! How far a measured field is from a computed one.

use super::Binned;
use crate::mesh::Point;

/// Sums over the bins that both fields fill, each with its weight `w`: the part of the bin that lies in the tissue. `e`
/// is measured less computed, `v` computed.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Bins that were compared.
    pub bins: usize,
    /// `(Σ w |e|² / Σ w |v|²)^½`
    pub relative: f64,
    /// `(Σ w e_c² / Σ w |v|²)^½`; the squares of both add up to that of `relative`.
    pub relative_by_component: [f64; 2],
    /// `Σ w e_c / Σ w`
    pub bias: [f64; 2],
    /// Of the components, about their means; NaN where one is constant.
    pub correlation: [f64; 2],
    /// `max |e|`, and where.
    pub largest: f64,
    /// Middle of the bin in which the difference is largest.
    pub largest_at: Point,
    /// `(Σ w var / Σ w |v|²)^½`: the relative distance that the scatter of the data alone makes.
    pub noise: f64,
}

impl Difference {
    /// Compares two fields on the same bins, within `|x_1| ≤ window`; `shares` are the weights. `None` if no bin is
    /// left.
    pub fn of(measured: &Binned, computed: &Binned, shares: &[f64], window: f64) -> Option<Self> {
        let bins: Vec<usize> = (0..shares.len())
            .filter(|&bin| measured.is_filled(bin) && computed.is_filled(bin) && shares[bin] > 0.0)
            .filter(|&bin| measured.bins.centre(bin).x.abs() <= window)
            .collect();
        let sum = |f: &dyn Fn(usize) -> f64| bins.iter().map(|&bin| shares[bin] * f(bin)).sum::<f64>();
        let error = |bin: usize| measured.values[bin] - computed.values[bin];
        let total = sum(&|_| 1.0);
        let norm = sum(&|bin| computed.values[bin].norm_squared());
        let largest_at = *bins.iter().max_by(|a, b| error(**a).norm().total_cmp(&error(**b).norm()))?;
        let correlation = |c: usize| {
            let mean = |field: &Binned| sum(&|bin| field.values[bin][c]) / total;
            let (m, n) = (mean(measured), mean(computed));
            let about = |bin: usize| (measured.values[bin][c] - m, computed.values[bin][c] - n);
            let product = sum(&|bin| about(bin).0 * about(bin).1);
            product / (sum(&|bin| about(bin).0.powi(2)) * sum(&|bin| about(bin).1.powi(2))).sqrt()
        };
        Some(Self {
            bins: bins.len(),
            relative: (sum(&|bin| error(bin).norm_squared()) / norm).sqrt(),
            relative_by_component: [0, 1].map(|c| (sum(&|bin| error(bin)[c].powi(2)) / norm).sqrt()),
            bias: [0, 1].map(|c| sum(&|bin| error(bin)[c]) / total),
            correlation: [0, 1].map(correlation),
            largest: error(largest_at).norm(),
            largest_at: measured.bins.centre(largest_at),
            noise: (sum(&|bin| measured.variances[bin].sum()) / norm).sqrt(),
        })
    }

    /// `(relative² − noise²)^½`: what is left of the distance when the scatter of the data is taken out, 0 if nothing
    /// is.
    pub fn without_noise(&self) -> f64 {
        (self.relative.powi(2) - self.noise.powi(2)).max(0.0).sqrt()
    }
}

/// `100 (max v_1 − 1)` on `x_2 = 0`, `from ≤ x_1 ≤ to`, and the `x_1` of the maximum; `None` without values there.
pub fn overshoot(field: &Binned, from: f64, to: f64) -> Option<(f64, f64)> {
    let nx = field.bins.count[0];
    // linear in between
    let centres = (0..nx).map(|i| field.bins.centre(i).x).filter(|x1| (from..=to).contains(x1));
    let values = centres.chain([from, to]).filter_map(|x1| Some((field.at(Point::new(x1, 0.0))?.x, x1)));
    values.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(most, x1)| (100.0 * (most - 1.0), x1))
}
