//! The JSON Schema of scenes, for editors that complete and check TOML, and for the tables of the docs.

use serde_json::{Map, Value, json};

use super::kinds::{self, SceneKind};
use crate::mesh::generate::{GENERATORS, MeshScene, Scale};
use crate::schema::{self, FileKind, printed};

/// What `model.kind` may be, and the file of such a scene.
pub fn kinds() -> Vec<FileKind> {
    let named = |kind: &'static SceneKind| kind.names.iter().map(|name| FileKind { name, said: kind.said });
    kinds::ALL.into_iter().flat_map(named).collect()
}

/// The schema of scenes of one kind; `None` of a kind that does not exist.
pub fn of_kind(kind: &str) -> Option<Value> {
    let mut scene = (FileKind::named(kind, &kinds())?.said)();
    schema::of_kind(&mut scene, kind);
    if scene.pointer("/properties/accuracy").is_some() {
        without_what_a_preset_gives(&mut scene);
    }
    Some(printed(scene, &format!("A scene of monolayer: kind = \"{kind}\"")))
}

/// The schema of scenes of any kind.
///
/// What holds of a scene is said by its kind in `if` and `then`, so that a message is about the key that is wrong.
/// Editors look for keys in `anyOf` alone; the last choice there holds always.
pub fn of_scenes() -> Value {
    let names: Vec<&str> = kinds().iter().map(|kind| kind.name).collect();
    let mut defs = Map::new();
    for (name, mut scene) in names.iter().filter_map(|name| Some((*name, of_kind(name)?))) {
        if let Some(scene) = scene.as_object_mut() {
            scene.remove("$schema");
        }
        defs.insert(name.to_owned(), scene);
    }
    let refer = |name: &str| json!({ "$ref": format!("#/$defs/{name}") });
    let chain = names.iter().skip(1).fold(refer(names[0]), |other, name| {
        let model = json!({ "properties": { "kind": { "const": name } }, "required": ["kind"] });
        json!({
            "if": { "properties": { "model": model }, "required": ["model"] },
            "then": refer(name),
            "else": other,
        })
    });
    let choices: Vec<Value> = names.iter().map(|name| refer(name)).chain([json!(true)]).collect();
    let mut all = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A scene of monolayer",
        "type": "object",
        "properties": { "model": { "properties": { "kind": { "enum": names } } } },
        "anyOf": choices,
        "$defs": defs,
    });
    if let (Some(all), Value::Object(chain)) = (all.as_object_mut(), chain) {
        all.extend(chain);
    }
    all
}

/// Keys of `[time]` that a preset gives.
const OF_TIME: [&str; 2] = ["scheme", "step"];

/// Keys that a preset fills in must be there only in a scene that names none.
fn without_what_a_preset_gives(scene: &mut Value) {
    let Some(mesh) = scene.pointer_mut("/properties/mesh") else { return };
    let needs = needs_of_mesh(mesh);
    let otherwise = json!({ "properties": { "mesh": needs, "time": { "required": OF_TIME } } });
    if let Some(scene) = scene.as_object_mut() {
        scene.insert("if".to_owned(), json!({ "required": ["accuracy"] }));
        scene.insert("else".to_owned(), otherwise);
    }
    if let Some(required) = scene.pointer_mut("/properties/time/required").and_then(Value::as_array_mut) {
        required.retain(|key| OF_TIME.iter().all(|given| key != given));
    }
}

/// Takes the keys that presets fill in out of what shapes need; these needs, shape by shape.
fn needs_of_mesh(mesh: &mut Value) -> Value {
    let mut chain = json!(true);
    for shape in GENERATORS.iter().rev() {
        let given: &[&str] = match MeshScene::of(shape.name).scale() {
            Scale::None => &[],
            Scale::Count => &["n"],
            Scale::Across(_) | Scale::Inside(_) => &["h"],
        };
        chain = json!({
            "if": { "properties": { "shape": { "const": shape.name } }, "required": ["shape"] },
            "then": { "required": given },
            "else": chain,
        });
        if let Some(required) = required_of(mesh, shape.name) {
            required.retain(|key| given.iter().all(|other| key != other));
        }
    }
    chain
}

/// The keys that a shape must have, in the schema of `[mesh]`.
fn required_of<'m>(mesh: &'m mut Value, shape: &str) -> Option<&'m mut Vec<Value>> {
    if mesh.pointer("/if/properties/shape/const")? == shape {
        return mesh.pointer_mut("/then/required")?.as_array_mut();
    }
    required_of(mesh.get_mut("else")?, shape)
}
