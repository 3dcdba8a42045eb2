//! What a run says of its own error, presets of accuracy, and the trade of accuracy against time.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use monolayer::scene::Scene;
use monolayer::scene::presets::{Accuracy, MEASURED};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn program(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().unwrap()
}

fn error_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs a scene of the studies with other values; its summary.
#[track_caller]
fn summary(scene: &str, sets: &[&str], folder: &Path) -> serde_json::Value {
    let scene = root().join("studies").join(scene);
    let mut arguments = vec!["run", scene.to_str().unwrap(), "-q", "--out", "out"];
    sets.iter().for_each(|set| arguments.extend(["--set", set]));
    let output = program(&arguments, folder);
    assert!(output.status.success(), "{}", error_of(&output));
    serde_json::from_slice(&std::fs::read(folder.join("out/summary.json")).unwrap()).unwrap()
}

fn numbers(value: &serde_json::Value) -> BTreeMap<String, f64> {
    value.as_object().unwrap().iter().map(|(name, v)| (name.clone(), v.as_f64().unwrap())).collect()
}

/// The estimate of each measure is at most three times, at least a third of the error that the limits show.
#[track_caller]
fn within_three(summary: &serde_json::Value, limits: &[(&str, f64)]) {
    let (measures, estimates) = (numbers(&summary["measures"]), numbers(&summary["estimates"]));
    for (name, limit) in limits {
        let (error, estimate) = ((measures[*name] - limit).abs(), estimates[*name]);
        let factor = estimate / error;
        assert!((1.0 / 3.0..=3.0).contains(&factor), "{name}: error {error:.3e}, estimated {estimate:.3e}");
    }
}

const MEASURES: &str = r#"output=[{ measures = ["free_energy", "energy_budget"], estimate = true }]"#;

/// `∫[(|p|²−1)²/4 + |∇p|²/2]` of the polarity of square.toml at t = 1, by the midpoint rule.
fn energy_of_the_square() -> f64 {
    let n = 400;
    let at = |k: usize| (k as f64 + 0.5) / n as f64;
    let density = |x: f64, y: f64| {
        let (a, b) = (1.0 - (2.0 * PI * x).cos(), 1.0 - (2.0 * PI * y).cos());
        let p = [a * (PI * y).cos(), (PI * x).cos() * b];
        let gradients = [
            2.0 * PI * (2.0 * PI * x).sin() * (PI * y).cos(),
            -PI * a * (PI * y).sin(),
            -PI * (PI * x).sin() * b,
            2.0 * PI * (PI * x).cos() * (2.0 * PI * y).sin(),
        ];
        let square = p[0] * p[0] + p[1] * p[1];
        0.25 * (square - 1.0).powi(2) + 0.5 * gradients.iter().map(|g| g * g).sum::<f64>()
    };
    let sum: f64 = (0..n * n).map(|k| density(at(k / n), at(k % n))).sum();
    sum / (n * n) as f64
}

#[test]
fn estimates_of_a_marched_run_are_within_a_factor_of_three() {
    for (n, k) in [(6, 1), (8, 1), (6, 2)] {
        let folder = tempfile::tempdir().unwrap();
        let sets = [format!("mesh.n={n}"), format!("space.k={k}"), format!("time.step={}", 1.0 / f64::from(3 * n))];
        let mut sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        sets.push(MEASURES);
        let found = summary("mms/square.toml", &sets, folder.path());
        // ‖v‖² = ½ and 2‖D(v)‖² = π² for v = (sin πx cos πy, −cos πx sin πy)
        let energy = energy_of_the_square();
        within_three(&found, &[("free_energy", energy), ("budget_friction", 0.5), ("budget_viscosity", PI * PI)]);
        let how = &found["estimated"];
        assert_eq!(how["contains"], "mesh and time step");
        assert_eq!(how["cells"].as_array().unwrap().len(), 3);
        assert_eq!(how["cells"][0], 2 * n * n);
        assert!(how["steps"][2].as_f64().unwrap() > how["steps"][0].as_f64().unwrap());
        assert!(how["seconds"].as_f64().unwrap() > 0.0 && found["not_estimated"].is_null());
    }
}

#[test]
fn estimates_of_a_compressible_run_are_within_a_factor_of_three() {
    let folder = tempfile::tempdir().unwrap();
    // so many cells that the coarsest of the three meshes still resolves the density wave
    let sets = ["mesh.n=16", "time.step=0.020833333333333332", "time.end=0.25", MEASURES];
    let found = summary("mms/squeezed-square.toml", &sets, folder.path());
    // by degrees one higher on 242 cells, BDF3 from exact values and Δt = 1/320
    let limits =
        [("free_energy", 0.913_617_55), ("budget_friction", 0.025_993_884), ("budget_viscosity", 0.719_176_06)];
    within_three(&found, &limits);
}

#[test]
fn an_estimate_of_a_time_step_alone_sees_the_time_step() {
    // so many cells that only the steps count
    let folder = tempfile::tempdir().unwrap();
    let sets = ["mesh.n=8", "space.k=2", "time.step=0.125", "time.scheme=bdf1", MEASURES];
    let found = summary("mms/square.toml", &sets, folder.path());
    within_three(&found, &[("free_energy", energy_of_the_square())]);
    assert_eq!(found["estimated"]["bounds"][0], 1.0);
}

#[test]
fn the_estimate_of_a_steady_strip_is_within_a_factor_of_three() {
    let folder = tempfile::tempdir().unwrap();
    let sets = [
        "mesh.length=[-6.0, 10.0]",
        "mesh.h=2.0",
        "mesh.h_disc=0.26",
        "mesh.grading=0.3",
        "model.peclet=0.5",
        "model.coherence=1.0",
        "model.elasticity=0.1",
        "steady.eigenvalues=0",
        "output=[{ measures = [\"overshoot\"], estimate = true }]",
    ];
    let found = summary("strip/strip.toml", &sets, folder.path());
    // on 1453 cells
    within_three(&found, &[("overshoot_velocity", -0.28371671)]);
    assert_eq!(found["estimated"]["contains"], "mesh");
    // the coarser runs begin where the run has ended
    let coarse = std::fs::read_to_string(folder.path().join("out/estimate/coarse/scene.toml")).unwrap();
    assert!(coarse.contains("checkpoint.bin"), "{coarse}");
}

#[test]
fn a_run_without_estimates_says_why_and_keeps_its_results() {
    let folder = tempfile::tempdir().unwrap();
    let found = summary("mms/square.toml", &["mesh.n=1", "time.step=0.25", MEASURES], folder.path());
    assert_eq!(found["status"], "finished");
    assert!(found["estimates"].is_null() && found["measures"]["free_energy"].is_f64());
    let reason = found["not_estimated"].as_str().unwrap();
    assert!(reason.contains("no two coarser"), "{reason}");
    let said = found["said"].as_array().unwrap();
    assert!(said.iter().any(|note| note.as_str().unwrap().contains("not estimated")), "{said:?}");
    // nobody asked
    let folder = tempfile::tempdir().unwrap();
    let found = summary("mms/square.toml", &["mesh.n=1", "time.step=0.25"], folder.path());
    assert!(found["estimates"].is_null() && found["not_estimated"].is_null());
    assert!(!folder.path().join("out/estimate").exists());
}

#[track_caller]
fn refused(arguments: &[&str], parts: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let output = program(arguments, folder.path());
    let error = error_of(&output);
    assert!(!output.status.success() && !error.contains("panicked"), "{error}");
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
}

#[test]
fn estimates_that_cannot_be_made_are_refused() {
    let strip = root().join("studies/strip/strip.toml");
    let strip = strip.to_str().unwrap();
    let file = root().join("studies/strip/from-file.toml");
    refused(&["check", strip, "--set", "output.0.estimate=true"], &["output.0.estimate", "only measures", "hint"]);
    let output = "output=[{ measures = [\"overshoot\"], estimate = true }]";
    let parts = ["output.0.estimate", "a mesh from a file has none", "mesh.shape"];
    refused(&["check", file.to_str().unwrap(), "--set", output], &parts);
    refused(&["check", strip, "--set", "output.1.estimate=1"], &["estimate"]);
}

fn scene(text: &str) -> Scene {
    Scene::parse(text, Path::new("scene.toml")).unwrap_or_else(|error| panic!("{error}"))
}

/// The manufactured square without what a preset can set, and with what is given.
fn bare(accuracy: &str, mesh: &str, rest: &str) -> String {
    let text = std::fs::read_to_string(root().join("studies/mms/square.toml")).unwrap();
    let kept: Vec<&str> = text
        .lines()
        .filter(|line| {
            !["n = ", "scheme = ", "step = ", "tolerance = ", "title"].iter().any(|key| line.starts_with(key))
        })
        .collect();
    let kept = kept.join("\n").replace("shape = \"square\"", &format!("shape = \"square\"\n{mesh}"));
    format!("accuracy = \"{accuracy}\"\n{}", kept.replace("end = 1.0", &format!("end = 1.0\n{rest}")))
}

#[test]
fn presets_fill_in_what_is_left_out_and_nothing_else() {
    for accuracy in Accuracy::ALL {
        let preset = accuracy.preset();
        let filled = scene(&bare(accuracy.name(), "", ""));
        assert_eq!(filled.accuracy(), Some(accuracy));
        assert_eq!((filled.mesh.get("n"), filled.space.pressure), (Some(preset.n), preset.k));
        assert_eq!(filled.coupling.tolerance, preset.tolerance);
        assert!((filled.time.control.step - preset.step).abs() < 1e-12);
        let mut keys: Vec<&str> = filled.preset.iter().map(|(key, _)| key.as_str()).collect();
        keys.sort_unstable();
        assert_eq!(keys, ["coupling.tolerance", "mesh.n", "space.k", "time.scheme", "time.step"]);
        // what is given wins
        let given = scene(&bare(accuracy.name(), "n = 5", "step = 0.3\nscheme = \"bdf4\""));
        assert_eq!((given.mesh.get::<usize>("n"), given.time.order, given.time.control.step), (Some(5), 4, 0.3));
        assert_eq!(given.preset.len(), 2, "{:?}", given.preset);
    }
}

#[test]
fn a_resolved_preset_parses_back_to_the_same_scene() {
    let first = scene(&bare("fine", "", ""));
    let again = scene(&first.resolved_toml());
    assert_eq!(first.resolved_toml(), again.resolved_toml());
    assert!(again.preset.is_empty(), "every key is given: {:?}", again.preset);
    assert_eq!((first.mesh, first.space, first.time), (again.mesh, again.space, again.time));
    // a single degree is a choice of its own
    let degrees = bare("fine", "", "\n[space]\ndegree = { velocity = 3, pressure = 2 }");
    assert!(scene(&degrees).preset.iter().all(|(key, _)| key != "space.k"));
}

#[test]
fn presets_go_by_the_size_of_the_shape() {
    let with = |file: &str, sets: &[(&str, &str)]| {
        let path = root().join("studies").join(file);
        let mut source = monolayer::scene::SceneSource::read(&path).unwrap();
        sets.iter().for_each(|(key, value)| source.set(key, value).unwrap());
        Scene::check(source).unwrap()
    };
    let bare = [("accuracy", "standard"), ("mesh.h", ""), ("mesh.h_disc", "")];
    let small = with("strip/strip.toml", &bare);
    let large = with("strip/strip.toml", &[&bare[..], &[("mesh.radius", "2.0"), ("mesh.width", "20.0")]].concat());
    let length = |scene: &Scene, key: &str| scene.mesh.get::<f64>(key).unwrap();
    assert!((length(&large, "h") / length(&small, "h") - 2.0).abs() < 1e-9);
    assert!((length(&large, "h_disc") / length(&small, "h_disc") - 2.0).abs() < 1e-9);
    let disc = with("disc/disc.toml", &[("accuracy", "draft"), ("mesh.h", ""), ("mesh.radius", "3.0")]);
    assert!((length(&disc, "h") - 3.0 * Accuracy::Draft.preset().h).abs() < 1e-9);
}

#[test]
fn check_says_what_a_preset_does() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), bare("draft", "", "")).unwrap();
    let output = program(&["check", "scene.toml"], folder.path());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in
        ["accuracy = \"draft\" sets", "mesh.n = 8", "time.scheme = bdf2", MEASURED[0].case, MEASURED[0].errors[0]]
    {
        assert!(text.contains(part), "`{part}` is not in: {text}");
    }
    // on the command line, too, a key that is taken away is filled in
    let square = root().join("studies/mms/square.toml");
    let sets = ["--set", "accuracy=fine", "--set", "time.step=", "--set", "time.scheme=", "--set", "mesh.n="];
    let output = program(&[&["check", square.to_str().unwrap()], &sets[..]].concat(), folder.path());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("time.scheme = bdf3") && text.contains("mesh.n = 12"), "{text}{}", error_of(&output));
    std::fs::write(folder.path().join("scene.toml"), bare("perfect", "", "")).unwrap();
    let output = program(&["check", "scene.toml"], folder.path());
    let error = error_of(&output);
    assert!(error.contains("perfect") && error.contains("draft") && !error.contains("panicked"), "{error}");
}

#[test]
fn the_page_has_the_numbers_of_the_presets() {
    let page = std::fs::read_to_string(root().join("docs/tradeoff.md")).unwrap();
    assert!(!MEASURED.is_empty());
    for m in MEASURED {
        for k in 0..3 {
            let row = format!(
                "| {} | {} | {} | {} | {} |",
                Accuracy::ALL[k].name(),
                m.case,
                m.measure,
                m.errors[k],
                m.seconds[k]
            );
            assert!(page.contains(&row), "docs/tradeoff.md has no line {row}");
        }
    }
}

const STUDY: &str = r#"title = "Small"
scene = "square.toml"
set = { "time.end" = 0.25, "time.step" = 0.0625 }
reference = "exact"
measures = ["velocity", "polarity Linf(Linf)"]
[[setting]]
name = "k1"
vary = { "mesh.n" = [2, 4] }
[[setting]]
name = "k2"
set = { "space.k" = 2, "mesh.n" = 2 }
"#;

fn with_study(text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(root().join("studies/mms/square.toml"), folder.path().join("square.toml")).unwrap();
    std::fs::write(folder.path().join("small.toml"), text).unwrap();
    folder
}

fn rows(folder: &Path) -> Vec<BTreeMap<String, String>> {
    let mut table = csv::Reader::from_path(folder.join("out/tradeoff.csv")).unwrap();
    table.deserialize().map(Result::unwrap).collect()
}

#[test]
fn a_trade_off_is_measured_kept_and_drawn() {
    let folder = with_study(STUDY);
    let arguments = ["tradeoff", "small.toml", "--out", "out", "--repeat", "2"];
    let output = program(&arguments, folder.path());
    assert!(output.status.success(), "{}", error_of(&output));
    assert!(String::from_utf8_lossy(&output.stdout).contains("no other setting is at once as fast and as exact"));
    let table = rows(folder.path());
    let names: Vec<&str> = table.iter().map(|row| row["setting"].as_str()).collect();
    assert_eq!(names, ["k1 n=2", "k1 n=4", "k2"]);
    let number = |row: usize, column: &str| table[row][column].parse::<f64>().unwrap();
    assert!(number(1, "error velocity") < 0.3 * number(0, "error velocity"));
    assert!((0..3).all(|row| number(row, "seconds") > 0.0 && number(row, "unknowns") > 0.0));
    // the fastest and the most exact are on the front, whatever the machine
    let best = (0..3).min_by(|a, b| number(*a, "error velocity").total_cmp(&number(*b, "error velocity"))).unwrap();
    let fastest = (0..3).min_by(|a, b| number(*a, "seconds").total_cmp(&number(*b, "seconds"))).unwrap();
    assert_eq!([&table[best]["on_front velocity"], &table[fastest]["on_front velocity"]], ["yes", "yes"]);
    for file in ["tradeoff-velocity.svg", "tradeoff-velocity.png", "tradeoff-polarity-Linf-Linf-.svg", "study.toml"] {
        assert!(folder.path().join("out").join(file).exists(), "{file}");
    }
    // again: nothing is run anew, so that the times are the same
    let output = program(&arguments, folder.path());
    assert!(output.status.success(), "{}", error_of(&output));
    assert_eq!(table, rows(folder.path()));
    // another study does not mix with it
    let output = program(&[&arguments[..], &["--set", "time.end=0.125"]].concat(), folder.path());
    assert!(!output.status.success() && error_of(&output).contains("earlier study"), "{}", error_of(&output));
}

#[test]
fn errors_below_that_of_the_reference_are_marked() {
    let text = STUDY.replace(
        "reference = \"exact\"\nmeasures = [\"velocity\", \"polarity Linf(Linf)\"]",
        "reference = { set = { \"mesh.n\" = 4 }, coarser = { \"mesh.n\" = 2 } }\nmeasures = [\"free_energy\"]",
    );
    let folder = with_study(&text);
    let output = program(&["tradeoff", "small.toml", "-q", "--out", "out"], folder.path());
    assert!(output.status.success(), "{}", error_of(&output));
    let table = rows(folder.path());
    // the setting that is the reference itself differs by nothing from it
    assert_eq!(table[1]["bound free_energy"], "≤");
    assert_eq!(table[1]["error free_energy"], table[3]["error free_energy"]);
    assert_eq!(table[3]["setting"], "(error of the reference)");
}

#[test]
fn wrong_studies_of_a_trade_off_are_explained() {
    let wrong = |text: &str, parts: &[&str]| {
        let folder = with_study(text);
        let output = program(&["tradeoff", "small.toml", "--out", "out"], folder.path());
        let error = error_of(&output);
        assert!(!output.status.success() && !error.contains("panicked"), "{error}");
        parts.iter().for_each(|part| assert!(error.contains(part), "`{part}` is not in: {error}"));
        assert!(!folder.path().join("out").exists());
    };
    wrong(&STUDY.replace("\"velocity\"", "\"velocty\""), &["measures", "velocty", "did you mean `velocity`"]);
    wrong(&STUDY.replace("\"exact\"", "\"exactly\""), &["reference", "exactly", "hint"]);
    wrong(&STUDY.replace("\"exact\"", "{ set = { \"mesh.n\" = 4 } }"), &["reference", "coarser", "hint"]);
    wrong(&STUDY.replace("\"mesh.n\" = [2, 4]", "\"mesh.m\" = [2, 4]"), &["mesh.m", "small.toml"]);
    wrong(&STUDY.replace("[2, 4]", "[]"), &["setting.0.vary.\"mesh.n\"", "the list is empty"]);
    wrong(&STUDY.replace("name = \"k2\"", "name = \"k 2\""), &["setting.1.name", "letters, digits"]);
    wrong("scene = \"square.toml\"\nvary = { \"mesh.n\" = [2] }\n", &["monolayer study"]);
    refused(&["run", root().join("studies/tradeoff/mms.toml").to_str().unwrap()], &["monolayer tradeoff"]);
    refused(&["study", root().join("studies/tradeoff/mms.toml").to_str().unwrap()], &["monolayer tradeoff"]);
}
