//! The disc.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::figure::{Core, Figure};
use super::form::{Checked, Described, Form, LENGTH, LENGTHS, Rules};
use super::{Shape, ShapeError};
use crate::mesh::Point;
use crate::schema;

/// All points within `radius` of the origin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Disc {
    /// Its radius.
    pub radius: f64,
}

/// `{ disc = { radius } }`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct DiscTable {
    /// Radius.
    #[schemars(transform = LENGTHS.said(), extend("x-unit" = "length"))]
    pub radius: f64,
}

impl Described for DiscTable {
    const EXAMPLES: &'static [&'static str] = &["radius = 0.3"];

    fn make<R: Rules>(&self, rules: &R) -> Result<(Shape, Option<Point>), R::Error> {
        Ok((Disc { radius: rules.length("radius", self.radius, LENGTH)? }.into(), None))
    }
}

impl Checked for Disc {
    fn checked(self) -> Result<Self, ShapeError> {
        ShapeError::positive("radius", self.radius)?;
        Ok(self)
    }
}

impl Form for Disc {
    fn figure(&self) -> Figure<'_> {
        Figure::Around { core: Core::Point, radius: self.radius }
    }

    fn area(&self) -> f64 {
        PI * self.radius * self.radius
    }

    fn inradius(&self) -> f64 {
        self.radius
    }
}
