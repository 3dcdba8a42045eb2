//! Means over time of what was measured in each bin.

use super::{Binned, Bins};
use crate::mesh::Point;

/// A velocity that was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Number of the frame, in the order of time.
    pub frame: usize,
    /// Where it was measured.
    pub x: Point,
    /// The velocity there.
    pub v: Point,
}

/// Sums over frames, bin by bin. A frame counts once in each bin that holds cells in it, with the mean `u_f` of these
/// cells; it does not count in the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Averages {
    /// Where they are taken.
    pub bins: Bins,
    /// Number `N` of frames in which the bin holds cells.
    pub frames: Vec<u32>,
    /// Number of cells, of all frames.
    pub cells: Vec<u64>,
    /// `Σ_f u_f`
    sum: Vec<Point>,
    /// `Σ_f u_f²`, by component.
    square: Vec<Point>,
}

impl Averages {
    fn none(bins: Bins) -> Self {
        let n = bins.len();
        let zero = vec![Point::zeros(); n];
        Self { bins, frames: vec![0; n], cells: vec![0; n], sum: zero.clone(), square: zero }
    }

    /// Averages of `blocks` successive parts of the `frames`, nearly equal in length; samples outside of the box are
    /// left out, and those in bins that are `closed`.
    pub fn of_blocks(bins: Bins, closed: &[bool], samples: &[Sample], frames: usize, blocks: usize) -> Vec<Self> {
        let mut placed: Vec<(usize, usize, Point)> = samples
            .iter()
            .filter_map(|s| bins.find(s.x).filter(|bin| !closed[*bin]).map(|bin| (s.frame, bin, s.v)))
            .collect();
        // stable: sums do not depend on anything but the order of the samples
        placed.sort_by_key(|(frame, bin, _)| (*frame, *bin));
        let mut parts = vec![Self::none(bins); blocks];
        for cells in placed.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let (frame, bin, _) = cells[0];
            let mean = cells.iter().map(|(_, _, v)| v).sum::<Point>() / cells.len() as f64;
            let part = &mut parts[frame * blocks / frames];
            part.frames[bin] += 1;
            part.cells[bin] += cells.len() as u64;
            part.sum[bin] += mean;
            part.square[bin] += mean.component_mul(&mean);
        }
        parts
    }

    /// Sums over all parts but one.
    pub fn join(parts: &[Self], without: Option<usize>) -> Self {
        let mut total = Self::none(parts[0].bins);
        for part in parts.iter().enumerate().filter(|(k, _)| Some(*k) != without).map(|(_, part)| part) {
            for bin in 0..total.sum.len() {
                total.frames[bin] += part.frames[bin];
                total.cells[bin] += part.cells[bin];
                total.sum[bin] += part.sum[bin];
                total.square[bin] += part.square[bin];
            }
        }
        total
    }

    /// Mean `ū = Σ u_f / N` in each bin, of variance `Σ (u_f − ū)² / (N (N − 1))`: frames count as independent. Where
    /// `N = 1`, the scatter of the others is taken; where it is nowhere more, the variance is NaN. The weight of a bin
    /// is `N`.
    pub fn mean(&self) -> Binned {
        let scatter = |bin: usize| {
            let (n, sum) = (f64::from(self.frames[bin]), self.sum[bin]);
            (self.square[bin] - sum.component_mul(&sum) / n).sup(&Point::zeros())
        };
        let several = (0..self.bins.len()).filter(|bin| self.frames[*bin] > 1);
        let freedoms: u32 = several.clone().map(|bin| self.frames[bin] - 1).sum();
        let pooled = several.map(scatter).sum::<Point>() / f64::from(freedoms);
        let mut binned = Binned::empty(self.bins);
        for bin in (0..self.bins.len()).filter(|bin| self.frames[*bin] > 0) {
            let n = f64::from(self.frames[bin]);
            binned.weights[bin] = n;
            binned.values[bin] = self.sum[bin] / n;
            binned.variances[bin] = if n > 1.0 { scatter(bin) / (n * (n - 1.0)) } else { pooled };
        }
        binned
    }
}
