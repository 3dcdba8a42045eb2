//! Overrides by path, and the scene written back.

mod names;

use std::path::Path;

use monolayer::measure::fields::{DENSITY, POLARITY, PRESSURE, VELOCITY};
use monolayer::measure::list::{self, Asked};
use monolayer::mesh::Point;
use monolayer::model::terms::factor;
use monolayer::model::{DensityLaw, ModelKind, PolarityCondition, VelocityCondition};
use monolayer::scene::{
    Axis, AxisLine, Cut, Initial, InitialDensity, Scene, SceneSource, Schedule, SlipTreatment, What,
};
use monolayer::time::CouplingKind;

const STRIP: &str = include_str!("../data/strip.toml");
const DISC: &str = include_str!("../data/disc.toml");
const SHEET: &str = include_str!("../data/compressible.toml");

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
    assert_eq!((p.coherence, p.elasticity, p.alignment, p.beta()), (0.1, 0.4, 1.0, 0.75));
    assert_eq!((strip.space.velocity, strip.space.pressure, strip.space.polarity), (2, 1, 3));
    assert_eq!(strip.space.slip, SlipTreatment::Rotated);
    assert_eq!((strip.time.order, strip.time.control.step, strip.time.end), (2, 0.1, 400.0));
    assert_eq!(strip.time.stop_residual, Some(1e-8));
    assert_eq!(strip.coupling.kind, CouplingKind::Newton);
    assert_eq!(strip.coupling.accept, 1e-4);
    assert_eq!(strip.initial, Initial::AlignedAroundDisc);
    assert_eq!(strip.outputs.len(), 4);
    assert_eq!(strip.outputs[0].schedule, Schedule::Time(10.0));
    assert_eq!(strip.outputs[0].what, What::Fields(vec![&VELOCITY, &PRESSURE, &POLARITY]));
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
    assert_eq!((p.elasticity, p.alignment, p.active_stress), (0.1, 1.0, 1.0));
    assert_eq!(disc.initial, Initial::Random { seed: 1, amplitude: 0.1, h_coarse: 0.25 });
    assert!(disc.pressure_is_free());
    assert_eq!(disc.remarks(), Vec::<String>::new());
    disc.check_tags(&tags(&["wall"])).unwrap();
}

#[test]
fn terms_that_are_off_are_named_with_their_reason() {
    let off = |scene: &Scene| {
        let terms = scene.terms();
        terms.iter().filter(|term| !term.on).map(|term| format!("{}: {}", term.name, term.reason)).collect::<Vec<_>>()
    };
    let quiet = ["force: not given", "polarity source: not given"];
    let factors = factor::of_kind(ModelKind::Incompressible).count();
    let of_factor = |term: &String| factor::all().any(|(factor, _)| term.ends_with(&format!("{} = 0", factor.key)));
    let plain: Vec<String> = off(&with(&[])).into_iter().filter(|term| !of_factor(term)).collect();
    assert_eq!(plain, ["active stress: active_stress = 0", quiet[0], quiet[1]]);
    assert_eq!(off(&with(&[])).len(), 3 + factors);
    let inelastic = with(&[("model.elasticity", "0"), ("model.alignment", "0"), ("source.force", "[\"x\", 0]")]);
    let names = ["elastic rotation", "elastic stretching", "elastic stress", "molecular field", "polarity stretching"];
    let off = off(&inelastic);
    assert!(names.iter().all(|name| off.iter().any(|term| term.starts_with(name))), "{off:?}");
    assert!(!off.iter().any(|term| term.starts_with("force")));
}

fn sheet(changes: &[(&str, &str)]) -> Scene {
    let mut source = SceneSource::parse(SHEET, Path::new("sheet.toml")).unwrap();
    for (path, value) in changes {
        source.set(path, value).unwrap();
    }
    Scene::check(source).unwrap()
}

#[test]
fn the_compressible_scene_has_a_density() {
    let sheet = sheet(&[]);
    let p = sheet.parameters;
    assert_eq!(p.kind(), ModelKind::Compressible);
    let law = DensityLaw { penalty: 2.0, exponent: 1.0, critical: 0.25, active_stress_iso: 0.1 };
    assert_eq!(p.density, Some(law));
    let space = sheet.space;
    assert_eq!((space.velocity, space.pressure, space.density, space.polarity), (2, 0, 1, 2));
    assert!(!sheet.time.density_implicit);
    assert_eq!(sheet.time.density_order(), 2);
    assert!(!sheet.pressure_is_free());
    let (x, inflow) = (Point::new(0.3, 0.7), |tag: &str, t| sheet.boundary[tag].inflow(Point::new(0.3, 0.7), t));
    assert_eq!((inflow("inlet", 5.0), inflow("outlet", 0.0), inflow("walls", 0.0)), (1.0, 1.0, 0.0));
    assert_eq!(inflow("outlet", 10.0), 2.0);
    let moving = |tag: &str| {
        let (key, formulas) = &sheet.boundary[tag].formulas()[2];
        (*key, formulas.iter().any(|formula| formula.depends_on_time()))
    };
    assert_eq!((moving("inlet"), moving("outlet")), (("density", false), ("density", true)));
    let Some(InitialDensity::Formula(start)) = &sheet.initial_density else { panic!("no formula") };
    assert_eq!(start.eval(x, 0.0), 1.0 + 0.1 * x.x.cos());
    assert_eq!(sheet.outputs[0].what, What::Fields(vec![&VELOCITY, &DENSITY, &PRESSURE]));
    assert_eq!(
        sheet.outputs[1].what,
        What::Measures([&list::MASS, &list::DENSITY_MIN, &list::LIMITED_CELLS].map(Asked::from).to_vec())
    );
}

#[test]
fn keys_of_the_compressible_scene_can_be_set() {
    let changed = sheet(&[
        ("model.density.exponent", "0"),
        ("model.density.penalty", "0"),
        ("space.degree", "{ velocity = 1, density = 3, polarity = 4 }"),
        ("time.scheme", "bdf5"),
        ("time.density_scheme", "bdf"),
        ("boundary.outlet.density", "density_exponent"),
        ("source.density", "x*t"),
        ("source.force", "[0, \"density_critical\"]"),
    ]);
    let law = changed.parameters.density.unwrap();
    assert_eq!((law.penalty, law.exponent), (0.0, 0.0));
    let space = changed.space;
    assert_eq!((space.velocity, space.density, space.polarity), (1, 3, 4));
    assert_eq!((changed.time.order, changed.time.density_order(), changed.time.density_implicit), (5, 3, true));
    let (x, parameters) = (Point::new(3.0, 0.0), &changed.parameters);
    assert_eq!((changed.sources.density(parameters, x, 2.0), changed.sources.force(parameters, x, 2.0).y), (6.0, 0.25));
    assert!(changed.sources.has_density() && !sheet(&[]).sources.has_density());
    let iso = sheet(&[("model.active_stress_iso", ""), ("model.elasticity", "0")]).parameters;
    assert_eq!((iso.density.unwrap().active_stress_iso, iso.has_free_energy()), (0.0, true));
}

#[test]
fn terms_of_a_compressible_sheet() {
    let term = |changes: &[(&str, &str)], name: &str| {
        let scene = sheet(changes);
        let terms = scene.terms();
        let term = terms.into_iter().find(|t| t.name == name).unwrap_or_else(|| panic!("no term `{name}`"));
        (term.on, term.reason)
    };
    for name in ["viscosity", "divergence viscosity", "density rate", "density transport", "elastic stress"] {
        assert!(term(&[], name).0, "{name}");
    }
    let free = ("model.density.penalty", "0");
    assert_eq!(term(&[], "pressure"), (true, "density.penalty = 2".to_owned()));
    assert!(term(&[free, ("model.elasticity", "0.5")], "pressure").0);
    assert_eq!(term(&[free, ("model.elasticity", "0")], "pressure"), (false, "density.penalty = 0".to_owned()));
    assert!(!term(&[free, ("model.density.critical", "0")], "pressure").0);
    assert!(term(&[], "isotropic active stress").0);
    assert!(!term(&[("model.active_stress_iso", "0")], "isotropic active stress").0);
    assert!(!term(&[], "density source").0);
    assert!(term(&[("source.density", "x")], "density source").0);
    assert!(scene(STRIP).terms().iter().all(|t| !t.name.contains("density")), "the incompressible sheet has none");
}

/// Boundary and start take the exact density where nothing else is said.
#[test]
fn exact_densities_fill_in_for_those_that_are_not_given() {
    let exact = "{ velocity = [\"x\", 0], density = \"2 + x + t\", polarity = [1, 0] }";
    let filled = [("exact", exact), ("boundary.inlet.density", ""), ("initial.density", "")];
    let sheet = sheet(&filled);
    assert_eq!(sheet.initial_density, Some(InitialDensity::Exact));
    assert_eq!(sheet.boundary["inlet"].inflow(Point::new(3.0, 0.0), 1.0), 6.0);
    assert_eq!(sheet.boundary["outlet"].inflow(Point::new(3.0, 0.0), 0.0), 1.0);
    assert_eq!(sheet.boundary["walls"].density, None);
    assert!(sheet.resolved_toml().contains("density = \"exact\""), "{}", sheet.resolved_toml());
    assert!(sheet.sources.has_density());
    assert_eq!(sheet.sources.density(&sheet.parameters, Point::new(1.0, 0.0), 0.0), 1.0 + 3.0 + 1.0);
    same(&sheet, &scene(&sheet.resolved_toml()));
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
        ("space.walls", "penalty"),
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
    let What::Cuts { cuts, .. } = &changed.outputs[2].what else { panic!("no cuts") };
    let line = Cut::Line { name: "wake".into(), from: Point::new(1.0, 0.0), to: Point::new(9.0, 0.0), points: 200 };
    assert_eq!(cuts, &[line, Cut::Axis(Axis::Axis1)]);
    assert_eq!(changed.space.slip, SlipTreatment::Penalty { epsilon: 1e-8 });
    assert_eq!(changed.space.polarity, 2);
    assert_eq!(changed.coupling.kind, CouplingKind::Anderson { depth: 10 });
    assert_eq!(changed.mesh.get("length"), Some([-30.0, 20.0]));
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
    assert_eq!(a.initial_density, b.initial_density);
}

#[test]
fn the_resolved_scene_parses_back_to_itself() {
    let forms = with(&[
        ("boundary.outlet.velocity", "{ traction = [\"min(t, 1)*x\", 0.25] }"),
        ("initial.polarity", "[1, \"0.5*sin(pi*y)\"]"),
        ("source.polarity", "[\"exp(-t)\", 1e-9]"),
        ("output.2.cuts.6", "{ name = \"wake\", from = [1, 0], to = [9, 1e-7], points = 31 }"),
        ("time.max_steps", "77"),
        ("space.k", "2"),
    ]);
    let implicit = sheet(&[("time.density_scheme", "bdf"), ("source.density", "x*t"), ("initial.density", "0.5")]);
    for original in [scene(STRIP), scene(DISC), forms, sheet(&[]), implicit] {
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
        "walls = \"rotated\"",
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
fn the_resolved_compressible_scene_shows_every_default() {
    let text = sheet(&[]).resolved_toml();
    for part in [
        "density = { penalty = 2.0, exponent = 1.0, critical = 0.25 }",
        "active_stress_iso = 0.1",
        "degree = { velocity = 2, density = 1, polarity = 2 }",
        "density_scheme = \"abdf\"",
        "elastic_force = \"stress\"",
    ] {
        assert!(text.contains(part), "`{part}` is not in\n{text}");
    }
    let incompressible = scene(STRIP).resolved_toml();
    assert!(!incompressible.contains("density") && !incompressible.contains("iso"), "{incompressible}");
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

#[test]
fn a_density_may_start_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("checkpoint.bin"), "").unwrap();
    let path = folder.path().join("scene.toml");
    let text = SHEET.replace("\"1 + 0.1*cos(x)\"", "{ file = \"checkpoint.bin\" }");
    std::fs::write(&path, text).unwrap();
    let read = Scene::read(&path).unwrap();
    assert_eq!(read.initial_density, Some(InitialDensity::File(folder.path().join("checkpoint.bin"))));
    same(&read, &scene(&read.resolved_toml()));
}

fn set_refused(path: &str, value: &str) -> String {
    let mut source = SceneSource::parse(STRIP, Path::new("strip.toml")).unwrap();
    let before = source.text();
    let text = source.set(path, value).expect_err("accepted").to_string();
    assert_eq!(source.text(), before, "a refused override changes nothing");
    text
}

#[test]
fn what_is_removed_must_be_a_key_of_scenes() {
    let cases = [
        ("model.pecle", &["`model.pecle`", "did you mean `peclet`?"][..]),
        ("time.stopp.residual", &["`time.stopp`", "did you mean `stop`?"]),
        ("tilte", &["`tilte`", "did you mean `title`?"]),
        ("boundary.inlt.velocity", &["boundary.inlt", "did you mean `inlet`?"]),
        ("boundary.\"my wall\"", &["boundary.\"my wall\"", "inlet, outlet"]),
        ("boundary.inlet.velocty", &["velocty", "did you mean `velocity`?"]),
        ("output.9", &["output.9", "no element"]),
        ("nonsense.of.any.depth", &["nonsense"]),
    ];
    for (path, words) in cases {
        let text = set_refused(path, "");
        words.iter().for_each(|word| assert!(text.contains(word), "`{word}` is not in {text}"));
    }
    // what scenes know and this one leaves out is at its default already
    let same = with(&[
        ("time.max_steps", ""),
        ("mesh.stretch", ""),
        ("time.stop.energy_rate", ""),
        ("boundary.inlet.density", ""),
    ]);
    assert_eq!(same.resolved_toml(), scene(STRIP).resolved_toml());
}

#[test]
fn keys_in_quotes_are_one_key() {
    let text = STRIP.replace("[boundary.walls]", "[boundary.\"a.b \\\"c\\\"\"]");
    let mut source = SceneSource::parse(&text, Path::new("strip.toml")).unwrap();
    source.set("boundary.\"a.b \\\"c\\\"\".velocity", "traction").unwrap();
    source.set("boundary . 'a.b \"c\"' . polarity", "{ dirichlet = [1, 0] }").unwrap();
    let scene = Scene::check(source).unwrap();
    let conditions = &scene.boundary["a.b \"c\""];
    assert!(conditions.velocity.fixes_pressure());
    assert!(matches!(conditions.polarity, PolarityCondition::Dirichlet(_)));
    assert_eq!(scene.boundary.len(), 4);
    let wrong = scene.check_tags(&tags(&["inlet", "outlet", "disc", "a.b c"])).unwrap_err().to_string();
    assert!(
        wrong.contains("[boundary.\"a.b \\\"c\\\"\"] names no part") && wrong.contains("did you mean `\"a.b c\"`?"),
        "{wrong}"
    );
    assert!(wrong.contains("with `boundary . 'a.b \"c\"' . polarity` set"), "{wrong}");
}

/// A misspelt tag makes a table of its own, which no part of the boundary has: the others are named.
#[test]
fn a_new_tag_by_mistake_is_compared_with_the_others() {
    let mut source = SceneSource::parse(STRIP, Path::new("strip.toml")).unwrap();
    source.set("boundary.inlt.velocity", "slip").unwrap();
    let text = Scene::check(source).unwrap_err().to_string();
    let words = ["[boundary.inlt] names no part", "the mesh's tags are inlet", "did you mean `inlet`?"];
    words.iter().for_each(|word| assert!(text.contains(word), "`{word}` is not in {text}"));
}

#[test]
fn paths_that_no_scene_has_are_refused_at_once() {
    let begin = std::time::Instant::now();
    for path in ["a.".repeat(5000) + "a", "boundary.".repeat(100_000) + "x", "\"".repeat(5001)] {
        let text = set_refused(&path, "1");
        assert!(text.len() < 2000 && text.contains("hint"), "{text}");
    }
    assert!(begin.elapsed().as_secs_f64() < 2.0);
    for path in ["", ".", "a.", "model..peclet", "boundary.\"wall.velocity", "boundary.\"a\"b.velocity"] {
        set_refused(path, "1");
    }
}
