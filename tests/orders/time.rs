//! Orders in time alone: fields that the spaces hold exactly, so that only the time differences err.

use monolayer::measure::errors::Norm;
use monolayer::model::fields::{POLARITY, VELOCITY};

use super::common::{Orders, run};

/// p is linear in space, so that |p|²p is cubic and L_h exact in P3; v is quadratic and Π linear.
const SCENE: &str = include_str!("../../studies/mms/polynomial.toml");

fn orders(order: usize, alternate: f64) -> Orders {
    let level = |n: usize| {
        let sets = [
            ("time.scheme", format!("bdf{order}")),
            ("time.alternate", alternate.to_string()),
            ("time.step", (1.0 / n as f64).to_string()),
        ];
        (1.0 / n as f64, run(SCENE, &sets).1)
    };
    Orders::new(&format!("BDF{order}, steps in the ratio {alternate}"), [20, 40, 80].map(level).to_vec())
}

#[test]
fn bdf_of_order_one_to_six_has_its_order_with_equal_steps() {
    for order in 1..=6 {
        let found = orders(order, 1.0);
        let p = found.of(POLARITY, Norm::Largest);
        // flow and pressure follow from the polarity, so that they inherit its order
        let v = found.of(VELOCITY, Norm::Largest);
        let b = order as f64;
        assert!((p - b).abs() < 0.2 && (v - b).abs() < 0.3, "BDF{order}: {p:.2} for p, {v:.2} for v");
        let last = found.last(POLARITY, Norm::Largest);
        let bound = [2e-2, 6e-4, 2e-5, 1e-6, 4e-8, 2e-9][order - 1];
        assert!(last < bound, "BDF{order}: error {last:.1e}");
    }
}

#[test]
fn steps_that_vary_strongly_keep_the_order() {
    // twice as long every other step; BDF6 is not zero-stable then and gets a smaller ratio
    for (order, ratio) in [(1, 2.0), (2, 2.0), (3, 2.0), (4, 2.0), (5, 2.0), (6, 1.3)] {
        let p = orders(order, ratio).of(POLARITY, Norm::Largest);
        assert!(p > order as f64 - 0.25, "BDF{order} with ratio {ratio}: {p:.2}");
    }
}

#[test]
fn the_low_order_start_costs_orders_above_two() {
    let level = |n: usize, scheme: &str| {
        let sets = [
            ("time.scheme", scheme.to_owned()),
            ("time.start", "low-order".to_owned()),
            ("time.step", (1.0 / n as f64).to_string()),
        ];
        (1.0 / n as f64, run(SCENE, &sets).1)
    };
    for scheme in ["bdf2", "bdf4"] {
        let found =
            Orders::new(&format!("{scheme} from one step of BDF1"), [20, 40, 80].map(|n| level(n, scheme)).to_vec());
        let p = found.of(POLARITY, Norm::Largest);
        assert!((1.7..2.3).contains(&p), "{scheme}: {p:.2}");
    }
}
