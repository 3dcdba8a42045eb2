//! The free energy of passive tissue, and its rate.

use crate::common::*;
use monolayer::measure::Budget;
use monolayer::model::compressible::Compressible;
use monolayer::model::fields::POLARITY;
use monolayer::model::{DensityLaw, Parameters};
use monolayer::time::sheet::Sheet;
use monolayer::time::{CouplingKind, March};

/// Tissue that nothing drives.
fn passive(penalty: f64, exponent: f64, critical: f64) -> Compressible {
    let law = DensityLaw { penalty, exponent, critical, active_stress_iso: 0.0 };
    let parameters = Parameters { traction: 0.0, active_stress: 0.0, density: Some(law), ..PARAMETERS };
    sheet(&square(2), parameters, 1, closed)
}

/// Independent coefficients: polarity in [−1, 1], density in [0.2, 2].
fn rough(model: &Compressible, seed: u64) -> Vec<f64> {
    let mut y = random(model.carried_len(), seed);
    y[..model.density.space.dof_count()].iter_mut().for_each(|r| *r = 1.1 + 0.9 * *r);
    y
}

#[test]
fn closed_tissue_without_activity_never_gains_energy() {
    let mut grown = Vec::new();
    for penalty in [0.0, 1.0, 100.0] {
        // without a penalty its exponent does not matter
        let exponents: &[f64] = if penalty == 0.0 { &[1.0] } else { &[1.0, 3.0] };
        for &exponent in exponents {
            for critical in [0.0, 0.5] {
                let model = passive(penalty, exponent, critical);
                let mut march =
                    March::start(&model, settings(2e-3, 1, CouplingKind::Newton), rough(&model, 1)).unwrap();
                let first = march.energy().0;
                let (mut last, mut most) = (first, 0.0_f64);
                for step in 1..=200 {
                    march.advance(1e9).unwrap();
                    let now = march.energy().0;
                    if now > last {
                        grown.push((penalty, exponent, critical, step, (now - last) / first));
                    }
                    most = most.max(now - last);
                    last = now;
                }
                println!(
                    "c_0 {penalty}, γ {exponent}, ρ_min {critical}: F {first:.4} to {last:.4}, at most {most:+.1e}, \
                     {:?}",
                    march.counts
                );
                assert!(last < 0.9 * first, "it relaxes: {first} to {last}");
            }
        }
    }
    for case in &grown {
        println!("c_0, γ, ρ_min, step, growth: {case:?}");
    }
    assert!(grown.is_empty(), "the energy grew in {} steps, first in {:?}", grown.len(), grown[0]);
}

#[test]
fn the_rate_of_the_energy_is_that_of_its_differences() {
    for (penalty, exponent, critical) in [(0.0, 1.0, 0.5), (1.0, 3.0, 0.5), (1.0, 0.0, 0.0), (100.0, 1.0, 0.0)] {
        let model = passive(penalty, exponent, critical);
        let errors = [4e-4, 2e-4].map(|dt| {
            let mut march = March::start(&model, settings(dt, 2, CouplingKind::Newton), smooth(&model)).unwrap();
            let mut rows = Vec::new();
            for _ in 0..(0.02 / dt).round() as usize {
                march.advance(1e9).unwrap();
                rows.push((march.t, march.energy()));
            }
            // (F(t+Δt) − F(t−Δt))/2Δt at the middle of the last three
            let [a, b, c] = [rows.len() - 3, rows.len() - 2, rows.len() - 1].map(|k| rows[k]);
            let difference = (c.1.0 - a.1.0) / (c.0 - a.0);
            println!("c_0 {penalty}, γ {exponent}, ρ_min {critical}, Δt {dt}: {} and {difference}", b.1.1);
            assert!(difference < -1e-2, "it relaxes: {difference}");
            (b.1.1 / difference - 1.0).abs()
        });
        println!("{errors:?}");
        assert!(errors[1] < 2e-4 && errors[1] < errors[0] / 3.8, "of second order: {errors:?}");
    }
}

#[test]
fn the_rate_of_the_energy_is_its_derivative_along_the_rates() {
    // at one state, without a time step: F along ∂_t ρ = −M⁻¹ transport, and along any ∂_t p
    for (penalty, exponent, critical) in [(1.0, 3.0, 0.5), (1.5, 2.5, 0.3)] {
        let model = passive(penalty, exponent, critical);
        let y: Vec<f64> =
            smooth(&model).iter().zip(random(model.carried_len(), 2)).map(|(y, r)| y + 0.05 * r).collect();
        let state = Sheet::state_of(&model, &y, 0.0).unwrap();
        let rate_of_p = random(state[POLARITY].values.len(), 3);
        let rate = model.stacked(&model.density_rate(&state, 0.0).unwrap().values, &rate_of_p);
        let energy = |s: f64| {
            let moved: Vec<f64> = y.iter().zip(&rate).map(|(y, r)| y + s * r).collect();
            let moved = model.with_carried(&state, &moved).unwrap();
            model.free_energy(&moved, 0.0)
        };
        let central = |h: f64| (energy(h) - energy(-h)) / (2.0 * h);
        let expected = (4.0 * central(1e-3) - central(2e-3)) / 3.0;
        let found = model.energy_rate(&state, &rate_of_p, 0.0);
        println!("{found} {expected}");
        assert!((found / expected - 1.0).abs() < 1e-8, "{found} {expected}");
    }
}

/// What the energy law leaves on a mesh of 2n² cells, and the line of a term, over the largest line.
fn left_by_the_law(n: usize, (key, factor): (&str, f64)) -> [f64; 2] {
    let law = DensityLaw { penalty: 1.0, exponent: 1.0, critical: 0.3, active_stress_iso: 0.0 };
    let factors = PARAMETERS.factors.with(key, factor);
    let model = sheet(&square(n), Parameters { density: Some(law), factors, ..PARAMETERS }, 2, closed);
    let mut march = March::start(&model, settings(5e-4, 2, CouplingKind::Newton), smooth(&model)).unwrap();
    for _ in 0..4 {
        march.advance(1e9).unwrap();
    }
    let budget = Budget::of(&march).unwrap();
    let largest = budget.lines.iter().fold(budget.relaxation, |m, line| m.max(line.abs()));
    [budget.defect(), budget.line(&format!("budget_{key}"))].map(|power| power.abs() / largest)
}

/// The line of a term closes the law up to the error of the elements, as the lines of all others do.
#[test]
fn lines_of_terms_of_other_models_close_the_law() {
    for (key, factor) in [("self_advection", 0.8), ("flow_alignment", 20.0)] {
        let [coarse, fine] = [4, 8].map(|n| left_by_the_law(n, (key, factor)));
        println!("{key}: {coarse:?} {fine:?}");
        assert!(fine[1] > 1e-2, "{key}: the line is {:e}", fine[1]);
        assert!(fine[0] < coarse[0] / 4.0 && fine[0] < 1e-2 * fine[1], "{key}: {coarse:?} became {fine:?}");
    }
}
