//! A condition as a scene has it: a name, alone or with a formula or two.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de, ser::SerializeMap};

use crate::expression::{Formula, VectorFormula};

/// A condition as the file has it: a name, or a table of one name with a formula or two.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCondition {
    /// Such as `slip`.
    pub name: String,
    /// What it prescribes, where it prescribes something.
    pub values: Option<Values>,
}

/// What a condition is given.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Values {
    /// A scalar.
    One(Formula),
    /// A vector.
    Pair(VectorFormula),
}

impl<'de> Deserialize<'de> for Values {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ValuesVisitor)
    }
}

/// By hand, because serde's untagged enums lose line and reason.
struct ValuesVisitor;

impl<'de> de::Visitor<'de> for ValuesVisitor {
    type Value = Values;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a formula, a number, or two of them")
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Values, E> {
        Ok(Values::One(Formula::Integer(value)))
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Values, E> {
        Ok(Values::One(Formula::Number(value)))
    }

    fn visit_str<E: de::Error>(self, value: &str) -> Result<Values, E> {
        Ok(Values::One(Formula::Text(value.to_owned())))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, sequence: A) -> Result<Values, A::Error> {
        VectorFormula::deserialize(de::value::SeqAccessDeserializer::new(sequence)).map(Values::Pair)
    }
}

impl fmt::Display for NamedCondition {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.values {
            None => write!(out, "\"{}\"", self.name),
            Some(Values::One(value)) => write!(out, "{{ {} = \"{value}\" }}", self.name),
            Some(Values::Pair([first, second])) => write!(out, "{{ {} = [\"{first}\", \"{second}\"] }}", self.name),
        }
    }
}

impl Serialize for NamedCondition {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.values {
            None => serializer.serialize_str(&self.name),
            Some(values) => {
                let mut map = serializer.serialize_map(Some(1))?;
                map.serialize_entry(&self.name, values)?;
                map.end()
            }
        }
    }
}

impl<'de> Deserialize<'de> for NamedCondition {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ConditionVisitor)
    }
}

/// By hand, because serde's untagged enums lose line and reason.
struct ConditionVisitor;

impl<'de> de::Visitor<'de> for ConditionVisitor {
    type Value = NamedCondition;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a condition such as \"slip\" or { dirichlet = [\"1\", \"0\"] }")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<NamedCondition, E> {
        Ok(NamedCondition { name: name.to_owned(), values: None })
    }

    fn visit_map<A: de::MapAccess<'de>>(self, mut map: A) -> Result<NamedCondition, A::Error> {
        let one = || de::Error::custom("a condition has exactly one name, as in { dirichlet = [\"1\", \"0\"] }");
        let name = map.next_key::<String>()?.ok_or_else(one)?;
        let values = match name.as_str() {
            "dirichlet" | "traction" => Values::Pair(map.next_value()?),
            _ => map.next_value()?,
        };
        if map.next_key::<String>()?.is_some() {
            return Err(one());
        }
        Ok(NamedCondition { name, values: Some(values) })
    }
}
