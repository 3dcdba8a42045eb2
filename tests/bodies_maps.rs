//! Pictures of flows with bodies in them, and what a run tells of bodies that are all fixed.

use std::path::Path;
use std::process::{Command, Output};

const SETTLING: &str = r#"
[model]
kind = "stokes"
[mesh]
shape = "square"
n = 6
[boundary.left]
velocity = { dirichlet = ["0", "0"] }
[boundary.right]
velocity = { dirichlet = ["0", "0"] }
[boundary.bottom]
velocity = { dirichlet = ["0", "0"] }
[boundary.top]
velocity = { dirichlet = ["0", "0"] }
[[body]]
name = "disc"
shape = { disc = { radius = 0.15 } }
position = [0.4, 0.6]
force = ["0", "-500*area"]
[time]
step = 0.02
end = 0.06
[[output]]
maps = ["speed", "pressure", "bodies",
    { of = "velocity_2", name = "lines", arrows = "velocity", streamlines = true, mesh = true }]
every = { steps = 2 }
[[output]]
fields = ["velocity"]
every = { steps = 1 }
[[output]]
measures = ["holding"]
"#;

const STRIP: &str = r#"
[model]
kind = "incompressible"
beta = 0.75
peclet = 2.0
coherence = 0.3
elasticity = 0.4
alignment = 1.0
[mesh]
shape = "strip"
length = [-4.0, 4.0]
width = 6.0
h = 1.4
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
[[body]]
name = "disc"
shape = { disc = { radius = 1.0 } }
position = [0.0, 0.2]
motion = "fixed"
friction = 3.0
[time]
scheme = "bdf1"
step = 0.2
end = 0.4
[[output]]
maps = ["speed", "polarity"]
every = { steps = 1 }
[[output]]
fields = ["velocity"]
[[output]]
bodies = true
every = { steps = 1 }
[[output]]
measures = ["body", "holding"]
every = { steps = 1 }
"#;

fn program(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().unwrap()
}

fn good(arguments: &[&str], folder: &Path) {
    let output = program(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn refused(arguments: &[&str], folder: &Path, parts: &[&str]) {
    let output = program(arguments, folder);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "{arguments:?} was taken");
    for part in parts.iter().chain(&["hint: "]) {
        assert!(said.contains(part), "`{part}` is not in: {said}");
    }
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn measure(run: &Path, name: &str) -> f64 {
    let summary: serde_json::Value = serde_json::from_str(&text(&run.join("summary.json"))).unwrap();
    summary["measures"][name].as_f64().unwrap_or_else(|| panic!("{name}: {}", summary["measures"]))
}

/// What `monolayer map` draws afterwards is what the run has drawn of its last state, to the byte.
fn drawn_again(run: &str, of: &[&str], step: usize, folder: &Path) {
    let named = of.iter().flat_map(|of| ["--of", of]);
    let arguments: Vec<&str> = ["map", run, "-q", "--out", "again"].into_iter().chain(named).collect();
    good(&arguments, folder);
    for of in of {
        let first = std::fs::read(folder.join(format!("{run}/plots/{of}-{step:06}.png"))).unwrap();
        let again = std::fs::read(folder.join(format!("again/{run}-{of}-{step:06}.png"))).unwrap();
        assert!(first == again, "{of} of {run} differs");
    }
}

#[test]
fn a_flow_with_a_body_in_it() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    std::fs::write(folder.join("settling.toml"), SETTLING).unwrap();
    good(&["run", "settling.toml", "-q", "--out", "run"], folder);
    let run = folder.join("run");
    let frames = text(&run.join("frames.csv"));
    for name in ["speed", "pressure", "bodies", "lines"] {
        for step in [0, 2, 3] {
            let file = format!("plots/{name}-{step:06}.png");
            assert!(run.join(&file).is_file() && frames.contains(&file), "{file}: {frames}");
        }
        assert!(text(&run.join(format!("frames-{name}.txt"))).contains(&format!("plots/{name}-000003.png")));
    }
    let index = text(&run.join("fields.pvd"));
    for step in 0..4 {
        assert!(index.contains(&format!("fields/step-{step:06}.vtu")), "{index}");
        assert!(index.contains(&format!("bodies/step-{step:06}.vtp")), "{index}");
    }
    assert_eq!(measure(&run, "holding_x2"), 0.0, "nothing holds a free body");
    drawn_again("run", &["speed", "pressure"], 3, folder);
    // without a name: what a flow has of the usual ones
    good(&["map", "run", "-q", "--out", "usual", "--same-range"], folder);
    let usual: Vec<_> = std::fs::read_dir(folder.join("usual")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(usual.len(), 2, "{usual:?}");
    refused(&["map", "run", "--of", "polarity"], folder, &["`of` = \"polarity\"", "has no map of it"]);
    let set = |set: &'static str| ["check", "settling.toml", "--set", set];
    refused(&set("output.0.maps=[\"density\"]"), folder, &["`output.0.maps.0` = \"density\"", "speed, velocity_1"]);
    let arrows = set("output.0.maps=[{ of = \"speed\", arrows = \"polarity\" }]");
    refused(&arrows, folder, &["`output.0.maps.0.arrows`", "has no such field"]);
    let window = "output.0.maps=[{ of = \"speed\", window = [[5, 5], [6, 6]] }]";
    refused(&["run", "settling.toml", "--set", window], folder, &["no value in the window"]);
}

#[test]
fn what_holds_a_body() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    std::fs::write(folder.join("settling.toml"), SETTLING).unwrap();
    let fixed = ["--set", "body.disc.motion=fixed", "--set", "time.max_steps=1"];
    good(&[&["run", "settling.toml", "-q", "--out", "run"], &fixed[..]].concat(), folder);
    // all of its weight, as nothing moves
    let weight = 500.0 * std::f64::consts::PI * 0.15f64.powi(2);
    let held = measure(&folder.join("run"), "holding_x2");
    assert!((held - weight).abs() < 1e-8 * weight, "{held} for {weight}");
}

#[test]
fn fixed_and_free_bodies_in_a_tissue() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    std::fs::write(folder.join("strip.toml"), STRIP).unwrap();
    good(&["run", "strip.toml", "-q", "--out", "fixed"], folder);
    let fixed = folder.join("fixed");
    let table = text(&fixed.join("bodies.csv"));
    assert_eq!(table.lines().count(), 4, "a row at 0 and after both steps: {table}");
    assert!(text(&fixed.join("fields.pvd")).contains("bodies/step-000002.vtp"));
    assert!(text(&fixed.join("frames.csv")).contains("plots/polarity-000001.png"));
    assert_eq!((measure(&fixed, "body_x1"), measure(&fixed, "body_x2")), (0.0, 0.2));
    assert!(measure(&fixed, "body_velocity_1").abs() < 1e-9);
    // the tissue pushes it downstream
    let held = measure(&fixed, "holding_x1");
    assert!(held < -1.0, "{held}");
    let rows = text(&fixed.join("history.csv"));
    assert!(rows.lines().next().unwrap().ends_with("holding_x1,holding_x2,holding_torque"), "{rows}");
    drawn_again("fixed", &["speed", "polarity"], 2, folder);

    good(&["run", "strip.toml", "-q", "--out", "free", "--set", "body.disc.motion=free"], folder);
    let free = folder.join("free");
    assert!(text(&free.join("frames.csv")).contains("plots/polarity-000002.png"));
    assert!(measure(&free, "body_velocity_1") > 0.5);
    assert_eq!(measure(&free, "holding_x1"), 0.0);
    drawn_again("free", &["speed", "polarity"], 2, folder);

    let idle = "output.3.measures=[\"contacts\"]";
    refused(&["run", "strip.toml", "--set", idle], folder, &["\"contacts\"", "all fixed", "`holding`"]);
    refused(&["run", "strip.toml", "--set", "output.2.contacts=true"], folder, &["output.2.contacts", "no contacts"]);
}
