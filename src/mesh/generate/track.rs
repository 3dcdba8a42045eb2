//! The way around a closed domain.

use super::{MeshScene, Shape};
use crate::mesh::Point;

/// A closed centre line, counterclockwise: two straight arms along x₁ joined by half circles, or circles about one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    centre: Point,
    half_arm: f64,
}

impl Track {
    /// Unit vector along the track at `x`; zero where there is no direction.
    pub fn tangent(&self, x: Point) -> Point {
        let r = x - self.centre;
        let outwards = Point::new(r.x - r.x.clamp(-self.half_arm, self.half_arm), r.y);
        let size = outwards.norm();
        if size == 0.0 { Point::zeros() } else { Point::new(-outwards.y, outwards.x) / size }
    }
}

impl MeshScene {
    /// The way around the domain: of a racetrack along its arms and turns, of a disc and of a ring around the centre.
    pub fn track(&self) -> Option<Track> {
        match self.shape? {
            Shape::Square | Shape::SquareWithCircle | Shape::Strip | Shape::StripWithDisc => None,
            Shape::Disc | Shape::Annulus => {
                Some(Track { centre: Point::from(self.centre.unwrap_or_default()), half_arm: 0.0 })
            }
            Shape::Racetrack => Some(Track { centre: Point::zeros(), half_arm: 0.5 * self.arm.unwrap_or(0.0) }),
        }
    }

    /// Discs on a racetrack.
    pub(super) fn discs_on_track(&self) -> usize {
        self.discs.unwrap_or(2)
    }
}
