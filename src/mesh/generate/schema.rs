//! The schema of `[mesh]`, and its tables in the docs, from the list of generators.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde_json::{Map, Value, json};

use super::keys::{Key, ValueKind, Values};
use super::table::{BESIDE_FILE, KEYS, MeshScene};
use super::{GENERATORS, Generator};
use crate::schema;

impl JsonSchema for MeshScene {
    fn schema_name() -> Cow<'static, str> {
        "MeshScene".into()
    }

    /// All keys stand side by side, where editors find them; which of them a shape has, and which it must have, is said
    /// shape by shape below.
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let shapes: Vec<Value> = GENERATORS.iter().map(|shape| schema::choice(shape.name, shape.about)).collect();
        let mut properties = Map::new();
        properties.insert("shape".to_owned(), json!({ "oneOf": shapes, "description": "Domain; this or `file`." }));
        let file = "Gmsh file (MSH 2.0 to 2.2, 4.0 or 4.1), from the scene's folder.";
        properties.insert("file".to_owned(), json!({ "type": "string", "description": file, "x-values": "path" }));
        let slits = "Beside `file`: boundary edges may lie on one another.";
        properties.insert("slits".to_owned(), json!({ "type": "boolean", "description": slits, "default": false }));
        properties.extend(KEYS.iter().map(|key| (key.name.to_owned(), of_key(key.name))));
        let beside: Vec<&str> = ["file", "slits"].into_iter().chain(BESIDE_FILE).collect();
        let file = json!({ "required": ["file"], "propertyNames": { "enum": beside } });
        let chain = GENERATORS.iter().rev().fold(file, |other, shape| {
            let names: Vec<&str> = ["shape"].into_iter().chain(shape.keys.iter().map(|key| key.name)).collect();
            let must: Vec<&str> = shape.keys.iter().filter(|key| key.must).map(|key| key.name).collect();
            json!({
                "if": { "properties": { "shape": { "const": shape.name } }, "required": ["shape"] },
                "then": { "required": must, "propertyNames": { "enum": names } },
                "else": other,
            })
        });
        let mut all = json!({ "type": "object", "properties": properties, "additionalProperties": false });
        if let (Some(all), Value::Object(chain)) = (all.as_object_mut(), chain) {
            all.extend(chain);
        }
        Schema::try_from(all).unwrap_or_default()
    }
}

/// The generators that have a key, with what they say of it.
fn owners(name: &str) -> impl Iterator<Item = (&'static Generator, &'static Key)> {
    GENERATORS.iter().filter_map(move |shape| Some((shape, shape.key(name)?)))
}

/// What a key is, in all shapes that have it.
fn of_key(name: &str) -> Value {
    let mut schema = Map::new();
    let mut abouts: Vec<&str> = Vec::new();
    let mut defaults: Vec<(String, Value, &str)> = Vec::new();
    for (shape, key) in owners(name) {
        let about = key.about.trim_end_matches('.');
        if !abouts.contains(&about) {
            abouts.push(about);
        }
        if let Some((text, value)) = default(shape, key)
            && defaults.iter().all(|(other, ..)| *other != text)
        {
            defaults.push((text, value, shape.name));
        }
        let number = |key: &Key| {
            let mut number =
                schemars::json_schema!({ "type": if key.kind == ValueKind::Whole { "integer" } else { "number" } });
            if key.kind == ValueKind::Whole {
                number.insert("minimum".to_owned(), json!(0));
            }
            if key.meaning != super::Meaning::Free {
                key.meaning.range().said()(&mut number);
            }
            number.to_value()
        };
        let of_kind = match key.kind {
            ValueKind::Flag => json!({ "type": "boolean" }),
            ValueKind::Whole | ValueKind::Number => number(key),
            ValueKind::Pair => json!({ "type": "array", "items": number(key), "minItems": 2, "maxItems": 2 }),
        };
        schema.extend(of_kind.as_object().cloned().unwrap_or_default());
        if let (Some(unit), ValueKind::Number) = (key.meaning.unit(), key.kind) {
            schema.insert("x-unit".to_owned(), json!(unit));
        }
    }
    let [first, others @ ..] = &abouts[..] else { return Value::Object(schema) };
    let others = others.iter().map(|about| format!("; {}", small(about)));
    schema.insert("description".to_owned(), json!(format!("{first}{}.", others.collect::<String>())));
    match &defaults[..] {
        [] => {}
        [(_, value, _)] if !value.is_null() => drop(schema.insert("default".to_owned(), value.clone())),
        [(text, ..)] => drop(schema.insert("x-default".to_owned(), json!(text))),
        [(first, ..), others @ ..] => {
            let others = others.iter().map(|(text, _, shape)| format!("; `{shape}`: {text}")).collect::<String>();
            schema.insert("x-default".to_owned(), json!(format!("{first}{others}")));
        }
    }
    Value::Object(schema)
}

fn small(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_lowercase().chain(letters).collect())
}

/// The default of a key in words and, where it is always the same, as a value; none of a key that must be given.
fn default(shape: &Generator, key: &Key) -> Option<(String, Value)> {
    if key.must {
        return None;
    }
    if let Some(words) = key.otherwise {
        return Some((words.to_owned(), Value::Null));
    }
    let domain = (shape.read)(&Values::new());
    let at = shape.keys.iter().position(|other| other.name == key.name)?;
    let value = *domain.values().get(at)?;
    let value = serde_json::to_value(value?).ok()?;
    Some((format!("`{value}`"), value))
}

/// `| shape | domain | must have | may have | boundary tags |` for every generator, as the docs have it.
pub fn shape_rows() -> Vec<String> {
    let list = |names: Vec<&str>| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let row = |shape: &Generator| {
        let (must, may): (Vec<&Key>, Vec<&Key>) = shape.keys.iter().partition(|key| key.must);
        let [must, may] = [must, may].map(|keys| list(keys.iter().map(|key| key.name).collect()));
        let tags = list((shape.read)(&Values::new()).tags().to_vec());
        format!("| `{}` | {} | {must} | {may} | {tags} |", shape.name, small(shape.about.trim_end_matches('.')))
    };
    GENERATORS.iter().map(row).collect()
}

/// `| key | meaning | values | default |` for every key of a shape or a file.
pub fn key_rows() -> Vec<String> {
    let table = schema::of::<MeshScene>();
    let names = KEYS.iter().map(|key| key.name).chain(["file", "slits"]);
    let row = |name: &str| {
        let must = owners(name).next().is_some() && owners(name).all(|(_, key)| key.must);
        schema::row(name, &table["properties"][name], must, None)
    };
    names.map(row).collect()
}
