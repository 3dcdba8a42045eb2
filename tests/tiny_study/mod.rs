//! A study `tiny.toml` of a scene cut short, in a folder of its own, and the program on it.

use std::path::Path;
use std::process::{Command, Output};

pub const SCENE: &str = include_str!("../../studies/mms/square.toml");

/// A folder with the scene `square.toml`, cut short, and the study `tiny.toml`.
pub fn with_study(study: &str) -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    std::fs::write(root.path().join("square.toml"), SCENE.replace("end = 1.0", "end = 0.25")).unwrap();
    std::fs::write(root.path().join("tiny.toml"), study).unwrap();
    root
}

/// Runs the program in a folder.
pub fn program(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().unwrap()
}

/// What it wrote to its standard error.
pub fn error_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs the program, which has to end well.
#[track_caller]
pub fn succeeds(folder: &Path, arguments: &[&str]) -> Output {
    let output = program(folder, arguments);
    assert!(output.status.success(), "{}", error_of(&output));
    output
}

/// Expects an error of one line with `parts`, and that no file was written.
#[track_caller]
pub fn refused_in(root: &tempfile::TempDir, arguments: &[&str], parts: &[&str]) {
    let output = program(root.path(), arguments);
    let error = error_of(&output);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.starts_with("error: ") && error.lines().count() == 1 && !error.contains("panicked"), "{error}");
    assert!(error.contains("hint: "), "{error}");
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
    assert!(!root.path().join("out").exists(), "nothing was computed, so nothing is to be written");
    println!("{error}");
}
