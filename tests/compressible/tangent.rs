//! The derivative that Newton's method uses against differences of the equations; the factors of the coupled matrix
//! against it.

use crate::common::*;
use monolayer::model::compressible::Compressible;
use monolayer::model::fields::DENSITY;
use monolayer::model::lagged::Lagged;
use monolayer::model::terms::factor;
use monolayer::model::{DensityLaw, Parameters};
use monolayer::solve::multifrontal::Precision;
use monolayer::space::Field;
use monolayer::time::Phases;
use monolayer::time::equations::{Equations, Trial};
use monolayer::time::sheet::{Sheet, Weights};

const WEIGHTS: Weights = Weights { density: 2.1, polarity: 3.7 };

/// The equations of a step with a random past.
fn equations(model: &Compressible) -> Equations<'_> {
    Equations {
        model,
        inputs: Sheet::inputs(model, 0.3).unwrap(),
        before: Field::zero(&model.velocity),
        weights: WEIGHTS,
        history: random(model.carried_len(), 3),
    }
}

fn evaluate(equations: &Equations, y: Vec<f64>) -> Trial {
    equations.evaluate(y, &mut Phases::default()).unwrap()
}

/// Smooth fields with a disturbance in every coefficient, so that they jump from cell to cell.
fn disturbed(model: &Compressible) -> Vec<f64> {
    smooth(model).iter().zip(random(model.carried_len(), 17)).map(|(y, r)| y + 0.05 * r).collect()
}

/// The same with a density below zero at a point of every third cell.
fn limited(model: &Compressible) -> Vec<f64> {
    let mut y = disturbed(model);
    for cell in (0..model.loops.mesh.cells.len()).step_by(3) {
        y[cell * model.density.space.n] = -0.2 - 0.01 * cell as f64;
    }
    y
}

/// `(f(h) − f(−h))/2h`, with its error of order h² taken out.
fn difference(equations: &Equations, y: &[f64], d: &[f64]) -> Vec<f64> {
    let residual = |s: f64| evaluate(equations, y.iter().zip(d).map(|(y, d)| y + s * d).collect()).residual;
    let central =
        |h: f64| -> Vec<f64> { residual(h).iter().zip(residual(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect() };
    central(1e-4).iter().zip(central(2e-4)).map(|(a, b)| (4.0 * a - b) / 3.0).collect()
}

fn parameters() -> Parameters {
    let law = DensityLaw { penalty: 1.5, exponent: 2.5, critical: 0.3, active_stress_iso: 0.4 };
    Parameters { alignment: 0.7, density: Some(law), ..PARAMETERS }
}

/// With derivatives that mix the components across faces.
fn others() -> Parameters {
    let plain = parameters();
    let factors = factor::of_kind(plain.kind()).fold(plain.factors, |all, factor| all.with(factor.key, 0.7));
    Parameters { factors, ..plain }
}

fn sheets() -> Vec<(Compressible, &'static str)> {
    vec![
        (sheet(&square(2), parameters(), 1, closed), "closed"),
        (sheet(&square(2), parameters(), 1, channel), "open"),
        (sheet(&disc(), parameters(), 1, closed), "curved"),
        (sheet(&square(2), parameters(), 2, channel), "open, degree 2"),
        (sheet(&disc(), Parameters { elasticity: 0.0, ..parameters() }, 2, closed), "curved, without elasticity"),
        (sheet(&square(2), others(), 1, channel), "terms of other models"),
    ]
}

#[test]
fn the_derivative_is_that_of_the_equations() {
    for (model, name) in sheets() {
        let equations = equations(&model);
        for (y, limits) in [(disturbed(&model), false), (limited(&model), true)] {
            let trial = evaluate(&equations, y.clone());
            let cells = trial.evaluated.as_ref().unwrap().limited.cells;
            assert_eq!(cells > 0, limits, "{name}: {cells} cells are limited");
            let (low, high) = (least(&model, &trial.state[DENSITY]), largest(&trial.state[DENSITY].values));
            assert!(limits || low > 0.3 && high < 2.0, "{name}: {low} to {high}");
            let tangent = model.tangent(&equations, &trial, WEIGHTS);
            let (count, first) = (y.len(), model.density.space.dof_count());
            // both fields at once, then each of them alone
            for (seed, range) in [(1, 0..count), (2, 0..count), (3, 0..first), (4, first..count)] {
                let mut d = vec![0.0; count];
                d[range.clone()].copy_from_slice(&random(range.len(), 40 + seed));
                let mut image = vec![0.0; count];
                tangent.times(&d, &mut image).unwrap();
                let expected = difference(&equations, &y, &d);
                for part in [0..first, first..count] {
                    let scale = largest(&expected[part.clone()]);
                    let error = largest(&minus(&image[part.clone()], &expected[part.clone()])) / scale;
                    println!(
                        "{name}, limited {cells}, direction {seed}, rows {part:?}: {scale:.2e}, error {error:.1e}"
                    );
                    assert!(
                        error < 1e-8 && scale > 1e-2,
                        "{name}: rows {part:?} are off by {error:.1e} of {scale:.1e}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_factors_of_the_coupled_matrix_invert_the_derivative() {
    for (model, name) in sheets() {
        let equations = equations(&model);
        for y in [disturbed(&model), limited(&model)] {
            let trial = evaluate(&equations, y);
            let tangent = model.tangent(&equations, &trial, WEIGHTS);
            let lagged =
                Lagged::new(Sheet::structure(&model).unwrap(), &*tangent.elements(), Precision::Double).unwrap();
            let x = random(model.carried_len(), 8);
            let mut image = vec![0.0; x.len()];
            tangent.times(&x, &mut image).unwrap();
            lagged.solve(&mut image);
            let error = largest(&minus(&image, &x));
            println!("{name}: {error:.1e}");
            assert!(error < 1e-7, "{name}: {error:.1e}");
        }
    }
}

#[test]
fn other_weights_than_those_of_the_equations_are_those_of_the_newest_level() {
    // R′(w) − R′(w₀) is what multiplies ∂_t y at the state, times the difference of the weights
    let model = sheet(&square(2), parameters(), 1, channel);
    let equations = equations(&model);
    let trial = evaluate(&equations, disturbed(&model));
    let times = |weights: Weights, d: &[f64]| {
        let mut out = vec![0.0; d.len()];
        model.tangent(&equations, &trial, weights).times(d, &mut out).unwrap();
        out
    };
    let d = random(model.carried_len(), 5);
    let more = Weights { density: WEIGHTS.density + 1.0, polarity: WEIGHTS.polarity + 1.0 };
    let found = minus(&times(more, &d), &times(WEIGHTS, &d));
    let expected = model.inertia_times(&trial.state, &d);
    let error = largest(&minus(&found, &expected)) / largest(&expected);
    assert!(error < 1e-11, "{error:.1e}");
}
