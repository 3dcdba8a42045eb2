//! The spectrum against that of finite differences of the residual.

use crate::common::*;
use crate::spectrum::steady;
use monolayer::model::fields::{POLARITY, VELOCITY};
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::time::Phases;
use monolayer::time::equations::Equations;
use nalgebra::{Complex, DMatrix};

/// `−M⁻¹R′/Pe` by central differences, column by column; the upwind directions of the energy-consistent force stay
/// those of the state.
fn differences(model: &Incompressible, state: &State) -> DMatrix<f64> {
    let equations = Equations::stationary(model, &state[VELOCITY], 0.0).unwrap();
    let residual = |p: Vec<f64>| equations.evaluate(p, &mut Phases::default()).unwrap().residual;
    let (n, h) = (state[POLARITY].values.len(), 1e-5);
    let mut matrix = DMatrix::zeros(n, n);
    for j in 0..n {
        let shifted = |s: f64| {
            let mut p = state[POLARITY].values.clone();
            p[j] += s;
            residual(p)
        };
        let (up, down) = (shifted(h), shifted(-h));
        let column: Vec<f64> = up.iter().zip(down).map(|(u, d)| (u - d) / (2.0 * h)).collect();
        for (i, value) in model.polarity.mass_solve(&column).into_iter().enumerate() {
            matrix[(i, j)] = -value / model.parameters.peclet;
        }
    }
    matrix
}

#[test]
fn the_spectrum_is_that_of_finite_differences_for_both_elastic_forces() {
    let mut leading = Vec::new();
    for (force, factor) in [("stress", "0"), ("energy-consistent", "0"), ("stress", "0.7")] {
        let (scene, setup) = Square::new()
            .sides("velocity", "{ dirichlet = [\"y\", \"x/2\"] }")
            .set("boundary.right.velocity", "\"traction\"")
            .set("boundary.left.polarity", "{ dirichlet = [\"1\", \"y\"] }")
            .set("initial.polarity", "[\"1\", \"y\"]")
            .set("mesh.n", "2")
            .set("model.elasticity", "0.8")
            .set("model.active_stress", "0.5")
            .set("model.traction", "0.6")
            .set("model.elastic_force", &format!("\"{force}\""))
            .set("model.self_advection", factor)
            .setup();
        let model = model_of(&setup);
        let rest = steady(&scene, model);
        let found = spectrum_of(model, &rest, 8);
        let mut dense: Vec<Complex<f64>> = differences(model, &rest).complex_eigenvalues().iter().copied().collect();
        dense.retain(|value| value.im >= -1e-9);
        dense.sort_by(|a, b| b.re.total_cmp(&a.re));
        println!("{:?}\n{:?}", values(&found.modes), &dense[..8]);
        for (mode, exact) in found.modes.iter().zip(&dense).take(6) {
            assert!((mode.value - exact).norm() < 1e-5, "{force}: {} instead of {exact}", mode.value);
            assert!(mode.residual < 1e-6, "{force}: {}", mode.residual);
        }
        leading.push(found.modes[0].value.re);
    }
    assert!((leading[0] - leading[1]).abs() > 1e-4, "the forces differ: {leading:?}");
    assert!((leading[0] - leading[2]).abs() > 1e-4, "polarity carries itself along: {leading:?}");
}
