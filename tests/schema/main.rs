//! What is said of keys beside their fields: the schemas that editors take, the checks, and the tables of the docs
//! agree.

mod misspelt;
mod pages;
mod ranges;
mod valid;

use std::path::{Path, PathBuf};

use jsonschema::Validator;
use monolayer::run::AnyScene;
use monolayer::scene::SceneSource;
use serde_json::Value;

/// A TOML text as the JSON that a schema is about. Numbers that JSON does not have are the largest that it has.
fn json(text: &str) -> Option<Value> {
    let table: toml::Table = text.parse().ok()?;
    Some(of(toml::Value::Table(table)))
}

fn of(value: toml::Value) -> Value {
    match value {
        toml::Value::String(text) => Value::String(text),
        toml::Value::Integer(number) => number.into(),
        toml::Value::Float(number) => number.clamp(-f64::MAX, f64::MAX).into(),
        toml::Value::Boolean(flag) => flag.into(),
        toml::Value::Datetime(time) => Value::String(time.to_string()),
        toml::Value::Array(list) => list.into_iter().map(of).collect(),
        toml::Value::Table(table) => table.into_iter().map(|(key, value)| (key, of(value))).collect(),
    }
}

fn validator(schema: &Value) -> Validator {
    jsonschema::draft202012::new(schema).expect("a schema")
}

/// What a schema finds wrong with a text.
fn wrong(validator: &Validator, text: &str) -> Vec<String> {
    let value = json(text).expect("TOML");
    validator.iter_errors(&value).map(|error| format!("{}: {error}", error.instance_path())).collect()
}

/// Whether a text is a scene without a mistake, its mesh included, as if it lay in this folder.
fn check(text: &str, folder: &Path) -> Result<AnyScene, String> {
    let source = SceneSource::parse(text, &folder.join("scene.toml")).map_err(|error| error.to_string())?;
    let scene = AnyScene::check(source).map_err(|error| error.to_string())?;
    match scene.mesh() {
        Some(mesh) if mesh.shape().is_some() && mesh.expected().is_none() => {
            Err(mesh.build().expect_err("a mesh that is refused").to_string())
        }
        Some(_) | None => Ok(scene),
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Files of a folder and of those in it with this ending.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, ending));
        } else if path.extension().is_some_and(|other| other == ending) {
            found.push(path);
        }
    }
    found.sort();
    found
}
