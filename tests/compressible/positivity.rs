//! A density never becomes negative, and a negative one is refused.

use std::path::Path;

use crate::common::*;
use monolayer::mesh::Point;
use monolayer::model::compressible::Compressible;
use monolayer::model::fields::{DENSITY, POLARITY, VELOCITY};
use monolayer::model::{Conditions, DensityLaw, Parameters};
use monolayer::run::Setup;
use monolayer::scene::{Scene, SceneSource};
use monolayer::scheme::ControlSettings;
use monolayer::time::{CouplingKind, March, MarchError, MarchSettings, StepFailure};

/// A step in the density from 1 to 1e-10, over a hundredth.
fn front(s: f64) -> f64 {
    1e-10 + (1.0 - 1e-10) * 0.5 * (1.0 - (s / 0.01).tanh())
}

/// Friction so strong that the tissue moves as `f_v` tells it to.
fn carried_by(n: usize, k: usize, flow: [&str; 2], condition: fn(&str) -> Conditions) -> Compressible {
    let friction = 1e5;
    let law = DensityLaw { penalty: 0.0, exponent: 1.0, critical: 0.0, active_stress_iso: 0.0 };
    let parameters = Parameters { friction, traction: 0.0, active_stress: 0.0, density: Some(law), ..PARAMETERS };
    let mesh = square(n);
    let mut description = describe(&mesh, parameters, k, condition);
    description.sources.force = Some(flow.map(|f| formula(&format!("{friction}*({f})"))));
    Compressible::new(&mesh, &description).unwrap()
}

const TURNING: [&str; 2] = ["sin(pi*x)*cos(pi*y)", "-cos(pi*x)*sin(pi*y)"];
/// Evaluated towards the middle, and torn from it.
const SQUEEZED: [&str; 2] = ["sin(2*pi*x)*cos(9*t)", "0.5*sin(2*pi*y)*cos(9*t)"];

fn through(tag: &str) -> Conditions {
    match tag {
        "left" => Conditions::flow(pair("1", "0")).with_density(formula("0")),
        "right" => Conditions::open().with_density(formula("0")),
        _ => closed(tag),
    }
}

fn march_keeps_positive(
    model: &Compressible,
    settings: MarchSettings,
    rho: impl Fn(Point) -> f64,
    steps: usize,
    what: &str,
) {
    let start = carried(model, rho, |x| Point::new(0.5, 0.3 * x.x));
    let mut march = March::start(model, settings, start).unwrap();
    let (mut lowest, mut speed) = (f64::INFINITY, 0.0_f64);
    for _ in 0..steps {
        march.advance(1e9).unwrap();
        lowest = lowest.min(least(model, &march.state[DENSITY]));
        speed = speed.max(largest(&march.state[VELOCITY].values));
        assert!(march.state[POLARITY].values.iter().all(|p| p.is_finite()), "{what}: the polarity is finite");
    }
    println!(
        "{what}: least {lowest:.1e}, speed {speed:.2}, p {:.2}, {:?}",
        largest(&march.state[POLARITY].values),
        march.counts
    );
    assert!(lowest >= 0.0, "{what}: {lowest:.1e}");
    assert!(speed > 0.8 && march.counts.limited > 10, "{what}: speed {speed}, {:?}", march.counts);
}

#[test]
fn steep_fronts_are_carried_without_a_negative_density() {
    for kind in [CouplingKind::Newton, CouplingKind::Anderson { depth: 5 }] {
        for (flow, condition, name) in [
            (TURNING, closed as fn(&str) -> Conditions, "turning"),
            (SQUEEZED, closed, "squeezed"),
            (["1", "0"], through, "through"),
        ] {
            for (k, order) in [(1, 2), (2, 3)] {
                let model = carried_by(4, k, flow, condition);
                let what = format!("{kind:?}, {name}, degree {k}, order {order}");
                march_keeps_positive(&model, settings(0.02, order, kind), |x| front(x.x - 0.4 + 0.1 * x.y), 15, &what);
            }
        }
    }
}

#[test]
fn a_step_to_a_negative_mean_is_halved() {
    // BDF2 extrapolates: with nothing coming in, the upstream cells lose in the first step more than they have left in
    // the second
    for kind in [CouplingKind::Newton, CouplingKind::Anderson { depth: 5 }] {
        let model = carried_by(3, 1, ["1", "0"], through);
        let settings = MarchSettings { density_implicit: true, ..settings(0.5, 2, kind) };
        let mut march = March::start(&model, settings, carried(&model, |_| 1.0, |_| Point::new(0.5, 0.0))).unwrap();
        let mut rejected = Vec::new();
        for _ in 0..6 {
            let report = march.advance(1e9).unwrap();
            rejected.push(report.rejected);
            assert!(least(&model, &march.state[DENSITY]) >= 0.0);
            let mass = march.model.mass(&march.state.carried());
            assert!((march.mass_counted() / mass - 1.0).abs() < 1e-11, "{} {mass}", march.mass_counted());
        }
        println!("{kind:?}: {rejected:?}, t = {}", march.t);
        assert_eq!(rejected[0], 0, "implicit Euler steps as far as it likes");
        assert!(rejected[1] > 0 && march.nominal_step() < 0.5, "{rejected:?}");

        // where Δt may not be halved, the step fails and the cell is named
        let settings = MarchSettings { control: ControlSettings::new(0.5).down_to(0.4), ..settings };
        let mut march = March::start(&model, settings, carried(&model, |_| 1.0, |_| Point::new(0.5, 0.0))).unwrap();
        march.advance(1e9).unwrap();
        let before = march.state[DENSITY].values.clone();
        let error = march.advance(1e9).unwrap_err();
        let MarchError::StepTooSmall { cause, .. } = &error else { panic!("{error}") };
        println!("{error}");
        // Newton's method only sees that it does not converge
        if kind != CouplingKind::Newton {
            assert!(matches!(**cause, StepFailure::Density(_)), "{error}");
            assert!(error.to_string().contains("the mean density of cell"), "{error}");
        }
        assert!(before == march.state[DENSITY].values, "the last good state is kept");
    }
}

#[test]
fn a_negative_density_is_refused_at_the_start() {
    let model = sheet(&square(2), PARAMETERS, 1, closed);
    let y = carried(&model, |x| if x.x > 0.3 { -0.1 } else { 1.0 }, |_| Point::new(1.0, 0.0));
    let error = March::start(&model, settings(0.1, 1, CouplingKind::Newton), y).unwrap_err();
    assert!(matches!(error, StepFailure::Density(_)), "{error}");

    let mut source = SceneSource::parse(include_str!("../data/compressible.toml"), Path::new("test.toml")).unwrap();
    source.set("initial.density", "1 - x/2").unwrap();
    let scene = Scene::check(source).unwrap();
    let error = Setup::new(&scene).unwrap().start(&scene).unwrap_err().to_string();
    println!("{error}");
    for part in ["initial.density", "1 - x/2", "at x = 2.", ", t = 0; hint: "] {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
}

fn draining(tag: &str) -> Conditions {
    Conditions { density: (tag == "left" || tag == "right").then(|| formula("0.25 - t + 0.01*y")), ..channel(tag) }
}

#[test]
fn a_negative_density_of_inflow_is_refused_when_its_time_comes() {
    for kind in [CouplingKind::Newton, CouplingKind::Anderson { depth: 5 }] {
        let model = sheet(&square(2), PARAMETERS, 1, draining);
        let mut march = March::start(&model, settings(0.1, 2, kind), smooth(&model)).unwrap();
        march.advance(1e9).unwrap();
        march.advance(1e9).unwrap();
        let error = march.advance(1e9).unwrap_err();
        println!("{error}");
        let MarchError::Failed { step: 3, cause, .. } = &error else { panic!("{error}") };
        assert!(matches!(**cause, StepFailure::Formula(_)), "{error}");
        for part in ["0.25 - t + 0.01*y", "t = 0.3", " at x = ", "; hint: "] {
            assert!(error.to_string().contains(part), "`{part}` is not in: {error}");
        }
        assert!((march.t - 0.2).abs() < 1e-12 && march.state.carried().iter().all(|y| y.is_finite()));
    }
}
