//! What the program takes, the schemas take.

use std::path::Path;
use std::process::Command;

use monolayer::scene::SceneSource;
use monolayer::scene::renamed::modern;
use monolayer::{scene, study};
use serde_json::Value;

use super::{check, files, json, root, validator, wrong};

#[test]
fn every_schema_is_one_of_draft_2020_12() {
    let kinds = scene::schema::kinds();
    let scenes = kinds.iter().map(|kind| (kind.name, scene::schema::of_kind(kind.name).unwrap()));
    let studies = study::schema::KINDS.iter().map(|kind| (kind.name, study::schema::of_kind(kind.name).unwrap()));
    for (name, schema) in scenes.chain(studies).chain([("all", scene::schema::of_scenes())]) {
        assert!(jsonschema::draft202012::meta::is_valid(&schema), "{name}");
        let text = schema.to_string();
        for ours in ["x-order", "x-kinds", "x-default", "x-rule", "x-values", "\"null\""] {
            assert!(!text.contains(ours), "{name} has {ours}");
        }
    }
}

#[test]
fn the_studies_of_the_project_and_their_scenes() {
    let scenes = validator(&scene::schema::of_scenes());
    let mut seen = [0, 0];
    for file in files(&root().join("studies"), "toml") {
        let text = std::fs::read_to_string(&file).unwrap();
        let command = SceneSource::parse(&text, &file).unwrap().study_command();
        let found = match command {
            None => wrong(&scenes, &text),
            Some(command) => wrong(&validator(&study::schema::of_kind(command).unwrap()), &text),
        };
        assert!(found.is_empty(), "{}: {found:#?}", file.display());
        seen[usize::from(command.is_some())] += 1;
    }
    assert!(seen[0] > 20 && seen[1] > 20, "{seen:?}");
}

/// Texts in the tests that are scenes: files, and what stands between `r#"` and `"#`.
fn texts() -> Vec<(String, String)> {
    let tests = root().join("tests");
    let whole = files(&tests, "toml").into_iter().map(|file| {
        let text = std::fs::read_to_string(&file).unwrap();
        (file.display().to_string(), text)
    });
    let mut all: Vec<_> = whole.collect();
    for file in files(&tests, "rs") {
        let code = std::fs::read_to_string(&file).unwrap();
        let raw = code.split("r#\"").skip(1).filter_map(|rest| rest.split_once("\"#"));
        all.extend(raw.map(|(text, _)| (file.display().to_string(), text.to_owned())));
    }
    all
}

#[test]
fn every_scene_of_the_tests_that_is_checked() {
    let scenes = validator(&scene::schema::of_scenes());
    let mut count = 0;
    for (place, text) in texts() {
        let is_scene = json(&text).is_some_and(|value| value.get("model").is_some());
        if !is_scene || check(&text, &root().join("tests/data")).is_err() {
            continue;
        }
        let found = wrong(&scenes, &modern(&text).0);
        assert!(found.is_empty(), "{place}: {found:#?}\n{text}");
        count += 1;
    }
    assert!(count > 30, "{count} scenes were found");
}

/// What a run writes down of itself, with every default, is a scene like any other.
#[test]
fn resolved_scenes() {
    let scenes = validator(&scene::schema::of_scenes());
    for file in files(&root().join("studies"), "toml") {
        let text = std::fs::read_to_string(&file).unwrap();
        if SceneSource::parse(&text, &file).unwrap().study_command().is_some() {
            continue;
        }
        let Ok(scene) = check(&text, file.parent().unwrap_or(Path::new(""))) else { continue };
        let found = wrong(&scenes, &scene.resolved_toml());
        assert!(found.is_empty(), "{}: {found:#?}", file.display());
    }
}

fn printed(kind: &[&str]) -> Value {
    let out = Command::new(env!("CARGO_BIN_EXE_monolayer")).arg("schema").args(kind).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}

#[test]
fn the_command_prints_them() {
    assert_eq!(printed(&[]), scene::schema::of_scenes());
    assert_eq!(printed(&["stokes"]), scene::schema::of_kind("stokes").unwrap());
    assert_eq!(printed(&["study"]), study::schema::of_kind("study").unwrap());
    let out = Command::new(env!("CARGO_BIN_EXE_monolayer")).args(["schema", "tissue"]).output().unwrap();
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2));
    assert!(said.contains("incompressible") && said.contains("tradeoff"), "{said}");
}
