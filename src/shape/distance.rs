//! Signed distances of shapes, and what a shape must be.

use super::{Shape, edges};
use crate::mesh::Point;

/// What can be wrong with a shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum ShapeError {
    #[error("{what} = {value}: must be a positive number; hint: lengths are in the unit of the scene")]
    Size { what: &'static str, value: f64 },
    #[error("{what} = {value}: must not be negative; hint: 0 makes the capsule a disc")]
    Negative { what: &'static str, value: f64 },
    #[error("the polygon has {count} vertices: at least 3 are needed; hint: a rod is a capsule")]
    FewVertices { count: usize },
    #[error("vertex {index} of the polygon is ({x}, {y}): coordinates must be finite; hint: write plain numbers")]
    NotFinite { index: usize, x: f64, y: f64 },
    #[error(
        "vertices {index} and {next} of the polygon are the same point; hint: list every corner once, the first not again at the end"
    )]
    Repeated { index: usize, next: usize },
    #[error(
        "the polygon is not convex at vertex {index}, ({x}, {y}); hint: list the corners in their order around the body, and leave out those in the middle of a side"
    )]
    NotConvex { index: usize, x: f64, y: f64 },
    #[error("the polygon winds round more than once; hint: list the corners in their order around the body")]
    Winding,
    #[error(
        "the {shape} is a sliver: its width is {width:.1e} of its length, and {least:.0e} is the least; \
         hint: {hint}",
        least = NARROWEST
    )]
    Sliver { shape: &'static str, width: f64, hint: &'static str },
}

/// The narrowest shape, width over length, that distances and cuts are computed for.
const NARROWEST: f64 = 1e-6;

const THICKER: &str =
    "make it thicker: what is thinner than the gaps around it, or than a cell of a mesh, changes nothing";

impl Shape {
    /// The shape if it is one: sizes positive and finite, polygons convex, made counterclockwise and moved so that the
    /// centre of area is the origin.
    ///
    /// # Errors
    /// What is wrong, with a hint.
    pub fn checked(self) -> Result<Shape, ShapeError> {
        let positive = |what, value: f64| match value > 0.0 && value.is_finite() {
            true => Ok(()),
            false => Err(ShapeError::Size { what, value }),
        };
        match self {
            Shape::Disc { radius } => positive("radius", radius)?,
            Shape::Ellipse { semi_axes: [a, b] } => {
                positive("semi_axes[0]", a)?;
                positive("semi_axes[1]", b)?;
                let width = a.min(b) / a.max(b);
                if width < NARROWEST {
                    return Err(ShapeError::Sliver { shape: "ellipse", width, hint: THICKER });
                }
            }
            Shape::Capsule { half_length, radius } => {
                positive("radius", radius)?;
                if !(half_length >= 0.0 && half_length.is_finite()) {
                    return Err(ShapeError::Negative { what: "length", value: 2.0 * half_length });
                }
                let width = radius / (half_length + radius);
                if width < NARROWEST {
                    return Err(ShapeError::Sliver { shape: "capsule", width, hint: THICKER });
                }
            }
            Shape::Polygon { vertices } => return Shape::polygon(vertices).map(|(shape, _)| shape),
        }
        Ok(self)
    }

    /// The polygon with these vertices, either way round, about the centre of its area; and where that centre was.
    ///
    /// # Errors
    /// Fewer than three vertices, repeated ones, a polygon that is not convex, or a sliver.
    pub fn polygon(mut vertices: Vec<Point>) -> Result<(Shape, Point), ShapeError> {
        let count = vertices.len();
        if count < 3 {
            return Err(ShapeError::FewVertices { count });
        }
        if let Some(index) = vertices.iter().position(|v| !(v.x.is_finite() && v.y.is_finite())) {
            return Err(ShapeError::NotFinite { index, x: vertices[index].x, y: vertices[index].y });
        }
        let repeated = (0..count).find(|&k| vertices[k] == vertices[(k + 1) % count]);
        if let Some(index) = repeated {
            return Err(ShapeError::Repeated { index, next: (index + 1) % count });
        }
        let first = vertices[0];
        let twice_area: f64 = edges(&vertices).map(|(p, q)| (p - first).perp(&(q - first))).sum();
        check_convex(&vertices, twice_area.signum())?;
        check_width(&vertices)?;
        if twice_area < 0.0 {
            vertices.reverse();
        }
        let first = vertices[0];
        let moment: Point = edges(&vertices).map(|(p, q)| (p + q - 2.0 * first) * (p - first).perp(&(q - first))).sum();
        let centre = first + moment / (3.0 * twice_area.abs());
        vertices.iter_mut().for_each(|v| *v -= centre);
        Ok((Shape::Polygon { vertices }, centre))
    }

    /// Signed distance of a point in the body's frame from the boundary, negative inside, and its gradient.
    ///
    /// The gradient is the unit normal of the boundary at the nearest point; where several are nearest, that of one of
    /// them.
    pub fn signed_distance(&self, x: Point) -> (f64, Point) {
        match self {
            Shape::Disc { radius } => from_round(x, *radius, Point::new(1.0, 0.0)),
            Shape::Ellipse { semi_axes } => from_ellipse(x, *semi_axes),
            &Shape::Capsule { half_length, radius } => {
                let nearest = Point::new(x.x.clamp(-half_length, half_length), 0.0);
                from_round(x - nearest, radius, Point::new(0.0, 1.0))
            }
            Shape::Polygon { vertices } => from_polygon(x, vertices),
        }
    }

    /// Whether a point in the body's frame is a point of the body; the boundary is part of it.
    pub fn contains(&self, x: Point) -> bool {
        match self {
            Shape::Disc { radius } => x.norm() <= *radius,
            Shape::Ellipse { semi_axes: [a, b] } => (x.x / a).hypot(x.y / b) <= 1.0,
            &Shape::Capsule { half_length, radius } => {
                (x.x - x.x.clamp(-half_length, half_length)).hypot(x.y) <= radius
            }
            Shape::Polygon { vertices } => edges(vertices).all(|(p, q)| (q - p).perp(&(x - p)) >= 0.0),
        }
    }
}

fn check_convex(vertices: &[Point], sense: f64) -> Result<(), ShapeError> {
    let count = vertices.len();
    let mut turn = 0.0;
    for k in 0..count {
        let (before, at, after) = (vertices[(k + count - 1) % count], vertices[k], vertices[(k + 1) % count]);
        let (a, b) = (at - before, after - at);
        if a.perp(&b) * sense <= 1e-12 * a.norm() * b.norm() {
            return Err(ShapeError::NotConvex { index: k, x: at.x, y: at.y });
        }
        turn += a.perp(&b).atan2(a.dot(&b)).abs();
    }
    // a star turns the same way at every vertex, but more than once in all
    if turn > 3.0 * std::f64::consts::PI { Err(ShapeError::Winding) } else { Ok(()) }
}

fn check_width(vertices: &[Point]) -> Result<(), ShapeError> {
    let spread = |n: Point| {
        let along = vertices.iter().map(|v| v.dot(&n));
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| (l.min(s), h.max(s)));
        high - low
    };
    let normals = || edges(vertices).map(|(p, q)| (q - p).normalize());
    let width = normals().map(|e| spread(Point::new(-e.y, e.x))).fold(f64::INFINITY, f64::min);
    let length = normals().map(spread).fold(0.0, f64::max);
    if width >= NARROWEST * length {
        return Ok(());
    }
    Err(ShapeError::Sliver {
        shape: "polygon",
        width: width / length,
        hint: "a capsule is a rod with round ends; make it thicker",
    })
}

/// Distance from the disc about the origin; `fallback` is the gradient at its centre.
fn from_round(x: Point, radius: f64, fallback: Point) -> (f64, Point) {
    let r = x.norm();
    (r - radius, if r > 0.0 { x / r } else { fallback })
}

fn from_ellipse(x: Point, [a, b]: [f64; 2]) -> (f64, Point) {
    if a < b {
        let (distance, gradient) = from_ellipse(Point::new(x.y, x.x), [b, a]);
        return (distance, Point::new(gradient.y, gradient.x));
    }
    let y = x.abs();
    let nearest = nearest_on_ellipse(y, a, b);
    let outside = (y.x / a).hypot(y.y / b) > 1.0;
    let normal = Point::new(nearest.x * (b / a), nearest.y * (a / b)).normalize();
    let distance = (y - nearest).norm();
    let gradient = Point::new(normal.x.copysign(x.x), normal.y.copysign(x.y));
    (if outside { distance } else { -distance }, gradient)
}

/// The point of the ellipse nearest to a point of the first quadrant, `a ≥ b`.
///
/// It is `(a²y₀/(τ+a²), b²y₁/(τ+b²))` with the largest root τ of `(ay₀/(τ+a²))² + (by₁/(τ+b²))² = 1`. In `u = τ/b² + 1`
/// the left side is convex and falls, so that Newton's method from the left of the root never passes it; u keeps its
/// relative accuracy next to the long axis.
fn nearest_on_ellipse(y: Point, a: f64, b: f64) -> Point {
    let (ratio, apart) = ((a / b) * (a / b), (a - b) * (a + b) / (b * b));
    let z = Point::new(y.x / a, y.y / b);
    if z.y == 0.0 {
        // on the long axis the nearest point leaves it between the centres of the smallest circles of curvature
        let share = if apart > 0.0 { z.x * ratio / apart } else { f64::INFINITY };
        return if share < 1.0 {
            Point::new(a * share, b * ((1.0 - share) * (1.0 + share)).sqrt())
        } else {
            Point::new(a, 0.0)
        };
    }
    let n = ratio * z.x;
    let mut u = z.y.max(n - apart);
    for _ in 0..200 {
        let (p, q) = (n / (u + apart), z.y / u);
        let excess = p * p + q * q - 1.0;
        let step = 0.5 * excess / (p * p / (u + apart) + q * q / u);
        if excess.is_nan() || step <= f64::EPSILON * u {
            break;
        }
        u += step;
    }
    // both share the rounding of u; the point is put back on the ellipse
    let (p, q) = (n / (u + apart), z.y / u);
    let r = p.hypot(q);
    Point::new(a * p / r, b * q / r)
}

fn from_polygon(x: Point, vertices: &[Point]) -> (f64, Point) {
    let mut inner = (f64::NEG_INFINITY, Point::zeros());
    let mut outer = (f64::INFINITY, Point::zeros());
    for (p, q) in edges(vertices) {
        let (edge, to_x) = (q - p, x - p);
        let length = edge.norm();
        let normal = Point::new(edge.y, -edge.x) / length;
        let height = normal.dot(&to_x);
        if height > inner.0 {
            inner = (height, normal);
        }
        let along = edge.dot(&to_x) / (length * length);
        let apart = to_x - edge * along.clamp(0.0, 1.0);
        let distance = apart.norm();
        if height > 0.0 && distance < outer.0 {
            let beyond = !(0.0..=1.0).contains(&along);
            outer = (distance, if beyond { apart / distance } else { normal });
        }
    }
    if inner.0 <= 0.0 { inner } else { outer }
}
