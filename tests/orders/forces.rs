//! Forces and torques on boundary tags: a disc in Poiseuille flow, and what all tags add up to.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use monolayer::element::quadrature;
use monolayer::mesh::Point;
use monolayer::model::{Exact, Incompressible, Numbers, Reactions, State};
use monolayer::output::progress::Verbosity;
use monolayer::run::setup::describe;
use monolayer::run::{AnyScene, Options, kinds};
use monolayer::scene::{Scene, SceneSource, StokesScene};
use monolayer::space::project;

use super::slope;

static NEVER: AtomicBool = AtomicBool::new(false);

/// Measures of a scene at its end.
fn measured(text: &str, measures: &str) -> BTreeMap<String, f64> {
    let text = format!("{text}\n[[output]]\nmeasures = [{measures}]\n");
    let source = SceneSource::parse(&text, Path::new("tests/orders")).unwrap_or_else(|error| panic!("{error}"));
    let scene = AnyScene::check(source).unwrap_or_else(|error| panic!("{error}"));
    let out = tempfile::tempdir().unwrap();
    let options = Options { out: out.path().into(), resume: false, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    let summary = kinds::run(&scene, &options).unwrap_or_else(|error| panic!("{error}"));
    assert!(!summary.ending.is_failure(), "{:?}", summary.ending);
    summary.measures.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// A disc of radius 0.1 in the unit square about the origin, in the flow `4(½+y)(½−y)` of its ends.
fn poiseuille([x, y]: [f64; 2], (k, curved): (usize, usize), h: f64) -> String {
    format!(
        r#"
[model]
kind = "stokes"
[mesh]
shape = "strip-with-disc"
length = [-0.5, 0.5]
width = 1.0
radius = 0.1
centre = [{x}, {y}]
h = {h}
h_disc = {}
grading = {}
curved = {curved}
[space]
k = {k}
[boundary.inlet]
velocity = {{ dirichlet = ["4*(0.25-y^2)", "0"] }}
[boundary.outlet]
velocity = {{ dirichlet = ["4*(0.25-y^2)", "0"] }}
[boundary.walls]
velocity = {{ dirichlet = ["0", "0"] }}
[boundary.disc]
velocity = {{ dirichlet = ["0", "0"] }}
[time]
step = 1.0
end = 1.0
"#,
        0.3 * h,
        2.0 * h
    )
}

/// Drag, lift and torque about its centre of the disc.
fn on_disc(centre: [f64; 2], degrees: (usize, usize), h: f64) -> [f64; 3] {
    let asked = format!("{{ force_on = \"disc\" }}, {{ torque_on = \"disc\", around = {centre:?} }}");
    let found = measured(&poiseuille(centre, degrees, h), &asked);
    ["force_x1:disc", "force_x2:disc", "torque:disc"].map(|column| found[column])
}

/// Unit peak of the flow and unit viscosity: 16.5989 and no more in the middle, 16.3219, −0.86896 and 0.11538 at
/// (0.43, 0.61), of an independent code; here with P4/P3 on twice as many cells.
const CENTRED: [f64; 3] = [16.598901, 0.0, 0.0];
const ASIDE: [f64; 3] = [16.321903, -0.868960, 0.1153796];

#[test]
fn a_disc_in_poiseuille_flow_has_the_forces_of_an_independent_code() {
    for (centre, known) in [([0.0, 0.0], CENTRED), ([-0.07, 0.11], ASIDE)] {
        let found = on_disc(centre, (2, 3), 0.05);
        println!("{centre:?}: {found:?}");
        for ((found, known), allowed) in found.into_iter().zip(known).zip([6e-6, 1e-6, 1e-7]) {
            assert!((found - known).abs() < allowed, "{centre:?}: {found}, not {known}");
        }
    }
}

/// Velocities of degree q have gradients of order q: the forces have twice as many.
#[test]
fn forces_have_twice_the_order_of_the_stress() {
    for ((k, curved), least, last) in [((1, 2), 3.6, [9e-4, 6e-5, 9e-6]), ((2, 3), 5.2, [6e-6, 1e-6, 1e-7])] {
        let sizes = [0.2, 0.1, 0.05];
        let found = sizes.map(|h| on_disc([-0.07, 0.11], (k, curved), h));
        for (c, what) in ["drag", "lift", "torque"].into_iter().enumerate() {
            let errors: Vec<(f64, f64)> = (0..3).map(|l| (sizes[l], (found[l][c] - ASIDE[c]).abs())).collect();
            let order = slope(&errors);
            println!(
                "P{}/P{k}: {what:<6} {:.1e} {:.1e} {:.1e}  order {order:.2}",
                k + 1,
                errors[0].1,
                errors[1].1,
                errors[2].1
            );
            assert!(errors[2].1 < last[c], "{what}: {:.2e}", errors[2].1);
            assert!(c > 0 || order > least, "{what}: {order:.2}");
        }
    }
}

/// A flow of the space has the forces of its formula, corners included.
#[test]
fn the_walls_of_a_channel_are_dragged_along() {
    let text = r#"
[model]
kind = "stokes"
[mesh]
shape = "strip"
length = [0.0, 1.0]
width = 1.0
h = 0.25
[boundary.inlet]
velocity = { dirichlet = ["4*(0.25-y^2)", "0"] }
[boundary.outlet]
velocity = { traction = ["0", "-8*y"] }
[boundary.walls]
velocity = { dirichlet = ["0", "0"] }
[time]
step = 1.0
end = 1.0
"#;
    let forces = ["walls", "inlet", "outlet"].map(|tag| format!("{{ force_on = \"{tag}\" }}")).join(", ");
    let asked = &format!("{forces}, {{ torque_on = \"walls\", around = [0.5, 1.0] }}");
    let found = measured(text, asked);
    // shear of 4 on both walls; Π falls from 8 to 0; of the torque on walls what their drag makes about (½, 1), and Π
    let known = [
        ("force_x1:walls", 8.0),
        ("force_x2:walls", 0.0),
        ("force_x1:inlet", -8.0),
        ("force_x2:inlet", 0.0),
        ("force_x1:outlet", 0.0),
        ("force_x2:outlet", 0.0),
        ("torque:walls", 8.0),
    ];
    for (column, known) in known {
        assert!((found[column] - known).abs() < 1e-11, "{column}: {}, not {known}", found[column]);
    }
}

/// Sides of the unit square.
const SIDES: [(&str, Side); 4] = [
    ("left", |s| (Point::new(0.0, s), Point::new(-1.0, 0.0))),
    ("right", |s| (Point::new(1.0, s), Point::new(1.0, 0.0))),
    ("bottom", |s| (Point::new(s, 0.0), Point::new(0.0, -1.0))),
    ("top", |s| (Point::new(s, 1.0), Point::new(0.0, 1.0))),
];

/// Place and normal at a share of the way along a side.
type Side = fn(f64) -> (Point, Point);

/// `−∫ n·σ` of exact fields over the sides.
fn exact_forces<'a>(exact: &Exact, numbers: impl Into<Numbers<'a>> + Copy, t: f64) -> [Point; 4] {
    let rule = quadrature::interval(20);
    SIDES.map(|(_, at)| {
        let points = rule.points.iter().zip(&rule.weights);
        points.map(|(&s, w)| -*w * exact.traction(numbers, at(s).0, t, at(s).1)).sum()
    })
}

/// Compares orders and last errors on the sides, from squares of 8, 16 and 32 cells a side.
fn converge(name: &str, level: impl Fn(usize) -> [f64; 4], least: f64, last: f64) {
    let levels = [8, 16, 32].map(|n| (1.0 / n as f64, level(n)));
    for (k, (tag, _)) in SIDES.iter().enumerate() {
        let errors: Vec<(f64, f64)> = levels.iter().map(|(h, errors)| (*h, errors[k])).collect();
        let (order, shown) = (slope(&errors), errors.iter().map(|(_, e)| format!("{e:.1e}")).collect::<Vec<_>>());
        println!("{name}, {tag:<6} {}  order {order:.2}", shown.join(" "));
        assert!(order > least && errors[2].1 < last, "{name}, {tag}: order {order:.2}, error {:.2e}", errors[2].1);
    }
}

/// On tags that meet others, the sides of a square, the parts of their corners are shared.
#[test]
fn forces_on_sides_that_meet_converge() {
    let text = include_str!("../../studies/mms/stokes-square.toml");
    let scene = StokesScene::parse(text, Path::new("test.toml")).unwrap();
    let known = exact_forces(scene.sources.exact.as_ref().unwrap(), &scene.fluid, 1.0);
    let asked = SIDES.map(|(tag, _)| format!("{{ force_on = \"{tag}\" }}")).join(", ");
    let level = |n: usize| {
        let found = measured(&text.replace("\nn = 8 ", &format!("\nn = {n} ")), &asked);
        let on = |tag: &str| Point::new(found[&format!("force_x1:{tag}")], found[&format!("force_x2:{tag}")]);
        [0, 1, 2, 3].map(|k| (on(SIDES[k].0) - known[k]).norm())
    };
    converge("Stokes", level, 2.9, 2.2e-4);
}

/// The same of a tissue, whose stress is of all its terms, with either elastic force.
#[test]
fn forces_of_a_tissue_converge() {
    let text = include_str!("../../studies/mms/square.toml");
    let t = 0.7;
    for kind in ["stress", "energy-consistent"] {
        let level = |n: usize| {
            let mut source = SceneSource::parse(text, Path::new("test.toml")).unwrap();
            let sets = [("mesh.n", n.to_string()), ("model.elastic_force", kind.to_owned())];
            sets.iter().for_each(|(key, value)| source.set(key, value).unwrap());
            source.set("boundary.right.velocity", "traction").unwrap();
            let scene = Scene::check(source).unwrap();
            let mesh = Arc::new(scene.mesh.build().unwrap());
            let model = Incompressible::new(&mesh, &describe(&scene, &mesh)).unwrap();
            let exact = scene.sources.exact.as_ref().unwrap();
            let p = project::interpolate_vector(&model.polarity.space, |x| exact.at(x, t).polarity);
            let (v, pi) = model.flow(&p, t).unwrap();
            let found = Reactions::of_incompressible(&model, &State::incompressible(v, pi, p), t).unwrap();
            let known = exact_forces(exact, &scene.parameters, t);
            [0, 1, 2, 3].map(|k| (found.force(mesh.tag(SIDES[k].0).unwrap()) - known[k]).norm())
        };
        converge(kind, level, 1.9, 1e-2);
    }
}
