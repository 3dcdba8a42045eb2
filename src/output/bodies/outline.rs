//! Outlines of shapes as polygons.

use std::f64::consts::{PI, TAU};

use crate::mesh::Point;
use crate::shape::Shape;

/// The outline of a shape in its own frame, counterclockwise, beginning on the side of the frame's first axis: straight
/// parts by their ends, the round ones by points of the outline, about `points` on a whole turn.
///
/// # Panics
/// For fewer than 8 points.
pub fn outline(shape: &Shape, points: usize) -> Vec<Point> {
    assert!(points >= 8, "an outline of {points} points");
    let at = |angle: f64| Point::new(angle.cos(), angle.sin());
    match shape {
        Shape::Disc { radius } => (0..points).map(|k| *radius * at(TAU * k as f64 / points as f64)).collect(),
        Shape::Ellipse { semi_axes: [a, b] } => {
            (0..points).map(|k| at(TAU * k as f64 / points as f64).component_mul(&Point::new(*a, *b))).collect()
        }
        Shape::Capsule { half_length, radius } => {
            let half = points.div_ceil(2);
            let cap = |side: f64| {
                let start = if side > 0.0 { -PI / 2.0 } else { PI / 2.0 };
                let angle = move |k: usize| start + PI * k as f64 / half as f64;
                (0..=half).map(move |k| Point::new(side * half_length, 0.0) + *radius * at(angle(k)))
            };
            cap(1.0).chain(cap(-1.0)).collect()
        }
        Shape::Polygon { vertices } => vertices.clone(),
    }
}

/// Whether a point of the shape's frame lies in it or on its outline.
pub fn contains(shape: &Shape, x: Point) -> bool {
    match shape {
        Shape::Disc { radius } => x.norm() <= *radius,
        Shape::Ellipse { semi_axes: [a, b] } => (x.x / a).hypot(x.y / b) <= 1.0,
        Shape::Capsule { half_length, radius } => (x.x - x.x.clamp(-half_length, *half_length)).hypot(x.y) <= *radius,
        Shape::Polygon { vertices } => {
            let edges = vertices.iter().zip(vertices.iter().cycle().skip(1));
            edges.into_iter().all(|(p, q)| (q - p).perp(&(x - p)) >= 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outlines_enclose_the_area_of_their_shapes() {
        let polygon = vec![Point::new(-1.0, -1.0), Point::new(2.0, -1.0), Point::new(-1.0, 2.0)];
        let shapes = [
            Shape::Disc { radius: 0.7 },
            Shape::Ellipse { semi_axes: [2.0, 0.3] },
            Shape::Capsule { half_length: 1.5, radius: 0.25 },
            Shape::Polygon { vertices: polygon },
        ];
        for shape in shapes {
            let points = outline(&shape, 720);
            let next = points.iter().cycle().skip(1);
            let area: f64 = points.iter().zip(next).map(|(p, q)| 0.5 * p.perp(q)).sum();
            assert!((area / shape.area() - 1.0).abs() < 2e-5, "{shape:?}: {area}");
            for x in &points {
                assert!(contains(&shape, 0.999 * x) && !contains(&shape, 1.001 * x), "{shape:?} at {x}");
            }
        }
    }
}
