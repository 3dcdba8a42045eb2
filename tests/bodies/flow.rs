//! Twists and forces of bodies.

use monolayer::body::{Body, Hold};
use monolayer::form::Linear;
use monolayer::mesh::Point;
use monolayer::model::Conditions;
use monolayer::model::momentum::SlipTreatment;
use monolayer::shape::{Capsule, Shape, Twist};
use monolayer::shape::{Wrench, rigid_motion};
use monolayer::solve::dot;

use crate::common::{MIDDLE, disc, flow_of, formula, full, penalty, pushed, solved, square, usual, walls};

#[test]
fn a_disc_in_a_shear_flow_turns_with_half_the_shear_rate() {
    let mesh = square(14);
    for (radius, method) in [0.05, 0.1, 0.2, 0.3].into_iter().flat_map(|r| [(r, usual()), (r, penalty(1e-8))]) {
        let (_, carried) = solved(&mesh, ["0", "x"], vec![disc(radius, MIDDLE)], method);
        let twist = carried.twists[0];
        assert!((twist.spin - 0.5).abs() < 5e-3, "radius {radius}: spin {}", twist.spin);
        assert!((twist.velocity - Point::new(0.0, 0.5)).norm() < 5e-3, "radius {radius}: {}", twist.velocity);
    }
}

#[test]
fn a_rigid_flow_is_found_exactly() {
    let (velocity, spin) = (Point::new(0.3, -0.2), 0.7);
    let moving = ["0.3 - 0.7*(y - 0.4)", "-0.2 + 0.7*(x - 0.4)"];
    for method in [usual(), penalty(1e-10), full(1e-10)] {
        for (radius, x, y) in [(0.15, 0.4, 0.4), (0.01, 0.41, 0.43), (0.2, 0.1, 0.5)] {
            let place = Point::new(x, y);
            let (_, carried) = solved(&square(9), moving, vec![disc(radius, place)], method);
            let twist = carried.twists[0];
            let expected = Twist { velocity, spin }.at(place, Point::new(0.4, 0.4));
            assert!((twist.velocity - expected).norm() < 1e-10, "{place}: {}", twist.velocity - expected);
            assert!((twist.spin - spin).abs() < 1e-9, "{place}: {}", twist.spin - spin);
        }
    }
}

#[test]
fn spins_converge_with_the_penalty_and_nothing_is_lost_at_the_end() {
    let mesh = square(10);
    let spin = |epsilon: f64| {
        let off = disc(0.17, Point::new(0.43, 0.52));
        solved(&mesh, ["0", "x^2"], vec![off], penalty(epsilon)).1.twists[0].spin
    };
    let spins: Vec<f64> = [1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14].map(spin).to_vec();
    let steps: Vec<f64> = spins.windows(2).map(|s| (s[1] - s[0]).abs()).collect();
    for pair in steps.windows(2) {
        // of order 1 in ε
        assert!(pair[1] < 0.02 * pair[0] || pair[1] < 1e-11, "{spins:?}");
    }
    assert!((spins[5] - spins[4]).abs() < 1e-10, "{spins:?}");
    // rounding is not larger with a coarse penalty either
    assert!((spin(1e-2) - spins[5]).abs() < 1e-2, "{spins:?}");
}

/// A free disc with a force by penalty: testing the balance with its rigid motions gives its force and torque back.
#[test]
fn forces_on_a_free_body_are_in_balance() {
    let body = pushed(disc(0.13, Point::new(0.45, 0.55)), [3.0, -5.0], 0.4);
    let (flow, carried) = solved(&square(12), ["0", "0"], vec![body], penalty(1e-9));
    let momentum = &flow.momentum;
    let positions = momentum.velocity.node_positions();
    // K v without bodies, tested with the rigid motions of the patch, is what the fluid does to the body
    let immersion = &momentum.bodies().expect("a body").immersion;
    let patch: std::collections::BTreeSet<usize> = immersion.parts[0]
        .iter()
        .filter(|(_, part)| part.viscosity.is_some())
        .flat_map(|(&cell, _)| momentum.velocity.cell_nodes(cell))
        .map(|&node| node as usize)
        .collect();
    let (stiffness, divergence) = momentum.element_blocks(&flow.loops);
    let mut tested = [0.0; 3];
    for (k, sum) in tested.iter_mut().enumerate() {
        let mut w = vec![0.0; momentum.velocity.dof_count()];
        for &node in &patch {
            let r = rigid_motion(k, Point::new(0.45, 0.55), positions[node]);
            (w[2 * node], w[2 * node + 1]) = (r.x, r.y);
        }
        let (nv, np) = (momentum.velocity.cell_dof_count(), momentum.pressure.n);
        for cell in 0..flow.loops.mesh.cells.len() {
            let local = |values: &[f64]| -> Vec<f64> {
                (0..nv).map(|i| values[momentum.velocity.dof(cell, i / (nv / 2), i % (nv / 2))]).collect()
            };
            let (v, w) = (local(&carried.v), local(&w));
            for i in 0..nv {
                *sum += w[i] * dot(&stiffness[(cell * nv + i) * nv..][..nv], &v);
                for j in 0..np {
                    *sum += w[i] * divergence[(cell * nv + i) * np + j] * carried.pi[momentum.pressure.dof(cell, 0, j)];
                }
            }
        }
    }
    for (sum, expected) in tested.iter().zip([3.0, -5.0, 0.4]) {
        assert!((sum - expected).abs() < 1e-8, "{tested:?}");
    }
    assert_eq!(carried.holding, [Wrench::ZERO]);
}

/// The force that holds a body with the velocity of a pushed one is the push.
#[test]
fn multipliers_are_the_forces_that_hold() {
    let mesh = square(12);
    let place = Point::new(0.42, 0.51);
    for method in [usual(), penalty(1e-8), full(1e-8)] {
        let (_, free) = solved(&mesh, ["y", "0"], vec![pushed(disc(0.11, place), [2.0, 1.0], -0.3)], method);
        let twist = free.twists[0];
        let velocity = [twist.velocity.x, twist.velocity.y].map(|v| formula(&format!("{v:e}")));
        let hold = Hold::Held { velocity, spin: formula(&format!("{:e}", twist.spin)) };
        let (_, held) = solved(&mesh, ["y", "0"], vec![Body { hold, ..disc(0.11, place) }], method);
        let holding = held.holding[0];
        assert!((holding.force - Point::new(2.0, 1.0)).norm() < 1e-6, "{holding:?}");
        assert!((holding.torque + 0.3).abs() < 1e-6, "{holding:?}");
        assert!((held.twists[0].velocity - twist.velocity).norm() < 1e-10);
        let fixed = Body { hold: Hold::Fixed, ..disc(0.11, place) };
        let (_, fixed) = solved(&mesh, ["y", "0"], vec![fixed], method);
        assert!(fixed.twists[0].velocity.norm() + fixed.twists[0].spin.abs() < 1e-10, "{:?}", fixed.twists);
        assert!(fixed.holding[0].force.x < -0.1, "{:?}", fixed.holding);
    }
}

/// A rod along a shear flow that a pin holds at one end.
fn pinned_rod() -> Body {
    let shape = Shape::from(Capsule { half_length: 0.12, radius: 0.05 });
    Body { shape, hold: Hold::Pinned(Point::new(-0.12, 0.0)), ..disc(0.1, Point::new(0.52, 0.5)) }
}

/// The full penalty makes the rod thicker by a cell, and turn ten times as fast as it does.
#[test]
fn a_pinned_body_turns_about_its_pin() {
    for (method, spin) in [(usual(), -0.02), (full(1e-8), -0.1)] {
        let (mut flow, carried) = solved(&square(12), ["y", "0"], vec![pinned_rod()], method);
        let pin = Point::new(0.4, 0.5);
        let (twist, place) = (carried.twists[0], flow.motion.poses[0].position);
        assert!(twist.at(pin, place).norm() < 1e-10, "{twist:?}");
        assert!(twist.spin < spin && carried.holding[0].force.norm() > 0.1, "{method:?}: {twist:?}");
        for _ in 0..4 {
            let now = flow.solve(&Linear::zero()).expect("a solution").twists;
            let by = flow.predicted(0.3, &now).expect("a prediction");
            flow.advance(0.3, &now, &by).expect("a move");
            let at = flow.motion.poses[0].to_space(Point::new(-0.12, 0.0));
            assert!((at - pin).norm() < 1e-12, "{at}");
        }
    }
}

/// Against cells a third as long, on which the spin is −0.02307 and the force 7.683.
#[test]
fn the_spin_of_a_pinned_body_converges() {
    for (n, [spin, force]) in [(24, [0.2, 5e-3]), (48, [0.02, 5e-4])] {
        let carried = solved(&square(n), ["y", "0"], vec![pinned_rod()], usual()).1;
        let (found, held) = (carried.twists[0].spin, carried.holding[0].force.x);
        println!("n = {n}: spin {found:.6}, force {held:.5}");
        assert!((found / -0.023_07 - 1.0).abs() < spin && (held / -7.6829 - 1.0).abs() < force, "{n}: {found} {held}");
    }
}

/// With a traction boundary, slip walls and friction the rows of the system differ; the spin of the flow must not.
#[test]
fn open_boundaries_and_slip_walls_carry_bodies_too() {
    let inlet = Conditions::flow([formula("1"), formula("0")]);
    let conditions = [inlet, Conditions::open(), Conditions::slip(), Conditions::slip()];
    for method in [usual(), penalty(1e-8)] {
        let flow = flow_of(&square(10), &conditions, vec![disc(0.1, MIDDLE)], method).expect("a flow");
        let twist = flow.solve(&Linear::zero()).expect("a solution").twists[0];
        assert!((twist.velocity - Point::new(1.0, 0.0)).norm() < 1e-9 && twist.spin.abs() < 1e-9, "{twist:?}");
    }
}

/// A uniform flow past bodies with friction: they lag behind, the more the larger their friction.
#[test]
fn friction_of_a_body_is_its_own() {
    use monolayer::model::immersed::flow::{Flow, Settings};
    let mesh = square(10);
    let speed = |fluid: f64, own: f64| {
        let body = Body { friction: own, ..disc(0.15, MIDDLE) };
        let settings = Settings { order: 1, ..Settings::default() };
        let slip = SlipTreatment::Rotated;
        let flow =
            Flow::new(&mesh, (2, 1), &walls(["1", "0"]), (fluid, slip), vec![body], (settings, 0.0)).expect("a flow");
        flow.solve(&Linear::zero()).expect("a solution").twists[0].velocity.x
    };
    // a fluid without friction and a body without: all at the same speed
    assert!((speed(0.0, 0.0) - 1.0).abs() < 1e-9);
    assert!((speed(5.0, 5.0) - 1.0).abs() < 1e-9, "the pressure balances a friction that is the same everywhere");
    let lagging = [speed(0.0, 1.0), speed(0.0, 10.0), speed(0.0, 1000.0)];
    assert!(lagging[0] < 0.999 && lagging[1] < lagging[0] && lagging[2] < 0.6 * lagging[1], "{lagging:?}");
    assert!(speed(10.0, 0.0) > 1.0, "driven by the pressure");
}
