//! The way around a closed domain.

use crate::mesh::Point;

/// A closed centre line, counterclockwise: two straight arms along x₁ joined by half circles, or circles about one
/// point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    pub(super) centre: Point,
    pub(super) half_arm: f64,
}

impl Track {
    /// Around a point.
    pub(super) fn about(centre: [f64; 2]) -> Self {
        Self { centre: Point::from(centre), half_arm: 0.0 }
    }

    /// Whether it is made of circles, along which the domain can turn as a whole.
    pub fn is_round(&self) -> bool {
        self.half_arm == 0.0
    }

    /// Unit vector along the track at `x`; zero where there is no direction.
    pub fn tangent(&self, x: Point) -> Point {
        let r = x - self.centre;
        let outwards = Point::new(r.x - r.x.clamp(-self.half_arm, self.half_arm), r.y);
        let size = outwards.norm();
        if size == 0.0 { Point::zeros() } else { Point::new(-outwards.y, outwards.x) / size }
    }
}
