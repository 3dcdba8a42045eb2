//! Whole runs through the library: restart, wrong inputs, failures that keep what was computed.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use monolayer::output::progress::Verbosity;
use monolayer::run::{self, Ending, Options, RunError, Summary};
use monolayer::scene::{Scene, SceneSource};
use monolayer::solve::SolveError;
use monolayer::time::{MarchError, StepFailure};

static NEVER: AtomicBool = AtomicBool::new(false);

const SCENE: &str = r#"
[model]
kind = "incompressible"
beta = 0.75
peclet = 2.0
coherence = 0.2
elasticity = 0.4
active_stress = 0.5

[mesh]
shape = "strip-with-disc"
length = [-4.0, 6.0]
width = 6.0
h = 1.6
h_disc = 0.5

[boundary.inlet]
velocity = { dirichlet = ["1", "0"] }
polarity = { dirichlet = ["1", "0"] }
[boundary.outlet]
velocity = "traction"
polarity = { dirichlet = ["1", "0.1*sin(t)"] }
[boundary.walls]
velocity = "slip"
polarity = "neumann"
[boundary.disc]
velocity = "slip"
polarity = "neumann"

[initial]
polarity = "aligned-around-disc"

[time]
scheme = "bdf3"
step = 0.1
end = 1.0

[coupling]
kind = "anderson"
depth = 4

[[output]]
fields = ["velocity", "pressure", "polarity", "molecular_field", "stream_function", "tissue_velocity"]
every = { time = 0.25 }
[[output]]
measures = ["overshoot", "asymmetry", "free_energy"]
every = { steps = 3 }
[[output]]
cuts = ["axis-1", "axis-3", { name = "oblique", from = [-3.0, -2.0], to = [5.0, 2.0], points = 40 }]
"#;

/// The scene with data that are constant from some time on, as they must be where a run may stop.
fn settling() -> String {
    SCENE.replace("0.1*sin(t)", "0.1*min(t, 0.35)")
}

fn scene_of(text: &str, sets: &[(&str, &str)]) -> Scene {
    let mut source = SceneSource::parse(text, Path::new("test.toml")).expect("the test's scene parses");
    for (key, value) in sets {
        source.set(key, value).expect("the test's override fits");
    }
    Scene::check(source).expect("the test's scene is good")
}

fn run_in(folder: &Path, scene: &Scene, resume: bool) -> Result<Summary, RunError> {
    let options = Options { out: folder.to_owned(), resume, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    run::run(scene, &options)
}

fn folder(root: &tempfile::TempDir, name: &str) -> PathBuf {
    root.path().join(name)
}

fn bytes(path: PathBuf) -> Vec<u8> {
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

#[test]
fn a_resumed_run_has_the_bits_of_an_uninterrupted_one() {
    for kind in ["anderson", "fixed-point", "newton"] {
        resumes_bit_for_bit(kind);
    }
}

fn resumes_bit_for_bit(kind: &str) {
    let root = tempfile::tempdir().unwrap();
    let (whole, parts) = (folder(&root, "whole"), folder(&root, "parts"));
    let coupling = ("coupling.kind", kind);
    let summary = run_in(&whole, &scene_of(SCENE, &[coupling]), false).unwrap();
    assert_eq!(summary.ending, Ending::EndTime);
    for stop in ["3", "5"] {
        let first = run_in(&parts, &scene_of(SCENE, &[coupling, ("time.max_steps", stop)]), stop != "3").unwrap();
        assert_eq!(first.ending, Ending::MaxSteps);
    }
    let last = run_in(&parts, &scene_of(SCENE, &[coupling]), true).unwrap();
    assert_eq!(last.counts, summary.counts);
    let name = format!("fields/step-{:06}.vtu", summary.counts.steps);
    for file in ["history.csv", name.as_str(), "cuts/axis-1.csv", "cuts/oblique.csv"] {
        assert!(bytes(whole.join(file)) == bytes(parts.join(file)), "{file} differs");
    }
    let saved =
        |dir: &Path| monolayer::output::checkpoint::Saved::read(&dir.join("checkpoint.bin")).unwrap().march().unwrap();
    assert!(saved(&whole) == saved(&parts), "the checkpoints differ");
}

#[test]
fn a_run_killed_after_a_scheduled_checkpoint_resumes_with_the_same_bits() {
    let root = tempfile::tempdir().unwrap();
    let (whole, parts) = (folder(&root, "whole"), folder(&root, "parts"));
    // the checkpoint falls between two landings, and the energy's rate counts towards an ending
    let text = format!("{}\n[[output]]\ncheckpoint = true\nevery = {{ steps = 4 }}\n", settling());
    let sets = [("time.stop.energy_rate", "1e-30")];
    let summary = run_in(&whole, &scene_of(&text, &sets), false).unwrap();
    // what a killed process leaves: rows and files beyond its last checkpoint
    let stop = [("time.stop.energy_rate", "1e-30"), ("time.max_steps", "4")];
    run_in(&parts, &scene_of(&text, &stop), false).unwrap();
    let checkpoint = bytes(parts.join("checkpoint.bin"));
    run_in(&parts, &scene_of(&text, &[("time.stop.energy_rate", "1e-30"), ("time.max_steps", "6")]), true).unwrap();
    std::fs::write(parts.join("checkpoint.bin"), checkpoint).unwrap();
    let last = run_in(&parts, &scene_of(&text, &sets), true).unwrap();
    assert_eq!(last.counts, summary.counts);
    assert!(bytes(whole.join("history.csv")) == bytes(parts.join("history.csv")), "history.csv differs");
}

#[test]
fn schedules_that_nearly_coincide_do_not_spoil_the_solution() {
    let root = tempfile::tempdir().unwrap();
    let energy = |name: &str, every: &str| {
        let sets = [("output.0.every.time", every)];
        let summary = run_in(&folder(&root, name), &scene_of(SCENE, &sets), false).unwrap();
        (summary.measures["free_energy"], summary.counts.rejected)
    };
    let (clean, _) = energy("clean", "0.5");
    // a sliver of 1e-9 before t = 0.5 and another before the end
    let (slivers, rejected) = energy("slivers", "0.4999999995");
    assert_eq!(rejected, 0);
    assert!((clean - slivers).abs() < 2e-3 * clean.abs(), "{clean} {slivers}");
}

#[test]
fn a_run_stopped_from_outside_can_be_resumed() {
    let root = tempfile::tempdir().unwrap();
    let out = folder(&root, "out");
    let stop = AtomicBool::new(true);
    let options = Options { out: out.clone(), resume: false, verbosity: Verbosity::Quiet, interrupt: &stop };
    let scene = scene_of(SCENE, &[]);
    assert_eq!(run::run(&scene, &options).unwrap().ending, Ending::Interrupted);
    let end = run_in(&out, &scene, true).unwrap();
    assert_eq!(end.ending, Ending::EndTime);
    assert_eq!(end.time, 1.0);
}

#[test]
fn every_file_of_a_run_is_there_and_says_what_was_on() {
    let root = tempfile::tempdir().unwrap();
    let out = folder(&root, "out");
    run_in(&out, &scene_of(SCENE, &[]), false).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&bytes(out.join("summary.json"))).unwrap();
    assert_eq!(summary["status"], "finished");
    assert_eq!(summary["ending"], "end-time");
    for key in ["residual", "seconds_total", "peak_memory_mib", "direct_solves"] {
        assert!(summary[key].as_f64().is_some_and(|v| v > 0.0), "{key}: {}", summary[key]);
    }
    assert!(summary["measures"]["overshoot_velocity"].is_number());
    let on = |name: &str| summary["terms"].as_array().unwrap().iter().any(|t| t["name"] == name && t["on"] == true);
    assert!(on("active stress") && on("molecular field") && !on("force"));
    // outputs at 0, 0.25, 0.5, 0.75, 1: steps land on them
    let index = String::from_utf8(bytes(out.join("fields.pvd"))).unwrap();
    for time in ["0", "0.25", "0.5", "0.75", "1"] {
        assert!(index.contains(&format!("timestep=\"{time}\"")), "{time} in {index}");
    }
    // the resolved scene runs by itself and resolves to itself
    let text = String::from_utf8(bytes(out.join("scene.toml"))).unwrap();
    assert_eq!(scene_of(&text, &[]).resolved_toml(), text);
    assert!(text.contains("grading"), "defaults of the mesh are filled in:\n{text}");
}

#[test]
fn terms_that_are_off_cost_nothing() {
    let root = tempfile::tempdir().unwrap();
    let off = [("model.elasticity", "0"), ("model.active_stress", "0"), ("output.0.fields", "[\"velocity\"]")];
    let summary = run_in(&folder(&root, "out"), &scene_of(SCENE, &off), false).unwrap();
    let on: Vec<&str> = summary.terms.iter().filter(|t| t.on).map(|t| t.name).collect();
    assert!(!on.contains(&"molecular field") && !on.contains(&"active stress"), "{on:?}");
    assert!(summary.unknowns.stream_function.is_none(), "no stream function was asked for");
    assert_eq!(summary.measures["free_energy"], 0.0);
}

#[test]
fn the_run_ends_when_the_state_is_stationary_or_the_energy_at_rest() {
    let root = tempfile::tempdir().unwrap();
    let square = r#"
[model]
kind = "incompressible"
friction = 1.0
traction = 0.0
peclet = 1.0
coherence = 0.5
elasticity = 0.5
[mesh]
shape = "square"
n = 3
[boundary.left]
velocity = "slip"
polarity = "neumann"
[boundary.right]
velocity = "slip"
polarity = "neumann"
[boundary.top]
velocity = "slip"
polarity = "neumann"
[boundary.bottom]
velocity = "slip"
polarity = "neumann"
[initial]
polarity = ["1 + 0.2*cos(pi*x)", "0.1*cos(pi*y)"]
[time]
scheme = "bdf1"
step = 0.2
end = 100.0
"#;
    let residual = run_in(&folder(&root, "r"), &scene_of(square, &[("time.stop.residual", "1e-5")]), false).unwrap();
    assert_eq!(residual.ending, Ending::Stationary);
    assert!(residual.residual.unwrap() < 1e-5 && residual.time < 50.0);
    let energy = run_in(&folder(&root, "e"), &scene_of(square, &[("time.stop.energy_rate", "1e-6")]), false).unwrap();
    assert_eq!(energy.ending, Ending::EnergyAtRest);
    // the free energy never grew on the way
    let mut reader = csv::Reader::from_path(folder(&root, "e").join("history.csv")).unwrap();
    let column = reader.headers().unwrap().iter().position(|h| h == "free_energy").unwrap();
    let energies: Vec<f64> = reader.records().map(|r| r.unwrap()[column].parse().unwrap()).collect();
    assert!(energies.len() > 10 && energies.windows(2).all(|w| w[1] <= w[0] + 1e-15), "{energies:?}");
}

const CHANNEL: &str = r#"
[model]
kind = "incompressible"
friction = 1.0
peclet = 1.0
coherence = 0.5
[mesh]
shape = "strip"
length = [0.0, 2.0]
width = 1.0
h = 0.5
[boundary.inlet]
velocity = { dirichlet = ["if(t < 1, 0, 1)", "0"] }
polarity = "neumann"
[boundary.outlet]
velocity = "traction"
polarity = "neumann"
[boundary.walls]
velocity = "slip"
polarity = "neumann"
[initial]
polarity = ["0", "0"]
[time]
scheme = "bdf2"
step = 0.1
end = 3.0
stop = { residual = 1e-6 }
[[output]]
measures = ["free-energy"]
"#;

#[test]
fn a_run_does_not_stop_before_its_data_have_come_to_rest() {
    let root = tempfile::tempdir().unwrap();
    // nothing moves before t = 1, and nothing changes from then on: p = 0 stays, v follows at once
    let sets = [("model.traction", "0")];
    let switched = run_in(&folder(&root, "switched"), &scene_of(CHANNEL, &sets), false).unwrap();
    assert_eq!((&switched.ending, switched.time, switched.counts.steps), (&Ending::Stationary, 1.0, 10));
    assert!(switched.said.iter().any(|note| note.contains("the data change until t = 1;")), "{:?}", switched.said);
    // a run that was cut off while the data only paused goes on
    let cut = scene_of(CHANNEL, &[sets[0], ("time.max_steps", "4")]);
    assert_eq!(run_in(&folder(&root, "parts"), &cut, false).unwrap().ending, Ending::MaxSteps);
    let last = run_in(&folder(&root, "parts"), &scene_of(CHANNEL, &sets), true).unwrap();
    assert_eq!((&last.ending, last.time), (&Ending::Stationary, 1.0));
    // the rate of the energy counts from then on, too
    let energy = CHANNEL.replace("stop = { residual = 1e-6 }", "stop = { energy_rate = 1e-9 }");
    let sets = [sets[0], ("model.elasticity", "0.1")];
    let energy = run_in(&folder(&root, "energy"), &scene_of(&energy, &sets), false).unwrap();
    assert_eq!(energy.ending, Ending::EnergyAtRest);
    assert!(energy.time >= 1.9 - 1e-12, "ten steps from t = 1 on: {}", energy.time);
}

#[test]
fn times_of_equal_steps_are_the_multiples_of_the_step() {
    let root = tempfile::tempdir().unwrap();
    let long = CHANNEL.replace("stop = { residual = 1e-6 }", "max_steps = 90").replace("step = 0.1", "step = 0.05");
    let summary = run_in(&folder(&root, "out"), &scene_of(&long, &[("time.end", "50.0")]), false).unwrap();
    assert_eq!(summary.time, 4.5);
    let mut reader = csv::Reader::from_path(folder(&root, "out").join("history.csv")).unwrap();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    for (k, row) in rows.iter().enumerate() {
        let time = format!("{:.2}", 0.05 * (k + 1) as f64);
        let shortest = time.trim_end_matches('0').trim_end_matches('.');
        assert_eq!((&row[1], &row[2]), (shortest, "0.05"));
    }
}

#[test]
fn the_last_lines_of_a_run_are_true_for_marches_and_searches() {
    let root = tempfile::tempdir().unwrap();
    let march = run_in(&folder(&root, "march"), &scene_of(CHANNEL, &[("time.stop", "")]), false).unwrap().to_string();
    assert!(march.starts_with("t = 3 after 30 steps (0 rejected): the end time was reached\n"), "{march}");
    let line = march.lines().nth(1).unwrap();
    assert!(line.contains("iterations a step, ") && line.contains("s each; ") && !line.contains("0.000 s"), "{line}");
    let steady = CHANNEL.replace("if(t < 1, 0, 1)", "1").replace("[\"0\", \"0\"]", "[\"1\", \"0\"]");
    let steady = scene_of(&steady, &[("time.stop", ""), ("steady.eigenvalues", "2")]);
    let found = run_in(&folder(&root, "steady"), &steady, false).unwrap();
    assert_eq!(found.ending, Ending::Steady);
    let text = found.to_string();
    let head = format!("{} steps of the search: a steady state was found; ", found.counts.steps);
    assert!(text.starts_with(&head) && !text.contains("t = 0") && !text.contains("iterations a step"), "{text}");
}

#[track_caller]
fn fails(text: &str, sets: &[(&str, &str)], parts: &[&str]) {
    let root = tempfile::tempdir().unwrap();
    let error = run_in(&folder(&root, "out"), &scene_of(text, sets), false).expect_err("a wrong input").to_string();
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
    let empty = std::fs::read_dir(folder(&root, "out")).is_ok_and(|mut entries| entries.next().is_none());
    assert!(!empty, "an empty folder was left behind");
}

#[test]
fn wrong_inputs_that_only_the_run_can_see() {
    // a tag without condition, a condition without tag
    let missing = SCENE.replace("[boundary.walls]\nvelocity = \"slip\"\npolarity = \"neumann\"\n", "");
    fails(&missing, &[], &["walls", "[boundary.walls]"]);
    fails(&SCENE.replace("[boundary.walls]", "[boundary.wals]"), &[], &["wals", "did you mean `walls`", "inlet"]);
    // mesh keys that do not fit
    fails(SCENE, &[("mesh.h_disc", "7.0")], &["mesh.h_disc", "hint"]);
    fails(SCENE, &[("mesh.radius", "3.5")], &["mesh.radius", "hint"]);
    fails(SCENE, &[("mesh.n", "4")], &["mesh.n", "hint"]);
    // formulas that are not finite where they are used
    fails(SCENE, &[("initial.polarity", "[\"sqrt(x)\", \"0\"]")], &["sqrt(x)", "initial.polarity"]);
    fails(SCENE, &[("boundary.inlet.velocity", "{ dirichlet = [\"sqrt(-1-y^2)\", \"0\"] }")], &["sqrt(-1-y^2)", "NaN"]);
    // a source that is not finite before the first step
    fails(&format!("{SCENE}\n[source]\npolarity = [\"log(x-1)\", \"0\"]\n"), &[], &["log(x-1)", "NaN", "t = 0"]);
    // exact fields that are none, and nothing is left behind
    let exact = "\n[exact]\nvelocity = [\"0\", \"0\"]\npressure = \"1/(x+4)\"\npolarity = [\"1\", \"0\"]\n";
    fails(&format!("{SCENE}{exact}"), &[], &["exact.pressure", "1/(x+4)", "inf at x = -4", "hint"]);
    let exact = exact.replace("1/(x+4)", "x").replace("[\"0\", \"0\"]", "[\"x\", \"0\"]");
    fails(&format!("{SCENE}{exact}"), &[], &["exact.velocity", "div v = 1", "stream function"]);
    let exact = exact.replace("[\"x\", \"0\"]", "[\"1\", \"0\"]");
    fails(&format!("{SCENE}{exact}"), &[], &["exact.velocity", "v·n = ", "`disc`", "slip", "hint"]);
    // too many random vectors; a measure that the domain does not have; cuts that overwrite each other
    fails(SCENE, &[("initial.polarity", "{ random = { seed = 1, h_coarse = 1e-6 } }")], &["h_coarse", "hint"]);
    let square = SCENE
        .replace("strip-with-disc", "strip")
        .replace("h_disc = 0.5\n", "")
        .replace("[boundary.disc]\nvelocity = \"slip\"\npolarity = \"neumann\"\n", "");
    fails(&square, &[], &["overshoot", "disc", "hint"]);
    // an inflow from which no overshoot counts
    let inlet = "boundary.inlet.velocity";
    fails(SCENE, &[(inlet, "{ dirichlet = [0, 0] }")], &["overshoot", "velocity of `inlet`", "is 0", "hint"]);
    fails(SCENE, &[(inlet, "{ dirichlet = [\"-1\", \"0\"] }")], &["overshoot", "velocity of `inlet`", "is -1"]);
    fails(SCENE, &[(inlet, "\"slip\"")], &["overshoot", "nothing passes `inlet`"]);
    let polarity = ("boundary.inlet.polarity", "{ dirichlet = [\"0\", \"1\"] }");
    fails(SCENE, &[polarity], &["overshoot", "polarity of `inlet`", "is 0"]);
    // a flow that the closed boundary cannot have
    fails(SCENE, &[("boundary.outlet.velocity", "{ dirichlet = [\"0\", \"0\"] }")], &["net flux", "hint"]);
}

#[test]
fn an_overshoot_counts_from_what_flows_in() {
    let root = tempfile::tempdir().unwrap();
    let text = SCENE.replace("0.1*sin(t)", "0");
    let measured = |name: &str, sets: &[(&str, &str)]| {
        // no output on the way, where a step would have to land
        let common = [("time.end", "0.3"), ("output.0.every", ""), ("output.1.every", "")];
        let scene = scene_of(&text, &[&common[..], sets].concat());
        let summary = run_in(&folder(&root, name), &scene, false).unwrap();
        ["overshoot_velocity", "overshoot_velocity_x1", "overshoot_polarity"].map(|m| summary.measures[m])
    };
    let reference = measured("one", &[]);
    // the same flow with another unit of time: twice as fast, with an inflow of 2
    let faster = [
        ("boundary.inlet.velocity", "{ dirichlet = [2, 0] }"),
        ("model.traction", "6.0"),
        ("model.elasticity", "0.8"),
        ("model.active_stress", "1.0"),
        ("model.peclet", "1.0"),
        ("time.step", "0.05"),
        ("time.end", "0.15"),
    ];
    let doubled = measured("two", &faster);
    assert!(reference[0].abs() > 0.1, "{reference:?}");
    for (ours, theirs) in doubled.iter().zip(reference) {
        assert!((ours - theirs).abs() < 1e-6 * theirs.abs(), "{doubled:?} {reference:?}");
    }
    // nothing flows in yet: nothing to count from
    let later =
        measured_columns(&root, &text, &[("boundary.inlet.velocity", "{ dirichlet = [\"if(t<9,0,1)\", \"0\"] }")]);
    assert!(!later.contains(&"overshoot_velocity".to_owned()) && later.contains(&"overshoot_polarity".to_owned()));
}

/// The measures that a short run has at its end.
fn measured_columns(root: &tempfile::TempDir, text: &str, sets: &[(&str, &str)]) -> Vec<String> {
    let common = [("time.end", "0.1"), ("output.0.fields", "[\"velocity\"]"), ("output.1.every", "")];
    let scene = scene_of(text, &[&common[..], sets].concat());
    run_in(&folder(root, "columns"), &scene, false).unwrap().measures.keys().map(ToString::to_string).collect()
}

#[test]
fn a_resumed_run_may_measure_more_and_write_other_fields() {
    let root = tempfile::tempdir().unwrap();
    let out = folder(&root, "out");
    let less =
        [("output.1.measures", "[\"free_energy\"]"), ("output.0.fields", "[\"velocity\"]"), ("time.max_steps", "4")];
    run_in(&out, &scene_of(&settling(), &less), false).unwrap();
    run_in(&out, &scene_of(&settling(), &[("time.stop.residual", "1e-12")]), true).unwrap();
    let mut reader = csv::Reader::from_path(out.join("history.csv")).unwrap();
    let column = |name: &str, headers: &csv::StringRecord| headers.iter().position(|h| h == name).unwrap();
    let headers = reader.headers().unwrap().clone();
    let (energy, overshoot) = (column("free_energy", &headers), column("overshoot_velocity", &headers));
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert!(!rows[2][energy].is_empty() && rows[2][overshoot].is_empty(), "{:?}", rows[2]);
    assert!(!rows[8][overshoot].is_empty() && rows.len() > 9);
}

#[test]
fn the_last_state_is_written_with_every_field() {
    let root = tempfile::tempdir().unwrap();
    let out = folder(&root, "out");
    let more = format!("{SCENE}\n[[output]]\nfields = [\"pressure\"]\n");
    let sets = [("output.0.fields", "[\"velocity\"]"), ("time.end", "0.5")];
    let summary = run_in(&out, &scene_of(&more, &sets), false).unwrap();
    let last =
        String::from_utf8_lossy(&bytes(out.join(format!("fields/step-{:06}.vtu", summary.counts.steps)))).into_owned();
    assert!(last.contains("\"velocity\"") && last.contains("\"pressure\""));
}

#[test]
fn damaged_and_foreign_files_are_named() {
    let root = tempfile::tempdir().unwrap();
    let msh = bytes(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/square-with-disc-order1.msh"));
    let mesh = |name: &str, content: &[u8]| -> String {
        let path = root.path().join(name);
        std::fs::write(&path, content).unwrap();
        let text = SCENE.replace(
            "shape = \"strip-with-disc\"\nlength = [-4.0, 6.0]\nwidth = 6.0\nh = 1.6\nh_disc = 0.5\n",
            &format!("file = {:?}\n", path.to_string_lossy()),
        );
        run_in(&folder(&root, "mesh"), &scene_of(&text, &[]), false).expect_err("a wrong mesh").to_string()
    };
    let cut = mesh("cut.msh", &msh[..msh.len() / 2]);
    assert!(cut.contains("cut.msh") && cut.contains("cut off"), "{cut}");
    let error = mesh("empty.msh", b"");
    assert!(error.contains("empty.msh") && error.contains("hint"), "{error}");
    // a cell whose three vertices lie on one line
    let flat = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 1 1 0\n1 0 0 0 2 0 0 1 1 0\n1 0 0 0 2 0 0 0 0\n\
                $EndEntities\n$Nodes\n1 3 1 3\n2 1 0 3\n1\n2\n3\n0 0 0\n1 0 0\n2 0 0\n$EndNodes\n\
                $Elements\n2 4 1 4\n1 1 1 3\n1 1 2\n2 2 3\n3 3 1\n2 1 2 1\n4 1 2 3\n$EndElements\n";
    let error = mesh("flat.msh", flat.as_bytes());
    assert!(error.contains("flat.msh") && error.contains("cell 0"), "{error}");

    // a folder that cannot be made, because a file is in its place
    let occupied = root.path().join("file");
    std::fs::write(&occupied, "not a folder").unwrap();
    let error = run_in(&occupied.join("out"), &scene_of(SCENE, &[]), false).unwrap_err().to_string();
    assert!(error.contains("file") && error.contains("hint"), "{error}");

    // results of an earlier run, no checkpoint, another problem, a damaged checkpoint
    let out = folder(&root, "out");
    let short = scene_of(SCENE, &[("time.max_steps", "1")]);
    let error = run_in(&out, &short, true).unwrap_err().to_string();
    assert!(error.contains("checkpoint.bin") && error.contains("--out"), "{error}");
    run_in(&out, &short, false).unwrap();
    let error = run_in(&out, &short, false).unwrap_err().to_string();
    assert!(error.contains("--resume"), "{error}");
    let error = run_in(&out, &scene_of(SCENE, &[("model.peclet", "3.0")]), true).unwrap_err().to_string();
    assert!(error.contains("model.peclet") && error.contains("checkpoint.bin"), "{error}");
    let whole = bytes(out.join("checkpoint.bin"));
    std::fs::write(out.join("checkpoint.bin"), &whole[..whole.len() / 2]).unwrap();
    let error = run_in(&out, &short, true).unwrap_err().to_string();
    assert!(error.contains("checkpoint.bin") && error.contains("hint"), "{error}");
}

#[test]
fn a_step_that_cannot_be_solved_ends_the_run_and_keeps_the_last_good_state() {
    let root = tempfile::tempdir().unwrap();
    let out = folder(&root, "out");
    // the plain iteration may take two iterations only, and no step may be smaller than the first
    let sets = [
        ("coupling.kind", "fixed-point"),
        ("coupling.max_iterations", "2"),
        ("coupling.accept", "2e-8"),
        ("time.step_min", "0.05"),
    ];
    fails(SCENE, &[("output.2.cuts", "[{ name = \"far\", from = [90, 0], to = [91, 0] }]")], &["far", "hint"]);
    let twice = "[{ name = \"a\", from = [2, 2], to = [3, 2] }, { name = \"a\", from = [2, 2], to = [2, 3] }]";
    let source =
        SceneSource::parse(SCENE, Path::new("test.toml")).map(|mut s| s.set("output.2.cuts", twice).map(|()| s));
    let error = Scene::check(source.unwrap().unwrap()).unwrap_err().to_string();
    assert!(error.contains("\"a\"") && error.contains("same file"), "{error}");
    let summary = run_in(&out, &scene_of(SCENE, &sets), false).unwrap();
    let Ending::Failed { reason } = &summary.ending else { panic!("{:?}", summary.ending) };
    for part in ["time.step_min", "fixed-point", "t = 0", "hint"] {
        assert!(reason.contains(part), "{reason}");
    }
    let saved: serde_json::Value = serde_json::from_slice(&bytes(out.join("summary.json"))).unwrap();
    assert_eq!(saved["status"], "failed");
    assert!(out.join("checkpoint.bin").exists() && out.join("fields/step-000000.vtu").exists());
}

#[test]
fn sources_that_turn_infinite_end_the_run_with_a_message() {
    let root = tempfile::tempdir().unwrap();
    let out = folder(&root, "out");
    let source = "\n[source]\nforce = [\"1/(0.55-t)^2*0 + if(t > 0.55, sqrt(0.55-t), 0)\", \"0\"]\n";
    let summary = run_in(&out, &scene_of(&format!("{SCENE}{source}"), &[]), false).unwrap();
    let Ending::Failed { reason } = &summary.ending else { panic!("{:?}", summary.ending) };
    assert!(reason.contains("is NaN at x") && reason.contains("sqrt"), "{reason}");
    assert!(summary.time > 0.4 && summary.time <= 0.55, "{}", summary.time);
}

#[test]
fn a_run_can_start_from_another_runs_checkpoint_on_another_mesh() {
    let root = tempfile::tempdir().unwrap();
    let (coarse, fine) = (folder(&root, "coarse"), folder(&root, "fine"));
    run_in(&coarse, &scene_of(SCENE, &[]), false).unwrap();
    let start = format!("{{ file = {:?} }}", coarse.join("checkpoint.bin").to_string_lossy());
    let sets =
        [("initial.polarity", start.as_str()), ("mesh.h_disc", "0.35"), ("time.max_steps", "1"), ("space.k", "2")];
    let scene = scene_of(SCENE, &sets);
    let summary = run_in(&fine, &scene, false).unwrap();
    // close to where the coarse run ended: its free energy, not that of the aligned start
    let end: serde_json::Value = serde_json::from_slice(&bytes(coarse.join("summary.json"))).unwrap();
    let (a, b) = (end["measures"]["free_energy"].as_f64().unwrap(), summary.measures["free_energy"]);
    assert!((a - b).abs() < 0.1 * a.abs(), "{a} {b}");
}

/// A closed sheet on a square of 2n² cells.
const SHEET: &str = r#"
[model]
kind = "compressible"
friction = 1.0
traction = 1.0
peclet = 1.0
coherence = 0.5
elasticity = 0.2
density = { penalty = 1.0, exponent = 1.0, critical = 0.2 }
[mesh]
shape = "square"
n = 4
[boundary]
left = { velocity = "slip", polarity = "neumann" }
right = { velocity = "slip", polarity = "neumann" }
bottom = { velocity = "slip", polarity = "neumann" }
top = { velocity = "slip", polarity = "neumann" }
[initial]
polarity = ["0.5", "0.1*y"]
density = "if(x>0.5,1,0.1)"
[time]
scheme = "bdf2"
step = 0.05
end = 0.1
[coupling]
kind = "newton"
tolerance = 1e-9
[[output]]
measures = ["mass"]
every = { steps = 1 }
"#;

#[test]
fn the_mass_of_a_density_that_jumps_is_right_and_goes_on_to_other_meshes() {
    let root = tempfile::tempdir().unwrap();
    let first = folder(&root, "first");
    let summary = run_in(&first, &scene_of(SHEET, &[]), false).unwrap();
    assert!((summary.measures["mass"] - 0.55).abs() < 1e-13, "{:?}", summary.measures);
    let start = format!("{{ file = {:?} }}", first.join("checkpoint.bin").to_string_lossy());
    let sets = [("initial.polarity", start.as_str()), ("initial.density", start.as_str())];
    for (name, n) in [("same", "4"), ("finer", "7"), ("coarser", "3")] {
        let sets: Vec<_> =
            sets.into_iter().chain([("mesh.n", n), ("mesh.distortion", "0.1"), ("mesh.seed", "3")]).collect();
        let summary = run_in(&folder(&root, name), &scene_of(SHEET, &sets), false).unwrap();
        assert!((summary.measures["mass"] - 0.55).abs() < 1e-12, "{name}: {:?}", summary.measures);
        assert!(!summary.said.iter().any(|said| said.contains("has the mass")), "{:?}", summary.said);
    }
    fails(
        SHEET,
        &[("initial.density", "1-1.5*sin(4*pi*x)^2*sin(4*pi*y)^2")],
        &["initial.density", "must not be negative"],
    );
}

#[test]
fn a_source_that_turns_nan_is_never_taken_for_converged() {
    // no force depends on the polarity here, so that nothing but the polarity's own equation can notice
    let scene = r#"
[model]
kind = "incompressible"
friction = 1
traction = 0
peclet = 1
coherence = 0.5
[mesh]
shape = "square"
n = 2
[initial]
polarity = ["1 + 0.1*sin(x)", "0.2*y"]
[boundary]
left = { velocity = { dirichlet = ["y*(1-y)", 0] }, polarity = "neumann" }
right = { velocity = "traction", polarity = "neumann" }
bottom = { velocity = "slip", polarity = "neumann" }
top = { velocity = "slip", polarity = "neumann" }
[source]
polarity = ["0.1*sqrt(0.25 - t)", 0]
[time]
scheme = "bdf2"
step = 0.1
end = 0.5
"#;
    for kind in ["newton", "anderson", "fixed-point"] {
        let root = tempfile::tempdir().unwrap();
        let summary = run_in(&folder(&root, "out"), &scene_of(scene, &[("coupling.kind", kind)]), false).unwrap();
        let Ending::Failed { reason } = &summary.ending else { panic!("{kind}: {:?}", summary.ending) };
        assert!(reason.contains("sqrt(0.25 - t)") && summary.counts.steps == 2, "{kind}: {reason}");
    }
}

#[test]
fn a_failed_step_has_one_hint() {
    let inaccurate = SolveError::Inaccurate { system: "Newton".into(), residual: 1e-3, hint: "a smaller step".into() };
    let cause = Box::new(StepFailure::from(inaccurate));
    let step_min = monolayer::scheme::ControlSettings::new(1.0).step_min;
    let error =
        MarchError::StepTooSmall { step: 1, t: 0.0, step_min, cause, hint: "a finer mesh".to_owned() }.to_string();
    assert!(error.contains("with relative residual 1.0e-3 only; hint: a finer mesh"), "{error}");
    assert_eq!(error.matches("hint: ").count(), 1, "{error}");
}

#[test]
fn check_refuses_what_a_run_refuses_before_its_first_step() {
    use monolayer::run::report::report_within;
    let cases: [(&[(&str, &str)], &str); 6] = [
        (&[("mesh.centre", "[0.0, 0.7]"), ("output.1.measures", "[\"asymmetry\"]")], "mirror image"),
        (&[("initial.polarity", "[\"sqrt(x)\", \"0\"]")], "is NaN"),
        (&[("initial.polarity", "{ random = { seed = 1, h_coarse = 1e-6 } }")], "h_coarse"),
        (&[("boundary.outlet.velocity", "{ dirichlet = [\"0\", \"0\"] }")], "net flux"),
        (&[("output.2.cuts", "[{ name = \"far\", from = [20, 0], to = [30, 0] }]")], "far"),
        (&[("output.2.cuts", ""), ("output.2.maps", "[{ of = \"speed\", window = [[20, 20], [30, 30]] }]")], "window"),
    ];
    for (sets, part) in cases {
        let scene = scene_of(SCENE, sets);
        let checked = report_within(&scene, None).expect_err(part).to_string();
        let root = tempfile::tempdir().unwrap();
        let run = run_in(&folder(&root, "out"), &scene, false).expect_err(part).to_string();
        assert_eq!(checked, run);
        assert!(checked.contains(part), "`{part}` is not in: {checked}");
    }
    // on a mesh that takes long, a coarser one of the same domain tells
    let fine = [("mesh.h", "0.1"), ("mesh.h_disc", "0.02")];
    let error = report_within(&scene_of(SCENE, &[cases[0].0, &fine[..]].concat()), None).expect_err("off the axis");
    assert!(error.to_string().contains("mirror image"), "{error}");
    let report = report_within(&scene_of(SCENE, &fine), None).unwrap();
    assert!(report.mesh.cells() > 14_000 && report.memory_mib > 1000.0, "{} MiB", report.memory_mib);
}
