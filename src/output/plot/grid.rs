//! Values over two unlike axes, such as place and time, as colours.

use super::PlotError;
use super::map::{Map, Palette, Picture, Window};
use crate::mesh::Point;

/// Height of the axes on paper over their width.
const HEIGHT: f64 = 0.75;

/// Values on a grid. Between its points they are linear in both directions; next to a point without a value there is
/// none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Grid {
    /// Title line; wrapped when too long; may be empty.
    pub title: String,
    /// Small line below the title, for the parameters; wrapped when too long; may be empty.
    pub subtitle: String,
    /// Names of the horizontal and the vertical axis.
    pub axes: [String; 2],
    /// Columns of the grid, ascending.
    pub x: Vec<f64>,
    /// Rows of the grid, ascending.
    pub y: Vec<f64>,
    /// Row by row; not finite where there is no value.
    pub values: Vec<f64>,
    /// Name of the values, as a formula.
    pub name: String,
    /// Whether values below zero have colours of their own.
    pub signed: bool,
}

impl Grid {
    /// The value at a point between the first and the last of either axis.
    pub fn at(&self, x: f64, y: f64) -> Option<f64> {
        let ((i, s), (j, t)) = (between(&self.x, x)?, between(&self.y, y)?);
        let value = |i: usize, j: usize| self.values.get(j * self.x.len() + i).copied().unwrap_or(f64::NAN);
        let row = |j: usize| (1.0 - s) * value(i, j) + s * value(i + 1, j);
        let found = (1.0 - t) * row(j) + t * row(j + 1);
        found.is_finite().then_some(found)
    }

    /// Draws it.
    ///
    /// # Errors
    /// [`PlotError::Window`] for an axis with less than two points; those of [`Map::draw`].
    pub fn draw(&self) -> Result<Picture, PlotError> {
        let ends = |all: &[f64]| [all.first(), all.last()].map(|end| end.copied().unwrap_or(f64::NAN));
        let ([x0, x1], [y0, y1]) = (ends(&self.x), ends(&self.y));
        let sampler = |at: Point| self.at(at.x, at.y);
        let map = Map {
            title: self.title.clone(),
            subtitle: self.subtitle.clone(),
            axes: self.axes.clone(),
            height: Some(HEIGHT),
            name: self.name.clone(),
            palette: if self.signed { Palette::Diverging } else { Palette::Sequential },
            ..Map::new(Window::of_two_scales([x0, y0], [x1, y1])?, &sampler)
        };
        map.draw()
    }
}

/// The interval of a list that a number lies in, and the share of the way along it.
fn between(all: &[f64], at: f64) -> Option<(usize, f64)> {
    let last = all.len().checked_sub(2)?;
    let k = all.partition_point(|one| *one <= at).checked_sub(1)?.min(last);
    let share = (at - all[k]) / (all[k + 1] - all[k]);
    (0.0..=1.0).contains(&share).then_some((k, share))
}
