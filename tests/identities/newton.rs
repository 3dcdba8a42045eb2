//! The derivative that Newton's method uses, against finite differences; the factors of the coupled matrix against it.

use std::sync::Arc;

use crate::common::*;
use crate::model::{PARAMETERS, formula};
use monolayer::mesh::Mesh;
use monolayer::model::fields::{POLARITY, PRESSURE, VELOCITY};
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::model::lagged::{Lagged, Parts, Structure};
use monolayer::model::parameters::PolarityForm;
use monolayer::model::tangent::Tangent;
use monolayer::model::terms::factor;
use monolayer::model::{Conditions, Description, ElasticForce, Parameters, VelocityCondition};
use monolayer::solve::multifrontal::Precision;
use monolayer::space::Field;

/// Dirichlet at the left with a polarity that flows in, slip with Dirichlet polarity below, traction at the right, slip
/// above.
fn mixed(tag: &str) -> Conditions {
    let data = || [formula("0.7 + y"), formula("x - 0.2")];
    match tag {
        "left" => Conditions::flow([formula("1 + y"), formula("0.3")]).with_polarity(data()),
        "bottom" => Conditions::slip().with_polarity(data()),
        "right" => Conditions::new(VelocityCondition::Traction([formula("0.1"), formula("y")])),
        _ => Conditions::slip(),
    }
}

fn curved() -> Arc<Mesh> {
    mesh("shape = \"disc\"\nh = 0.9")
}

/// A state whose flow crosses no face at exactly zero speed, and which solves nothing.
fn state(model: &Incompressible, seed: u64) -> State {
    let p = random(&model.polarity.space, seed);
    State::incompressible(random(&model.momentum.velocity, seed + 1), random(&model.momentum.pressure, seed + 2), p)
}

fn cases() -> Vec<(Incompressible, &'static str)> {
    let kinds = [ElasticForce::Stress, ElasticForce::Energy];
    let build = |mesh: &Arc<Mesh>, elastic_force, condition: fn(&str) -> Conditions| {
        let parameters = Parameters { elastic_force, form: PolarityForm::Direct, ..PARAMETERS };
        Incompressible::new(mesh, &Description::new(mesh, parameters, condition)).expect("the model builds")
    };
    let on = |kind| {
        [(build(&square(2), kind, mixed), "mixed"), (build(&curved(), kind, |_| Conditions::slip()), "closed, curved")]
    };
    // derivatives that mix the components across faces
    let factors = factor::of_kind(PARAMETERS.kind()).fold(PARAMETERS.factors, |all, factor| all.with(factor.key, 0.7));
    let parameters = Parameters { factors, form: PolarityForm::Direct, ..PARAMETERS };
    let others =
        Incompressible::new(&square(2), &Description::new(&square(2), parameters, mixed)).expect("the model builds");
    kinds.into_iter().flat_map(on).chain([(others, "terms of other models")]).collect()
}

/// Central difference of `f` along unit vector `j` at `x`.
fn difference(f: &dyn Fn(&[f64]) -> Vec<f64>, x: &[f64], j: usize) -> Vec<f64> {
    let h = 1e-5;
    let shifted = |s: f64| {
        let mut y = x.to_vec();
        y[j] += s * h;
        f(&y)
    };
    shifted(1.0).iter().zip(shifted(-1.0)).map(|(a, b)| (a - b) / (2.0 * h)).collect()
}

#[track_caller]
fn compare(exact: &[f64], differences: &[f64], scale: f64, what: &str) {
    for (i, (a, b)) in exact.iter().zip(differences).enumerate() {
        assert!((a - b).abs() < 2e-8 * scale, "{what}: entry {i} is {a}, difference {b}, scale {scale}");
    }
}

#[test]
fn every_entry_of_the_derivative_is_that_of_the_equations() {
    for (model, name) in cases() {
        let now = state(&model, 11);
        let (t, w) = (0.3, 2.5);
        let tangent = Tangent::new(&model, &now, &now[VELOCITY], w, t);
        let inputs = model.inputs(t).unwrap();
        let kind = model.parameters.elastic_force;
        let unit = |n: usize, j: usize| (0..n).map(|i| f64::from(u8::from(i == j))).collect::<Vec<f64>>();
        let np = now[POLARITY].values.len();
        let force =
            |p: &[f64]| model.force(&Field::new(&now[POLARITY].space, p.to_vec()), &now[VELOCITY], &inputs).flow;
        let equation = |v: &[f64], p: &[f64]| {
            let p = Field::new(&now[POLARITY].space, p.to_vec());
            let v = Field::new(&now[VELOCITY].space, v.to_vec());
            let mut r = model.polarity_residual(&State::incompressible(v, now[PRESSURE].clone(), p.clone()), t);
            let mass = model.polarity.mass_times(&p.values);
            r.iter_mut().zip(mass).for_each(|(r, m)| *r += model.parameters.peclet * w * m);
            r
        };
        let mut largest = [0.0_f64; 3];
        for j in 0..np {
            let column = tangent.force_of(&unit(np, j)).flow;
            compare(
                &column,
                &difference(&force, &now[POLARITY].values, j),
                100.0,
                &format!("F' {kind:?} {name} column {j}"),
            );
            largest[0] = column.iter().fold(largest[0], |m, v| m.max(v.abs()));
            let mut column = vec![0.0; np];
            tangent.operator.times(&unit(np, j), &mut column);
            let differences = difference(&|p: &[f64]| equation(&now[VELOCITY].values, p), &now[POLARITY].values, j);
            compare(&column, &differences, 10.0, &format!("J_pp {kind:?} {name} column {j}"));
            largest[1] = column.iter().fold(largest[1], |m, v| m.max(v.abs()));
        }
        for j in 0..now[VELOCITY].values.len() {
            let column = tangent.drag_of(&unit(now[VELOCITY].values.len(), j));
            let differences = difference(&|v: &[f64]| equation(v, &now[POLARITY].values), &now[VELOCITY].values, j);
            compare(&column, &differences, 10.0, &format!("D {kind:?} {name} column {j}"));
            largest[2] = column.iter().fold(largest[2], |m, v| m.max(v.abs()));
        }
        assert!(largest.iter().all(|l| *l > 0.1), "all blocks are there: {largest:?}");
    }
}

#[test]
fn the_factors_of_the_coupled_matrix_invert_the_derivative() {
    for (model, name) in cases() {
        if model.parameters.elastic_force != ElasticForce::Stress {
            continue;
        }
        let now = state(&model, 5);
        let tangent = Tangent::new(&model, &now, &now[VELOCITY], 4.0, 0.0);
        let x = random(&now[POLARITY].space, 8).values;
        // in single precision to the digits that it has, less what the condition of the matrix takes
        for (precision, bound) in [(Precision::Double, 1e-8), (Precision::Single, 1e-2)] {
            let structure = Structure::new("coupled", &model.layout()).unwrap();
            let lagged = Lagged::new(&structure, &Parts::new(&tangent), precision).unwrap();
            let mut y = vec![0.0; x.len()];
            tangent.times(&x, &mut y).unwrap();
            lagged.solve(&mut y);
            let worst = x.iter().zip(&y).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            println!("{name}, {precision:?}: {worst:.1e}");
            assert!(worst < bound, "{name}, {precision:?}: {worst}");
        }
    }
}
