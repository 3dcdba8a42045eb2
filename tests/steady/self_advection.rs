//! Polarity that carries itself along: a kink in closed form, and its spectrum.

use std::sync::atomic::AtomicBool;

use crate::common::*;
use monolayer::mesh::Point;
use monolayer::model::State;
use monolayer::model::fields::{POLARITY, VELOCITY};
use monolayer::run::Setup;
use monolayer::scene::Scene;
use monolayer::space::Field;
use monolayer::steady::{Found, SteadySettings, Want, find};
use monolayer::time::Phases;
use monolayer::time::sheet::SheetKind;

const KAPPA: f64 = 0.1;

/// `w = ½(ζ + √(ζ² + 8κ²))`: `ζpp′ = κ²p″ + (1−p²)p` has the solution `p = ±tanh(x/w)`, with `−ζ` for the lower sign.
fn width(factor: f64) -> f64 {
    0.5 * (factor + (factor * factor + 8.0 * KAPPA * KAPPA).sqrt())
}

/// A closed square at rest whose polarity goes from −tanh(1/2w) at x = 0 to tanh(1/2w) at x = 1.
fn kink(n: usize, factor: f64, sets: &[(&str, &str)]) -> (Scene, Setup) {
    let end = format!("tanh((x - 1/2)/{})", width(factor));
    let ends = format!("{{ dirichlet = [\"{end}\", \"0\"] }}");
    let start = format!("[\"(2*x - 1)*tanh(1/{})\", \"0\"]", 2.0 * width(factor));
    let square = Square::new()
        .set("mesh.n", &n.to_string())
        .set("model.coherence", &KAPPA.to_string())
        .set("model.self_advection", &factor.to_string())
        .set("boundary.left.polarity", &ends)
        .set("boundary.right.polarity", &ends)
        .set("initial.polarity", &start);
    sets.iter().fold(square, |square, (key, value)| square.set(key, value)).setup()
}

fn found(scene: &Scene, setup: &Setup) -> State {
    let settings = SteadySettings { want: Want::Any, eigenvalues: 0, residual: 1e-11, ..scene.steady.unwrap() };
    let p = setup.initial(scene).unwrap().values;
    let start = setup.initial_density(scene).unwrap().map_or_else(|| p.clone(), |rho| [&rho.values[..], &p].concat());
    let never = AtomicBool::new(false);
    let (phases, seen) = (&mut Phases::default(), &mut |_: monolayer::steady::Event<'_, '_>| Ok(()));
    let settings = monolayer::steady::SearchSettings { steady: settings, marching: scene.march() };
    let search = find(&*setup.model, start, &settings, &never, phases, seen).unwrap();
    match search.found {
        Found::Steady(steady) => steady.state,
        other => panic!("{other:?}, {:?}", search.tries),
    }
}

/// `‖p − p_exact‖` and `‖v‖`
fn errors(setup: &Setup, state: &State, factor: f64) -> [f64; 2] {
    let loops = match setup.model.kind() {
        SheetKind::Incompressible(model) => &model.loops,
        SheetKind::Compressible(model) => &model.loops,
    };
    let of = |field: &Field, exact: &(dyn Fn(Point) -> Point + Sync)| {
        loops.sum(12, |x| (field.vector(&x.site) - exact(x.site.x)).norm_squared()).sqrt()
    };
    let exact = |x: Point| Point::new(((x.x - 0.5) / width(factor)).tanh(), 0.0);
    [of(&state[POLARITY], &exact), of(&state[VELOCITY], &|_| Point::zeros())]
}

/// A kink that polarity runs away from is wide, one that it runs into is narrow; nothing else moves.
#[test]
fn a_kink_has_the_width_of_its_closed_form_in_both_sheets() {
    let density = [
        ("model.kind", "\"compressible\""),
        ("model.density", "{ penalty = 1.0 }"),
        ("initial.density", "\"1\""),
        ("space.degree.polarity", "3"),
    ];
    for sets in [&[][..], &density] {
        for factor in [0.3, -0.1] {
            let errors = [4, 8, 16].map(|n| {
                let (scene, setup) = kink(n, factor, sets);
                errors(&setup, &found(&scene, &setup), factor)
            });
            let order = ((errors[1][0] / errors[2][0]).log2(), errors[2][0]);
            println!("ζ = {factor}, w = {}: {errors:?}, order {}", width(factor), order.0);
            assert!(order.0 > 3.5 && order.1 < 2e-4, "ζ = {factor}: {errors:?}");
            assert!(errors.iter().all(|[_, v]| *v < 1e-8), "ζ = {factor}: it is at rest, {errors:?}");
        }
    }
}
