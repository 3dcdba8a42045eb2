//! A disc that falls in a box.

use monolayer::mesh::Point;
use monolayer::mesh::locate::Locator;

use crate::common::*;

/// Its speed, on finer meshes and of higher degrees.
const SPEED: f64 = -0.9278907;

#[test]
fn orders_of_the_flow() {
    let (fine, exact) = falling(&distorted(48, 0.05), MIDDLE, 3);
    assert!((exact.twists[0].velocity.y / SPEED - 1.0).abs() < 1e-5);
    let (field, locator) = (velocity(&fine, &exact), Locator::new(&fine.loops.mesh));
    for distortion in [0.0, 0.2] {
        let (mut l2, mut h1) = (Vec::new(), Vec::new());
        for n in [16, 32, 64] {
            let (flow, carried) = falling(&distorted(n, distortion), MIDDLE, 2);
            let errors = distance(&flow, &carried, (&field, &locator));
            let v = carried.twists[0].velocity;
            println!(
                "distorted by {distortion}, n = {n}: L² {:.3e}, H¹ {:.3e}, V₂ {:.7} ({:.1e}), V₁/V₂ {:.1e}",
                errors[0],
                errors[1],
                v.y,
                v.y / SPEED - 1.0,
                v.x / v.y
            );
            l2.push((n, errors[0]));
            h1.push((n, errors[1]));
            if (distortion, n) == (0.0, 32) {
                assert!((v.x / v.y).abs() < 2e-4 && errors[0] < 6e-4 && errors[1] < 0.1);
            }
        }
        let [l2, h1] = [order(&l2), order(&h1)];
        println!("orders {l2:.2} and {h1:.2}");
        assert!(l2 >= 2.7 && h1 >= 1.8);
    }
    let speed = falling(&square(40), MIDDLE, 2).1.twists[0].velocity.y;
    assert!((speed / SPEED - 1.0).abs() < 5e-4, "{speed}");
}

#[test]
fn shifts_within_a_cell() {
    // against a mesh on which errors are ten times smaller, for the walls are nearer or farther
    let (coarse, fine) = (square(32), square(64));
    let error = |(a, b): (f64, f64)| {
        let x = MIDDLE + Point::new(a, b) / 32.0;
        let [coarse, fine] = [&coarse, &fine].map(|mesh| falling(mesh, x, 2).1.twists[0].velocity.y);
        coarse / fine - 1.0
    };
    let errors = [(0.0, 0.0), (0.25, 0.0), (0.5, 0.5), (0.1, 0.77), (0.33, 0.6), (0.9, 0.2)].map(error);
    println!("{errors:?}");
    let (low, high) = errors.iter().fold((f64::MAX, f64::MIN), |(low, high), e| (low.min(*e), high.max(*e)));
    assert!(high - low < 2e-4, "{errors:?}");
}
