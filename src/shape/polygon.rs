//! The convex polygon.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::NARROWEST;
use super::figure::{Core, Figure, edges};
use super::form::{Checked, Described, Form, Rules};
use super::{Shape, ShapeError};
use crate::mesh::Point;
use crate::schema;

/// Convex, counterclockwise, about the centre of its area.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Polygon {
    /// Counterclockwise.
    pub vertices: Vec<Point>,
}

/// `{ polygon = { vertices = [[x, y], …] } }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct PolygonTable {
    /// Corners, either way round.
    #[schemars(extend("minItems" = 3))]
    pub vertices: Vec<[f64; 2]>,
}

impl Described for PolygonTable {
    const EXAMPLES: &'static [&'static str] = &[
        "vertices = [[0, 0], [0.5, 0.1], [0.2, 0.6]]",
        "vertices = [[1.0, 0.0], [1.0, 0.4], [1.5, 0.4], [1.5, 0.0]]",
        "vertices = [[0.3, 0], [0.1, 0.3], [-0.2, 0.25], [-0.3, -0.1], [0.05, -0.3]]",
    ];

    fn make<R: Rules>(&self, rules: &R) -> Result<(Shape, Option<Point>), R::Error> {
        let vertices = self.vertices.iter().map(|x| Point::from(*x)).collect();
        let value = format!("{} vertices", self.vertices.len());
        let (polygon, centre) = Polygon::centred(vertices).map_err(|error| rules.wrong("vertices", value, &error))?;
        rules.length("vertices", polygon.circumradius(), "corners such as [[0, 0], [1, 0], [0, 1]]")?;
        Ok((polygon.into(), Some(centre)))
    }
}

impl Polygon {
    /// The polygon with these vertices, either way round, about the centre of its area; and where that centre was.
    ///
    /// # Errors
    /// Fewer than three vertices, repeated ones, a polygon that is not convex, or a sliver.
    pub fn centred(mut vertices: Vec<Point>) -> Result<(Polygon, Point), ShapeError> {
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
        Ok((Polygon { vertices }, centre))
    }
}

impl Checked for Polygon {
    fn checked(self) -> Result<Self, ShapeError> {
        Self::centred(self.vertices).map(|(polygon, _)| polygon)
    }
}

impl Form for Polygon {
    fn figure(&self) -> Figure<'_> {
        Figure::Around { core: Core::Polygon(&self.vertices), radius: 0.0 }
    }

    fn area(&self) -> f64 {
        edges(&self.vertices).map(|(p, q)| 0.5 * p.perp(&q)).sum()
    }

    fn second_moment(&self) -> f64 {
        edges(&self.vertices).map(|(p, q)| p.perp(&q) * (p.norm_squared() + p.dot(&q) + q.norm_squared()) / 12.0).sum()
    }

    fn inradius(&self) -> f64 {
        edges(&self.vertices).map(|(p, q)| p.perp(&q) / (q - p).norm()).fold(f64::INFINITY, f64::min)
    }

    fn contains(&self, x: Point) -> bool {
        edges(&self.vertices).all(|(p, q)| (q - p).perp(&(x - p)) >= 0.0)
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
