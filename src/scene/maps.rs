//! `maps` of an `[[output]]`: pictures of fields.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, de};

use super::output::Field;
use crate::schema::{self, FLOWS, TISSUE, WITH_DENSITY, WITH_PRESSURE};

/// A scalar that a map shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// `|v|`
    #[schemars(extend("x-kinds" = FLOWS))]
    Speed,
    /// `v_1`
    #[serde(rename = "velocity_1")]
    #[schemars(extend("x-kinds" = FLOWS))]
    Velocity1,
    /// `v_2`
    #[serde(rename = "velocity_2")]
    #[schemars(extend("x-kinds" = FLOWS))]
    Velocity2,
    /// `|p|`
    #[schemars(extend("x-kinds" = TISSUE))]
    Polarity,
    /// `p_1`
    #[serde(rename = "polarity_1")]
    #[schemars(extend("x-kinds" = TISSUE))]
    Polarity1,
    /// `p_2`
    #[serde(rename = "polarity_2")]
    #[schemars(extend("x-kinds" = TISSUE))]
    Polarity2,
    /// `Π`, in a compressible sheet `ρΠ`.
    #[schemars(extend("x-kinds" = WITH_PRESSURE))]
    Pressure,
    /// `ρ`, of a compressible sheet and of advection.
    #[schemars(extend("x-kinds" = WITH_DENSITY))]
    Density,
    /// `|κ²Δ_h p|`
    #[schemars(extend("x-kinds" = TISSUE))]
    PolarityLaplacian,
    /// `(κ²Δ_h p)_1`
    #[serde(rename = "polarity_laplacian_1")]
    #[schemars(extend("x-kinds" = TISSUE))]
    PolarityLaplacian1,
    /// `(κ²Δ_h p)_2`
    #[serde(rename = "polarity_laplacian_2")]
    #[schemars(extend("x-kinds" = TISSUE))]
    PolarityLaplacian2,
    /// No field: the rigid bodies alone, without tissue around them.
    #[schemars(extend("x-kinds" = "stokes particles"))]
    Bodies,
}

/// A vector that a map shows as arrows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ArrowsOf {
    /// `v`
    Velocity,
    /// `p`
    #[schemars(extend("x-kinds" = TISSUE))]
    Polarity,
}

impl Quantity {
    /// Every quantity.
    pub const ALL: [Quantity; 12] = [
        Quantity::Speed,
        Quantity::Velocity1,
        Quantity::Velocity2,
        Quantity::Polarity,
        Quantity::Polarity1,
        Quantity::Polarity2,
        Quantity::Pressure,
        Quantity::Density,
        Quantity::PolarityLaplacian,
        Quantity::PolarityLaplacian1,
        Quantity::PolarityLaplacian2,
        Quantity::Bodies,
    ];

    /// The field that it is a part of; bodies alone have none.
    pub fn field(self) -> Option<Field> {
        use Quantity as Q;
        match self {
            Q::Speed | Q::Velocity1 | Q::Velocity2 => Some(Field::Velocity),
            Q::Polarity | Q::Polarity1 | Q::Polarity2 => Some(Field::Polarity),
            Q::Pressure => Some(Field::Pressure),
            Q::Density => Some(Field::Density),
            Q::PolarityLaplacian | Q::PolarityLaplacian1 | Q::PolarityLaplacian2 => Some(Field::PolarityLaplacian),
            Q::Bodies => None,
        }
    }

    /// Default name of its pictures.
    pub fn file_name(self) -> String {
        self.name().replace('_', "-")
    }

    /// As in the scene file.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Speed => "speed",
            Quantity::Velocity1 => "velocity_1",
            Quantity::Velocity2 => "velocity_2",
            Quantity::Polarity => "polarity",
            Quantity::Polarity1 => "polarity_1",
            Quantity::Polarity2 => "polarity_2",
            Quantity::Pressure => "pressure",
            Quantity::Density => "density",
            Quantity::PolarityLaplacian => "polarity_laplacian",
            Quantity::PolarityLaplacian1 => "polarity_laplacian_1",
            Quantity::PolarityLaplacian2 => "polarity_laplacian_2",
            Quantity::Bodies => "bodies",
        }
    }
}

/// A checked map.
#[derive(Debug, Clone, PartialEq)]
pub struct MapRequest {
    /// Name of the files, without step and ending.
    pub name: String,
    /// What the colours show.
    pub of: Quantity,
    /// The vectors above them.
    pub arrows: Option<ArrowsOf>,
    /// Contour lines of the stream function.
    pub streamlines: bool,
    /// Edges of the cells.
    pub mesh: bool,
    /// Lower left and upper right corner; the whole domain if there is none.
    pub window: Option<[[f64; 2]; 2]>,
    /// Ends of the colour bar; the smallest and the largest value if there are none.
    pub range: Option<[f64; 2]>,
}

/// An element of `maps`: a quantity, or `{ of = "…", … }`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum MapTable {
    /// What the colours show; the rest by default.
    Quantity(Quantity),
    /// All that can be said.
    Options(MapOptions),
}

/// `{ of = "speed", arrows = "velocity", window = [[x0, y0], [x1, y1]] }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct MapOptions {
    /// The quantity.
    pub of: Quantity,
    /// Name of the files, which no other map has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = schema::file_name, extend("x-default" = "the quantity"))]
    pub name: Option<String>,
    /// Vector shown by arrows on a regular grid, lengths in proportion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = FLOWS))]
    pub arrows: Option<ArrowsOf>,
    /// Contour lines of the stream function at even distances `Δψ`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("x-kinds" = "incompressible stokes advection", "default" = false))]
    pub streamlines: bool,
    /// Edges of the cells.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("x-kinds" = FLOWS, "default" = false))]
    pub mesh: bool,
    /// Lower left and upper right corner, in the scene's lengths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-rule" = "sides differ at most 25 times", "x-default" = "the domain"))]
    pub window: Option<[[f64; 2]; 2]>,
    /// Ends of the colour bar; values beyond have the colour of the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = FLOWS, "x-default" = "smallest and largest value shown"))]
    #[schemars(extend("x-rule" = "the smaller one first"))]
    pub range: Option<[f64; 2]>,
}

impl MapOptions {
    /// The quantity alone.
    pub fn of(of: Quantity) -> Self {
        Self { of, name: None, arrows: None, streamlines: false, mesh: false, window: None, range: None }
    }
}

impl MapTable {
    /// Its options, where only a quantity is given all the defaults.
    pub fn options(&self) -> MapOptions {
        match self {
            MapTable::Quantity(of) => MapOptions::of(*of),
            MapTable::Options(options) => options.clone(),
        }
    }
}

impl<'de> Deserialize<'de> for MapTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(MapVisitor)
    }
}

/// By hand, because serde's untagged enums lose line and reason.
struct MapVisitor;

impl<'de> de::Visitor<'de> for MapVisitor {
    type Value = MapTable;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("the name of a quantity or { of = \"speed\", name, arrows, streamlines, mesh, window, range }")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<MapTable, E> {
        Quantity::deserialize(de::value::StrDeserializer::new(name)).map(MapTable::Quantity)
    }

    fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<MapTable, A::Error> {
        MapOptions::deserialize(de::value::MapAccessDeserializer::new(map)).map(MapTable::Options)
    }
}
