//! The regular polygon, with corners that may be round.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::figure::{Core, Figure};
use super::form::{Checked, Described, Form, LENGTH, LENGTHS, Rules};
use super::polygon::Polygon;
use super::{Shape, ShapeError};
use crate::mesh::Point;
use crate::schema::{self, Range};

/// All points within `rounding` of a regular polygon about the origin, one of whose corners is on the first axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegularPolygon {
    /// Counterclockwise.
    vertices: Vec<Point>,
    rounding: f64,
}

/// `{ regular-polygon = { sides, radius, rounding } }`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct RegularPolygonTable {
    /// How many sides.
    #[schemars(transform = RegularPolygonTable::SIDES.said())]
    pub sides: usize,
    /// From the centre to the corners, before they are rounded.
    #[schemars(transform = LENGTHS.said(), extend("x-unit" = "length"))]
    pub radius: f64,
    /// By how much the polygon is thickened, which makes its corners round.
    #[serde(default)]
    #[schemars(transform = RegularPolygonTable::ROUNDING.said())]
    #[schemars(extend("x-unit" = "length", "x-rule" = "0 or at least 1e-9"))]
    pub rounding: f64,
}

impl RegularPolygonTable {
    /// Of the number of sides.
    pub const SIDES: Range = Range::within(3.0, 100.0);
    /// A length, or nothing.
    pub const ROUNDING: Range = Range::within(0.0, 1e9);
}

impl Described for RegularPolygonTable {
    const EXAMPLES: &'static [&'static str] = &[
        "sides = 6\nradius = 0.3",
        "sides = 3\nradius = 0.2\nrounding = 0.1",
        "sides = 6\nradius = 0.3\nrounding = 0.05",
        "sides = 5\nradius = 0.01\nrounding = 0.3",
    ];

    fn make<R: Rules>(&self, rules: &R) -> Result<(Shape, Option<Point>), R::Error> {
        let hint = "6 makes a hexagon; a disc is round";
        rules.within("sides", self.sides as f64, Self::SIDES, "must lie between 3 and 100", hint)?;
        let radius = rules.length("radius", self.radius, LENGTH)?;
        let rounding = match self.rounding {
            0.0 => 0.0,
            some => rules.length("rounding", some, "a length, such as 0.01; 0 keeps sharp corners")?,
        };
        let polygon = RegularPolygon::new(self.sides, radius, rounding).checked();
        let polygon = polygon.map_err(|error| rules.wrong("sides", self.sides.to_string(), &error))?;
        Ok((polygon.into(), None))
    }
}

impl RegularPolygon {
    /// With corners at `radius` from the origin, thickened by `rounding`.
    pub fn new(sides: usize, radius: f64, rounding: f64) -> Self {
        let corner = |k: usize| {
            let (s, c) = (std::f64::consts::TAU * k as f64 / sides as f64).sin_cos();
            radius * Point::new(c, s)
        };
        Self { vertices: (0..sides).map(corner).collect(), rounding }
    }
}

impl Checked for RegularPolygon {
    fn checked(self) -> Result<Self, ShapeError> {
        if !(self.rounding >= 0.0 && self.rounding.is_finite()) {
            let hint = "0 keeps sharp corners";
            return Err(ShapeError::Negative { what: "rounding", value: self.rounding, hint });
        }
        Polygon { vertices: self.vertices.clone() }.checked()?;
        Ok(self)
    }
}

impl Form for RegularPolygon {
    fn figure(&self) -> Figure<'_> {
        Figure::Around { core: Core::Polygon(&self.vertices), radius: self.rounding }
    }
}
