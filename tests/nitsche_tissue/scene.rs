//! Scenes of tissue with `rigid.method = "nitsche"` through the program.

use std::path::Path;
use std::process::{Command, Output};

/// A strip with every stress, around a fixed disc.
const FIXED: &str = r#"
[model]
kind = "incompressible"
beta = 0.75
peclet = 0.5
coherence = 0.5
elasticity = 0.4
alignment = 1.0
active_stress = 0.3
polar_stress = 0.1

[mesh]
shape = "strip"
length = [-4.0, 6.0]
width = 6.0
h = 0.9

[boundary.inlet]
velocity = { dirichlet = ["1", "0"] }
polarity = { dirichlet = ["1", "0"] }
[boundary.outlet]
velocity = "traction"
polarity = { dirichlet = ["1", "0"] }
[boundary.walls]
velocity = "slip"
polarity = "neumann"

[initial]
polarity = ["1", "0"]

[rigid]
method = "nitsche"

[[body]]
name = "disc"
shape = { disc = { radius = 1.0 } }
position = [0.0, 0.2]
motion = "fixed"

[time]
scheme = "bdf2"
step = 0.05
end = 0.4
"#;

const MEASURES: &str = r#"
[[output]]
measures = ["energy_budget", "free_energy", "holding", "body", "wrench", "power_to", { force_on = "walls" }, { force_on = "inlet" }]
every = { steps = 1 }
[[output]]
checkpoint = true
every = { steps = 4 }
"#;

fn program(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().unwrap()
}

#[track_caller]
fn good(arguments: &[&str], folder: &Path) {
    let output = program(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn write(folder: &Path, text: &str) {
    std::fs::write(folder.join("scene.toml"), text).unwrap();
}

fn summary(folder: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(folder.join("summary.json")).unwrap()).unwrap()
}

fn moving() -> String {
    let other =
        "[[body]]\nname = \"free\"\nshape = { disc = { radius = 0.5 } }\nposition = [-1.5, -1.6]\nfriction = 1.0\n";
    let held =
        FIXED.replace("motion = \"fixed\"", "motion = { held = { velocity = [\"0.4\", \"0.1\"], spin = \"0.5\" } }");
    let powers = "[[output]]\nmeasures = [{ power_to = \"free\" }]\nevery = { steps = 1 }\n";
    let wall = "[[wall]]\ntag = \"walls\"\n[contact]\nmargin = 0.1\n";
    held + other + wall + MEASURES + powers
}

#[test]
fn bodies_that_move_and_what_goes_on_where_it_was_left() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    write(folder, &moving());
    good(&["run", "scene.toml", "-q", "--out", "whole"], folder);
    good(&["run", "scene.toml", "-q", "--out", "parts", "--set", "time.max_steps=4"], folder);
    good(&["run", "scene.toml", "-q", "--out", "parts", "--resume"], folder);
    for file in ["history.csv", "scene.toml"] {
        let [whole, parts] = ["whole", "parts"].map(|run| std::fs::read(folder.join(run).join(file)).unwrap());
        assert!(whole == parts, "{file} differs");
    }
    let measures = &summary(&folder.join("whole"))["measures"];
    let of = |name: &str| measures[name].as_f64().unwrap();
    assert!((of("body_x1") - 0.16).abs() < 1e-9 && of("budget_bodies").abs() > 1e-3, "{measures}");
    // the line of the law body by body
    let parts = [of("power_to"), of("power_to:free")];
    assert!((parts[0] + parts[1] - of("budget_bodies")).abs() < 1e-9 && parts[1].abs() > 1e-6, "{measures}");
    // what the flow does to a body that is held, its holding and its friction balance
    assert!(of("wrench_x1").abs() > 1e-3, "{measures}");
    println!("{measures:#}");
}

#[test]
fn bodies_that_are_fixed_march_and_rest() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    write(folder, &(FIXED.to_owned() + MEASURES));
    good(
        &[
            "run",
            "scene.toml",
            "-q",
            "--out",
            "march",
            "--set",
            "time.end=400",
            "--set",
            "time.step=4",
            "--set",
            "time.stop.residual=1e-7",
        ],
        folder,
    );
    good(&["run", "scene.toml", "-q", "--out", "rest", "--steady", "--set", "steady.residual=1e-9"], folder);
    let [march, rest] = ["march", "rest"].map(|run| summary(&folder.join(run)));
    println!("{}\n{}", march["status"], rest["steady"]);
    assert_eq!(rest["steady"]["stability"], "stable");
    for name in ["holding_x1", "holding_x2", "free_energy", "force_x2:walls"] {
        let [a, b] = [&march, &rest].map(|summary| summary["measures"][name].as_f64().unwrap());
        println!("{name}: {a} and {b}");
        assert!((a - b).abs() < 1e-5 * b.abs().max(1e-2), "{name}: {a} and {b}");
    }
}

#[test]
fn what_has_no_traction_is_refused_of_bodies_that_move() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    write(folder, &moving().replace("alignment = 1.0", "alignment = 1.0\nelastic_force = \"energy-consistent\""));
    let output = program(&["check", "scene.toml"], folder);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success() && message.contains("model.elastic_force"), "{message}");
}
