//! The wanted edge length.

use super::{MeshScene, Shape};
use crate::mesh::Point;

/// `h(x) = min(h, h_disc + grading·distance to the nearest disc)`.
#[derive(Debug, Clone)]
pub(super) struct Size {
    h: f64,
    h_disc: f64,
    grading: f64,
    radius: f64,
    centres: Vec<Point>,
}

impl Size {
    /// The size function of a scene whose defaults are filled in.
    pub fn new(scene: &MeshScene, shape: Shape) -> Self {
        let h = scene.h.unwrap_or(1.0);
        let turn = scene.turn_radius.unwrap_or(0.0);
        let centres = match shape {
            Shape::Square | Shape::SquareWithCircle | Shape::Strip | Shape::Disc | Shape::Annulus => Vec::new(),
            Shape::StripWithDisc => vec![Point::from(scene.centre.unwrap_or_default())],
            Shape::Racetrack => [turn, -turn][..scene.discs_on_track()].iter().map(|y| Point::new(0.0, *y)).collect(),
        };
        let (h_disc, grading) = (scene.h_disc.unwrap_or(h), scene.grading.unwrap_or(1.0));
        Self { h, h_disc, grading, radius: scene.radius.unwrap_or(1.0), centres }
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
}
