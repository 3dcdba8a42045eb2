//! A vector field on bins, some of which are empty.

use super::Bins;
use crate::mesh::Point;

/// Widths of the Gaussian beyond which it counts as zero, in deviations.
const REACH: f64 = 4.0;

/// Values, their variances and weights; a bin of weight 0 is empty.
#[derive(Debug, Clone, PartialEq)]
pub struct Binned {
    /// Where the values are.
    pub bins: Bins,
    /// The mean of each bin; NaN where there is none.
    pub values: Vec<Point>,
    /// Of each component; NaN where the data say nothing.
    pub variances: Vec<Point>,
    /// How much each bin counts; 0 of one that is empty.
    pub weights: Vec<f64>,
}

impl Binned {
    /// No bin is filled.
    pub fn empty(bins: Bins) -> Self {
        let zeros = vec![Point::zeros(); bins.len()];
        Self { bins, values: zeros.clone(), variances: zeros, weights: vec![0.0; bins.len()] }
    }

    /// Whether a bin has a value.
    pub fn is_filled(&self, bin: usize) -> bool {
        self.weights[bin] > 0.0
    }

    /// Normalised convolution with a Gaussian `G` of this deviation, in bins: `Σ G w u / Σ G w`, and the variance
    /// `Σ G² w² var / (Σ G w)²`   [11.1]
    ///
    /// Empty bins, the obstacle and what lies beyond the box carry no weight, and stay empty.
    ///
    /// With `w = N`, the number of frames in which a bin holds cells, this is the filter in bins *and* frames, averaged
    /// in time: a Gaussian in frames that hands out weight 1 from every frame leaves the sums over all frames as they
    /// are.
    pub fn filtered(&self, deviation: f64) -> Self {
        if deviation == 0.0 {
            return self.clone();
        }
        let reach = (REACH * deviation).ceil() as usize;
        let tap = |power: f64| {
            let g = move |k: usize| (-0.5 * power * (k as f64 / deviation).powi(2)).exp();
            (0..=reach).map(g).collect::<Vec<f64>>()
        };
        let (once, twice) = (tap(1.0), tap(2.0));
        let weight = self.spread(&once, |bin| self.weights[bin]);
        let mut out = self.clone();
        for c in 0..2 {
            let sums = self.spread(&once, |bin| self.weights[bin] * self.values[bin][c]);
            let squares = self.spread(&twice, |bin| self.weights[bin].powi(2) * self.variances[bin][c]);
            for bin in (0..self.bins.len()).filter(|bin| self.is_filled(*bin)) {
                out.values[bin][c] = sums[bin] / weight[bin];
                out.variances[bin][c] = squares[bin] / weight[bin].powi(2);
            }
        }
        out
    }

    /// Sums of the filled bins' values with the weights `taps[|i − i'|] taps[|j − j'|]`.
    fn spread(&self, taps: &[f64], value: impl Fn(usize) -> f64) -> Vec<f64> {
        let [nx, ny] = self.bins.count;
        let of = |bin: usize| if self.is_filled(bin) { value(bin) } else { 0.0 };
        let all: Vec<f64> = (0..self.bins.len()).map(of).collect();
        let line = |from: &[f64], at: usize, count: usize, index: &dyn Fn(usize) -> usize| -> f64 {
            let first = at.saturating_sub(taps.len() - 1);
            let last = (at + taps.len() - 1).min(count - 1);
            (first..=last).map(|k| taps[k.abs_diff(at)] * from[index(k)]).sum()
        };
        let along: Vec<f64> = (0..all.len()).map(|bin| line(&all, bin % nx, nx, &|k| bin - bin % nx + k)).collect();
        (0..all.len()).map(|bin| line(&along, bin / nx, ny, &|k| k * nx + bin % nx)).collect()
    }

    /// Bilinear interpolation between the centres of filled bins: empty ones carry no weight. `None` outside of the
    /// box, and where all bins around are empty.
    pub fn at(&self, x: Point) -> Option<Point> {
        self.interpolate(x, |bin| self.values[bin])
    }

    /// Standard error of [`Binned::at`], by component, if neighbours err alike: never too small.
    pub fn error_at(&self, x: Point) -> Option<Point> {
        self.interpolate(x, |bin| self.variances[bin].map(f64::sqrt))
    }

    fn interpolate(&self, x: Point, value: impl Fn(usize) -> Point) -> Option<Point> {
        let filled = self.bins.around(x)?.into_iter().filter(|(bin, _)| self.is_filled(*bin));
        let (sum, weight) = filled.fold((Point::zeros(), 0.0), |(sum, weight), (bin, w)| {
            // 0 · NaN is NaN
            if w > 0.0 { (sum + value(bin) * w, weight + w) } else { (sum, weight) }
        });
        (weight > 0.0).then(|| sum / weight)
    }
}
