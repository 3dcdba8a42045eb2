//! Exact fields of Stokes flows: orders with every kind of boundary condition, on straight and on curved cells.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use monolayer::output::progress::Verbosity;
use monolayer::run::{AnyScene, Ending, Options, kinds};
use monolayer::scene::SceneSource;

use super::slope;

static NEVER: AtomicBool = AtomicBool::new(false);

const MIXED: &str = include_str!("../../studies/mms/stokes-square.toml");

/// `v = (cos πx cos πy, sin πx sin πy)` goes straight through the left and the right side, and along the others.
const STRAIGHT: &str = r#"
[model]
kind = "stokes"
friction = 2.0
[mesh]
shape = "square"
n = 8
[boundary.left]
velocity = "no-tangential"
[boundary.right]
velocity = "no-tangential"
[boundary.bottom]
velocity = "slip"
[boundary.top]
velocity = "slip"
[exact]
velocity = ["cos(pi*x)*cos(pi*y)", "sin(pi*x)*sin(pi*y)"]
pressure = "sin(2*x)*cos(y)"
[time]
step = 1.0
end = 1.0
"#;

/// `v = g(r) (−y, x)`, between a wall that resists and one that slips, with a shear stress at both.
const RING: &str = r#"
[model]
kind = "stokes"
[mesh]
shape = "annulus"
radius = 2.0
inner_radius = 1.0
h = 0.5
curved = 2
[boundary.outer]
velocity = { friction = 3.0 }
[boundary.inner]
velocity = "slip"
[exact]
velocity = ["-y*(1+cos(x^2+y^2))", "x*(1+cos(x^2+y^2))"]
pressure = "x*y"
[time]
step = 1.0
end = 1.0
"#;

/// Errors of a scene: of v in L² and H¹, and of Π in L².
fn errors(text: &str, sets: &[(&str, String)]) -> (f64, [f64; 3]) {
    let mut source = SceneSource::parse(text, Path::new("tests/orders")).unwrap();
    sets.iter().for_each(|(key, value)| source.set(key, value).unwrap());
    let scene = AnyScene::check(source).unwrap();
    let out = tempfile::tempdir().unwrap();
    let options = Options { out: out.path().into(), resume: false, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    let summary = kinds::run(&scene, &options).unwrap();
    assert_eq!(summary.ending, Ending::EndTime);
    let of = |field: &str, norm: &str| summary.errors[field][norm];
    let h = kinds::mesh(&scene).unwrap().quality().h_max;
    (h, [of("velocity", "L2(L2)"), of("velocity", "L2(H1)"), of("pressure", "L2(L2)")])
}

/// Compares slopes and last errors of v in L² and H¹ and of Π in L².
#[track_caller]
fn converges(name: &str, levels: Vec<(f64, [f64; 3])>, orders: [f64; 3], last: [f64; 3]) {
    for (k, what) in ["v, L2", "v, H1", "Pi, L2"].into_iter().enumerate() {
        let table: Vec<(f64, f64)> = levels.iter().map(|(h, errors)| (*h, errors[k])).collect();
        let (order, error) = (slope(&table), table.last().unwrap().1);
        let shown: Vec<String> = table.iter().map(|(_, e)| format!("{e:.2e}")).collect();
        println!("{name}: {what:<7} {}  order {order:.2}", shown.join("  "));
        assert!(order >= orders[k], "{name}, {what}: order {order:.2}, not {}", orders[k]);
        assert!(error <= last[k], "{name}, {what}: error {error:.2e}, not {:.2e}", last[k]);
    }
}

/// On squares of 8, 16 and 32 cells a side.
fn on_squares(text: &str, k: usize) -> Vec<(f64, [f64; 3])> {
    [8, 16, 32].map(|n| errors(text, &[("mesh.n", n.to_string()), ("space.k", k.to_string())])).to_vec()
}

#[test]
fn every_condition_keeps_the_orders_of_the_degrees() {
    converges("mixed, P2/P1", on_squares(MIXED, 1), [2.95, 1.95, 2.3], [2.3e-5, 5.5e-3, 2.4e-4]);
    converges("mixed, P3/P2", on_squares(MIXED, 2), [3.95, 2.95, 3.3], [2.0e-7, 6.8e-5, 5.8e-6]);
    let closed = MIXED.replace("\"traction\"", "\"dirichlet\"");
    converges("closed, P2/P1", on_squares(&closed, 1), [2.95, 1.95, 2.4], [2.3e-5, 5.5e-3, 2.5e-4]);
    converges("straight, P2/P1", on_squares(STRAIGHT, 1), [2.95, 1.95, 2.0], [1.3e-5, 3.2e-3, 1.3e-4]);
    let penalty = MIXED.replace("[boundary.left]", "[space]\nwalls = \"penalty\"\n[boundary.left]");
    converges("penalty, P2/P1", on_squares(&penalty, 1), [2.95, 1.95, 2.3], [2.3e-5, 5.5e-3, 2.4e-4]);
}

#[test]
fn walls_of_curved_cells_keep_them() {
    let levels = [0.4, 0.2, 0.1].map(|h| errors(RING, &[("mesh.h", h.to_string())])).to_vec();
    converges("ring, P2/P1", levels, [2.95, 1.95, 2.1], [6.5e-4, 5e-2, 1.7e-3]);
}

/// A polynomial flow lies in the space: nothing is left but rounding, of the pressure's mean neither.
#[test]
fn a_flow_of_the_space_is_found_to_rounding() {
    let text = MIXED
        .replace("(1+t)*(sin(pi*x)*cos(pi*y) + y)", "y*(1+t)")
        .replace("-(1+t)*cos(pi*x)*sin(pi*y)", "0")
        .replace("(1+t)*sin(2*x)*cos(y)", "3 + x - 2*y");
    for text in [text.clone(), text.replace("\"traction\"", "\"dirichlet\"")] {
        let (_, found) = errors(&text, &[]);
        assert!(found.iter().all(|error| *error < 1e-12), "{found:?}");
    }
}

/// Bodies have no exact fields, and a field that is no solution is refused.
#[test]
fn what_cannot_be_exact_is_refused() {
    let refused = |text: &str, words: &[&str]| {
        let scene = SceneSource::parse(text, Path::new("test.toml")).map_err(|error| error.to_string());
        let scene = scene.and_then(|source| AnyScene::check(source).map_err(|error| error.to_string()));
        let error = scene.and_then(|scene| kinds::check(&scene).map(|_| ()).map_err(|error| error.to_string()));
        let error = error.unwrap_err();
        words.iter().for_each(|word| assert!(error.contains(word), "{error} has no {word}"));
    };
    let body = "\n[[body]]\nname = \"disc\"\nshape = { disc = { radius = 0.1 } }\nposition = [0.5, 0.5]\n";
    refused(&format!("{MIXED}{body}"), &["test.toml", "`exact`", "without bodies", "hint: "]);
    refused(&MIXED.replace("\"-(1+t)*cos(pi*x)*sin(pi*y)\"", "\"y\""), &["`exact.velocity`", "div v", "hint: "]);
    refused(&MIXED.replace("+ y)", "+ y + x^2*y)"), &["div v"]);
    refused(&MIXED.replace("\"slip\"", "\"no-tangential\""), &["v·t", "`bottom`"]);
    refused(&MIXED.replace("\"traction\"", "{ traction = [1, 0] }"), &["the traction is that of the exact fields"]);
    refused(&MIXED.replace("pressure = ", "polarity = [0, 0]\npressure = "), &["polarity"]);
    refused(&MIXED.replace("sin(2*x)", "ln(x-0.5)"), &["`exact.pressure`", "hint: "]);
}
