//! Measures as scenes ask for them: by name, or with the boundary tag or the body that they are taken of.

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
    /// Where a measure on a boundary tag is taken, and of which body one of bodies; of the first where none is named.
    pub on: Option<On>,
}

/// What a measure is taken of.
#[derive(Debug, Clone, PartialEq)]
pub struct On {
    /// Of a boundary tag, or of a body.
    pub name: String,
    /// The point that a torque on a tag is about.
    pub around: Option<[f64; 2]>,
}

impl Asked {
    /// Its columns; those of a measure on a tag or of a body that is named have its name, as in `force_x1:disc`.
    pub fn columns(&self) -> impl Iterator<Item = Column> {
        self.measure.columns.iter().map(|column| match &self.on {
            None => *column,
            Some(on) => Column { name: names::kept(format!("{}:{}", column.name, on.name)), ..*column },
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
            (Of::Body(_, take), _) => {
                let name = self.on.as_ref().map(|on| on.name.clone());
                Prepared::Body { take, name, columns: self.column_names().collect() }
            }
            (Of::Boundary { take, .. }, Some(domain)) => {
                let on = self.on.as_ref().expect("a measure on a tag has one");
                let tag = domain.mesh.tag(&on.name).expect("the mesh has the tags of its scene");
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
            Some(On { name: on, around: None }) => write!(out, "{{ {name} = \"{on}\" }}"),
            Some(On { name: on, around: Some([x, y]) }) => write!(out, "{{ {name} = \"{on}\", around = [{x}, {y}] }}"),
        }
    }
}

impl Serialize for Asked {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Some(on) = &self.on else { return self.measure.serialize(serializer) };
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry(self.measure.name, &on.name)?;
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
        out.write_str("the name of a measure, or one on a boundary tag or of a body, such as { force_on = \"disc\" }")
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
            match Measure::named(&key).filter(|measure| takes_a_name(measure)) {
                Some(measure) if found.is_none() => found = Some((measure, map.next_value::<String>()?)),
                None if key == "around" => around = Some(map.next_value::<[f64; 2]>()?),
                Some(measure) => {
                    let rule = "is a second measure: write it in a table of its own";
                    return Err(de::Error::custom(format!("`{}` {rule}", measure.name)));
                }
                None => return Err(de::Error::unknown_field(&key, &KEYS)),
            }
        }
        let Some((measure, name)) = found else {
            return Err(de::Error::custom("it names no measure: write { force_on = \"TAG\" }"));
        };
        if measure.is_around_a_point() != around.is_some() {
            let rule = if around.is_none() { "needs the point that it is about" } else { "is about no point" };
            return Err(de::Error::custom(format!("`{}` {rule}: write {}", measure.name, example(measure))));
        }
        Ok(Asked { measure, on: Some(On { name, around }) })
    }
}

/// Whether it may stand beside the name of a boundary tag or a body.
fn takes_a_name(measure: &Measure) -> bool {
    measure.is_on_a_tag() || measure.is_of_a_body()
}

/// The keys of a measure on a tag or of a body.
static KEYS: LazyLock<Vec<&str>> = LazyLock::new(|| {
    let named = ALL.iter().filter(|measure| takes_a_name(measure));
    named.map(|measure| measure.name).chain(["around"]).collect()
});

/// How a measure on a tag or of a body is written.
fn example(measure: &Measure) -> String {
    let name = if measure.is_on_a_tag() { "TAG" } else { "BODY" };
    let around = if measure.is_around_a_point() { ", around = [x, y]" } else { "" };
    format!("{{ {} = \"{name}\"{around} }}", measure.name)
}

impl JsonSchema for Asked {
    fn schema_name() -> Cow<'static, str> {
        "Measure".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let choices = |measure: &&Measure| {
            let alone = (!measure.is_on_a_tag()).then(|| schema::choice(measure.name, measure.help));
            let named = takes_a_name(measure).then(|| table(measure));
            let mut choices: Vec<serde_json::Value> = alone.into_iter().chain(named).collect();
            choices.iter_mut().for_each(|choice| choice["x-kinds"] = measure.kinds().into());
            choices
        };
        json_schema!({ "oneOf": ALL.iter().flat_map(choices).collect::<Vec<_>>() })
    }
}

/// The table of a measure on a tag or of a body.
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
