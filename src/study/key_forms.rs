//! Keys of a study that have more than one form.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, de};

use super::figures::PlotSpec;

/// `warm_start = true` or the key along which each run starts from its neighbour.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) enum WarmStart {
    #[default]
    Off,
    /// Along the first axis.
    First,
    Along(String),
}

impl JsonSchema for WarmStart {
    fn schema_name() -> Cow<'static, str> {
        "WarmStart".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["boolean", "string"] })
    }
}

impl<'de> Deserialize<'de> for WarmStart {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WarmVisitor)
    }
}

/// By hand, because serde's untagged enums lose line and reason.
struct WarmVisitor;

impl de::Visitor<'_> for WarmVisitor {
    type Value = WarmStart;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("true, false or a key that varies, such as \"model.peclet\"")
    }

    fn visit_bool<E: de::Error>(self, on: bool) -> Result<WarmStart, E> {
        Ok(if on { WarmStart::First } else { WarmStart::Off })
    }

    fn visit_str<E: de::Error>(self, key: &str) -> Result<WarmStart, E> {
        Ok(WarmStart::Along(key.to_owned()))
    }
}

/// One plot or several.
#[derive(Debug, Clone)]
pub(super) struct Plots(pub Vec<PlotSpec>);

impl JsonSchema for Plots {
    fn schema_name() -> Cow<'static, str> {
        "Plots".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let plot = generator.subschema_for::<PlotSpec>();
        json_schema!({ "anyOf": [plot, { "type": "array", "items": plot }] })
    }
}

impl<'de> Deserialize<'de> for Plots {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(PlotsVisitor)
    }
}

/// By hand for the same reason.
struct PlotsVisitor;

impl<'de> de::Visitor<'de> for PlotsVisitor {
    type Value = Plots;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("{ x = \"…\", y = \"…\" } or a list of such tables")
    }

    fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<Plots, A::Error> {
        PlotSpec::deserialize(de::value::MapAccessDeserializer::new(map)).map(|plot| Plots(vec![plot]))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, sequence: A) -> Result<Plots, A::Error> {
        Vec::deserialize(de::value::SeqAccessDeserializer::new(sequence)).map(Plots)
    }
}
