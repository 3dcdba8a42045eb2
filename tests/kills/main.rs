//! Runs and studies that are killed, that nobody listens to, that meet each other or somebody's own files.
#![cfg(unix)]

mod folders;
mod print;
mod random;
mod study;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The program, at work in a folder.
pub fn program(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_monolayer"));
    command.args(arguments).current_dir(folder).stdin(Stdio::null());
    command
}

/// What it did.
pub fn ran(folder: &Path, arguments: &[&str]) -> Output {
    program(folder, arguments).output().expect("the program starts")
}

/// What it says to its standard error.
pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What it printed, where it ended well.
#[track_caller]
pub fn good(folder: &Path, arguments: &[&str]) -> String {
    let output = ran(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", said(&output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// All files below a folder by their paths, without what is not about results: marks of who is at work.
pub fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(inside) = open.pop() {
        for entry in std::fs::read_dir(&inside).unwrap_or_else(|e| panic!("{}: {e}", inside.display())) {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.file_name().is_some_and(|name| name != "lock") {
                let bytes = std::fs::read(&path).unwrap();
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), bytes);
            }
        }
    }
    found
}

/// Two sides, flow and neumann everywhere: the smallest tissue.
pub const SQUARE: &str = r#"
[model]
kind = "incompressible"
friction = 1
peclet = 1
coherence = 0.5
elasticity = 0.2
[mesh]
shape = "square"
n = 4
[boundary]
left = { velocity = "slip", polarity = "neumann" }
right = { velocity = "slip", polarity = "neumann" }
bottom = { velocity = "slip", polarity = "neumann" }
top = { velocity = "slip", polarity = "neumann" }
[initial]
polarity = ["1 + 0.2*cos(pi*x)", "0.1*cos(pi*y)"]
[time]
scheme = "bdf2"
step = 0.1
end = 0.5
"#;
