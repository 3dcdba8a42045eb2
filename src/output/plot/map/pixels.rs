//! The values of a scalar at the middles of pixels.

use rayon::prelude::*;

use super::{Palette, Scalar, Window};
use crate::output::plot::PlotError;
use crate::output::plot::scene::{Image, Rect, WHITE};

/// Sampled values, row by row from the top; NaN where there is none.
pub(super) struct Pixels {
    width: usize,
    height: usize,
    values: Vec<f64>,
    /// Smallest and largest value.
    pub extent: [f64; 2],
}

impl Pixels {
    /// Samples the window; the rows are shared among the threads.
    ///
    /// # Errors
    /// [`PlotError::Blank`] where the scalar has no value in the window.
    pub fn sample(scalar: Scalar, name: &str, window: &Window, width: usize, height: usize) -> Result<Self, PlotError> {
        let row = |j: usize| {
            let up = 1.0 - (j as f64 + 0.5) / height as f64;
            let value = move |i: usize| {
                let across = (i as f64 + 0.5) / width as f64;
                scalar(window.at(across, up)).filter(|v| v.is_finite()).unwrap_or(f64::NAN)
            };
            (0..width).map(value).collect::<Vec<f64>>()
        };
        let values = (0..height).into_par_iter().map(row).collect::<Vec<_>>().concat();
        let extent = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |e, v| [e[0].min(*v), e[1].max(*v)]);
        if extent[0] > extent[1] {
            return Err(PlotError::Blank { name: name.to_owned() });
        }
        Ok(Self { width, height, values, extent })
    }

    /// Their colours on an area.
    pub fn image(&self, palette: Palette, range: [f64; 2], rect: Rect) -> Image {
        let colour = |v: &f64| if v.is_nan() { WHITE } else { palette.colour(*v, range) };
        Image { rect, width: self.width, height: self.height, pixels: self.values.par_iter().map(colour).collect() }
    }
}
