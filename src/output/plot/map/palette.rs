//! Colours of values.

use colorous::{RED_BLUE, VIRIDIS};

use super::Palette;
use crate::output::plot::scene::Rgb;

impl Palette {
    /// Red, green and blue of a value where the bar runs from `range[0]` to `range[1]`.
    pub fn colour(self, value: f64, range: [f64; 2]) -> Rgb {
        let [low, high] = range;
        let value = value.clamp(low, high);
        let (gradient, share) = match self {
            Self::Sequential => (VIRIDIS, (value - low) / (high - low)),
            // the palette runs from red to blue
            Self::Diverging => (RED_BLUE, 0.5 - 0.5 * value / low.abs().max(high.abs())),
        };
        gradient.eval_continuous(share.clamp(0.0, 1.0)).into_array()
    }

    /// A range that has a width: that of the values, or a little around a single one.
    pub(super) fn widen([low, high]: [f64; 2]) -> [f64; 2] {
        let size = low.abs().max(high.abs());
        if high - low > 1e-12 * size {
            [low, high]
        } else {
            let half = if size > 0.0 { 0.05 * size } else { 0.5 };
            [low - half, high + half]
        }
    }
}
