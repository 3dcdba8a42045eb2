//! `maps` of an `[[output]]`: pictures of fields.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, de};

use super::output::Field;

/// A scalar that a map shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// `|v|`
    Speed,
    /// `v_1`
    #[serde(rename = "velocity_1")]
    Velocity1,
    /// `v_2`
    #[serde(rename = "velocity_2")]
    Velocity2,
    /// `|p|`
    Polarity,
    /// `p_1`
    #[serde(rename = "polarity_1")]
    Polarity1,
    /// `p_2`
    #[serde(rename = "polarity_2")]
    Polarity2,
    /// `Π`, in a compressible sheet `ρΠ`.
    Pressure,
    /// `ρ`, of a compressible sheet.
    Density,
    /// `|κ²Δ_h p|`
    PolarityLaplacian,
    /// `(κ²Δ_h p)_1`
    #[serde(rename = "polarity_laplacian_1")]
    PolarityLaplacian1,
    /// `(κ²Δ_h p)_2`
    #[serde(rename = "polarity_laplacian_2")]
    PolarityLaplacian2,
    /// No field: the rigid bodies alone, without tissue around them.
    Bodies,
}

/// A vector that a map shows as arrows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ArrowsOf {
    /// `v`
    Velocity,
    /// `p`
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
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum MapTable {
    /// What the colours show; the rest by default.
    Quantity(Quantity),
    /// All that can be said.
    Options(MapOptions),
}

/// `{ of = "speed", arrows = "velocity", window = [[x0, y0], [x1, y1]] }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapOptions {
    /// What the colours show.
    pub of: Quantity,
    /// Name of the files (default: the quantity).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Vector that arrows show (default: none).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arrows: Option<ArrowsOf>,
    /// Whether contour lines of the stream function are drawn (default: no).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub streamlines: bool,
    /// Whether the edges of the cells are drawn (default: no).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mesh: bool,
    /// Lower left and upper right corner (default: the whole domain).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<[[f64; 2]; 2]>,
    /// Ends of the colour bar (default: the smallest and the largest value).
    #[serde(default, skip_serializing_if = "Option::is_none")]
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
