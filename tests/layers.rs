//! The floors of the house: a folder of `src/` imports only from floors below it, so that there is no circle between
//! folders either. And no room is so large that one gets lost in it.

mod sources;

use std::collections::BTreeSet;
use std::path::Path;

use sources::sources;

/// From the ground up.
const FLOORS: [&str; 23] = [
    "names",
    "schema",
    "element",
    "mesh",
    "space",
    "expression",
    "shape",
    "cut",
    "solve",
    "form",
    "scheme",
    "body",
    "model",
    "contact",
    "time",
    "steady",
    "measure",
    "output",
    "scene",
    "results",
    "run",
    "study",
    "report",
];

/// Folders that a file names, in code and not in comments, without its tests.
fn imports(text: &str) -> BTreeSet<String> {
    let code = text.split("#[cfg(test)]").next().unwrap();
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    let mut found = BTreeSet::new();
    for line in lines {
        for rest in line.split("crate::").skip(1) {
            found.insert(rest.chars().take_while(|c| c.is_ascii_lowercase() || *c == '_').collect());
        }
    }
    found
}

#[test]
fn folders_import_from_the_floors_below_them_alone() {
    let floor = |name: &str| FLOORS.iter().position(|name_of| *name_of == name);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut wrong = BTreeSet::new();
    for file in &sources(&root) {
        let inside = file.strip_prefix(&root).unwrap();
        let Some(folder) = inside.iter().next().and_then(|name| name.to_str()) else { continue };
        // the door of the library, and the program that stands beside it
        if folder.ends_with(".rs") || folder == "command" {
            continue;
        }
        let own = floor(folder).unwrap_or_else(|| panic!("`{folder}` has no floor"));
        for name in imports(&std::fs::read_to_string(file).unwrap()) {
            if floor(&name).is_some_and(|other| other > own) {
                wrong.insert(format!("{} imports `{name}`, which stands above it", inside.display()));
            }
        }
    }
    assert_eq!(wrong, BTreeSet::new());
}

#[test]
fn the_page_about_the_house_has_its_floors() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md")).unwrap();
    let first = page.lines().filter_map(|line| line.strip_prefix(' ')?.split_whitespace().next());
    let mut shown: Vec<&str> = first.filter(|word| FLOORS.contains(word)).collect();
    shown.reverse();
    assert_eq!(shown, FLOORS);
}

/// Most lines of a file of `src/`.
const LONGEST: usize = 450;

#[test]
fn no_file_is_too_long() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut long = Vec::new();
    for file in &sources(&root) {
        if std::fs::read_to_string(file).unwrap().lines().count() > LONGEST {
            long.push(file.strip_prefix(&root).unwrap().to_str().unwrap().replace('\\', "/"));
        }
    }
    assert_eq!(long, Vec::<String>::new());
}
