//! Every scene, small, has the numbers that `tests/pins.toml` gives it.

use std::path::{Path, PathBuf};

use serde_json::Value;
use toml_edit::{DocumentMut, Table, value};

use super::{program, root, scenes};

/// Relative difference between a number and its pin.
const TOLERANCE: f64 = 1e-6;

fn strings<'a>(table: &'a Table, key: &str) -> Vec<&'a str> {
    let list = table.get(key).and_then(|list| list.as_array()).unwrap_or_else(|| panic!("{table}: no list `{key}`"));
    list.iter().map(|text| text.as_str().unwrap()).collect()
}

/// What the scene of an entry measures at the end of its short run.
fn measured(entry: &Table, folder: &Path) -> Value {
    let file = root().join(entry["file"].as_str().unwrap());
    // one on a boundary tag is a table
    let quoted = |name: &&str| if name.starts_with('{') { (*name).to_owned() } else { format!("\"{name}\"") };
    let names: Vec<String> = strings(entry, "measures").iter().map(quoted).collect();
    let output = format!("output=[{{ measures = [{}] }}]", names.join(", "));
    let mut arguments = vec!["run", file.to_str().unwrap(), "-q", "--out", "run", "--set", &output];
    strings(entry, "set").iter().for_each(|set| arguments.extend(["--set", set]));
    let _ = std::fs::remove_dir_all(folder.join("run"));
    let output = program(&arguments, folder);
    assert!(output.status.success(), "{}: {}", file.display(), String::from_utf8_lossy(&output.stderr));
    let summary: Value = serde_json::from_slice(&std::fs::read(folder.join("run/summary.json")).unwrap()).unwrap();
    summary["measures"].clone()
}

/// Compares, or writes what was found where `write` is set; a line for every number that is not its pin.
fn compare(entry: &mut Table, found: &Value, write: bool) -> Vec<String> {
    let file = entry["file"].as_str().unwrap().to_owned();
    let pins = entry["pins"].as_table_mut().unwrap_or_else(|| panic!("{file} has no table `pins`"));
    assert_eq!(pins.len(), 3, "{file}: three pins");
    let mut wrong = Vec::new();
    for (name, pin) in pins.iter_mut() {
        let now = found[name.get()].as_f64();
        let Some(now) = now.filter(|now| now.is_finite() && *now != 0.0) else {
            wrong.push(format!("{file}: `{name}` is {now:?}, which pins nothing: {found}"));
            continue;
        };
        if write {
            *pin = value(now);
        } else if let Some(pinned) = pin.as_float().filter(|pinned| (now - pinned).abs() > TOLERANCE * pinned.abs()) {
            wrong.push(format!("{file}: `{name}` is {now:?}, pinned at {pinned:?}"));
        } else {
            assert!(pin.is_float(), "{file}: `{name}` must be a number");
        }
    }
    wrong
}

#[test]
fn every_scene_has_its_pinned_numbers() {
    let path = root().join("tests/pins.toml");
    let mut document: DocumentMut = std::fs::read_to_string(&path).unwrap().parse().unwrap();
    let write = std::env::var_os("MONOLAYER_PINS").is_some_and(|wish| wish == "write");
    let temporary = tempfile::tempdir().unwrap();
    let (mut wrong, mut pinned) = (Vec::new(), Vec::new());
    for entry in document["scene"].as_array_of_tables_mut().unwrap().iter_mut() {
        pinned.push(root().join(entry["file"].as_str().unwrap()));
        let found = measured(entry, temporary.path());
        wrong.extend(compare(entry, &found, write));
    }
    if write {
        std::fs::write(&path, document.to_string()).unwrap();
    }
    assert!(wrong.is_empty(), "{}\nwhere a change is meant, see the first lines of tests/pins.toml", wrong.join("\n"));
    let mut all: Vec<PathBuf> = Vec::new();
    ["studies", "tests/data"].iter().for_each(|folder| scenes(&root().join(folder), &mut all));
    all.retain(|path| super::table_of(path).contains_key("model"));
    all.sort();
    pinned.sort();
    assert_eq!(all, pinned, "every scene has its pins");
}
