//! Measures as scenes ask for them: by name, or with the boundary tag that they are taken on.

use std::borrow::Cow;
use std::fmt;
use std::sync::LazyLock;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use serde_json::json;

use super::subject::OfTissue;
use super::{ALL, Column, Domain, Measure, Of, Prepared, Spot, Taking};
use crate::measure::MeasureError;
use crate::mesh::Point;
use crate::names;
use crate::schema;

/// A measure that is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// Which one.
    pub measure: &'static Measure,
    /// Of a measure on a boundary tag, where it is taken.
    pub on: Option<OnTag>,
}

/// Where a measure on a boundary tag is taken.
#[derive(Debug, Clone, PartialEq)]
pub struct OnTag {
    /// The tag.
    pub tag: String,
    /// The point that a torque is about.
    pub around: Option<[f64; 2]>,
}

impl Asked {
    /// Its columns; those of a measure on a tag are named after the tag, as in `force_x1:disc`.
    pub fn columns(&self) -> impl Iterator<Item = Column> {
        self.measure.columns.iter().map(|column| match &self.on {
            None => *column,
            Some(on) => Column { name: names::kept(format!("{}:{}", column.name, on.tag)), ..*column },
        })
    }

    /// What takes it, in this domain if there is one.
    ///
    /// # Errors
    /// A domain in which it cannot be taken.
    ///
    /// # Panics
    /// A tag that the mesh does not have: scenes are checked for it.
    pub fn prepare(&self, domain: Option<&Domain>) -> Result<Prepared, MeasureError> {
        Ok(match (self.measure.of, domain) {
            (Of::Flow(take), _) => Prepared::Flow(take),
            (Of::Bodies(_, take), _) => Prepared::Bodies(take),
            (Of::Boundary { take, .. }, Some(domain)) => {
                let on = self.on.as_ref().expect("a measure on a tag has one");
                let tag = domain.mesh.tag(&on.tag).expect("the mesh has the tags of its scene");
                let spot = Spot { tag, around: on.around.map_or_else(Point::zeros, Point::from) };
                Prepared::Boundary { take, spot, columns: self.column_names().collect() }
            }
            (Of::Tissue(_, Taking::Prepared(make)) | Of::Compressible(Taking::Prepared(make)), Some(domain)) => {
                Prepared::Tissue(make(domain)?)
            }
            (Of::Tissue(_, Taking::At(take)) | Of::Compressible(Taking::At(take)), _) => {
                Prepared::Tissue(Box::new(OfTissue(take)))
            }
            (Of::Boundary { .. } | Of::Tissue(..) | Of::Compressible(_), None) => unreachable!("a flow has a domain"),
        })
    }

    /// The names of its columns.
    pub fn column_names(&self) -> impl Iterator<Item = &'static str> {
        self.columns().map(|column| column.name)
    }
}

impl From<&'static Measure> for Asked {
    fn from(measure: &'static Measure) -> Self {
        Self { measure, on: None }
    }
}

/// As in the scene.
impl fmt::Display for Asked {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.measure.name;
        match &self.on {
            None => write!(out, "\"{name}\""),
            Some(OnTag { tag, around: None }) => write!(out, "{{ {name} = \"{tag}\" }}"),
            Some(OnTag { tag, around: Some([x, y]) }) => write!(out, "{{ {name} = \"{tag}\", around = [{x}, {y}] }}"),
        }
    }
}

impl Serialize for Asked {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Some(on) = &self.on else { return self.measure.serialize(serializer) };
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry(self.measure.name, &on.tag)?;
        on.around.iter().try_for_each(|around| map.serialize_entry("around", around))?;
        map.end()
    }
}

impl<'de> Deserialize<'de> for Asked {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AskedVisitor)
    }
}

/// By hand, because serde's untagged enums lose line and reason.
struct AskedVisitor;

impl<'de> de::Visitor<'de> for AskedVisitor {
    type Value = Asked;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("the name of a measure, or one on a boundary tag, such as { force_on = \"disc\" }")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<Asked, E> {
        let measure = <&'static Measure>::deserialize(de::value::StrDeserializer::new(name))?;
        match measure.is_on_a_tag() {
            false => Ok(measure.into()),
            true => Err(E::custom(format!("`{name}` needs the tag of a boundary: write {}", example(measure)))),
        }
    }

    fn visit_map<A: de::MapAccess<'de>>(self, mut map: A) -> Result<Asked, A::Error> {
        let (mut found, mut around) = (None, None);
        while let Some(key) = map.next_key::<String>()? {
            match Measure::named(&key).filter(|measure| measure.is_on_a_tag()) {
                Some(measure) if found.is_none() => found = Some((measure, map.next_value::<String>()?)),
                None if key == "around" => around = Some(map.next_value::<[f64; 2]>()?),
                Some(measure) => {
                    let rule = "is a second measure: write it in a table of its own";
                    return Err(de::Error::custom(format!("`{}` {rule}", measure.name)));
                }
                None => return Err(de::Error::unknown_field(&key, &KEYS)),
            }
        }
        let Some((measure, tag)) = found else {
            return Err(de::Error::custom("it names no measure: write { force_on = \"TAG\" }"));
        };
        if measure.is_around_a_point() != around.is_some() {
            let name = measure.name;
            let rule = if around.is_none() { "needs the point that it is about" } else { "is about no point" };
            return Err(de::Error::custom(format!("`{name}` {rule}: write {}", example(measure))));
        }
        Ok(Asked { measure, on: Some(OnTag { tag, around }) })
    }
}

/// The measures on boundary tags.
fn on_tags() -> impl Iterator<Item = &'static Measure> {
    ALL.iter().copied().filter(|measure| measure.is_on_a_tag())
}

/// The keys of a measure on a tag.
static KEYS: LazyLock<Vec<&str>> = LazyLock::new(|| on_tags().map(|measure| measure.name).chain(["around"]).collect());

/// How a measure on a tag is written.
fn example(measure: &Measure) -> String {
    let around = if measure.is_around_a_point() { ", around = [x, y]" } else { "" };
    format!("{{ {} = \"TAG\"{around} }}", measure.name)
}

impl JsonSchema for Asked {
    fn schema_name() -> Cow<'static, str> {
        "Measure".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let choice = |measure: &&Measure| {
            let mut choice = match measure.is_on_a_tag() {
                false => schema::choice(measure.name, measure.help),
                true => table(measure),
            };
            choice["x-kinds"] = measure.kinds().into();
            choice
        };
        json_schema!({ "oneOf": ALL.iter().map(choice).collect::<Vec<_>>() })
    }
}

/// The table of a measure on a tag.
fn table(measure: &Measure) -> serde_json::Value {
    let mut keys = serde_json::Map::new();
    keys.insert(measure.name.to_owned(), json!({ "type": "string", "description": measure.help }));
    if measure.is_around_a_point() {
        let pair = json!({ "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": 2 });
        keys.insert("around".to_owned(), pair);
    }
    let required: Vec<&String> = keys.keys().collect();
    json!({ "type": "object", "required": required, "properties": keys, "additionalProperties": false })
}
