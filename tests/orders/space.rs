//! Orders in space alone, on uniform and on distorted meshes of the square: BDF4 from exact values, with steps so short
//! that halving them changes no order by more than 0.02.

use super::common::{Orders, run};
use monolayer::model::fields::{LAPLACIAN, POLARITY, PRESSURE, VELOCITY};

fn orders(k: usize, distortion: f64) -> Orders {
    let scene = std::fs::read_to_string("studies/mms/square.toml").unwrap();
    let level = |n: usize| {
        let sets = [
            ("space.k", k.to_string()),
            ("mesh.n", n.to_string()),
            ("mesh.distortion", distortion.to_string()),
            ("mesh.seed", "1".to_owned()),
            ("time.scheme", "bdf4".to_owned()),
            ("time.start", "exact".to_owned()),
            ("time.step", "0.0125".to_owned()),
            ("time.end", "0.25".to_owned()),
            ("coupling.tolerance", "1e-10".to_owned()),
        ];
        run(&scene, &sets)
    };
    Orders::new(&format!("P{}/P{k}/P{}, distortion {distortion}", k + 1, k + 2), [4, 8, 16].map(level).to_vec())
}

#[test]
fn taylor_hood_and_swip_are_optimal_on_uniform_meshes() {
    for k in [1, 2] {
        let best = k as f64 + 2.0;
        let bounds =
            [(VELOCITY, best - 0.15), (PRESSURE, best - 1.1), (POLARITY, best + 0.75), (LAPLACIAN, best - 1.1)];
        orders(k, 0.0).at_least(bounds);
    }
}

/// Meshes of different n are distorted independently, so that the worst cell, which makes the maximum, varies at
/// random.
#[test]
fn distortion_costs_no_order() {
    for k in [1, 2] {
        let best = k as f64 + 2.0;
        let bounds = [(VELOCITY, best - 0.4), (PRESSURE, best - 1.4), (POLARITY, best + 0.5), (LAPLACIAN, best - 1.2)];
        orders(k, 0.2).at_least(bounds);
    }
}
