//! `[initial]`: what a run starts from.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, de};

use crate::expression::{Formula, VectorFormula};

/// `[initial]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InitialTable {
    /// The polarity at t = 0.
    pub polarity: PolarityStart,
    /// Compressible only, and needed there unless there are exact fields.
    #[serde(default, skip_serializing_if = "Option::is_none")]
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

/// The forms of `initial.polarity` that carry values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StartTable {
    /// Vectors at random.
    Random(RandomTable),
    /// The last state of another run.
    File(String),
}

/// `{ random = { seed, amplitude, h_coarse } }` [10.4.4].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RandomTable {
    /// Same seed, same start (default 1).
    pub seed: u64,
    /// Standard deviation of the length of p at a coarse node (default 0.1).
    pub amplitude: f64,
    /// Edge length of the coarse mesh whose nodes are drawn (default 0.25, the side of the unit disc's 25-gon).
    pub h_coarse: f64,
}

impl Default for RandomTable {
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

/// The form of `initial.density` that is a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DensityTable {
    /// The last state of another run.
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
