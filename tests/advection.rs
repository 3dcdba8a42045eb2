//! The kind `advection`: a density that a given velocity carries.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use monolayer::output::progress::Verbosity;
use monolayer::run::kinds::{self, AnyScene};
use monolayer::run::{Ending, Options};

static NEVER: AtomicBool = AtomicBool::new(false);

/// A bump that turns about the middle of a square, and is in its place again at t = 2π.
const TURNING: &str = r#"
[model]
kind = "advection"
velocity = ["-y", "x"]

[mesh]
shape = "square"
length = [-1.0, 1.0]
n = 8

[space]
k = 1

[boundary]
left = { density = 0 }
right = { density = 0 }
bottom = { density = 0 }
top = { density = 0 }

[initial]
density = "exp(-20*((x-0.3)^2 + y^2))"

[time]
step = 0.02
end = 0.5
order = 3

[[output]]
fields = ["density", "velocity", "stream_function"]
[[output]]
measures = ["mean_speed"]
every = { steps = 5 }
[[output]]
cuts = [{ name = "middle", from = [-1.0, 0.0], to = [1.0, 0.0], points = 401 }]
[[output]]
maps = ["density", { of = "speed", arrows = "velocity", streamlines = true }]
"#;

fn scene(sets: &[(&str, &str)]) -> AnyScene {
    let mut source = monolayer::scene::SceneSource::parse(TURNING, Path::new("turning.toml")).unwrap();
    sets.iter().for_each(|(path, value)| source.set(path, value).unwrap());
    AnyScene::check(source).unwrap()
}

fn run_in(out: &Path, scene: &AnyScene, resume: bool) -> monolayer::run::Summary {
    let options = Options { out: out.to_owned(), resume, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    kinds::run(scene, &options).unwrap()
}

/// `(x, ρ)` along the cut `middle`.
fn cut(out: &Path) -> Vec<(f64, f64)> {
    let mut table = csv::Reader::from_path(out.join("cuts/middle.csv")).unwrap();
    let names: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
    assert_eq!(names, ["s", "x1", "x2", "v1", "v2", "density"]);
    table.records().map(|row| row.unwrap()).map(|row| (row[1].parse().unwrap(), row[5].parse().unwrap())).collect()
}

/// The exact density on the line y = 0: the bump has turned by t.
fn exact(x: f64, t: f64) -> f64 {
    let (s, c) = t.sin_cos();
    (-20.0 * ((x - 0.3 * c).powi(2) + (0.3 * s).powi(2))).exp()
}

#[test]
fn a_turning_bump_is_of_the_order_of_its_space_and_leaves_all_files() {
    let root = tempfile::tempdir().unwrap();
    let mut errors = Vec::new();
    for n in ["8", "16", "32"] {
        let (out, step) = (root.path().join(n), format!("{}", 0.16 / n.parse::<f64>().unwrap()));
        let summary = run_in(&out, &scene(&[("mesh.n", n), ("time.step", &step)]), false);
        assert_eq!(summary.ending, Ending::EndTime);
        assert!((summary.measures["mean_speed"] - 0.7652).abs() < 1e-3, "{:?}", summary.measures);
        errors.push(cut(&out).into_iter().map(|(x, rho)| (rho - exact(x, 0.5)).abs()).fold(0.0, f64::max));
        for file in ["checkpoint.bin", "history.csv", "fields.pvd", "plots", "summary.json", "scene.toml"] {
            assert!(out.join(file).exists(), "{file}");
        }
    }
    let order = (errors[1] / errors[2]).log2();
    assert!(order > 1.7 && errors[2] < 1.5e-2, "{order}, {errors:?}");
}

#[test]
fn a_resumed_run_has_the_bits_of_a_whole_one() {
    let root = tempfile::tempdir().unwrap();
    let [whole, parts] = ["whole", "parts"].map(|name| root.path().join(name));
    run_in(&whole, &scene(&[]), false);
    let first = run_in(&parts, &scene(&[("time.max_steps", "7")]), false);
    assert_eq!((first.ending, first.counts.steps), (Ending::MaxSteps, 7));
    let last = run_in(&parts, &scene(&[]), true);
    for file in
        ["history.csv", "cuts/middle.csv", "checkpoint.bin", &format!("fields/step-{:06}.vtu", last.counts.steps)]
    {
        let [a, b] = [&whole, &parts].map(|out| std::fs::read(out.join(file)).unwrap());
        assert!(a == b, "{file} differs");
    }
}

#[test]
fn wrong_scenes_are_told_by_their_keys() {
    let refused = |from: &str, to: &str| {
        let text = TURNING.replacen(from, to, 1);
        assert_ne!(text, TURNING);
        let checked = AnyScene::parse(&text, Path::new("turning.toml"));
        let reported = checked.map_err(|error| error.to_string());
        let message = reported.and_then(|scene| kinds::check(&scene).map(|_| ()).map_err(|error| error.to_string()));
        message.expect_err(to)
    };
    for (from, to, said) in [
        ("velocity = [\"-y\", \"x\"]", "velocity = [\"-y\", \"z\"]", "model.velocity"),
        ("velocity = [\"-y\", \"x\"]", "peclet = 2.0", "peclet"),
        ("k = 1", "k = 9", "space.k"),
        ("left = { density = 0 }", "left = { density = -1 }", "boundary.left.density"),
        ("left = { density = 0 }", "lift = { density = 0 }", "lift"),
        ("step = 0.02", "step = 0.0", "time.step"),
        ("order = 3", "order = 4", "time.order"),
        ("density = \"exp(-20*((x-0.3)^2 + y^2))\"", "density = \"log(x)\"", "initial.density"),
        ("fields = [\"density\"", "fields = [\"polarity\"", "output.0.fields"),
        ("maps = [\"density\"", "maps = [\"pressure\"", "output.3.maps"),
        ("measures = [\"mean_speed\"]", "measures = [\"overshoot\"]", "output.1.measures"),
        ("[time]", "[coupling]\nkind = \"newton\"\n[time]", "coupling"),
    ] {
        let message = refused(from, to);
        assert!(message.contains(said), "{to}: {message}");
        assert!(message.contains("hint: "), "{to}: {message}");
    }
}
