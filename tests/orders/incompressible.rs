//! The shipped manufactured case in space and time together: P2/P1/P3, BDF2 from one step of BDF1, Δt = 1/(3n).

use monolayer::measure::errors::Norm;
use monolayer::model::fields::{FieldId, LAPLACIAN, POLARITY, PRESSURE, VELOCITY};

use super::common::{Orders, run};

const SCENE: &str = include_str!("../../studies/mms/square.toml");

/// L²(L²) errors of an independent program (Newton, the same spaces and steps) at n = 8 and 16.
const INDEPENDENT: [(FieldId, [f64; 2]); 4] = [
    (VELOCITY, [5.26e-4, 6.27e-5]),
    (PRESSURE, [4.56e-3, 8.88e-4]),
    (POLARITY, [1.47e-4, 2.51e-5]),
    (LAPLACIAN, [1.70e-2, 4.11e-3]),
];

#[test]
fn the_manufactured_case_is_of_optimal_order_and_as_accurate_as_an_independent_program() {
    let level = |n: usize| run(SCENE, &[("mesh.n", n.to_string()), ("time.step", (1.0 / (3 * n) as f64).to_string())]);
    let found = Orders::new("incompressible, n = 8, 16", vec![level(8), level(16)]);
    for (field, errors) in INDEPENDENT {
        for ((_, history), reference) in found.runs.iter().zip(errors) {
            let ratio = history.error(field, Norm::Square) / reference;
            assert!((0.85..1.15).contains(&ratio), "{}: {ratio:.3} times {reference:e}", field.name);
        }
    }
    found.at_least([(VELOCITY, 2.8), (PRESSURE, 1.95), (POLARITY, 1.95), (LAPLACIAN, 1.95)]);
}

#[test]
fn the_energy_consistent_force_keeps_the_orders_and_costs_accuracy() {
    let level = |n: usize, force: &str| {
        let sets = [
            ("mesh.n", n.to_string()),
            ("time.step", (1.0 / (3 * n) as f64).to_string()),
            ("time.end", "0.5".to_owned()),
            ("model.elastic_force", force.to_owned()),
        ];
        run(SCENE, &sets)
    };
    let of = |force: &str| Orders::new(force, [8, 16].map(|n| level(n, force)).to_vec());
    let (stress, energy) = (of("stress"), of("energy-consistent"));
    // Ψ is part of the multiplier, which P1 resolves less well than Π
    let ratio = |field| energy.last(field, Norm::Square) / stress.last(field, Norm::Square);
    energy.at_least([(VELOCITY, 2.8), (PRESSURE, 1.95), (POLARITY, 1.95), (LAPLACIAN, 1.95)]);
    let (v, pi, p) = (ratio(VELOCITY), ratio(PRESSURE), ratio(POLARITY));
    println!("energy-consistent over stress: v {v:.1}, Π {pi:.0}, p {p:.2}");
    assert!((1.2..4.0).contains(&v) && (30.0..200.0).contains(&pi) && p < 1.2, "v {v}, Π {pi}, p {p}");
}
