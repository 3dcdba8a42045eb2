//! The floors of the house: a folder of `src/` imports only from floors below it. What still looks upwards is listed;
//! the list may only become shorter.

mod sources;

use std::collections::BTreeSet;
use std::path::Path;

use sources::sources;

/// From the ground up.
const FLOORS: [&[&str]; 12] = [
    &["element"],
    &["mesh"],
    &["space"],
    &["solve"],
    &["body"],
    &["form"],
    &["model", "contact"],
    &["time"],
    &["steady"],
    &["measure"],
    &["output", "scene"],
    &["results", "run", "report", "study"],
];

/// Arrows upwards that are left: bodies know the flow around them, the expressions of the model and its time schemes,
/// and marks of files are read by meshes.
const LEFT: [(&str, &str); 4] = [("body", "form"), ("body", "model"), ("body", "time"), ("mesh", "output")];

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
fn folders_import_from_the_floors_below_them() {
    let floor = |name: &str| FLOORS.iter().position(|names| names.contains(&name));
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let files = sources(&root);
    let mut upwards = BTreeSet::new();
    for file in &files {
        let inside = file.strip_prefix(&root).unwrap();
        let Some(folder) = inside.iter().next().and_then(|name| name.to_str()) else { continue };
        // the door of the library, and the program that stands beside it
        if folder.ends_with(".rs") || folder == "command" {
            continue;
        }
        let own = floor(folder).unwrap_or_else(|| panic!("`{folder}` has no floor"));
        for name in imports(&std::fs::read_to_string(file).unwrap()) {
            let Some(other) = floor(&name) else { continue };
            let arrow = (folder.to_owned(), name);
            if other > own && LEFT.iter().all(|(from, to)| (*from, *to) != (&arrow.0, &arrow.1)) {
                panic!("{} imports `{}`, which stands above it", inside.display(), arrow.1);
            }
            if other > own {
                upwards.insert(arrow);
            }
        }
    }
    let left: BTreeSet<_> = LEFT.iter().map(|(from, to)| ((*from).to_owned(), (*to).to_owned())).collect();
    assert_eq!(upwards, left, "what no longer looks upwards leaves the list");
}
