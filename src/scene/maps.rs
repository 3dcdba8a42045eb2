//! `maps` of an `[[output]]`: pictures of fields.

use std::borrow::Cow;
use std::fmt;
use std::sync::LazyLock;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use crate::measure::OutputField;
use crate::measure::fields::{ALL, Scalar, Value};
use crate::schema::listed::{self, Listed};
use crate::schema::{self, FLOWS};

/// What the colours of a map show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// A scalar of a field.
    Of(Scalar),
    /// No field: the rigid bodies alone, without tissue around them.
    Bodies,
}

/// The name of [`Quantity::Bodies`].
const BODIES: &str = "bodies";

impl Quantity {
    /// Every quantity.
    pub fn all() -> impl Iterator<Item = Quantity> {
        Scalar::all().map(Quantity::Of).chain([Quantity::Bodies])
    }

    /// The field that it is a part of; bodies alone have none.
    pub fn field(self) -> Option<&'static OutputField> {
        match self {
            Quantity::Of(scalar) => Some(scalar.field),
            Quantity::Bodies => None,
        }
    }

    /// Default name of its pictures.
    pub fn file_name(self) -> String {
        self.name().replace('_', "-")
    }

    /// As in the scene file.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Of(scalar) => scalar.part.name,
            Quantity::Bodies => BODIES,
        }
    }
}

impl Listed for Quantity {
    const WHAT: &'static str = "Quantity";

    fn names() -> &'static [&'static str] {
        static NAMES: LazyLock<Vec<&'static str>> = LazyLock::new(|| Quantity::all().map(Quantity::name).collect());
        &NAMES
    }

    fn named(name: &str) -> Option<Self> {
        Quantity::all().find(|quantity| quantity.name() == name)
    }
}

impl Serialize for Quantity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Quantity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        listed::read(deserializer)
    }
}

impl JsonSchema for Quantity {
    fn schema_name() -> Cow<'static, str> {
        Self::WHAT.into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let choice = |quantity: Quantity| {
            let (help, kinds) = match quantity {
                Quantity::Of(scalar) => (scalar.part.symbol.to_string(), scalar.field.kinds()),
                Quantity::Bodies => ("no field: the rigid bodies alone".to_owned(), "stokes particles".to_owned()),
            };
            let mut choice = schema::choice(quantity.name(), &help);
            choice["x-kinds"] = kinds.into();
            choice
        };
        json_schema!({
            "oneOf": Quantity::all().map(choice).collect::<Vec<_>>(),
            "x-values": "a [quantity](#maps)",
        })
    }
}

/// A vector that a map shows as arrows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArrowsOf(pub &'static OutputField);

impl ArrowsOf {
    fn all() -> impl Iterator<Item = ArrowsOf> {
        ALL.iter().filter(|field| field.value == Value::Vector).map(|field| ArrowsOf(field))
    }
}

impl Listed for ArrowsOf {
    const WHAT: &'static str = "ArrowsOf";

    fn names() -> &'static [&'static str] {
        static NAMES: LazyLock<Vec<&'static str>> = LazyLock::new(|| ArrowsOf::all().map(|one| one.0.name).collect());
        &NAMES
    }

    fn named(name: &str) -> Option<Self> {
        ArrowsOf::all().find(|one| one.0.name == name)
    }
}

impl Serialize for ArrowsOf {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for ArrowsOf {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        listed::read(deserializer)
    }
}

impl JsonSchema for ArrowsOf {
    fn schema_name() -> Cow<'static, str> {
        Self::WHAT.into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let choice = |one: ArrowsOf| {
            let mut choice = schema::choice(one.0.name, &one.0.symbol.to_string());
            choice["x-kinds"] = one.0.kinds().into();
            choice
        };
        json_schema!({ "oneOf": ArrowsOf::all().map(choice).collect::<Vec<_>>() })
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
