//! Bodies that the tissue moves, and restarts.

use std::sync::atomic::AtomicBool;

use monolayer::body::Hold;
use monolayer::mesh::Point;
use monolayer::model::Conditions;
use monolayer::space::{Field, project};
use monolayer::time::moving::MovingMarch;

use crate::common::*;
use crate::setting::*;

#[test]
fn the_tissue_carries_bodies_without_friction_at_its_own_speed() {
    let mesh = square(6);
    let one = || [formula("1"), formula("0")];
    let open = |tag: &str| match tag {
        "left" => Conditions::flow(one()).with_polarity(one()),
        "right" => Conditions::open(),
        _ => Conditions::slip(),
    };
    // with the active stress on: a uniform one moves nothing
    let bodies = vec![round(0.17, [0.3, 0.52], Hold::Free), capsule([0.4, 0.2], 0.3, Hold::Free)];
    let model = around(&mesh, ACTIVE, &open, bodies);
    let p = project::interpolate_vector(&model.polarity.space, |_| Point::new(1.0, 0.0));
    let mut march = MovingMarch::start(model, settings(0.05, 2, ANDERSON), p.values, (2, None)).unwrap();
    for step in 1..=5 {
        march.advance(10.0, &AtomicBool::new(false)).unwrap();
        for (twist, from) in march.twists().iter().zip([0.3, 0.4]).map(|(twist, from)| (*twist, from)) {
            assert!((twist.velocity - Point::new(1.0, 0.0)).norm() < 1e-8 && twist.spin.abs() < 1e-7, "{twist:?}");
            let there = march.poses().iter().any(|p| (p.position.x - from - 0.05 * f64::from(step)).abs() < 1e-8);
            assert!(there, "{:?}", march.poses());
        }
    }
}

#[test]
fn the_force_that_holds_a_disc_holds_it_as_an_outer_force_too() {
    let mesh = square(5);
    let at = [0.47, 0.52];
    let fixed = around(&mesh, with_factors(), &slip, vec![round(0.2, at, Hold::Fixed)]);
    let p = swirl(&fixed);
    let inputs = fixed.inputs(0.0).unwrap();
    let force = fixed.force(&p, &Field::zero(&fixed.momentum.velocity), &inputs);
    let held = fixed.carry(&force, &inputs).unwrap();
    let load = held.holding[0];
    assert!(load.force.norm() > 1e-2 && load.torque.abs() > 1e-4, "something is to be held: {load:?}");
    let mut body = round(0.2, at, Hold::Free);
    body.force = [load.force.x, load.force.y].map(|f| formula(&format!("{f:e}")));
    body.torque = formula(&format!("{:e}", load.torque));
    let free = around(&mesh, with_factors(), &slip, vec![body]);
    let carried = free.carry(&force, &free.inputs(0.0).unwrap()).unwrap();
    let speed = held.v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let twist = carried.twists[0];
    assert!(twist.velocity.norm() < 1e-11 * speed && twist.spin.abs() < 1e-10 * speed, "{twist:?}, {speed}");
    // and the tissue pulls at it by as much
    assert!((held.wrenches[0].force + load.force).norm() < 1e-12);
}

const RADIUS: f64 = 0.12;

/// A disc dragged through several cells, beside one that the tissue carries.
fn dragged(steps: usize, resume_after: Option<usize>) -> (MovingMarch, f64) {
    let mesh = square(8);
    let hold = Hold::Held { velocity: [formula("0.6"), formula("0.2")], spin: formula("2") };
    let bodies = || vec![round(RADIUS, [0.35, 0.42], hold.clone()), round(0.1, [0.3, 0.75], Hold::Free)];
    let build = || around(&mesh, ACTIVE, &slip, bodies());
    let settings = settings(0.05, 2, ANDERSON);
    let model = build();
    let p = swirl(&model).values;
    let mut march = MovingMarch::start(model, settings, p, (2, None)).unwrap();
    let mut largest = 0.0_f64;
    for step in 1..=steps {
        march.advance(10.0, &AtomicBool::new(false)).unwrap();
        if resume_after == Some(step) {
            march = MovingMarch::resume(build(), settings, march.checkpoint(), None).unwrap();
        }
        let p = Field::new(&march.model().polarity.space, march.checkpoint().march.past[0].1.clone());
        let model = march.model();
        for cell in 0..model.loops.mesh.cells.len() {
            model.tissue().each_cell_point(cell, 6, &mut |x| largest = largest.max(p.vector(&x.site).norm()));
        }
    }
    (march, largest)
}

#[test]
fn the_polarity_stays_bounded_when_a_disc_sweeps_through_cells() {
    let (march, largest) = dragged(8, None);
    println!("largest |p| {largest:.3}, {:?}", march.poses());
    assert!(largest < 2.0, "{largest}");
    let moved = march.poses()[0].position - Point::new(0.35, 0.42);
    assert!((moved - Point::new(0.24, 0.08)).norm() < 1e-9, "{moved:?}");
    assert!((march.poses()[1].position - Point::new(0.3, 0.75)).norm() > 1e-2, "the tissue carries the other");
}

#[test]
fn a_restart_and_other_threads_change_no_bit() {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let whole = pool(1).install(|| dragged(4, None).0.checkpoint());
    let resumed = pool(3).install(|| dragged(4, Some(2)).0.checkpoint());
    assert_eq!(whole, resumed);
}
