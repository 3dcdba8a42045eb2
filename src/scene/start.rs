//! `[initial]`: what a run starts from.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, de};

use crate::expression::{Formula, VectorFormula};
use crate::schema::{self, Range};

/// `[initial]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct InitialTable {
    /// Polarity at the start.
    pub polarity: PolarityStart,
    /// Density at the start; needed there unless there are exact fields.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "compressible", "x-default" = "`\"exact\"` with `[exact]`"))]
    pub density: Option<DensityStart>,
}

/// `initial.polarity`: a name, two formulas, `{ random = { … } }` or `{ file = "…" }`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum PolarityStart {
    /// A start that has a name, such as `aligned-around-disc`.
    Name(String),
    /// Both components.
    Formulas(VectorFormula),
    /// A start that needs more to be said.
    Table(StartTable),
}

/// Starts of the polarity that have a name, and what they are.
pub const NAMED: [(&str, &str); 3] = [
    ("aligned-around-disc", "`e_1` smoothed over `mesh.radius` (or 1), tangential to slip tags, `p_D` on Dirichlet"),
    ("circulating", "the unit vector along the track, counterclockwise, in a `racetrack`, `annulus` or `disc`"),
    ("exact", "the polarity of `[exact]` at `t = 0`"),
];

/// What `{ file = "…" }` is.
pub const OF_FILE: &str = "last polarity of a run on the same domain; mesh and degree may differ";

impl JsonSchema for PolarityStart {
    fn schema_name() -> Cow<'static, str> {
        "PolarityStart".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let named = NAMED.iter().map(|(name, help)| schema::choice(name, help));
        let mut formulas = generator.subschema_for::<VectorFormula>();
        formulas.insert("description".to_owned(), "two formulas, at `t = 0`".into());
        let tables = generator.subschema_for::<StartTable>();
        let all: Vec<_> = named.chain([formulas.to_value(), tables.to_value()]).collect();
        json_schema!({ "oneOf": all })
    }
}

/// The forms of `initial.polarity` that carry values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum StartTable {
    /// Random at the nodes of a lattice, linear between.
    Random(RandomTable),
    /// Path of a checkpoint, from the scene's folder.
    File(String),
}

/// `{ random = { seed, amplitude, h_coarse } }` [10.4.4].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct RandomTable {
    /// Same seed, same start.
    pub seed: u64,
    /// Root mean square of `|p|` at a node.
    #[schemars(transform = Range::POSITIVE.said())]
    pub amplitude: f64,
    /// Edge length of the triangular lattice, which follows from the domain's extent and not from the mesh.
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "length"))]
    pub h_coarse: f64,
}

impl Default for RandomTable {
    /// The edges of the lattice are as long as the sides of the unit disc's 25-gon.
    fn default() -> Self {
        Self { seed: 1, amplitude: 0.1, h_coarse: 0.25 }
    }
}

/// `initial.density`: a formula, a number, `"exact"` or `{ file = "…" }`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum DensityStart {
    /// A formula.
    Formula(Formula),
    /// A start that needs more to be said.
    Table(DensityTable),
}

impl JsonSchema for DensityStart {
    fn schema_name() -> Cow<'static, str> {
        "DensityStart".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let (formula, file) = (generator.subschema_for::<Formula>(), generator.subschema_for::<DensityTable>());
        json_schema!({ "anyOf": [formula, file], "x-values": "formula ≥ 0, `\"exact\"`, `{ file = \"…\" }`" })
    }
}

/// The form of `initial.density` that is a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DensityTable {
    /// Path of a compressible run's checkpoint, from the scene's folder.
    File(String),
}

impl<'de> Deserialize<'de> for PolarityStart {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(StartVisitor)
    }
}

/// By hand, because serde's untagged enums lose line and reason.
struct StartVisitor;

impl<'de> de::Visitor<'de> for StartVisitor {
    type Value = PolarityStart;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("\"aligned-around-disc\", \"circulating\", two formulas, { random = { … } } or { file = \"…\" }")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<PolarityStart, E> {
        Ok(PolarityStart::Name(name.to_owned()))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, sequence: A) -> Result<PolarityStart, A::Error> {
        VectorFormula::deserialize(de::value::SeqAccessDeserializer::new(sequence)).map(PolarityStart::Formulas)
    }

    fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<PolarityStart, A::Error> {
        StartTable::deserialize(de::value::MapAccessDeserializer::new(map)).map(PolarityStart::Table)
    }
}

impl<'de> Deserialize<'de> for DensityStart {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(DensityVisitor)
    }
}

/// By hand for the same reason.
struct DensityVisitor;

impl<'de> de::Visitor<'de> for DensityVisitor {
    type Value = DensityStart;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a formula, a number, \"exact\" or { file = \"…\" }")
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<DensityStart, E> {
        Ok(DensityStart::Formula(Formula::Integer(value)))
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<DensityStart, E> {
        Ok(DensityStart::Formula(Formula::Number(value)))
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<DensityStart, E> {
        Ok(DensityStart::Formula(Formula::Text(text.to_owned())))
    }

    fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<DensityStart, A::Error> {
        DensityTable::deserialize(de::value::MapAccessDeserializer::new(map)).map(DensityStart::Table)
    }
}
