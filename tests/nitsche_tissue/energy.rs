//! The energy law with bodies: what they take is a line of it.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use monolayer::body::{Body, Hold};
use monolayer::measure::Budget;
use monolayer::model::fields::{PRESSURE, VELOCITY};
use monolayer::model::incompressible::State;
use monolayer::model::{ElasticForce, Parameters};
use monolayer::shape::Twist;
use monolayer::time::moving::MovingMarch;
use monolayer::time::{CouplingKind, March};

use crate::common::*;
use crate::setting::*;

/// The largest line.
fn size(budget: &Budget) -> f64 {
    let own = [budget.rate, budget.relaxation, budget.bodies, budget.wall_friction];
    budget.lines.iter().chain(&own).fold(0.0_f64, |most, line| most.max(line.abs()))
}

fn fixed() -> Vec<Body> {
    vec![round(0.15, [0.33, 0.42], Hold::Fixed), capsule([0.68, 0.61], 0.7, Hold::Fixed)]
}

#[test]
fn the_energy_law_holds_around_fixed_bodies() {
    let parameters = Parameters { elastic_force: ElasticForce::Energy, ..with_factors() };
    for condition in [slip, no_slip] {
        let model = around(&square(4), parameters, &condition, fixed());
        let p = random(&model.polarity.space, 4);
        let inputs = model.inputs(0.0).unwrap();
        let (mut v, mut pi) = (model.zero().into_field(VELOCITY), model.zero().into_field(PRESSURE));
        // the sides from which the elastic force looks settle
        for _ in 0..60 {
            (v, pi) = model.flow_of(&model.force(&p, &v, &inputs), &inputs).unwrap();
        }
        let state = State::incompressible(v, pi, p);
        let residual = model.polarity_residual(&state, 0.0);
        let rate: Vec<f64> = residual.iter().map(|r| -r / parameters.peclet).collect();
        let budget = Budget::at(&model, &state, &model.polarity.project(&rate), 0.0).unwrap();
        println!("{budget:?}: {:.1e}", budget.defect());
        assert!(budget.bodies.abs() > 1e-3 * size(&budget), "bodies take something");
        assert!(budget.defect().abs() < 1e-12 * size(&budget));
        // each its own part, whatever their order
        let powers = model.powers_to_bodies(&state, &[Twist::ZERO; 2], 0.0).unwrap();
        let turned = around(&square(4), parameters, &condition, fixed().into_iter().rev().collect());
        let others = turned.powers_to_bodies(&state, &[Twist::ZERO; 2], 0.0).unwrap();
        println!("{powers:?}, {others:?}");
        assert!((powers.iter().sum::<f64>() - budget.bodies).abs() < 1e-12 * size(&budget));
        assert!((powers[0] - powers[1]).abs() > 1e-3 * size(&budget), "bodies that differ take different powers");
        for (one, other) in powers.iter().zip(others.iter().rev()) {
            assert!((one - other).abs() < 1e-12 * size(&budget));
        }
    }
}

#[test]
fn a_passive_sheet_around_fixed_bodies_never_gains_energy() {
    let parameters = Parameters { elastic_force: ElasticForce::Energy, traction: 0.0, active_stress: 0.0, ..ACTIVE };
    let model = around(&square(4), parameters, &slip, fixed());
    let start = random(&model.polarity.space, 2);
    for kind in [CouplingKind::Newton, ANDERSON] {
        let mut march = March::start(&model, settings(1e-3, 1, kind), start.values.clone()).unwrap();
        let mut last = march.energy().0;
        let first = last;
        for _ in 0..6 {
            march.advance(1e9).unwrap();
            let now = march.energy().0;
            assert!(now < last, "{kind:?}: {last} to {now}");
            last = now;
        }
        assert!(last < 0.9 * first, "{kind:?}: {first} to {last}");
    }
}

/// A loaded disc and a dragged one in a tissue without elasticity: nothing but the balance of momentum is in the law.
#[test]
fn without_elasticity_the_law_holds_around_bodies_that_move() {
    let parameters = Parameters { elasticity: 0.0, ..with_factors() };
    let load = Body { force: [formula("1.5"), formula("-0.5")], friction: 1.5, ..round(0.13, [0.3, 0.4], Hold::Free) };
    let held = Hold::Held { velocity: [formula("-0.3"), formula("0.2")], spin: formula("1.2") };
    let model = around(&square(6), parameters, &slip, vec![load, capsule([0.68, 0.61], 0.7, held)]);
    let p = swirl(&model).values;
    let mut march = MovingMarch::start(model, settings(0.02, 2, ANDERSON), p, (2, None)).unwrap();
    for _ in 0..4 {
        march.advance(10.0, &AtomicBool::new(false)).unwrap();
        let budget = march.with(|march| Budget::of(march).unwrap());
        println!("{budget:?}: {:.1e}", budget.defect());
        assert!(budget.bodies.abs() > 1e-2 * size(&budget));
        assert!(budget.defect().abs() < 1e-7 * size(&budget));
    }
}

/// What is left of the law with elasticity, over its largest line.
fn left(n: usize, step: f64) -> f64 {
    let mesh: Arc<_> = mesh(&format!("shape = \"square\"\nn = {n}"));
    let held = Hold::Held { velocity: [formula("0.3"), formula("0.1")], spin: formula("1.2") };
    let bodies = vec![round(0.15, [0.41, 0.47], held)];
    let model = around(&mesh, ACTIVE, &no_slip, bodies);
    let p = swirl(&model).values;
    let mut march = MovingMarch::start(model, settings(step, 2, ANDERSON), p, (2, None)).unwrap();
    while march.time() < 0.3 - 1e-9 {
        march.advance(0.3, &AtomicBool::new(false)).unwrap();
    }
    let budget = march.with(|march| Budget::of(march).unwrap());
    println!("n = {n}, Δt = {step}: {budget:?}, left {:.3e}", budget.defect());
    budget.defect().abs() / size(&budget)
}

#[test]
fn with_elasticity_the_law_closes_with_the_cells() {
    let rows = [6, 12, 24].map(|n| left(n, 0.03));
    println!("{}", shown(&rows));
    assert!(rows[1] < 0.4 * rows[0] && rows[2] < 0.4 * rows[1] && rows[2] < 5e-5);
}
