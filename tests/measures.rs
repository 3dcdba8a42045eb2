//! Measures through whole runs: tables that survive a restart, and what a scene refuses.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use monolayer::output::progress::Verbosity;
use monolayer::run::{self, Ending, Options, RunError, Summary};
use monolayer::scene::{Scene, SceneError, SceneSource};

static NEVER: AtomicBool = AtomicBool::new(false);

const SCENE: &str = r#"
[model]
kind = "incompressible"
beta = 0.9
peclet = 0.5
coherence = 0.1
elasticity = 0.1

[mesh]
shape = "disc"
h = 0.4

[boundary.wall]
velocity = "slip"
polarity = "neumann"

[initial]
polarity = { random = { seed = 3, amplitude = 0.5, h_coarse = 0.5 } }

[time]
scheme = "bdf2"
step = 0.05
end = 0.4

[coupling]
kind = "anderson"

[[output]]
measures = ["defects", "circulation"]
every = { steps = 2 }
"#;

fn check(text: &str, sets: &[(&str, &str)]) -> Result<Scene, SceneError> {
    let mut source = SceneSource::parse(text, Path::new("test.toml")).expect("the test's scene parses");
    for (key, value) in sets {
        source.set(key, value).expect("the test's override fits");
    }
    Scene::check(source)
}

fn run_in(folder: &Path, sets: &[(&str, &str)], resume: bool) -> Result<Summary, RunError> {
    let options = Options { out: folder.to_owned(), resume, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    run::run(&check(SCENE, sets).expect("the test's scene is good"), &options)
}

/// The rows of a table, by column.
fn rows(path: &Path) -> Vec<std::collections::HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    reader.deserialize().map(|row| row.expect("a whole row")).collect()
}

#[test]
fn tables_of_defects_survive_a_restart() {
    let root = tempfile::tempdir().unwrap();
    let (whole, parts) = (root.path().join("whole"), root.path().join("parts"));
    let summary = run_in(&whole, &[], false).unwrap();
    assert_eq!(summary.ending, Ending::EndTime);
    // what a killed process leaves: rows beyond the checkpoint from which it goes on
    let checkpoint = parts.join("checkpoint.bin");
    run_in(&parts, &[("time.max_steps", "3")], false).unwrap();
    let saved = std::fs::read(&checkpoint).unwrap();
    run_in(&parts, &[("time.max_steps", "6")], true).unwrap();
    std::fs::write(&checkpoint, saved).unwrap();
    run_in(&parts, &[], true).unwrap();
    for file in ["history.csv", "defects.csv", "windings.csv"] {
        let [a, b] = [&whole, &parts].map(|folder| std::fs::read_to_string(folder.join(file)).unwrap());
        assert_eq!(a, b, "{file}");
    }
    let (defects, history) = (rows(&whole.join("defects.csv")), rows(&whole.join("history.csv")));
    assert!(!defects.is_empty());
    for row in &history {
        let here = |charge: &str| {
            defects.iter().filter(|d| d["step"] == row["step"] && d["charge"] == charge).count().to_string()
        };
        let measured = row["step"].parse::<usize>().unwrap() % 2 == 0;
        let expected = |charge| if measured { here(charge) } else { String::new() };
        assert_eq!([&row["defects_plus"], &row["defects_minus"]], [&expected("1"), &expected("-1")], "{row:?}");
    }
    for row in rows(&whole.join("windings.csv")) {
        let charges = defects.iter().filter(|d| d["step"] == row["step"]).map(|d| d["charge"].parse::<i32>().unwrap());
        assert_eq!(row["wall"].parse::<i32>().unwrap(), charges.sum::<i32>());
    }
    assert_eq!(summary.measures["defects_plus"].to_string(), history[history.len() - 1]["defects_plus"]);
}

#[test]
fn without_every_the_tables_hold_the_last_state() {
    let root = tempfile::tempdir().unwrap();
    let (whole, parts) = (root.path().join("whole"), root.path().join("parts"));
    let last = ("output.0.every", "");
    run_in(&whole, &[last], false).unwrap();
    run_in(&parts, &[last, ("time.max_steps", "3")], false).unwrap();
    run_in(&parts, &[last], true).unwrap();
    for file in ["defects.csv", "windings.csv"] {
        let [a, b] = [&whole, &parts].map(|folder| std::fs::read_to_string(folder.join(file)).unwrap());
        assert_eq!(a, b, "{file}");
        assert!(rows(&whole.join(file)).iter().all(|row| row["step"] == "8"));
    }
    assert_eq!(rows(&whole.join("windings.csv")).len(), 1);
}

#[test]
fn a_circulating_start_winds_once_and_goes_around() {
    let root = tempfile::tempdir().unwrap();
    let sets = [("initial.polarity", "circulating"), ("time.max_steps", "1"), ("output.0.every.steps", "1")];
    let summary = run_in(root.path(), &sets, false).unwrap();
    assert_eq!((summary.measures["defects_plus"], summary.measures["defects_minus"]), (1.0, 0.0));
    let [v, p] = ["circulation_velocity", "circulation_polarity"].map(|name| summary.measures[name]);
    assert!((0.8..1.0).contains(&p) && (0.3..1.0).contains(&v), "{v} and {p}");
}

#[test]
fn what_goes_around_needs_a_way_around() {
    for (sets, key) in [
        (vec![("output.0.measures", "[\"circulation\"]")], "output.0.measures"),
        (vec![("output.0.measures", "[\"defects\"]"), ("initial.polarity", "circulating")], "initial.polarity"),
    ] {
        let text = SCENE.replace("shape = \"disc\"\nh = 0.4", "shape = \"square\"\nn = 3");
        let error = check(&text, &sets).expect_err("a square has no way around").to_string();
        assert!(error.contains(key) && error.contains("racetrack") && error.contains("hint"), "{error}");
    }
}

/// A strip whose flow is steady from the start: nothing drives it but the inlet.
const STRIP: &str = r#"
[model]
kind = "incompressible"
beta = 0.5
traction = 0.0
peclet = 1.0
coherence = 0.5

[mesh]
shape = "strip-with-disc"
length = [-3.0, 5.0]
width = 5.0
h = 1.0
h_disc = 0.4

[boundary.inlet]
velocity = { dirichlet = ["1", "0"] }
polarity = "neumann"
[boundary.outlet]
velocity = "traction"
polarity = "neumann"
[boundary.walls]
velocity = "slip"
polarity = "neumann"
[boundary.disc]
velocity = "slip"
polarity = "neumann"

[initial]
polarity = ["0", "0"]

[time]
scheme = "bdf1"
step = 0.1
end = 0.2

[coupling]
kind = "anderson"

[strain]
weissenberg = 0.2

[[output]]
fields = ["velocity", "elastic_strain"]
[[output]]
cuts = ["axis-1"]
[[output]]
measures = ["elastic_strain"]
every = { steps = 1 }
"#;

fn run_text(folder: &Path, text: &str, sets: &[(&str, &str)]) -> (Summary, String) {
    let options = Options { out: folder.to_owned(), resume: false, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    let mut record = run::Record::default();
    let scene = check(text, sets).expect("the test's scene is good");
    let summary = run::run_recorded(&scene, &options, &mut record).unwrap();
    (summary, record.said.join("\n"))
}

#[test]
fn the_strain_of_a_steady_flow_is_written_in_every_form() {
    let root = tempfile::tempdir().unwrap();
    let (summary, said) = run_text(root.path(), STRIP, &[]);
    assert!(!said.contains("elastic strain"), "{said}");
    let columns = ["strain_max", "strain_least_stretch", "strain_growth"].map(|name| summary.measures[name]);
    let [largest, least, growth] = columns;
    assert!(largest > 0.1 && (0.0..1.0).contains(&least) && (0.0..1.0).contains(&growth), "{columns:?}");
    let history = rows(&root.path().join("history.csv"));
    assert_eq!(history[0]["strain_max"], history[1]["strain_max"], "the flow is steady");
    let cut = rows(&root.path().join("cuts/axis-1.csv"));
    let value = |row: &std::collections::HashMap<String, String>, name: &str| row[name].parse::<f64>().unwrap();
    // tissue comes in unstrained, and is stretched along the flow where it leaves the disc
    assert!(value(&cut[0], "strain_11").abs() < 0.02, "{}", value(&cut[0], "strain_11"));
    let behind = cut.iter().filter(|row| value(row, "x1") > 1.0).map(|row| value(row, "strain_11"));
    assert!(behind.fold(f64::MIN, f64::max) > 0.05);
    let vtu = std::fs::read_to_string(root.path().join("fields/step-000002.vtu")).unwrap();
    assert!(vtu.contains(r#"Name="elastic_strain" NumberOfComponents="6""#));
}

#[test]
fn an_unbounded_strain_and_a_changing_flow_are_told() {
    let root = tempfile::tempdir().unwrap();
    let sets = [("strain.weissenberg", "5.0"), ("initial.polarity", "[\"1\", \"0\"]"), ("model.traction", "1.0")];
    let (summary, said) = run_text(root.path(), STRIP, &sets);
    assert!(summary.measures["strain_growth"] >= 1.0);
    assert!(said.contains("has no bound") && said.contains("still changes"), "{said}");
}

#[test]
fn without_outputs_the_strain_costs_nothing_and_without_a_table_there_is_none() {
    let without = STRIP.split("[[output]]").next().unwrap();
    let scene = check(without, &[]).unwrap();
    assert!(scene.strain.is_some() && scene.strain_needed().is_none());
    let on = |scene: &Scene| scene.terms().into_iter().find(|t| t.name == "elastic strain").map(|t| t.on);
    assert_eq!([on(&scene), on(&check(STRIP, &[]).unwrap())], [Some(false), Some(true)]);
    let wrong = [
        ["strain", "", "output.0", "[strain]"],
        ["strain.weissenberg", "0.0", "strain.weissenberg", "greater than 0"],
        ["strain.weissenberg", "-1.0", "strain.weissenberg", "greater than 0"],
        ["strain.weissenberg", "inf", "strain.weissenberg", "finite"],
        ["strain.degree", "0", "strain.degree", "between 1 and"],
        ["strain.degree", "9", "strain.degree", "between 1 and"],
    ];
    for [set, value, key, words] in wrong {
        let error = check(STRIP, &[(set, value)]).expect_err("it is wrong").to_string();
        assert!(error.contains(key) && error.contains(words) && error.contains("hint"), "{error}");
    }
}
