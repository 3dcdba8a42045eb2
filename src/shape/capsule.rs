//! The capsule, a rod with round ends.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::{NARROWEST, THICKER};
use super::figure::{Core, Figure, from_round};
use super::form::{Checked, Described, Form, LENGTH, LENGTHS, Rules};
use super::outline::Piece;
use super::{Shape, ShapeError};
use crate::mesh::Point;
use crate::schema;

/// All points within `radius` of the segment from `(−half_length, 0)` to `(half_length, 0)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Capsule {
    /// Half of the length of its core.
    pub half_length: f64,
    /// What the core is thickened by.
    pub radius: f64,
}

/// `{ capsule = { length, radius } }`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct CapsuleTable {
    /// Of the straight part.
    #[schemars(transform = LENGTHS.said(), extend("x-unit" = "length"))]
    pub length: f64,
    /// Of the half discs.
    #[schemars(transform = LENGTHS.said(), extend("x-unit" = "length"))]
    pub radius: f64,
}

impl Described for CapsuleTable {
    const EXAMPLES: &'static [&'static str] = &["length = 0.5\nradius = 0.1", "length = 0.6\nradius = 0.03"];

    fn make<R: Rules>(&self, rules: &R) -> Result<(Shape, Option<Point>), R::Error> {
        let half_length = 0.5 * rules.length("length", self.length, LENGTH)?;
        let radius = rules.length("radius", self.radius, LENGTH)?;
        let capsule = Capsule { half_length, radius }.checked();
        let capsule = capsule.map_err(|error| rules.wrong("radius", radius.to_string(), &error))?;
        Ok((capsule.into(), None))
    }
}

impl Checked for Capsule {
    fn checked(self) -> Result<Self, ShapeError> {
        let Self { half_length, radius } = self;
        ShapeError::positive("radius", radius)?;
        if !(half_length >= 0.0 && half_length.is_finite()) {
            let hint = "0 makes the capsule a disc";
            return Err(ShapeError::Negative { what: "length", value: 2.0 * half_length, hint });
        }
        let width = radius / (half_length + radius);
        if width < NARROWEST {
            return Err(ShapeError::Sliver { shape: "capsule", width, hint: THICKER });
        }
        Ok(self)
    }
}

impl Form for Capsule {
    fn figure(&self) -> Figure<'_> {
        let end = |x: f64| Point::new(x, 0.0);
        let core = if self.half_length > 0.0 {
            Core::Segment([-self.half_length, self.half_length].map(end))
        } else {
            Core::Point
        };
        Figure::Around { core, radius: self.radius }
    }

    fn area(&self) -> f64 {
        self.radius * (4.0 * self.half_length + PI * self.radius)
    }

    fn second_moment(&self) -> f64 {
        let (l, r) = (self.half_length, self.radius);
        let rectangle = 4.0 * l * r * (l * l + r * r) / 3.0;
        // both half discs make a disc whose halves are moved by l, their centres of area a further 4r/(3π)
        let caps = PI * r * r * (0.5 * r * r + l * l) + 8.0 * r.powi(3) * l / 3.0;
        rectangle + caps
    }

    fn inradius(&self) -> f64 {
        self.radius
    }

    fn signed_distance(&self, x: Point) -> (f64, Point) {
        let nearest = Point::new(x.x.clamp(-self.half_length, self.half_length), 0.0);
        from_round(x - nearest, self.radius, Point::new(0.0, 1.0))
    }

    fn contains(&self, x: Point) -> bool {
        (x.x - x.x.clamp(-self.half_length, self.half_length)).hypot(x.y) <= self.radius
    }

    fn boundary(&self) -> Vec<Piece> {
        let (l, r) = (self.half_length, self.radius);
        let arc = |x: f64, from: f64, to: f64| Piece::Arc {
            centre: Point::new(x, 0.0),
            axes: [Point::new(r, 0.0), Point::new(0.0, r)],
            from,
            to,
        };
        let side = |x: f64, y: f64| Piece::Segment { from: Point::new(x, y), to: Point::new(-x, y) };
        vec![arc(l, -0.5 * PI, 0.5 * PI), side(l, r), arc(-l, 0.5 * PI, 1.5 * PI), side(-l, -r)]
    }

    fn support(&self, direction: Point) -> Point {
        let unit = direction.try_normalize(0.0).unwrap_or(Point::new(1.0, 0.0));
        Point::new(self.half_length.copysign(unit.x), 0.0) + unit * self.radius
    }
}
