//! The wanted edge length, and how many cells it gives.

use std::f64::consts::TAU;

use crate::mesh::Point;

/// Default of `grading`, chosen so that the reference strip (`h = 1`, `h_disc = 0.13`) has about 3000 cells.
pub(super) const GRADING: f64 = 0.15;

/// `h(x) = min(h, h_disc + grading·distance to the nearest disc)`.
#[derive(Debug, Clone)]
pub(super) struct Size {
    pub h: f64,
    pub h_disc: f64,
    pub grading: f64,
    pub radius: f64,
    pub centres: Vec<Point>,
}

impl Size {
    /// The same everywhere.
    pub fn even(h: f64) -> Self {
        Self { h, h_disc: h, grading: 1.0, radius: 1.0, centres: Vec::new() }
    }

    /// The wanted edge length at `x`.
    pub fn at(&self, x: Point) -> f64 {
        let near = |c: &Point| self.h_disc + self.grading * ((x - c).norm() - self.radius).max(0.0);
        self.centres.iter().map(near).fold(self.h, f64::min)
    }

    /// The wanted length of the edge from `a` to `b`.
    pub fn between(&self, a: Point, b: Point) -> f64 {
        self.at((a + b) * 0.5)
    }

    /// The smallest wanted length.
    pub fn least(&self) -> f64 {
        self.h_disc.min(self.h)
    }

    /// Cells on this area far from discs, `∫ 4/(√3 h²)`.
    pub fn far(&self, area: f64) -> f64 {
        4.0 / 3f64.sqrt() * area / self.h.powi(2)
    }

    /// Cells on this area, `∫ 4/(√3 h(x)²)`, where walls are `width` apart; an estimate from above where they cut the
    /// graded zone.
    pub fn cells(&self, area: f64, width: f64) -> f64 {
        let far = self.far(area);
        if self.centres.is_empty() {
            return far;
        }
        let (h, a, g, radius) = (self.h, self.h_disc, self.grading, self.radius);
        let reach = ((h - a) / g).min(width);
        // ∫_0^reach (r + s)/(a + g s)² ds − the same with h
        let end = a + g * reach;
        let graded = ((radius - a / g) * (1.0 / a - 1.0 / end) + (end / a).ln() / g) / g;
        let flat = (radius * reach + 0.5 * reach * reach) / (h * h);
        let discs = self.centres.len() as f64;
        far + discs * TAU * 4.0 / 3f64.sqrt() * (graded - flat).max(0.0)
    }
}
