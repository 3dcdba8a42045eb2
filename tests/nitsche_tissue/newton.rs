//! Newton's method around bodies, and the factors that it is preconditioned by.

use monolayer::body::{Body, Hold};
use monolayer::model::fields::{POLARITY, VELOCITY};
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::model::lagged::{Lagged, Parts};
use monolayer::model::tangent::Tangent;
use monolayer::solve::krylov::gmres;
use monolayer::solve::multifrontal::Precision;
use monolayer::space::Field;
use monolayer::time::{CouplingKind, March};

use crate::common::*;
use crate::setting::*;

const WEIGHT: f64 = 5.0;

/// The residual of an implicit step from a polarity, and the state with the flow that follows.
fn residual(model: &Incompressible, p: &[f64], from: &[f64]) -> (State, Vec<f64>) {
    let p = Field::new(&model.polarity.space, p.to_vec());
    let (v, pi) = model.flow(&p, 0.0).unwrap();
    let state = State::incompressible(v, pi, p);
    let mut r = model.polarity_residual(&state, 0.0);
    let rate: Vec<f64> = state[POLARITY].values.iter().zip(from).map(|(p, q)| WEIGHT * (p - q)).collect();
    let inertia = model.polarity.inertia_times(&rate);
    r.iter_mut().zip(inertia).for_each(|(r, m)| *r += model.parameters.peclet * m);
    (state, r)
}

fn cases() -> Vec<Vec<Body>> {
    let pair = |hold: fn() -> Hold| vec![round(0.15, [0.33, 0.42], hold()), capsule([0.68, 0.61], 0.7, hold())];
    vec![pair(|| Hold::Free), pair(|| Hold::Fixed)]
}

#[test]
fn newtons_method_converges_quadratically_around_bodies() {
    for bodies in cases() {
        let model = around(&square(6), with_factors(), &slip, bodies);
        let start = swirl(&model).values;
        let (mut p, mut sizes, mut products) = (start.clone(), Vec::<f64>::new(), Vec::new());
        for _ in 0..8 {
            let (state, r) = residual(&model, &p, &start);
            let size = dot(&r, &r).sqrt();
            sizes.push(size);
            if size < 1e-12 * sizes[0] {
                break;
            }
            let tangent = Tangent::new(&model, &state, &state[VELOCITY], WEIGHT, 0.0);
            let factors = Lagged::new(model.structure().unwrap(), &Parts::new(&tangent), Precision::Double).unwrap();
            let right: Vec<f64> = r.iter().map(|r| -r).collect();
            let mut step = vec![0.0; p.len()];
            let apply = |x: &[f64], y: &mut [f64]| tangent.times(x, y).unwrap();
            let precondition = |x: &mut [f64]| factors.solve(x);
            let outcome = gmres(&apply, &precondition, &right, &mut step, 1e-8 * size, 100);
            assert!(outcome.converged);
            products.push(outcome.iterations);
            p.iter_mut().zip(&step).for_each(|(p, s)| *p += s);
        }
        println!("residuals {}, products {products:?}", shown(&sizes));
        let quadratic = |k: usize| sizes[k + 1] < 3.0 * sizes[k].powi(2) / sizes[0] || sizes[k + 1] < 1e-10 * sizes[0];
        assert!((0..sizes.len() - 1).all(quadratic) && sizes.last().unwrap() < &(1e-10 * sizes[0]), "{sizes:?}");
        assert!(products.iter().all(|count| *count <= 30), "the factors come near the inverse: {products:?}");
    }
}

#[test]
fn newton_and_the_fixed_point_take_the_same_step() {
    let [newton, turns] = [CouplingKind::Newton, ANDERSON].map(|kind| {
        let bodies = cases().remove(1);
        let model = around(&square(5), with_factors(), &slip, bodies);
        let start = swirl(&model).values;
        let mut march = March::start(&model, settings(0.02, 2, kind), start).unwrap();
        for _ in 0..3 {
            march.advance(1e9).unwrap();
        }
        march.state[POLARITY].values.clone()
    });
    let far = newton.iter().zip(&turns).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
    println!("{far:.1e} apart");
    assert!(far < 1e-7);
}
