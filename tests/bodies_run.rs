//! Particles and bodies in a Stokes flow through the program: folders, restarts, sweeps, wrong inputs.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn studies() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("studies/bodies")
}

fn program(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().unwrap()
}

fn good(arguments: &[&str], folder: &Path) {
    let output = program(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn path(name: &str) -> String {
    studies().join(name).to_string_lossy().into_owned()
}

fn same(a: &Path, b: &Path, files: &[&str]) {
    for file in files {
        let [one, other] = [a, b].map(|folder| std::fs::read(folder.join(file)).unwrap());
        assert!(one == other, "{file} differs in {} and {}", a.display(), b.display());
    }
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// Few glued discs in a small drum: every kind of body, wall and hold of particles.
const DRUM: [&str; 8] = [
    "--set",
    "bodies.disc.count=30",
    "--set",
    "contact.gamma_min=-1",
    "--set",
    "time.step=0.01",
    "--set",
    "output.2.every.time=0.5",
];

#[test]
fn a_resumed_run_of_particles_has_the_same_bits() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let drum = path("drum.toml");
    let run = |out: &str, more: &[&str]| {
        good(&[&["run", &drum, "-q", "--out", out, "--set", "time.end=1.5"], &DRUM[..], more].concat(), folder);
    };
    run("whole", &[]);
    // the end of a part is written like any other: it falls on an output
    run("parts", &["--set", "time.max_steps=100"]);
    run("parts", &["--resume"]);
    let files = ["history.csv", "bodies.csv", "scene.toml", "bodies.pvd", "bodies/step-000150.vtp", "frames.csv"];
    same(&folder.join("whole"), &folder.join("parts"), &files);
    let [whole, parts] = ["whole", "parts"].map(|name| json(&folder.join(name).join("summary.json")));
    assert_eq!(whole["measures"], parts["measures"]);
    assert_eq!((whole["steps"].as_u64(), whole["status"].as_str()), (Some(150), Some("finished")));
    assert!(whole["measures"]["contacts"].as_f64().unwrap() > 0.0, "they lie in the drum: {whole}");
    assert!(whole["measures"]["overlap"].as_f64().unwrap() < 1e-9, "{whole}");
    // nothing is left to do, and nothing changes
    run("parts", &["--resume"]);
    same(&folder.join("whole"), &folder.join("parts"), &files);
}

#[test]
fn push_and_pull() {
    let temporary = tempfile::tempdir().unwrap();
    good(&["run", &path("push-pull.toml"), "-q", "--out", "out"], temporary.path());
    let mut table = csv::Reader::from_path(temporary.path().join("out/history.csv")).unwrap();
    let header = table.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|c| c == name).unwrap();
    let (time, height) = (column("time"), column("body_x2"));
    let mut worst: f64 = 0.0;
    for row in table.records().map(Result::unwrap) {
        let [t, y]: [f64; 2] = [time, height].map(|k| row[k].parse().unwrap());
        let exact = match t {
            t if t < 1.0 => 0.5 - 0.5 * t * t,
            t if t < 4.0 => 0.0,
            t => 0.5 * (t - 4.0).powi(2),
        };
        worst = worst.max((y - 1.0 - exact).abs());
    }
    assert!(worst > 1e-4 && worst <= 1.5 * 0.01, "first order in Δt = 0.01: {worst}");
}

#[test]
fn a_sweep_over_particles() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let sweep = format!(
        "scene = {}\nset = {{ \"time.end\" = 3.0 }}\n\
         vary = {{ \"body.particle.density\" = [0.2, 0.4], \"contact.gamma_min\" = [0.0, -inf] }}\n\
         measures = [\"body_velocity_2\", \"contacts\"]\n",
        toml::Value::from(path("push-pull.toml"))
    );
    std::fs::write(folder.join("sweep.toml"), sweep).unwrap();
    good(&["study", "sweep.toml", "-q", "--out", "out", "--jobs", "2"], folder);
    let mut table = csv::Reader::from_path(folder.join("out/results.csv")).unwrap();
    let header = table.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let value = |row: usize, name: &str| rows[row][header.iter().position(|c| c == name).unwrap()].to_owned();
    assert_eq!(rows.len(), 4);
    assert!((0..4).all(|row| value(row, "status") == "finished"), "{rows:?}");
    assert_eq!((value(0, "contact.gamma_min"), value(1, "contact.gamma_min")), ("0".into(), "-inf".into()));
    // without glue the particle leaves the plane when it is pulled, with glue it is held still
    let speed = |row: usize| value(row, "body_velocity_2").parse::<f64>().unwrap();
    assert!(speed(0) > 0.5 && speed(1).abs() < 1e-9, "{rows:?}");
    // a run that is there already is not done again
    good(&["study", "sweep.toml", "-q", "--out", "out", "--jobs", "2"], folder);
}

#[test]
fn a_resumed_run_of_a_flow_has_the_same_bits() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let settling = path("settling.toml");
    let run = |out: &str, more: &[&str]| {
        let sets = ["--set", "mesh.n=8", "--set", "time.end=0.6", "--set", "contact.margin=0.05"];
        good(&[&["run", &settling, "-q", "--out", out], &sets[..], more].concat(), folder);
    };
    run("whole", &[]);
    run("parts", &["--set", "time.max_steps=10"]);
    run("parts", &["--resume"]);
    let files = ["fields.pvd", "scene.toml", "history.csv", "bodies.csv", "checkpoint.bin"];
    same(&folder.join("whole"), &folder.join("parts"), &files);
    let measures = &json(&folder.join("whole/summary.json"))["measures"];
    let [x, y] = ["body_x1", "body_x2"].map(|name| measures[name].as_f64().unwrap());
    assert!((0.15..0.3).contains(&y), "it has fallen, and keeps its margin: {measures}");
    assert!((x - 0.5).abs() < 0.05, "it falls straight down: {measures}");
}

#[test]
fn wrong_inputs() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let (box_scene, drum, shear) = (path("box.toml"), path("drum.toml"), path("shear.toml"));
    let bare = format!("scene = {}\nvary = {{ \"model.drag\" = [0, 1] }}\n", toml::Value::from(drum.clone()));
    std::fs::write(folder.join("warm.toml"), format!("{bare}warm_start = true\n")).unwrap();
    std::fs::write(folder.join("unknown.toml"), format!("{bare}measures = [\"overshoot\"]\n")).unwrap();
    for (arguments, parts) in [
        (vec!["run", &box_scene, "--set", "bodies.disc.count=9000"], vec!["with `bodies.disc.count` set", "no room"]),
        (vec!["run", &box_scene, "--steady"], vec!["model.kind", "this needs tissue"]),
        (vec!["mesh", &box_scene], vec!["particles have no mesh"]),
        (vec!["check", &shear, "--set", "body.disc.position.0=4"], vec!["wholly outside of the mesh"]),
        (vec!["check", &drum, "--set", "mesh.n=4"], vec!["`mesh`", "the keys that exist there are title, model"]),
        (vec!["check", &shear, "--set", "rigid.epsilon=2"], vec!["`rigid.epsilon` = 2.0", "both excluded"]),
        (vec!["study", "warm.toml"], vec!["`warm_start`", "only scenes of tissue"]),
        (vec!["study", "unknown.toml"], vec!["`measures.0`", "kinetic_energy, overlap, contacts"]),
    ] {
        let output = program(&arguments, folder);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{arguments:?} was taken");
        for part in parts.into_iter().chain(["hint: ", "error: "]) {
            assert!(said.contains(part), "`{part}` is not in: {said}");
        }
    }
    // nothing is left of what was refused
    let left: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left.iter().filter(|name| name.to_string_lossy() == "out").count(), 0, "{left:?}");
    let output = program(&["check", &shear, "--json"], folder);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((report["bodies"].as_u64(), report["mesh"]["cells"].as_u64()), (Some(1), Some(5000)));
    assert!(report["memory_mib"].as_f64().unwrap() > 10.0);
}
