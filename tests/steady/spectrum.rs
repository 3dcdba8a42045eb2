//! The spectrum against eigenvalues that are known, and against what marching in time shows.

use std::f64::consts::PI;

use crate::common::*;
use monolayer::model::fields::{POLARITY, VELOCITY};
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::model::start;
use monolayer::scene::{Initial, Scene};
use monolayer::space::{Field, project};
use monolayer::steady::spectrum::Spectrum;
use monolayer::steady::{Found, SearchSettings, Stability, SteadySettings, Want, find};
use monolayer::time::{CouplingKind, CouplingSettings, March, MarchSettings, Phases};

fn uniform(model: &Incompressible, p: [f64; 2]) -> Field {
    project::interpolate_vector(&model.polarity.space, |_| p.into())
}

/// The leading real eigenvalues are `exact`, largest first; equal ones count once.
#[track_caller]
fn leads_with(spectrum: &Spectrum, exact: &[f64], tolerance: f64) {
    let mut distinct: Vec<f64> = Vec::new();
    for mode in &spectrum.modes {
        assert!(mode.residual < 1e-5, "{}: {}", mode.value, mode.residual);
        near(mode.value.im, 0.0, 1e-9, "imaginary part");
        if distinct.last().is_none_or(|last| (last - mode.value.re).abs() > 0.01) {
            distinct.push(mode.value.re);
        }
    }
    assert!(distinct.len() >= exact.len(), "{distinct:?}");
    for (found, exact) in distinct.iter().zip(exact) {
        near(*found, *exact, tolerance, "eigenvalue");
    }
}

#[test]
fn a_uniform_polarity_turns_freely_and_relaxes_at_known_rates() {
    let (scene, setup) = Square::new().setup();
    let model = model_of(&setup);
    let found = spectrum_of(model, &state(model, uniform(model, [1.0, 0.0])), 8);
    let (pe, kappa) = (scene.parameters.peclet, scene.parameters.coherence);
    let across = |k: f64| -(kappa * PI).powi(2) * k / pe;
    let along = |k: f64| across(k) - 2.0 / pe;
    leads_with(&found, &[0.0, across(1.0), across(2.0), along(0.0)], 2e-4);
    near(found.modes[0].value.re, 0.0, 1e-9, "the rotation");
    assert_eq!(found.stability(), Stability::NotKnown, "a rotated state is as good");
    assert_eq!(found.unstable_dimension(), 0);
}

#[test]
fn a_prescribed_polarity_on_one_side_makes_it_stable() {
    let (scene, setup) = Square::new().set("boundary.left.polarity", "{ dirichlet = [1, 0] }").setup();
    let model = model_of(&setup);
    let found = spectrum_of(model, &state(model, uniform(model, [1.0, 0.0])), 6);
    let rate = (scene.parameters.coherence * PI).powi(2) / scene.parameters.peclet;
    leads_with(&found, &[-0.25 * rate, -1.25 * rate, -2.25 * rate], 2e-4);
    assert_eq!(found.stability(), Stability::Stable);
    // the mode that leads is sin(πx/2) e₂
    let shape = project::interpolate_vector(&model.polarity.space, |x| [0.0, (0.5 * PI * x.x).sin()].into());
    let mode = &found.modes[0].vector[0];
    let share: f64 = shape.values.iter().zip(model.polarity.mass_times(mode)).map(|(a, b)| a * b).sum();
    near(share.abs(), size(model, &shape.values) * size(model, mode), 1e-5, "share of sin(πx/2)");
}

#[test]
fn all_directions_grow_about_no_polarity() {
    for (kappa, dimension) in [("0.4", 2), ("0.28", 6)] {
        let (scene, setup) = Square::new().set("model.coherence", kappa).setup();
        let model = model_of(&setup);
        let found = spectrum_of(model, &model.zero(), 8);
        let rate = |k: f64| (1.0 - (scene.parameters.coherence * PI).powi(2) * k) / scene.parameters.peclet;
        leads_with(&found, &[rate(0.0), rate(1.0), rate(2.0)], 2e-4);
        assert_eq!(found.stability(), Stability::Unstable);
        assert_eq!(found.unstable_dimension(), dimension, "{:?}", values(&found.modes));
    }
}

#[test]
fn tissue_that_turns_as_a_whole_turns_its_disturbances() {
    // in the frame that turns along, a uniform polarity grows at 1/Pe
    let flow = "{ dirichlet = [\"1.5*(1/2-y)\", \"1.5*(x-1/2)\"] }";
    let (scene, setup) = Square::new().sides("velocity", flow).set("model.friction", "0").setup();
    let model = model_of(&setup);
    let rest = state(model, Field::zero(&model.polarity.space));
    let found = spectrum_of(model, &rest, 4);
    near(found.modes[0].value.re, 1.0 / scene.parameters.peclet, 1e-8, "growth rate");
    near(found.modes[0].value.im, 1.5, 1e-8, "angular frequency");
    assert!(found.modes.iter().all(|mode| mode.value.im >= 0.0), "of a pair the upper one");
    assert_eq!(found.unstable_dimension(), 2 * found.growing().filter(|mode| mode.value.im > 0.0).count());
}

/// Tissue that is squeezed along one axis and stretched along the other, with every term.
fn driven(mesh: usize, sets: &[(&str, &str)]) -> (Scene, monolayer::run::Setup) {
    let flow = "{ dirichlet = [\"0.6*(x-1/2)\", \"-0.6*(y-1/2)\"] }";
    let square = Square::new()
        .sides("velocity", flow)
        .set("boundary.left.polarity", "{ dirichlet = [1, 0] }")
        .set("boundary.right.velocity", "\"traction\"")
        .set("initial.polarity", "[\"1\", \"1/5\"]")
        .set("mesh.n", &mesh.to_string());
    let terms = [("model.elasticity", "0.5"), ("model.traction", "0.6"), ("model.active_stress", "0.4")];
    terms.iter().chain(sets).fold(square, |square, (key, value)| square.set(key, value)).setup()
}

pub fn steady(scene: &Scene, model: &Incompressible) -> State {
    let Initial::Expressions(formulas) = &scene.initial else { panic!("formulas are given") };
    let begin = start::formulas(&model.polarity.space, formulas, 0.0).unwrap();
    let settings = SteadySettings { want: Want::Any, eigenvalues: 0, residual: 1e-11, ..scene.steady.unwrap() };
    let interrupt = std::sync::atomic::AtomicBool::new(false);
    let phases = &mut Phases::default();
    let settings = SearchSettings { steady: settings, marching: scene.march() };
    let search = find(model, begin.values, &settings, &interrupt, phases, &mut |_| Ok(())).unwrap();
    match search.found {
        Found::Steady(steady) => steady.state,
        other => panic!("{other:?}, {:?}", search.tries),
    }
}

/// The rate at which marching amplifies a small disturbance along `direction`, once other modes are gone.
fn rate_of_marching(scene: &Scene, model: &Incompressible, rest: &State, direction: &[f64], times: [f64; 2]) -> f64 {
    let mut begin = rest[POLARITY].clone();
    let scale = 1e-7 / size(model, direction);
    begin.values.iter_mut().zip(direction).for_each(|(p, d)| *p += scale * d);
    let coupling = CouplingSettings { kind: CouplingKind::Newton, tolerance: 1e-12, ..scene.coupling };
    let mut march = March::start(model, MarchSettings { coupling, ..scene.march() }, begin.values).unwrap();
    let mut distances = Vec::new();
    for time in times {
        while march.t < time - 1e-9 {
            march.advance(time).unwrap();
        }
        distances.push(distance(model, &march.state[POLARITY], &rest[POLARITY]));
    }
    (distances[1] / distances[0]).ln() / (times[1] - times[0])
}

#[test]
fn marching_a_disturbance_shows_the_leading_eigenvalue() {
    for (sets, unstable, times) in [
        (&[][..], false, [4.0, 5.0]),
        // squeezed along its own direction, and held less: it turns away
        (&[("boundary.left.polarity", "\"neumann\""), ("initial.polarity", "[0, 1]")][..], true, [7.0, 8.0]),
    ] {
        let (scene, setup) = driven(3, &[sets, &[("time.step", "0.02")]].concat());
        let model = model_of(&setup);
        let rest = steady(&scene, model);
        let flow = rest[VELOCITY].values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!(flow > 0.2, "there is a flow: {flow}");
        let found = spectrum_of(model, &rest, 6);
        println!("{:?} {:?}", values(&found.modes), found.searched);
        let leading = &found.modes[0];
        near(leading.value.im, 0.0, 1e-12, "imaginary part");
        assert_eq!(found.stability(), if unstable { Stability::Unstable } else { Stability::Stable });
        // the disturbance is the mode with another one of half its size
        let second = found.modes[1].vector[0].iter().map(|v| 0.5 * v);
        let direction: Vec<f64> = leading.vector[0].iter().zip(second).map(|(a, b)| a + b).collect();
        let rate = rate_of_marching(&scene, model, &rest, &direction, times);
        near(rate, leading.value.re, 1e-3 * leading.value.re.abs(), "rate of marching");
    }
}
