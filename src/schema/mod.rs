//! What the keys of a file are, said once beside the fields that they fill: meaning, range, default, unit.
//!
//! The structs of files derive [`schemars::JsonSchema`]. Comments of fields are what keys mean, serde's defaults are
//! the defaults, and what neither says stands in attributes: a [`Range`] (which the checks read, too), and these
//! extensions.
//!
//! | extension | what it says |
//! | --- | --- |
//! | `x-unit` | what the number is: `length`, `time`, … |
//! | `x-default` | a default that follows from other keys, in words |
//! | `x-rule` | a rule with other keys, in words |
//! | `x-values` | which values there are, in words, where type and range do not tell |
//! | `x-kinds` | kinds of scenes that have the key or the choice, where not all have it |
//! | `x-incompressible` | what else holds of the key in an incompressible sheet |
//! | `x-order` | the keys of a table in their order, see [`in_order`] |
//!
//! From there come the JSON Schema of files ([`printed`]) and the tables of the docs ([`rows`]).

mod fields;
pub mod listed;
mod range;
mod rows;

use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};

pub use fields::fields;
pub use listed::Listed;
pub use range::Range;
pub use rows::{choices, row, rows};

/// Kinds of scenes that are of tissue, for `x-kinds`.
pub const TISSUE: &str = "incompressible compressible";
/// Kinds that have a velocity.
pub const FLOWS: &str = "incompressible compressible stokes advection";
/// Kinds that have a pressure.
pub const WITH_PRESSURE: &str = "incompressible compressible stokes";
/// Kinds that have a density.
pub const WITH_DENSITY: &str = "compressible advection";
/// Kinds whose flow may carry rigid bodies.
pub const IN_A_FLOW: &str = "incompressible stokes";
/// Kinds that may have rigid bodies.
pub const WITH_BODIES: &str = "incompressible stokes particles";

/// A kind of file.
#[derive(Debug, Clone, Copy)]
pub struct FileKind {
    /// As in `monolayer schema`.
    pub name: &'static str,
    /// Its schema with all extensions.
    pub said: fn() -> Value,
}

impl FileKind {
    /// Files of this struct.
    pub const fn of<T: JsonSchema>(name: &'static str) -> Self {
        Self { name, said: of::<T> }
    }

    /// The kind of this name.
    pub fn named(name: &str, all: &[Self]) -> Option<Self> {
        all.iter().find(|kind| kind.name == name).copied()
    }
}

/// The schema of a table with all extensions, and no references in it.
pub fn of<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    schema.remove("title");
    let mut schema = schema.to_value();
    tidy(&mut schema);
    schema
}

/// A transform of a struct: its keys keep their order.
pub fn in_order<T: DeserializeOwned>(schema: &mut Schema) {
    schema.insert("x-order".to_owned(), json!(fields::<T>()));
}

/// A transform of a struct that may be spelled `center` where it has `centre`.
pub fn centre_or_center(schema: &mut Schema) {
    let Some(centre) = schema.pointer("/properties/centre").cloned() else { return };
    if let Some(properties) = schema.get_mut("properties").and_then(Value::as_object_mut) {
        properties.insert("center".to_owned(), centre);
    }
    let Some(required) = schema.get_mut("required").and_then(Value::as_array_mut) else { return };
    if required.iter().any(|key| key == "centre") {
        required.retain(|key| key != "centre");
        schema.insert("oneOf".to_owned(), json!([{ "required": ["centre"] }, { "required": ["center"] }]));
    }
}

/// A transform of a list that must not be empty.
pub fn not_empty(schema: &mut Schema) {
    schema.insert("minItems".to_owned(), json!(1));
}

/// A transform of a text that names files: no blanks, and of the marks of ASCII only `-` and `_`.
pub fn file_name(schema: &mut Schema) {
    schema.insert("pattern".to_owned(), json!(r"^[^\s!-,./:-@\[-^\x60{-~]+$"));
    schema.insert("x-values".to_owned(), json!("letters, digits, `-`, `_`"));
}

/// A flag that may only be on.
pub fn only_true(schema: &mut Schema) {
    schema.insert("const".to_owned(), json!(true));
}

/// A name of a choice and what it does.
pub fn choice(name: &str, help: &str) -> Value {
    json!({ "const": name, "description": help })
}

/// A table of one of these keys, each with the schema of its value.
pub fn one_of_keys(keys: Map<String, Value>) -> Value {
    json!({
        "type": "object",
        "properties": keys,
        "additionalProperties": false,
        "minProperties": 1,
        "maxProperties": 1,
    })
}

/// What stands for any value of another file, for fields that hold one.
pub fn any_values(_: &mut schemars::SchemaGenerator) -> Schema {
    schemars::json_schema!({ "type": "object", "x-values": "table of values" })
}

/// Takes out what TOML does not have: `null`, and formats that are Rust's.
fn tidy(schema: &mut Value) {
    match schema {
        Value::Array(list) => list.iter_mut().for_each(tidy),
        Value::Object(map) => {
            map.values_mut().for_each(tidy);
            let null = |one: &Value| *one == json!({ "type": "null" }) || one.is_null() || one == "null";
            for key in ["type", "enum", "anyOf", "oneOf"] {
                if let Some(list) = map.get_mut(key).and_then(Value::as_array_mut) {
                    list.retain(|one| !null(one));
                }
            }
            if let Some(Value::Array(types)) = map.get("type")
                && let [only] = &types[..]
            {
                map.insert("type".to_owned(), only.clone());
            }
            if let Some(Value::Array(one)) = map.get("anyOf")
                && let [Value::Object(only)] = &one[..]
            {
                // what stands around it speaks of the key, what is in it of its type
                let only = only.clone();
                map.remove("anyOf");
                for (key, value) in only {
                    map.entry(key).or_insert(value);
                }
            }
            if map.get("format").is_some_and(Value::is_string) {
                map.remove("format");
            }
            if map.get("default").is_some_and(|default| default.is_null() || default.is_object()) {
                map.remove("default");
            }
            if map.get("default").and_then(Value::as_array).is_some_and(Vec::is_empty) {
                map.remove("default");
            }
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

/// Leaves what scenes of this kind have.
pub fn of_kind(schema: &mut Value, kind: &str) {
    let has = |one: &Value| {
        let kinds = one.get("x-kinds").and_then(Value::as_str);
        kinds.is_none_or(|kinds| kinds.split(' ').any(|other| other == kind))
    };
    match schema {
        Value::Array(list) => {
            list.retain(has);
            list.iter_mut().for_each(|one| of_kind(one, kind));
        }
        Value::Object(map) => {
            if let Some(properties) = map.get_mut("properties").and_then(Value::as_object_mut) {
                properties.retain(|_, one| has(one));
            }
            if let Some(Value::Object(more)) = map.remove("x-incompressible").filter(|_| kind == "incompressible") {
                map.extend(more);
            }
            map.values_mut().for_each(|one| of_kind(one, kind));
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

/// The schema as editors read it: extensions are told in the descriptions, but for `x-unit`, which stays.
#[must_use]
pub fn printed(mut schema: Value, title: &str) -> Value {
    tell(&mut schema);
    if let Some(map) = schema.as_object_mut() {
        map.insert("title".to_owned(), json!(title));
    }
    schema
}

fn tell(schema: &mut Value) {
    match schema {
        Value::Array(list) => list.iter_mut().for_each(tell),
        Value::Object(map) => {
            map.values_mut().for_each(tell);
            let about = map.get("description").and_then(Value::as_str).unwrap_or_default();
            // lines are those of the code, but for examples
            let mut said = if about.contains("```") { about.to_owned() } else { about.replace('\n', " ") };
            let mut add = |text: String| {
                let dot = if said.is_empty() || said.ends_with(['.', '…']) { "" } else { "." };
                said = format!("{said}{dot}{}{text}", if said.is_empty() { "" } else { " " });
            };
            if let Some(Value::String(rule)) = map.remove("x-rule") {
                add(format!("Rule: {rule}."));
            }
            if let Some(Value::String(default)) = map.remove("x-default") {
                add(format!("Default: {default}."));
            }
            if let Some(Value::String(unit)) = map.get("x-unit") {
                add(format!("Unit: {unit}."));
            }
            if !said.is_empty() {
                map.insert("description".to_owned(), Value::String(said));
            }
            for key in ["x-order", "x-kinds", "x-values"] {
                if !map.get(key).is_some_and(Value::is_object) {
                    map.remove(key);
                }
            }
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}
