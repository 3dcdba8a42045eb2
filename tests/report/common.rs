//! Small runs, made once for all tests.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

const SCENE: &str = r#"
title = "a <script>document.title = 'hacked'</script> & \"b\""
[model]
kind = "incompressible"
beta = 0.75
peclet = 2.0
coherence = 0.3
elasticity = 0.4
[mesh]
shape = "strip-with-disc"
length = [-4.0, 6.0]
width = 6.0
h = 1.6
h_disc = 0.6
[boundary.inlet]
velocity = { dirichlet = ["1", "0"] }
polarity = { dirichlet = ["1", "0"] }
[boundary.outlet]
velocity = "traction"
polarity = { dirichlet = ["1", "0"] }
[boundary.walls]
velocity = "slip"
polarity = "neumann"
[boundary.disc]
velocity = "slip"
polarity = "neumann"
[initial]
polarity = "aligned-around-disc"
[time]
scheme = "bdf2"
step = 0.25
end = 1.5
[[output]]
measures = ["free_energy", "asymmetry"]
every = { steps = 1 }
[[output]]
cuts = ["axis-1", "axis-2a", "axis-3", "axis-4"]
"#;

const STUDY: &str = r#"
title = "Pe and κ"
scene = "strip.toml"
set = { "time.end" = 0.5 }
vary = { "model.peclet" = [2.0, 0.5, 10.0], "model.coherence" = [0.5, 1.0] }
[[case]]
name = "coarse"
set = { "mesh.h_disc" = 7.0 }
"#;

/// Folders of a run `one`, of `two` with another `Pe`, of a study `sweep` and of orders `orders`.
pub fn results() -> &'static Path {
    static MADE: OnceLock<tempfile::TempDir> = OnceLock::new();
    let make = || {
        let root = tempfile::tempdir().unwrap();
        let at = root.path();
        std::fs::write(at.join("strip.toml"), SCENE).unwrap();
        std::fs::write(at.join("sweep.toml"), STUDY).unwrap();
        let square = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies/mms/incompressible.toml");
        succeeds(at, &["-q", "run", "strip.toml", "--out", "one"]);
        succeeds(at, &["-q", "run", "strip.toml", "--out", "two", "--set", "model.peclet=0.5"]);
        // one of its runs is refused
        assert!(!program(at, &["-q", "study", "sweep.toml", "--out", "sweep"]).status.success());
        let (square, levels) = (square.to_str().unwrap(), "levels=[2, 4]");
        succeeds(
            at,
            &["-q", "order", square, "--out", "orders", "--set", levels, "--set", "expect=", "--set", "time.end=0.5"],
        );
        root
    };
    MADE.get_or_init(make).path()
}

pub fn program(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().unwrap()
}

#[track_caller]
pub fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    let output = program(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// What the program says of wrong arguments.
#[track_caller]
pub fn fails(folder: &Path, arguments: &[&str]) -> String {
    let output = program(folder, arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The files of a folder, sorted.
pub fn files(folder: PathBuf) -> Vec<String> {
    let read = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut names: Vec<String> = read.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// A copy of a folder's own files and of its `cuts`.
pub fn copy_of(folder: &Path) -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    std::fs::create_dir(root.path().join("cuts")).unwrap();
    for part in ["", "cuts"] {
        for entry in std::fs::read_dir(folder.join(part)).unwrap().map(Result::unwrap) {
            if entry.file_type().unwrap().is_file() {
                std::fs::copy(entry.path(), root.path().join(part).join(entry.file_name())).unwrap();
            }
        }
    }
    root
}
