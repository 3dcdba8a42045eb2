//! Orders on a disc with the homogeneous conditions of slip and `∂p/∂n = 0` on its circle, which the exact fields meet:
//! what curved cells are worth.

use monolayer::measure::errors::Norm;
use monolayer::mesh::Point;
use monolayer::model::fields::{LAPLACIAN, POLARITY, PRESSURE, VELOCITY};
use monolayer::scene::{Scene, SceneSource};

use super::common::{Orders, run};

const SCENE: &str = "studies/mms/disc.toml";

fn orders(k: usize, curved: usize) -> Orders {
    let scene = std::fs::read_to_string(SCENE).unwrap();
    let level = |n: f64| {
        let sets = [
            ("space.k", k.to_string()),
            ("mesh.h", (1.0 / n).to_string()),
            ("mesh.curved", curved.to_string()),
            ("time.end", "0.15".to_owned()),
        ];
        run(&scene, &sets)
    };
    Orders::new(&format!("P{}/P{k}/P{}, cells of degree {curved}", k + 1, k + 2), [3.0, 6.0, 12.0].map(level).to_vec())
}

#[test]
fn the_exact_fields_meet_the_homogeneous_conditions_on_the_circle() {
    let scene = Scene::check(SceneSource::read(SCENE.as_ref()).unwrap()).unwrap();
    let exact = scene.sources.exact.as_ref().unwrap();
    let parameters = &scene.parameters;
    let mut largest: [f64; 4] = [0.0; 4];
    for turn in 0..100 {
        let (sin, cos) = (turn as f64 * 0.0628).sin_cos();
        let (n, t) = (Point::new(cos, sin), Point::new(-sin, cos));
        for time in [0.0, 0.1, 0.3] {
            let sizes = [
                exact.at(n, time).velocity.dot(&n),
                exact.traction(parameters, n, time, n).dot(&t),
                exact.polarity_slope(n, time, n).norm(),
                exact.divergence(0.7 * n, time),
            ];
            for (worst, size) in largest.iter_mut().zip(sizes) {
                *worst = worst.max(size.abs());
            }
        }
    }
    assert!(largest.iter().all(|worst| *worst < 1e-13), "v·n, (n·σ)·t, |∂p/∂n|, div v: {largest:?}");
}

#[test]
fn straight_cells_are_of_second_order_and_curved_cells_optimal() {
    let straight = orders(1, 1);
    for field in [VELOCITY, PRESSURE, POLARITY] {
        let order = straight.least(field);
        assert!((1.7..2.3).contains(&order), "straight: {} has order {order:.2}", field.name);
    }
    for curved in [2, 3] {
        let found = orders(1, curved);
        found.at_least([(VELOCITY, 2.7), (PRESSURE, 1.9), (POLARITY, 3.8), (LAPLACIAN, 1.7)]);
        let gain = straight.last(POLARITY, monolayer::measure::errors::Norm::Square)
            / found.last(POLARITY, monolayer::measure::errors::Norm::Square);
        assert!(gain > 100.0, "cells of degree {curved} gain a factor {gain}");
    }
}

/// From P3 velocities on, the order of the pressure hangs on where slip is imposed: at evenly spaced nodes it is one.
#[test]
fn curved_cells_are_optimal_for_cubic_velocities() {
    for curved in [2, 3] {
        orders(2, curved).at_least([(VELOCITY, 3.8), (PRESSURE, 2.6), (POLARITY, 4.8), (LAPLACIAN, 2.4)]);
    }
}

#[test]
fn curved_cells_are_optimal_on_an_annulus_and_straight_ones_are_not() {
    let of = |curved: usize| {
        let level = |n: usize| {
            let sets = [("mesh.h", (1.0 / n as f64).to_string()), ("mesh.curved", curved.to_string())];
            run(include_str!("../../studies/mms/annulus.toml"), &sets)
        };
        Orders::new(&format!("annulus, curved = {curved}"), [6, 12].map(level).to_vec())
    };
    let (straight, curved) = (of(1), of(2));
    let order = |field| curved.of(field, Norm::Square);
    assert!(order(VELOCITY) > 2.8 && order(PRESSURE) > 2.0);
    assert!(order(POLARITY) > 3.8 && order(LAPLACIAN) > 1.95);
    for field in [VELOCITY, POLARITY] {
        assert!(straight.of(field, Norm::Square) < 2.3, "{}", field.name);
        assert!(straight.last(field, Norm::Square) > 20.0 * curved.last(field, Norm::Square), "{}", field.name);
    }
}
