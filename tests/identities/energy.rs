//! The semi-discrete energy law, term by term.

use std::sync::Arc;

use crate::common::*;
use crate::model::{PARAMETERS, settings};
use monolayer::measure::budget::Budget;
use monolayer::mesh::Mesh;
use monolayer::model::fields::{POLARITY, PRESSURE, VELOCITY};
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::model::{Conditions, Description, ElasticForce, Parameters};
use monolayer::space::Field;
use monolayer::time::{CouplingKind, March};

/// What the law `dF_h/dt + C_F‖v‖² + 2‖D(v)‖² + ‖L_h‖²/(Pe B) = T_a(p|v) + S_a δ(p,p,v)` leaves, relative to its
/// largest term.
fn defect(model: &Incompressible, p: &Field) -> f64 {
    let m = &model.parameters;
    let inputs = model.inputs(0.0).unwrap();
    let mut v = model.zero().into_field(VELOCITY);
    // the force looks upstream: repeat until the directions are those of the flow itself
    let mut pi = model.zero().into_field(PRESSURE);
    for _ in 0..60 {
        let (next, pressure) = model.flow_of(&model.force(p, &v, &inputs), &inputs).unwrap();
        let change: f64 = next.values.iter().zip(&v.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        (v, pi) = (next, pressure);
        if change == 0.0 {
            break;
        }
    }
    let l = model.molecular(p, &v, 0.0).unwrap();
    let state = State::incompressible(v, pi, p.clone());
    let rate: Vec<f64> = model.polarity_residual(&state, 0.0).iter().map(|r| -r / m.peclet).collect();
    let gain = m.elasticity * dot(&l.values, &rate);
    let (v, p) = (&state[VELOCITY], &state[POLARITY]);
    let friction = model.loops.sum(4, |x| m.friction * v.vector(&x.site).norm_squared());
    let viscous = model.loops.sum(2, |x| {
        let g = v.vector_gradient(&x.site);
        2.0 * ((g + g.transpose()) * 0.5).norm_squared()
    });
    let relaxation = m.elasticity * dot(&model.polarity.mass_times(&l.values), &l.values) / m.peclet;
    let activity = model.loops.sum(8, |x| {
        let (p, g) = (p.vector(&x.site), v.vector_gradient(&x.site));
        m.traction * p.dot(&v.vector(&x.site)) + m.active_stress * p.dot(&((g + g.transpose()) * 0.5 * p))
    });
    println!("{gain:.4e} {friction:.4e} {viscous:.4e} {relaxation:.4e} {activity:.4e}");
    let largest = [gain, friction, viscous, relaxation, activity].iter().fold(0.0_f64, |m, t| m.max(t.abs()));
    (gain + friction + viscous + relaxation - activity).abs() / largest
}

#[test]
fn the_energy_consistent_force_obeys_the_law_to_rounding_for_any_polarity() {
    for mesh in [square(3), disc()] {
        for seed in 0..3 {
            let of = |elastic_force| {
                let parameters = Parameters { elastic_force, ..PARAMETERS };
                let model =
                    Incompressible::new(&mesh, &Description::new(&mesh, parameters, |_| Conditions::slip())).unwrap();
                defect(&model, &random(&model.polarity.space, seed))
            };
            let (exact, stress) = (of(ElasticForce::Energy), of(ElasticForce::Stress));
            println!("energy-consistent {exact:.1e}, stress {stress:.1e}");
            assert!(exact < 1e-12 && stress > 1e-3, "energy-consistent {exact:.1e}, stress {stress:.1e}");
        }
    }
}

/// A passive tissue in a closed domain from a rough random start: its free energies and the terms of the law, step by
/// step.
fn relax(mesh: &Arc<Mesh>, elastic_force: ElasticForce, seed: u64, amplitude: f64) -> Vec<(f64, f64, f64)> {
    let parameters = Parameters { elastic_force, traction: 0.0, active_stress: 0.0, ..PARAMETERS };
    let model = Incompressible::new(mesh, &Description::new(mesh, parameters, |_| Conditions::slip())).unwrap();
    let mut start = random(&model.polarity.space, seed);
    start.values.iter_mut().for_each(|v| *v *= amplitude);
    let mut settings = settings(1e-3, 1);
    settings.coupling.kind = CouplingKind::Newton;
    settings.coupling.tolerance = 1e-9;
    settings.coupling.accept = 1e-8;
    let mut march = March::start(&model, settings, start.values).unwrap();
    let mut rows = vec![(march.energy().0, 0.0, 0.0)];
    for _ in 0..25 {
        march.advance(1e9).expect("the step converges");
        let budget = Budget::of(&march).unwrap();
        let dissipation = budget.relaxation + budget.line("budget_viscosity") + budget.line("budget_friction");
        rows.push((march.energy().0, budget.defect(), dissipation));
    }
    rows
}

#[test]
fn a_closed_tissue_without_activity_never_gains_energy() {
    for mesh in [square(3), disc()] {
        for (seed, amplitude) in [(1, 0.1), (2, 1.0), (3, 3.0)] {
            let rows = relax(&mesh, ElasticForce::Energy, seed, amplitude);
            for (k, pair) in rows.windows(2).enumerate() {
                assert!(pair[1].0 <= pair[0].0, "amplitude {amplitude}, step {k}: {:e} to {:e}", pair[0].0, pair[1].0);
            }
            let (first, last) = (rows[0].0, rows[rows.len() - 1].0);
            assert!(last < 0.9 * first, "it relaxes: {first} to {last}");
            for (_, defect, dissipation) in &rows[1..] {
                assert!(defect.abs() < 1e-5 * dissipation, "the law leaves {defect:e} of {dissipation:e}");
            }
        }
    }
}

/// With the energy-consistent force the lines of all terms that give or take energy close the law, those of other
/// models among them.
#[test]
fn the_law_has_a_line_for_every_power() {
    let plain = Parameters { elastic_force: ElasticForce::Energy, ..PARAMETERS };
    let keys = [("self_advection", 0.8), ("flow_alignment", 800.0)];
    for given in [None, Some(keys[0]), Some(keys[1])] {
        let factors = given.map_or(plain.factors, |(key, factor)| plain.factors.with(key, factor));
        let mesh = square(3);
        let parameters = Parameters { factors, ..plain };
        let model = Incompressible::new(&mesh, &Description::new(&mesh, parameters, |_| Conditions::slip())).unwrap();
        let p = random(&model.polarity.space, 5);
        let inputs = model.inputs(0.0).unwrap();
        let (mut v, mut pi) = (model.zero().into_field(VELOCITY), model.zero().into_field(PRESSURE));
        for _ in 0..60 {
            (v, pi) = model.flow_of(&model.force(&p, &v, &inputs), &inputs).unwrap();
        }
        let state = State::incompressible(v, pi, p);
        let residual = model.polarity_residual(&state, 0.0);
        let rate: Vec<f64> = residual.iter().map(|r| -r / model.parameters.peclet).collect();
        let budget = Budget::at(&model, &state, &model.polarity.mass_solve(&rate), 0.0).unwrap();
        let largest = budget.lines.iter().fold(budget.relaxation, |m, line| m.max(line.abs()));
        println!("{budget:?}");
        assert!(budget.defect().abs() < 1e-11 * largest, "the law leaves {:e} of {largest:e}", budget.defect());
        for (key, factor) in keys {
            let line = budget.line(&format!("budget_{key}"));
            let has = given == Some((key, factor));
            assert!(if has { line.abs() > 1e-3 * largest } else { line == 0.0 }, "{key} has {line:e}");
        }
    }
}
