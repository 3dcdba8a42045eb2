//! Every measure of the list: its names and words, the scenes that have it, and its numbers there.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use monolayer::measure::Measure;
use monolayer::measure::list::{ALL, Column, MEAN_SPEED, column};
use monolayer::model::ModelKind;
use monolayer::model::terms::factor;
use monolayer::output::progress::Verbosity;
use monolayer::run::AnyScene;
use monolayer::run::kinds;
use monolayer::run::{Ending, Options};
use monolayer::scene::{SceneSource, StokesScene, measured};

static NEVER: AtomicBool = AtomicBool::new(false);

/// Of tissue of either density.
const STRIP: &str = r#"
[model]
kind = "incompressible"
beta = 0.75
peclet = 2.0
coherence = 0.5
elasticity = 0.4
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
polarity = { dirichlet = ["1", "0"] }
[boundary.walls]
velocity = "slip"
polarity = "neumann"
[boundary.disc]
velocity = "slip"
polarity = "neumann"
[initial]
polarity = ["1", "0"]
[strain]
weissenberg = 0.1
[time]
scheme = "bdf2"
step = 0.05
end = 0.1
[coupling]
kind = "anderson"
"#;

const DISC: &str = r#"
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
polarity = "circulating"
[time]
scheme = "bdf2"
step = 0.05
end = 0.1
[coupling]
kind = "anderson"
"#;

/// In a tissue; `motion` follows.
const BODY_IN_TISSUE: &str = r#"
[model]
kind = "incompressible"
beta = 0.75
peclet = 2.0
coherence = 0.5
elasticity = 0.4
[mesh]
shape = "strip"
length = [-4.0, 6.0]
width = 6.0
h = 0.8
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
[time]
scheme = "bdf2"
step = 0.05
end = 0.1
[coupling]
kind = "anderson"
[[body]]
name = "disc"
shape = { disc = { radius = 1.0 } }
position = [0.0, 0.0]
"#;

const STOKES: &str = r#"
[model]
kind = "stokes"
[mesh]
shape = "square"
n = 8
[boundary.left]
velocity = { dirichlet = ["0", "0"] }
[boundary.right]
velocity = { dirichlet = ["0", "0"] }
[boundary.bottom]
velocity = { dirichlet = ["0", "0"] }
[boundary.top]
velocity = { dirichlet = ["0", "0"] }
[[wall]]
segment = [[0.0, 0.0], [1.0, 0.0]]
[[body]]
name = "disc"
shape = { disc = { radius = 0.15 } }
position = [0.4, 0.155]
force = ["0", "-500*area"]
[time]
step = 0.02
end = 0.04
"#;

const PARTICLES: &str = r#"
[model]
kind = "particles"
gravity = ["0", "-1"]
[[wall]]
segment = [[0.0, 0.0], [1.0, 0.0]]
[[body]]
name = "disc"
shape = { disc = { radius = 0.1 } }
position = [0.5, 0.1005]
[time]
step = 0.02
end = 0.1
"#;

/// A scene of each kind that has measures of its own, and the measures that it must have at least.
fn scenes() -> Vec<(&'static str, String, &'static [&'static str])> {
    let sheet = include_str!("data/compressible.toml");
    let sheet = sheet.split("[[output]]").next().unwrap().replace("end = 2.0", "end = 0.2");
    let fixed = format!("{BODY_IN_TISSUE}motion = \"fixed\"\n");
    // with every factor, for the columns that only scenes with them have
    let factors: String = factor::of_kind(ModelKind::Incompressible).map(|f| format!("{} = 0.1\n", f.key)).collect();
    let strip = STRIP.replacen("[mesh]", &format!("{factors}[mesh]"), 1);
    vec![
        (
            "strip",
            strip,
            &["free_energy", "overshoot", "asymmetry", "elastic_strain", "energy_budget", "force_on", "torque_on"],
        ),
        ("disc", DISC.to_owned(), &["mean_speed", "free_energy", "circulation", "defects"]),
        (
            "sheet",
            sheet,
            &["mean_speed", "free_energy", "energy_budget", "mass", "density_min", "limited_cells", "force_on"],
        ),
        (
            "fixed body",
            fixed,
            &["mean_speed", "free_energy", "overshoot", "energy_budget", "body", "holding", "wrench", "power_to"],
        ),
        (
            "moving body",
            BODY_IN_TISSUE.to_owned(),
            &["mean_speed", "kinetic_energy", "overlap", "body", "wrench", "power_to"],
        ),
        (
            "stokes",
            STOKES.to_owned(),
            &["mean_speed", "force_on", "kinetic_energy", "gap", "contacts", "wall_force", "body", "holding", "wrench"],
        ),
        ("particles", PARTICLES.to_owned(), &["kinetic_energy", "gap", "contacts", "wall_force", "body"]),
    ]
}

/// A measure as a scene asks for it; one on a boundary tag on the scene's first.
fn written(measure: &Measure, scene: &str) -> String {
    let tag = scene.split("[boundary.").nth(1).and_then(|rest| rest.split(']').next()).unwrap_or("none");
    let around = if measure.is_around_a_point() { ", around = [0.0, 1.0]" } else { "" };
    match measure.is_on_a_tag() {
        true => format!("{{ {} = \"{tag}\"{around} }}", measure.name),
        false => format!("\"{}\"", measure.name),
    }
}

/// The scene with these measures after every step; the reason where it has not got one of them.
fn measuring(scene: &str, measures: &[&Measure]) -> Result<AnyScene, String> {
    let written: Vec<String> = measures.iter().map(|measure| written(measure, scene)).collect();
    let text = format!("{scene}\n[[output]]\nmeasures = [{}]\nevery = {{ steps = 1 }}\n", written.join(", "));
    let source = SceneSource::parse(&text, Path::new("test.toml")).map_err(|error| error.to_string())?;
    let scene = AnyScene::check(source).map_err(|error| error.to_string())?;
    kinds::check(&scene).map_err(|error| error.to_string())?;
    Ok(scene)
}

/// Runs a scene to its end: the columns of its history, and its measures there.
fn taken(scene: &AnyScene) -> (Vec<String>, BTreeMap<&'static str, f64>) {
    let out = tempfile::tempdir().unwrap();
    let options = Options { out: out.path().to_owned(), resume: false, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    let summary = kinds::run(scene, &options).unwrap();
    assert_eq!(summary.ending, Ending::EndTime);
    let history = std::fs::read_to_string(out.path().join("history.csv")).unwrap();
    let header = history.lines().next().unwrap().split(',').map(str::to_owned).collect();
    (header, summary.measures)
}

#[test]
fn names_and_columns_are_said_once_and_in_words() {
    let (mut names, mut columns) = (BTreeSet::new(), BTreeSet::new());
    for measure in ALL {
        assert!(names.insert(measure.name), "{measure:?} is there twice");
        assert!(!measure.help.is_empty() && !measure.columns.is_empty(), "{measure:?}");
        for one in measure.columns {
            assert!(columns.insert(one.name), "{} is there twice", one.name);
            assert!(!one.words.is_empty() && !one.short.is_empty(), "{}", one.name);
            assert_eq!(column(one.name), Some(one));
        }
    }
}

#[test]
fn every_measure_that_a_scene_has_is_taken_and_finite() {
    let mut found = BTreeSet::new();
    for (kind, text, least) in scenes() {
        let tried = ALL.iter().map(|measure| (*measure, measuring(&text, &[measure])));
        let (has, refused): (Vec<_>, Vec<_>) = tried.partition(|(_, tried)| tried.is_ok());
        for (measure, refusal) in &refused {
            let why = refusal.as_ref().unwrap_err();
            assert!(!least.contains(&measure.name), "{kind}, {measure:?}: {why}");
            assert!(why.contains(measure.name) && why.contains("hint: "), "{kind}, {measure:?}: {why}");
        }
        let names: Vec<&Measure> = has.iter().map(|(measure, _)| *measure).collect();
        let (header, values) = taken(&measuring(&text, &names).unwrap());
        // less the tag
        let bare = |name: &'static str| name.split(':').next().unwrap();
        let header: Vec<&str> = header.iter().map(|name| name.split(':').next().unwrap()).collect();
        let values: BTreeMap<&str, f64> = values.into_iter().map(|(name, value)| (bare(name), value)).collect();
        let given = |column: &&Column| {
            (!column.of_bodies || text.contains("[[body]]"))
                && column.key.is_none_or(|key| text.contains(&format!("\n{key} = ")))
        };
        let all = has.iter().flat_map(|(measure, _)| measure.columns);
        let columns: Vec<&str> = all.filter(given).map(|column| column.name).collect();
        let last: Vec<&str> = header.iter().rev().take(columns.len()).rev().copied().collect();
        assert!(last == columns, "{kind}: {header:?} ends not with {columns:?}");
        for (name, value) in &values {
            assert!(columns.contains(name) && value.is_finite(), "{kind}: {name} = {value}");
            found.insert(*name);
        }
        for (measure, _) in &has {
            let taken = measure.column_names().any(|name| values.contains_key(name));
            assert!(taken || !least.contains(&measure.name), "{kind}: nothing is measured by {measure:?}");
        }
    }
    let all: BTreeSet<&str> = ALL.iter().flat_map(|measure| measure.column_names()).collect();
    assert_eq!(found, all, "the scenes of this test have every measure");
}

/// In a channel the flow is that on its ends, `1 − x₂²` over −1 < x₂ < 1, whose mean is 2/3.
#[test]
fn the_mean_speed_of_a_channel() {
    let flow = r#"
[model]
kind = "stokes"
[mesh]
shape = "strip"
length = [0.0, 2.0]
width = 2.0
h = 0.5
[boundary.inlet]
velocity = { dirichlet = ["1 - y^2", "0"] }
[boundary.outlet]
velocity = { dirichlet = ["1 - y^2", "0"] }
[boundary.walls]
velocity = { dirichlet = ["0", "0"] }
[time]
step = 0.1
end = 0.1
"#;
    let (_, values) = taken(&measuring(flow, &[&MEAN_SPEED]).unwrap());
    assert!((values["mean_speed"] - 2.0 / 3.0).abs() < 1e-9, "{values:?}");
}

/// Every body has the measures of one, under its name.
#[test]
fn measures_of_a_body_that_is_named() {
    let post = "name = \"post\"\nshape = { disc = { radius = 0.1 } }\nposition = [0.2, 0.8]\nmotion = \"fixed\"\n";
    // the disc still falls
    let falling = STOKES.replacen("position = [0.4, 0.155]", "position = [0.4, 0.4]", 1);
    let two = falling.replacen("[time]", &format!("[[body]]\n{post}[time]"), 1);
    let scene = |measures: &str| {
        let text = format!("{two}\n[[output]]\nmeasures = [{measures}]\nevery = {{ steps = 1 }}\n");
        AnyScene::parse(&text, Path::new("test.toml")).map_err(|error| error.to_string())
    };
    let asked = r#""body", "wrench", "holding", { body = "post" }, { wrench = "post" }, { holding = "post" }"#;
    let (header, values) = taken(&scene(asked).unwrap());
    let of_post = |name: &str| values[format!("{name}:post").as_str()];
    assert_eq!((of_post("body_x1"), of_post("body_x2"), of_post("body_velocity_1")), (0.2, 0.8, 0.0));
    assert!(values["body_x1"] != 0.2 && values["holding_x1"] == 0.0, "{values:?}");
    // nothing else pulls the post
    let off = of_post("holding_x1") + of_post("wrench_x1");
    assert!(of_post("wrench_x1").abs() > 1e-3 && off.abs() < 1e-12, "{values:?}");
    assert!(header.iter().any(|name| name == "wrench_torque:post"), "{header:?}");
    assert_eq!(column("body_x2:post").map(|column| column.name), Some("body_x2"));
    assert_eq!(monolayer::results::names::words("body_x1:post"), "x₁ of the body post");
    for (measures, parts) in [
        (r#"{ wrench = "pots" }"#, ["no body `pots`", "did you mean `post`?"]),
        (r#"{ wrench = "post", around = [0, 0] }"#, ["about no point", "{ wrench = \"BODY\" }"]),
        (r#"{ gap = "post" }"#, ["gap", "force_on"]),
    ] {
        let error = scene(measures).map(|_| ()).unwrap_err();
        assert!(parts.iter().all(|part| error.contains(part)), "{measures}: {error}");
    }
}

/// A measure on a boundary tag says what it needs, and the resolved scene has it as it was written.
#[test]
fn measures_on_boundary_tags() {
    let scene = |measures: &str| -> Result<StokesScene, String> {
        let text = format!("{STOKES}\n[[output]]\nmeasures = [{measures}]\n");
        StokesScene::parse(&text, Path::new("test.toml")).map_err(|error| error.to_string())
    };
    for (measures, count) in [
        (r#""mean_speed", { force_on = "top" }, { torque_on = "top", around = [0.5, 1] }"#, 3),
        (r#"{ force_on = "top" }, { force_on = "left" }"#, 2),
    ] {
        let one = scene(measures).unwrap();
        let again = StokesScene::parse(&one.resolved_toml(), Path::new("test.toml")).unwrap();
        assert_eq!(one.outputs, again.outputs);
        assert_eq!(measured(&one.outputs).len(), count);
    }
    let wrong = |measures: &str, words: &[&str]| {
        let error = scene(measures).unwrap_err();
        for word in ["test.toml", "output.0.measures"].iter().chain(words) {
            assert!(error.contains(word), "{measures}: {error} has no {word}");
        }
    };
    wrong(r#""force_on""#, &["needs the tag of a boundary", "{ force_on = \"TAG\" }"]);
    wrong(r#"{ force_on = "topp" }"#, &["no boundary tag `topp`", "did you mean `top`?", "hint: "]);
    wrong(r#"{ torque_on = "top" }"#, &["needs the point", "around = [x, y]"]);
    wrong(r#"{ force_on = "top", around = [0, 0] }"#, &["about no point"]);
    wrong(r#"{ force_at = "top" }"#, &["force_at", "force_on"]);
    wrong(r#"{ around = [0, 0] }"#, &["names no measure"]);
    wrong(r#"{ torque_on = "top", around = [0, inf] }"#, &["must be finite"]);
    let twice = r#"{ torque_on = "top", around = [0, 0] }, { torque_on = "top", around = [1, 0] }"#;
    wrong(twice, &["torque:top", "hint: "]);
    // the same twice is one
    let same = scene(r#"{ force_on = "top" }, { force_on = "top" }"#).unwrap();
    assert_eq!(measured(&same.outputs).len(), 1);
}
