//! Exact boundary curves.

use super::Point;

/// A smooth curve that boundary faces approximate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Curve {
    /// A circle.
    Circle {
        /// Its middle.
        centre: Point,
        /// Distance of its points from the middle.
        radius: f64,
    },
}

impl Curve {
    /// The nearest point of the curve.
    pub fn project(&self, x: Point) -> Point {
        match *self {
            Curve::Circle { centre, radius } => centre + (x - centre) * (radius / (x - centre).norm()),
        }
    }

    /// The point that divides the arc from `a` to `b` (both on the curve, the shorter way round) in the ratio
    /// `s : 1−s`.
    pub fn between(&self, a: Point, b: Point, s: f64) -> Point {
        match *self {
            Curve::Circle { centre, radius } => {
                let (u, w) = (a - centre, b - centre);
                let turn = u.perp(&w).atan2(u.dot(&w)) * s;
                let (sin, cos) = turn.sin_cos();
                let direction = Point::new(cos * u.x - sin * u.y, sin * u.x + cos * u.y);
                centre + direction * (radius / u.norm())
            }
        }
    }

    /// Unit normal at (the projection of) `x`, on the side of `outward`.
    pub fn normal(&self, x: Point, outward: Point) -> Point {
        let normal = match *self {
            Curve::Circle { centre, .. } => (x - centre).normalize(),
        };
        if normal.dot(&outward) < 0.0 { -normal } else { normal }
    }
}
