//! What holds to rounding.

use std::f64::consts::PI;

use monolayer::body::{Body, Hold};
use monolayer::form::Linear;
use monolayer::mesh::Point;
use monolayer::shape::{Capsule, Disc, Ellipse, Polygon, Shape, Twist, Wrench};
use monolayer::space::Field;

use crate::common::*;

fn body(shape: impl Into<Shape>, x: f64, y: f64, angle: f64) -> Body {
    Body::new("body", shape.into(), at(x, y, angle))
}

fn triangle() -> Polygon {
    let corners = vec![Point::new(-0.1, -0.05), Point::new(0.1, -0.05), Point::new(0.0, 0.1)];
    Polygon::centred(corners).expect("a triangle").0
}

#[test]
fn rigid_flows_pass() {
    let motion = Twist { velocity: Point::new(1.0, 0.5), spin: 2.0 };
    let crowd = || {
        vec![
            body(Disc { radius: 0.13 }, 0.5, 0.5, 0.0),
            body(Ellipse { semi_axes: [0.12, 0.05] }, 0.2, 0.77, 0.5),
            body(Capsule { half_length: 0.1, radius: 0.04 }, 0.77, 0.2, 2.0),
            body(triangle(), 0.22, 0.25, 0.3),
        ]
    };
    // half in a wall, in a corner, and smaller than a cell beside another one
    let at_walls = || {
        vec![
            body(Disc { radius: 0.1 }, 0.0, 0.5, 0.0),
            body(Disc { radius: 0.11 }, 0.98, 0.97, 0.0),
            body(Disc { radius: 0.02 }, 0.52, 0.48, 0.0),
            body(Disc { radius: 0.015 }, 0.56, 0.48, 0.0),
        ]
    };
    for mesh in [square(7), distorted(9, 0.3)] {
        for degree in [2, 3] {
            for bodies in [crowd(), at_walls()] {
                let count = bodies.len();
                let (flow, carried) = solved_with(&mesh, ["1 - 2*y", "0.5 + 2*x"], bodies, degree);
                let v = velocity(&flow, &carried);
                let error = fluid(&flow)
                    .sum(2 * degree, |x| (v.vector(&x.site) - motion.at(x.site.x, Point::zeros())).norm_squared());
                assert!(error.sqrt() < 1e-13, "{:e}", error.sqrt());
                for k in 0..count {
                    let (twist, pose) = (carried.twists[k], flow.motion.poses[k]);
                    let off = twist.velocity - motion.at(pose.position, Point::zeros());
                    assert!(off.norm() < 1e-11 && (twist.spin - 2.0).abs() < 1e-10, "{twist:?}");
                }
            }
        }
    }
}

#[test]
fn a_rigid_flow_passes_a_curved_mesh() {
    let scene = monolayer::mesh::generate::MeshScene::of("disc").with("h", 0.3).with("curved", 2);
    let mesh = std::sync::Arc::new(scene.build().expect("a disc"));
    let bodies = vec![
        body(Disc { radius: 0.2 }, 0.1, 0.2, 0.0),
        body(Capsule { half_length: 0.2, radius: 0.1 }, -0.5, -0.5, 1.0),
    ];
    let (flow, carried) = solved(&mesh, ["1 - y", "x"], bodies);
    let v = velocity(&flow, &carried);
    let error = fluid(&flow).sum(4, |x| (v.vector(&x.site) - Point::new(1.0 - x.site.x.y, x.site.x.x)).norm_squared());
    assert!(error.sqrt() < 1e-12, "{:e}", error.sqrt());
    assert!(carried.twists.iter().all(|twist| (twist.spin - 1.0).abs() < 1e-11), "{:?}", carried.twists);
}

#[test]
fn fixed_and_held_bodies_move_as_they_must() {
    let turning = Hold::Held { velocity: [formula("0.1*t"), formula("-0.2")], spin: formula("1") };
    let bodies = vec![
        fixed(body(Disc { radius: 0.1 }, 0.3, 0.4, 0.0)),
        Body { hold: turning, ..body(triangle(), 0.7, 0.6, 0.1) },
    ];
    let mesh = square(12);
    let mut flow = try_flow(&mesh, &walls(&mesh, ["4*y*(1-y)", "0"]), bodies, (2, 0.0)).expect("a flow");
    let start = flow.motion.poses.clone();
    for _ in 0..3 {
        let carried = flow.solve(&Linear::zero()).expect("a solution");
        assert_eq!(carried.twists[0], Twist::ZERO);
        assert_eq!(carried.twists[1], Twist { velocity: Point::new(0.1 * flow.t, -0.2), spin: 1.0 });
        // nothing else pulls them
        for (holding, wrench) in carried.holding.iter().zip(&carried.wrenches) {
            assert_eq!((holding.force, holding.torque), (-wrench.force, -wrench.torque));
            assert!(wrench.force.norm() > 0.1);
        }
        let by = flow.predicted(0.05, &carried.twists).expect("motions");
        flow.advance(0.05, &carried.twists, &by).expect("a place");
    }
    assert_eq!(flow.motion.poses[0], start[0]);
    assert!((flow.motion.poses[1].angle - start[1].angle - 0.15).abs() < 1e-15);
}

#[test]
fn pins_hold_and_forces_balance() {
    let pin = Point::new(0.05, 0.02);
    let wheel = Body { hold: Hold::Pinned(pin), ..body(Ellipse { semi_axes: [0.15, 0.06] }, 0.4, 0.4, 0.3) };
    let wheel = Body { friction: 3.0, ..pushed(wheel, [1.0, -2.0], 0.5) };
    let free = Body { friction: 2.0, ..pushed(body(triangle(), 0.7, 0.7, 1.0), [0.3, 0.1], -0.2) };
    let mesh = square(14);
    let conditions = walls(&mesh, ["4*y*(1-y)", "0"]);
    let flow = try_flow(&mesh, &conditions, vec![wheel, free.clone()], (2, 5.0)).expect("a flow");
    let carried = flow.solve(&Linear::zero()).expect("a solution");
    let poses = &flow.motion.poses;
    let at_pin = poses[0].to_space(pin);
    assert!(carried.twists[0].at(at_pin, poses[0].position).norm() < 1e-14);
    // the pin gives no torque about itself
    let Wrench { force, torque } = carried.holding[0];
    let arm = at_pin - poses[0].position;
    assert!((torque - arm.perp(&force)).abs() < 1e-10 * force.norm(), "{torque} {}", arm.perp(&force));
    // the fluid, the load and the friction of the free one
    let (twist, wrench) = (carried.twists[1], carried.wrenches[1]);
    let drag = 2.0 * free.shape.area() * twist.velocity;
    assert!((wrench.force + Point::new(0.3, 0.1) - drag).norm() < 1e-10, "{wrench:?}");
    assert!((wrench.torque - 0.2 - 2.0 * free.shape.second_moment() * twist.spin).abs() < 1e-10);
    assert_eq!(carried.holding[1], Wrench::ZERO);
}

#[test]
fn the_fluid_and_its_walls_balance() {
    // ∫ σn over the walls and the disc: the weak form tested with a constant field at the nodes of the walls
    let (flow, carried) = solved(&square(10), ["4*y*(1-y)", "0"], vec![fixed(disc(0.15, Point::new(0.45, 0.55)))]);
    let v = velocity(&flow, &carried);
    let pi = Field::new(&flow.momentum.pressure, carried.pi.clone());
    let fluid = fluid(&flow);
    let mean = fluid.sum(1, |x| pi.scalar(&x.site));
    assert!(mean.abs() < 1e-12, "zero mean: {mean:e}");
    let leak = fluid.sum(1, |x| v.vector_gradient(&x.site).trace());
    assert!(leak.abs() < 2e-3, "div v = 0 but for the slip: {leak:e}");
}

#[test]
fn moved_bodies_are_as_if_they_had_begun_there() {
    let mesh = square(14);
    let all = || vec![pushed(disc(0.12, Point::new(0.4, 0.6)), [1.0, -2.0], 0.1), body(triangle(), 0.7, 0.3, 0.2)];
    let conditions = walls(&mesh, ["y", "0"]);
    let mut flow = try_flow(&mesh, &conditions, all(), (2, 0.0)).expect("a flow");
    for shift in [0.003, 0.04, 0.11] {
        let by = [
            Twist { velocity: Point::new(shift, -0.5 * shift), spin: 1.0 },
            Twist { velocity: Point::new(-0.2 * shift, 0.0), spin: PI * shift },
        ];
        flow.advance(1.0, &by, &by).expect("a place");
        let mut there = all();
        there.iter_mut().zip(&flow.motion.poses).for_each(|(body, pose)| body.start = *pose);
        let fresh = try_flow(&mesh, &conditions, there, (2, 0.0)).expect("a flow");
        let [a, b] = [&flow, &fresh].map(|flow| flow.solve(&Linear::zero()).expect("a solution"));
        assert!(a.v == b.v && a.pi == b.pi && a.twists == b.twists, "after a shift by {shift}");
    }
}

/// The number of unknowns changes as a disc enters a wall and leaves it, and the arm of a pin as its body turns.
#[test]
fn bodies_that_enter_walls_are_as_if_they_had_begun_there() {
    let mesh = square(14);
    let pin = Point::new(0.05, 0.02);
    let all = || {
        let wheel = Body { hold: Hold::Pinned(pin), ..body(Ellipse { semi_axes: [0.15, 0.06] }, 0.7, 0.4, 0.3) };
        let wheel = Body { friction: 3.0, ..pushed(wheel, [1.0, -2.0], 0.5) };
        vec![pushed(disc(0.12, Point::new(0.3, 0.15)), [1.0, -2.0], 0.1), wheel, body(triangle(), 0.3, 0.7, 0.2)]
    };
    let conditions = walls(&mesh, ["0", "0"]);
    let mut flow = try_flow(&mesh, &conditions, all(), (2, 0.0)).expect("a flow");
    let mut rested = Vec::new();
    for fall in [0.02, 0.06, 0.01, -0.08] {
        let turn = Twist { velocity: 2.0 * Point::new(pin.y, -pin.x), spin: 2.0 };
        let by = [Twist { velocity: Point::new(0.01, -fall), spin: 0.0 }, turn, Twist::ZERO];
        flow.advance(1.0, &by, &by).expect("a place");
        let mut there = all();
        there.iter_mut().zip(&flow.motion.poses).for_each(|(body, pose)| body.start = *pose);
        let fresh = try_flow(&mesh, &conditions, there, (2, 0.0)).expect("a flow");
        let [a, b] = [&flow, &fresh].map(|flow| flow.solve(&Linear::zero()).expect("a solution"));
        assert!(a.v == b.v && a.pi == b.pi && a.twists == b.twists, "after a fall by {fall}");
        rested.push(a.twists[0].velocity.norm() < 1e-12);
    }
    assert_eq!(rested, [false, true, true, false]);
}
