//! Rigid bodies as geometry: shapes by distance and outline, poses, twists.
//!
//! A shape is one file and one row of the list of shapes. The file has its geometry, from a figure (what is thickened
//! by which radius) and the closed forms that it knows, and its table in scenes with the rules on its keys.

mod capsule;
mod disc;
mod ellipse;
mod error;
pub mod figure;
mod form;
pub mod outline;
mod polygon;
mod pose;
mod regular_polygon;

use std::ops::Deref;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::mesh::Point;

pub use error::ShapeError;
pub use figure::{Core, Figure, edges};
pub use form::{Checked, Described, Form, LENGTHS, Rules};
pub use outline::Placed;
pub use pose::{Pose, Twist, Wrench, perpendicular, rigid_motion, turned};

/// Makes of the list of shapes: the shape of a body, the table of a shape in scenes, and the rows that tests go
/// through.
macro_rules! shapes {
    ($($(#[doc = $about:literal])+ $name:literal => $file:ident::$shape:ident, $table:ident;)+) => {
        $(pub use $file::{$shape, $table};)+

        /// The list of all shapes, by the name of their row.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        enum Listed {
            $(#[serde(rename = $name)] $shape($shape),)+
        }

        /// `body.shape`
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        pub enum ShapeTable {
            $(
                $(#[doc = $about])+
                #[serde(rename = $name)]
                $shape($table),
            )+
        }

        /// Every shape.
        pub static SHAPES: &[Row] = &[$(Row { name: $name, examples: $table::EXAMPLES },)+];

        $(impl From<$shape> for Shape {
            fn from(shape: $shape) -> Self {
                Shape(Listed::$shape(shape))
            }
        })+

        impl Shape {
            /// The shape if it is one: sizes positive and finite, polygons convex, made counterclockwise and moved so
            /// that the centre of area is the origin.
            ///
            /// # Errors
            /// What is wrong, with a hint.
            pub fn checked(self) -> Result<Shape, ShapeError> {
                match self.0 {
                    $(Listed::$shape(shape) => shape.checked().map(Shape::from),)+
                }
            }
        }

        impl Deref for Shape {
            type Target = dyn Form;

            fn deref(&self) -> &Self::Target {
                match &self.0 {
                    $(Listed::$shape(shape) => shape,)+
                }
            }
        }

        impl ShapeTable {
            /// The name of its row.
            pub fn name(&self) -> &'static str {
                match self {
                    $(ShapeTable::$shape(_) => $name,)+
                }
            }

            /// The shape about its centre of area; and where that is in the coordinates of the table, where it has
            /// some.
            ///
            /// # Errors
            /// Those of the rules, for the first key with a wrong value.
            pub fn make<R: Rules>(&self, rules: &R) -> Result<(Shape, Option<Point>), R::Error> {
                match self {
                    $(ShapeTable::$shape(table) => table.make(rules),)+
                }
            }
        }
    };
}

shapes! {
    /// A disc.
    "disc" => disc::Disc, DiscTable;
    /// An ellipse.
    "ellipse" => ellipse::Ellipse, EllipseTable;
    /// A straight part between two half discs.
    "capsule" => capsule::Capsule, CapsuleTable;
    /// A convex polygon.
    "polygon" => polygon::Polygon, PolygonTable;
    /// All points within `rounding` of a regular polygon, one of whose corners is on the body's first axis.
    "regular-polygon" => regular_polygon::RegularPolygon, RegularPolygonTable;
}

/// The shape of a body, one of those in [`SHAPES`]; what one asks of it is in [`Form`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Shape(Listed);

/// A row of the list of shapes.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// As in `body.shape`.
    pub name: &'static str,
    /// Tables of it, as in a scene.
    pub examples: &'static [&'static str],
}
