//! `monolayer branch`: its table and diagram, its exit codes, and what it says about wrong studies.

use std::path::Path;
use std::process::{Command, Output};

const SCENE: &str = r#"
[model]
kind = "incompressible"
friction = 1.0
traction = 0.0
peclet = 1.0
coherence = 1.0

[mesh]
shape = "strip"
length = [0.0, 1.0]
width = 1.0
h = 0.8

[boundary.inlet]
velocity = "slip"
polarity = "neumann"
[boundary.outlet]
velocity = "slip"
polarity = "neumann"
[boundary.walls]
velocity = "slip"
polarity = "neumann"

[source]                  # nothing flows: the alignment parameter acts only here
polarity = ["slip", "0"]

[initial]
polarity = ["1", "0"]

[time]
scheme = "bdf2"
step = 0.5
end = 50.0

[[output]]
measures = ["asymmetry"]
"#;

const STUDY: &str = r#"title = "Tiny"
scene = "closed.toml"
parameter = "model.alignment"
range = [-1.0, 1.0]
start = 0.8
measure = "asymmetry_polarity"
max_points = 4
max_branches = 2
"#;

/// A folder with the scene `closed.toml` and the study `tiny.toml`.
fn with_study(study: &str) -> tempfile::TempDir {
    let root = tempfile::tempdir().unwrap();
    std::fs::write(root.path().join("closed.toml"), SCENE).unwrap();
    std::fs::write(root.path().join("tiny.toml"), study).unwrap();
    root
}

fn program(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().unwrap()
}

fn error_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn every_point_is_a_row_and_the_diagram_is_drawn() {
    let root = with_study(STUDY);
    let output = program(root.path(), &["branch", "tiny.toml", "--out", "out"]);
    assert!(output.status.success(), "{}", error_of(&output));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("1 branch, ") && said.contains("results in out"), "{said}");
    assert!(said.contains("branch 1: from 0.80000 to ") && said.contains("; from 0.80000 to "), "{said}");
    assert!(
        said.contains("ended: 4 points were taken, as many as it may have: a larger `max_points` leads further"),
        "{said}"
    );
    let out = root.path().join("out");
    let mut table = csv::Reader::from_path(out.join("branches.csv")).unwrap();
    let header: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
    let head = ["branch", "from", "point", "parameter", "stability", "unstable_dimension", "special"];
    assert_eq!(header[..7], head);
    let residuals = ["residual", "residual_polarity", "residual_pressure", "residual_velocity"];
    let measures = [&["asymmetry_polarity", "asymmetry_velocity"][..], &residuals].concat();
    assert_eq!(header[7..], [&measures[..], &["growth", "frequency", "corrections"]].concat());
    let rows: Vec<Vec<String>> = table.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect();
    let numbers = |name: &str| -> Vec<f64> {
        let at = header.iter().position(|h| h == name).unwrap();
        rows.iter().map(|row| row[at].parse().unwrap_or_else(|e| panic!("{name}: {row:?}: {e}"))).collect()
    };
    for name in header.iter().filter(|name| !["from", "stability", "special"].contains(&name.as_str())) {
        assert!(numbers(name).iter().all(|v| v.is_finite()), "{name}: {rows:?}");
    }
    let points: Vec<f64> = numbers("point");
    let count = rows.len();
    assert!(said.contains(&format!("1 branch, {count} points")) && (5..=7).contains(&count), "{said}");
    assert_eq!(points, (1..=count).map(|k| k as f64).collect::<Vec<_>>(), "from one end of the branch to the other");
    assert!(rows.iter().all(|row| row[4] == "stable" && row[1].is_empty() && row[6].is_empty()), "{rows:?}");
    let f = numbers("parameter");
    assert!(f[3] == 0.8 && f.is_sorted_by(|a, b| a < b), "{f:?}");
    for (f, growth) in f.iter().zip(numbers("growth")) {
        // the slowest disturbance turns the polarity s, where s³ − s = f
        let s = (1.0 - growth).sqrt();
        assert!((s.powi(3) - s - f).abs() < 1e-6, "{f}: {growth}");
    }
    for file in ["branches.svg", "branches.png", "study.toml"] {
        assert!(std::fs::metadata(out.join(file)).is_ok_and(|data| data.len() > 100), "{file}");
    }
    let svg = std::fs::read_to_string(out.join("branches.svg")).unwrap();
    assert!(svg.contains("Tiny") && svg.contains("stable"), "title and legend");

    let again = program(root.path(), &["branch", "tiny.toml", "--out", "out"]);
    assert!(!again.status.success() && error_of(&again).contains("holds the results of an earlier study"));
    let same = program(root.path(), &["branch", "out/study.toml", "-q", "--out", "same"]);
    assert!(same.status.success() && same.stdout.is_empty(), "{}", error_of(&same));
    let read = |folder: &str| std::fs::read_to_string(root.path().join(folder).join("branches.csv")).unwrap();
    assert_eq!(read("same"), read("out"), "the study beside the results gives them again");
}

#[test]
fn every_measure_of_a_steady_state_can_be_shown() {
    let root = with_study(STUDY);
    let mut arguments = vec!["branch", "tiny.toml", "-q", "--out", "out"];
    for set in ["measure=free_energy", "max_points=3", "model.elasticity=0.4"] {
        arguments.extend(["--set", set]);
    }
    let measures = "output.0.measures=[\"free_energy\", \"energy_budget\", \"asymmetry\"]";
    arguments.extend(["--set", measures]);
    let output = program(root.path(), &arguments);
    assert!(output.status.success(), "{}", error_of(&output));
    let mut table = csv::Reader::from_path(root.path().join("out/branches.csv")).unwrap();
    let header: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let number = |row: &csv::StringRecord, name: &str| -> f64 {
        let at = header.iter().position(|h| h == name).unwrap_or_else(|| panic!("{name}: {header:?}"));
        row[at].parse().unwrap_or_else(|e| panic!("{name}: {row:?}: {e}"))
    };
    assert!(rows.len() > 3);
    for row in &rows {
        let f = number(row, "parameter");
        // s³ − s = f, the root above 1, by Newton's method
        let s = (0..50).fold(1.5_f64, |s, _| s - (s.powi(3) - s - f) / (3.0 * s * s - 1.0));
        // F = B |Ω| (s² − 1)²/4 of a uniform polarity
        let energy = 0.4 * (s * s - 1.0).powi(2) / 4.0;
        assert!((number(row, "free_energy") - energy).abs() < 1e-7, "{f}: {row:?}");
        assert!(number(row, "free_energy_rate") == 0.0 && number(row, "budget_friction").abs() < 1e-12, "{row:?}");
        assert!(number(row, "residual") < 1e-7 && number(row, "asymmetry_polarity").is_finite(), "{row:?}");
    }
    let svg = std::fs::read_to_string(root.path().join("out/branches.svg")).unwrap();
    assert!(svg.contains("stable") && svg.contains("Tiny"), "the diagram shows it");
}

#[track_caller]
fn refused(root: &tempfile::TempDir, arguments: &[&str], parts: &[&str]) {
    let output = program(root.path(), arguments);
    let error = error_of(&output);
    assert!(!output.status.success(), "{arguments:?} should fail");
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
    assert!(!error.contains("panicked") && !root.path().join("out").exists(), "{error}");
}

#[test]
fn wrong_studies_are_explained() {
    let root = with_study(STUDY);
    let set = |value: &str, parts: &[&str]| refused(&root, &["branch", "tiny.toml", "--set", value], parts);
    let line = |from: &str, to: &str, parts: &[&str]| {
        let root = with_study(&STUDY.replace(from, to));
        refused(&root, &["branch", "tiny.toml"], parts);
    };
    let choices = "hint: the choices are model.friction, model.beta";
    line(
        "model.alignment",
        "model.alinment",
        &["tiny.toml, line 3", "`parameter` = \"model.alinment\"", "(did you mean `model.alignment`?)", choices],
    );
    line("model.alignment", "model.kind", &["`parameter` = \"model.kind\"", "must be a number of [model]", choices]);
    line("model.alignment", "mesh.h", &["`parameter` = \"mesh.h\"", "must be a number of [model]", choices]);
    line("start = 0.8", "start = 1.5", &["tiny.toml, line 5", "`start` = 1.5", "must lie in the range", "hint"]);
    line("[-1.0, 1.0]", "[1.0, -1.0]", &["line 4", "`range` = [1.0, -1.0]", "the smaller first", "hint: such as"]);
    let beyond = ["line 4", "`range`", "`model.alignment` = 3", "must lie in [-1, 1]", "hint"];
    line("[-1.0, 1.0]", "[-1.0, 3.0]", &beyond);
    let unknown = ["line 6", "`measure` = \"asymmetry_polarty\"", "(did you mean `asymmetry_polarity`?)"];
    line("asymmetry_polarity", "asymmetry_polarty", &[&unknown[..], &["asymmetry_velocity"]].concat());
    line("asymmetry_polarity", "mass", &["`measure` = \"mass\"", "measures no such thing", "hint"]);
    line("max_points = 4", "max_points = 1", &["line 7", "`max_points` = 1", "must be at least 2", "hint"]);
    line("max_points = 4", "max_pionts = 4", &["line 7", "max_pionts", "(did you mean `max_points`?)"]);
    set("scale=log", &["`range` = [-1.0, 1.0]", "two positive numbers", "hint"]);
    set("scale=cubic", &["scale", "cubic", "linear", "log"]);
    set("step=0", &["`step` = 0", "above 0", "hint"]);
    set("max_step=2", &["step", "at most 1", "hint"]);
    set(
        "model.alignment=0.5",
        &["`model.alignment` = 0.5", "the branch is followed in it", "hint: set `range` and `start`"],
    );
    set("model.peclet=-1", &["`model.peclet` = -1", "greater than 0", "hint"]);
    set("scene=other.toml", &["`scene` = \"other.toml\"", "there is no such file", "hint"]);
    set("source.polarity=[\"t\", \"0\"]", &["`source.polarity` = a formula of t", "must not depend on t", "hint"]);
}

#[test]
fn scenes_and_other_studies_are_told_apart() {
    let root = with_study(STUDY);
    let sweep = "scene = \"closed.toml\"\nvary = { \"model.peclet\" = [1, 2] }\n";
    let orders = "scene = \"closed.toml\"\nlevels = [2, 3]\nvary = { \"mesh.h\" = \"1/n\" }\n";
    std::fs::write(root.path().join("sweep.toml"), sweep).unwrap();
    std::fs::write(root.path().join("orders.toml"), orders).unwrap();
    refused(&root, &["branch", "closed.toml"], &["this is a scene, not a study", "`monolayer run closed.toml`"]);
    refused(&root, &["branch", "sweep.toml"], &["this is a sweep", "`monolayer study sweep.toml` runs it"]);
    refused(&root, &["branch", "orders.toml"], &["this is a study of orders", "`monolayer order orders.toml` runs it"]);
    refused(&root, &["branch", "nothing.toml"], &["nothing.toml", "hint: give the path of a study"]);
    for command in ["study", "order"] {
        refused(
            &root,
            &[command, "tiny.toml"],
            &["this is a study of branches", "`monolayer branch tiny.toml` runs it"],
        );
    }
    for command in ["run", "mesh"] {
        refused(
            &root,
            &[command, "tiny.toml"],
            &["this is a study, not a scene", "`monolayer branch tiny.toml` runs it"],
        );
    }
}

#[test]
fn no_steady_state_at_the_start_is_an_error() {
    let root = with_study(STUDY);
    let sets = ["--set", "steady.max_steps=1", "--set", "steady.march=0.5", "--set", "steady.step=1e-3"];
    let output = program(root.path(), &[&["branch", "tiny.toml", "--out", "out"], &sets[..]].concat());
    let error = error_of(&output);
    assert!(!output.status.success() && !error.contains("panicked"), "{error}");
    for part in
        ["no branch begins at model.alignment = 0.8", "no steady state was found there", "hint: choose another `start`"]
    {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
}

/// Nothing fixes the direction of a polarity that no wall sees: the states beside it are steady, too.
#[test]
fn a_start_among_states_that_are_all_steady_says_so() {
    let root = with_study(&STUDY.replace("model.alignment", "model.coherence").replace("[-1.0, 1.0]", "[0.5, 1.5]"));
    let free = ["--set", "source.polarity=[\"0\", \"0\"]", "--set", "model.traction=0.5"];
    let output = program(root.path(), &[&["branch", "tiny.toml", "--out", "out"], &free[..]].concat());
    let error = error_of(&output);
    assert!(!output.status.success() && !error.contains("panicked"), "{error}");
    for part in
        ["no branch begins at model.coherence = 0.8", "a steady state was found", "the direction of the polarity"]
    {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
    assert!(!error.contains("time step"), "a branch has no time step: {error}");
}

/// The state without polarity has a branch; where its instability leads, states are not apart from each other.
#[test]
fn a_branch_stays_when_another_start_has_none() {
    let root = with_study(&STUDY.replace("model.alignment", "model.coherence").replace("[-1.0, 1.0]", "[0.5, 1.5]"));
    let free = ["--set", "source.polarity=[\"0\", \"0\"]", "--set", "initial.polarity=[\"0\", \"0\"]"];
    let output = program(root.path(), &[&["branch", "tiny.toml", "--out", "out"], &free[..]].concat());
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &error_of(&output);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("note: of the other steady state") && said.contains("singular derivative"), "{said}");
    let table = std::fs::read_to_string(root.path().join("out/branches.csv")).unwrap();
    assert!(table.lines().count() > 4, "{table}");
}
