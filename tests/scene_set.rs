//! Overrides by path, and the scene written back.

use std::path::Path;

use monolayer::mesh::Point;
use monolayer::model::{PolarityCondition, VelocityCondition};
use monolayer::scene::{Axis, AxisLine, Cut, Field, Initial, Scene, SceneSource, Schedule, SlipTreatment, What};
use monolayer::time::CouplingKind;

const STRIP: &str = include_str!("data/strip.toml");
const DISC: &str = include_str!("data/disc.toml");

fn scene(text: &str) -> Scene {
    Scene::parse(text, Path::new("scene.toml")).unwrap()
}

fn with(changes: &[(&str, &str)]) -> Scene {
    let mut source = SceneSource::parse(STRIP, Path::new("strip.toml")).unwrap();
    for (path, value) in changes {
        source.set(path, value).unwrap();
    }
    Scene::check(source).unwrap()
}

fn tags(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

#[test]
fn the_reference_scene_is_the_reference_case() {
    let strip = scene(STRIP);
    let p = strip.parameters;
    assert_eq!((p.friction, p.traction, p.active_stress, p.peclet), (3.0, 3.0, 0.0, 2.0));
    assert_eq!((p.coherence, p.elasticity, p.slip, p.beta()), (0.1, 0.4, 1.0, 0.75));
    assert_eq!((strip.space.velocity, strip.space.pressure, strip.space.polarity), (2, 1, 3));
    assert_eq!(strip.space.slip, SlipTreatment::Rotated);
    assert_eq!((strip.time.order, strip.time.control.step, strip.time.end), (2, 0.1, 400.0));
    assert_eq!(strip.time.stop_residual, Some(1e-8));
    assert_eq!(strip.coupling.kind, CouplingKind::Newton);
    assert_eq!(strip.coupling.accept, 1e-4);
    assert_eq!(strip.initial, Initial::AlignedAroundDisc);
    assert_eq!(strip.outputs.len(), 4);
    assert_eq!(strip.outputs[0].schedule, Schedule::Time(10.0));
    assert_eq!(strip.outputs[0].what, What::Fields(vec![Field::Velocity, Field::Pressure, Field::Polarity]));
    assert_eq!(strip.outputs[1].schedule, Schedule::Steps(10));
    assert_eq!(strip.outputs[2].schedule, Schedule::End);
    assert_eq!(strip.outputs[3].what, What::Checkpoint);
    assert_eq!(Axis::Axis2b.line(), AxisLine::Horizontal(-1.66));
    assert!(!strip.pressure_is_free());
    strip.check_tags(&tags(&["inlet", "outlet", "walls", "disc"])).unwrap();
    let VelocityCondition::Dirichlet([v, _]) = &strip.boundary["inlet"].velocity else { panic!("no Dirichlet inlet") };
    assert_eq!(v.eval(Point::zeros(), 0.0), 1.0);
    assert_eq!(strip.boundary["walls"].polarity, PolarityCondition::Neumann);
}

#[test]
fn the_disc_scene_is_the_disc_study() {
    let disc = scene(DISC);
    let p = disc.parameters;
    assert_eq!((p.friction, p.traction, p.peclet, p.coherence), (19.0, 19.0, 0.5, 0.03));
    assert_eq!((p.elasticity, p.slip, p.active_stress), (0.1, 1.0, 1.0));
    assert_eq!(disc.initial, Initial::Random { seed: 1, amplitude: 0.1, h_coarse: 0.25 });
    assert!(disc.pressure_is_free());
    assert_eq!(disc.remarks().len(), 1);
    disc.check_tags(&tags(&["wall"])).unwrap();
}

#[test]
fn terms_that_are_off_are_named_with_their_reason() {
    let off = |scene: &Scene| {
        let terms = scene.terms();
        terms.iter().filter(|term| !term.on).map(|term| format!("{}: {}", term.name, term.reason)).collect::<Vec<_>>()
    };
    let quiet = ["force: not given", "polarity source: not given"];
    assert_eq!(off(&with(&[])), ["active stress: active_stress = 0", quiet[0], quiet[1]]);
    let inelastic = with(&[("model.elasticity", "0"), ("model.slip", "0"), ("source.force", "[\"x\", 0]")]);
    let names = ["elastic rotation", "elastic stretching", "elastic stress", "molecular field", "polarity stretching"];
    let off = off(&inelastic);
    assert!(names.iter().all(|name| off.iter().any(|term| term.starts_with(name))), "{off:?}");
    assert!(!off.iter().any(|term| term.starts_with("force")));
}

#[test]
fn every_kind_of_value_can_be_set() {
    let changed = with(&[
        ("model.peclet", "4"),
        ("model.active_stress", "-1.5"),
        ("boundary.inlet.velocity.dirichlet.0", "1 - (y/5)^2*peclet/4"),
        ("boundary.outlet.velocity", "no-tangential"),
        ("boundary.disc.velocity", "{ traction = [\"x\", 0.5] }"),
        ("boundary.walls.polarity", "{ dirichlet = [1, 0] }"),
        ("output.0.every.time", "2.5"),
        ("output.2.cuts", "[{ name = \"wake\", from = [1, 0], to = [9, 0] }, \"axis-1\"]"),
        ("output.1.measures.0", "asymmetry"),
        ("initial.polarity", "[\"cos(x)\", \"sin(x)\"]"),
        ("space.slip", "penalty"),
        ("space.degree.polarity", "2"),
        ("coupling.kind", "anderson"),
        ("time.stop.residual", "1e-6"),
        ("mesh.length.1", "20.0"),
        ("mesh.symmetric", "true"),
        ("title", "another one"),
    ]);
    assert_eq!((changed.parameters.peclet, changed.parameters.active_stress), (4.0, -1.5));
    let VelocityCondition::Dirichlet([v, _]) = &changed.boundary["inlet"].velocity else {
        panic!("no Dirichlet inlet")
    };
    assert_eq!(v.eval(Point::new(0.0, 5.0), 0.0), 0.0);
    assert_eq!(changed.boundary["outlet"].velocity, VelocityCondition::NoTangential);
    let VelocityCondition::Traction([s, _]) = &changed.boundary["disc"].velocity else { panic!("no traction") };
    assert_eq!(s.eval(Point::new(7.0, 0.0), 0.0), 7.0);
    assert_eq!(changed.outputs[0].schedule, Schedule::Time(2.5));
    let What::Cuts(cuts) = &changed.outputs[2].what else { panic!("no cuts") };
    let line = Cut::Line { name: "wake".into(), from: Point::new(1.0, 0.0), to: Point::new(9.0, 0.0), points: 200 };
    assert_eq!(cuts, &[line, Cut::Axis(Axis::Axis1)]);
    assert_eq!(changed.space.slip, SlipTreatment::Penalty { epsilon: 1e-8 });
    assert_eq!(changed.space.polarity, 2);
    assert_eq!(changed.coupling.kind, CouplingKind::Anderson { depth: 10 });
    assert_eq!(changed.mesh.length, Some([-30.0, 20.0]));
    assert_eq!(changed.title.as_deref(), Some("another one"));
    assert!(matches!(changed.initial, Initial::Expressions(_)));
}

#[test]
fn an_empty_value_removes_a_key() {
    let changed = with(&[("model.beta", ""), ("model.friction", "5"), ("output.0", ""), ("time.stop", "")]);
    assert_eq!((changed.parameters.friction, changed.parameters.traction), (5.0, 5.0));
    assert_eq!((changed.outputs.len(), changed.time.stop_residual), (3, None));
}

#[test]
fn a_failed_override_changes_nothing() {
    let mut strip = scene(STRIP);
    let before = strip.resolved_toml();
    assert!(strip.set("model.peclet", "-1").is_err());
    assert!(strip.set("model.pecle", "1").is_err());
    assert_eq!(strip.resolved_toml(), before);
    strip.set("model.peclet", "3").unwrap();
    assert_eq!(strip.parameters.peclet, 3.0);
}

/// Equal in everything that the solver reads.
fn same(a: &Scene, b: &Scene) {
    assert_eq!(a.resolved_toml(), b.resolved_toml());
    assert_eq!((&a.title, a.parameters, &a.mesh, a.space), (&b.title, b.parameters, &b.mesh, b.space));
    assert_eq!((&a.boundary, &a.initial, &a.sources), (&b.boundary, &b.initial, &b.sources));
    assert_eq!((a.time, a.coupling, &a.outputs), (b.time, b.coupling, &b.outputs));
}

#[test]
fn the_resolved_scene_parses_back_to_itself() {
    let forms = with(&[
        ("boundary.outlet.velocity", "{ traction = [\"t*x\", 0.25] }"),
        ("initial.polarity", "[1, \"0.5*sin(pi*y)\"]"),
        ("source.polarity", "[\"exp(-t)\", 1e-9]"),
        ("output.2.cuts.6", "{ name = \"wake\", from = [1, 0], to = [9, 1e-7], points = 31 }"),
        ("time.max_steps", "77"),
        ("space.k", "2"),
    ]);
    for original in [scene(STRIP), scene(DISC), forms] {
        let text = original.resolved_toml();
        same(&original, &scene(&text));
    }
}

#[test]
fn the_resolved_scene_shows_every_default() {
    let text = scene(STRIP).resolved_toml();
    for part in [
        "[model]",
        "traction = 3.0",
        "[space]",
        "degree = { velocity = 2, pressure = 1, polarity = 3 }",
        "slip = \"rotated\"",
        "penalty = 1e-8",
        "[boundary.outlet]",
        "velocity = { traction = [0, 0] }",
        "step_min = 1e-7",
        "growth = 1.25",
        "[coupling]",
        "kind = \"newton\"",
        "accept = 1e-4",
        "max_iterations = 100",
        "[[output]]",
    ] {
        assert!(text.contains(part), "`{part}` is not in\n{text}");
    }
}

#[test]
fn relative_files_become_absolute() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("start.vtu"), "").unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, STRIP.replace("\"aligned-around-disc\"", "{ file = \"start.vtu\" }")).unwrap();
    let read = Scene::read(&path).unwrap();
    assert_eq!(read.initial, Initial::File(folder.path().join("start.vtu")));
    same(&read, &scene(&read.resolved_toml()));
}
