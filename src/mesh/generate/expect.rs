//! How large a generated mesh will be, before it is made.

use std::f64::consts::TAU;

use super::stretch::Stretch;
use super::{MeshScene, Shape};

/// Cells of the size function over those that the generator makes, as measured on every shape.
const PACKED: f64 = 1.0;

impl MeshScene {
    /// About how many cells the generated mesh will have; exact for `square`. `None` of a file, and of a shape whose
    /// keys are missing.
    pub fn expected(&self) -> Option<f64> {
        let shape = self.shape?;
        let full = self.defaults_filled();
        full.check(shape).ok()?;
        let squares = full.n.map_or(0.0, |n| (n as f64).powi(2));
        Some(match shape {
            Shape::Square => 2.0 * squares,
            Shape::SquareWithCircle => 14.0 * squares,
            Shape::Strip | Shape::StripWithDisc | Shape::Disc | Shape::Annulus | Shape::Racetrack => {
                PACKED * full.expected_cells(shape)
            }
        })
    }

    /// A mesh of up to so many cells is there within a second or two.
    pub fn quickly_built(&self) -> f64 {
        match self.shape {
            Some(Shape::Square | Shape::SquareWithCircle) | None => 2e5,
            Some(Shape::Strip | Shape::StripWithDisc | Shape::Disc | Shape::Annulus | Shape::Racetrack) => 2e4,
        }
    }

    /// The rectangle `[x_0, x_1] × [y_0, y_1]` about the generated domain; `None` of a file.
    pub fn bounds(&self) -> Option<[[f64; 2]; 2]> {
        let full = self.defaults_filled();
        let about = |centre: [f64; 2], half: [f64; 2]| [0, 1].map(|k| [centre[k] - half[k], centre[k] + half[k]]);
        let (width, radius) = (full.width.unwrap_or(0.0), full.radius.unwrap_or(1.0));
        let length = full.length.unwrap_or_default();
        Some(match full.shape? {
            Shape::Square | Shape::SquareWithCircle => [length; 2],
            Shape::Strip | Shape::StripWithDisc => [length, [-0.5 * width, 0.5 * width]],
            Shape::Disc | Shape::Annulus => about(full.centre.unwrap_or_default(), [radius; 2]),
            Shape::Racetrack => {
                let end = full.turn_radius.unwrap_or(0.0) + 0.5 * width;
                about([0.0; 2], [0.5 * full.arm.unwrap_or(0.0) + end, end])
            }
        })
    }

    /// The same domain with cells longer by `ratio`; `None` where so few cells cannot follow its shape.
    pub fn coarser(&self, ratio: f64) -> Option<MeshScene> {
        let mut coarse = self.clone();
        coarse.n = self.n.map(|n| (n as f64 / ratio).round().max(1.0) as usize);
        coarse.h = self.h.map(|h| h * ratio);
        coarse.h_disc = self.h_disc.map(|h| h * ratio);
        coarse.defaults_filled().check(self.shape?).is_ok().then_some(coarse)
    }

    /// `∫ 4/(√3 h²)` with the constant `h` far from the discs.
    pub(super) fn expected_far(&self, shape: Shape) -> f64 {
        let (radius, width) = (self.radius.unwrap_or(1.0), self.width.unwrap_or(0.0));
        let [x0, x1] = self.length.unwrap_or_default();
        let area = match shape {
            Shape::Square | Shape::SquareWithCircle => 0.0,
            Shape::Strip => (x1 - x0) * width / self.stretch.unwrap_or(1.0),
            Shape::StripWithDisc => Stretch::new(self).image_length() * width,
            Shape::Disc => 0.5 * TAU * radius.powi(2),
            Shape::Annulus => 0.5 * TAU * (radius.powi(2) - self.inner_radius.unwrap_or(0.0).powi(2)),
            Shape::Racetrack => (2.0 * self.arm.unwrap_or(0.0) + TAU * self.turn_radius.unwrap_or(0.0)) * width,
        };
        4.0 / 3f64.sqrt() * area / self.h.unwrap_or(1.0).powi(2)
    }

    /// Number of cells of the size function, `∫ 4/(√3 h(x)²)`; an estimate from above where walls cut the graded
    /// zone.
    pub(super) fn expected_cells(&self, shape: Shape) -> f64 {
        let far = self.expected_far(shape);
        let (Some(h), Some(a), Some(g)) = (self.h, self.h_disc, self.grading) else { return far };
        let radius = self.radius.unwrap_or(1.0);
        let reach = ((h - a) / g).min(self.width.unwrap_or(f64::MAX));
        // ∫_0^reach (r + s)/(a + g s)² ds − the same with h
        let end = a + g * reach;
        let graded = ((radius - a / g) * (1.0 / a - 1.0 / end) + (end / a).ln() / g) / g;
        let flat = (radius * reach + 0.5 * reach * reach) / (h * h);
        let discs = if shape == Shape::Racetrack { self.discs_on_track() as f64 } else { 1.0 };
        far + discs * TAU * 4.0 / 3f64.sqrt() * (graded - flat).max(0.0)
    }
}
