//! Shapes of rigid bodies, by signed distance.

use crate::mesh::Point;

/// A convex shape in its own frame, whose origin is its centre of area.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// All points within a distance of the centre.
    Disc {
        /// That distance.
        radius: f64,
    },
    /// Semi-axes along the frame's axes.
    Ellipse {
        /// Half of its length along its first axis and across.
        semi_axes: [f64; 2],
    },
    /// All points within `radius` of the segment from `(−half_length, 0)` to `(half_length, 0)`.
    Capsule {
        /// From its centre to the centres of its caps.
        half_length: f64,
        /// Half of its width.
        radius: f64,
    },
    /// Convex, counterclockwise, about the centre of its area.
    Polygon {
        /// Counterclockwise, about the centre of area.
        vertices: Vec<Point>,
    },
}

impl Shape {
    /// Area.
    pub fn area(&self) -> f64 {
        match self {
            Shape::Disc { radius } => std::f64::consts::PI * radius * radius,
            Shape::Ellipse { semi_axes: [a, b] } => std::f64::consts::PI * a * b,
            Shape::Capsule { half_length, radius } => radius * (4.0 * half_length + std::f64::consts::PI * radius),
            Shape::Polygon { vertices } => edges(vertices).map(|(p, q)| 0.5 * p.perp(&q)).sum(),
        }
    }

    /// `∫ |x|²` over the shape.
    pub fn second_moment(&self) -> f64 {
        match self {
            Shape::Disc { radius } => 0.5 * std::f64::consts::PI * radius.powi(4),
            Shape::Ellipse { semi_axes: [a, b] } => 0.25 * std::f64::consts::PI * a * b * (a * a + b * b),
            Shape::Capsule { half_length: l, radius: r } => {
                let rectangle = 4.0 * l * r * (l * l + r * r) / 3.0;
                // both half discs make a disc whose halves are moved by l, their centres of area a further 4r/(3π)
                let caps = std::f64::consts::PI * r * r * (0.5 * r * r + l * l) + 8.0 * r.powi(3) * l / 3.0;
                rectangle + caps
            }
            Shape::Polygon { vertices } => edges(vertices)
                .map(|(p, q)| p.perp(&q) * (p.norm_squared() + p.dot(&q) + q.norm_squared()) / 12.0)
                .sum(),
        }
    }

    /// Largest distance of a point of the shape from its centre.
    pub fn circumradius(&self) -> f64 {
        match self {
            Shape::Disc { radius } => *radius,
            Shape::Ellipse { semi_axes: [a, b] } => a.max(*b),
            Shape::Capsule { half_length, radius } => half_length + radius,
            Shape::Polygon { vertices } => vertices.iter().map(|v| v.norm()).fold(0.0, f64::max),
        }
    }

    /// Radius of the largest disc about the centre that lies within the shape: half of the thickness.
    pub fn inradius(&self) -> f64 {
        match self {
            Shape::Disc { radius } | Shape::Capsule { radius, .. } => *radius,
            Shape::Ellipse { semi_axes: [a, b] } => a.min(*b),
            Shape::Polygon { vertices } => {
                edges(vertices).map(|(p, q)| p.perp(&q) / (q - p).norm()).fold(f64::INFINITY, f64::min)
            }
        }
    }
}

/// The edges of a polygon.
pub fn edges(vertices: &[Point]) -> impl Iterator<Item = (Point, Point)> {
    vertices.iter().zip(vertices.iter().cycle().skip(1)).map(|(p, q)| (*p, *q))
}
