//! A fixed disc of radius 0.1 in Poiseuille flow.

use monolayer::mesh::Point;
use monolayer::mesh::locate::Locator;
use monolayer::shape::Wrench;

use crate::common::*;

/// Force and torque of the flow, and the slip on the surface, whose largest velocity is 1.
fn at_disc(n: usize, position: Point) -> (Wrench, f64) {
    let (flow, carried) = solved(&square(n), ["4*y*(1-y)", "0"], vec![fixed(disc(0.1, position))]);
    let (wrench, slip) = (carried.wrenches[0], slip(&flow, &carried));
    let Wrench { force, torque } = wrench;
    println!("n = {n}: drag {:.6}, lift {:.6e}, torque {torque:.8}, slip {slip:.2e}", force.x, force.y);
    (wrench, slip)
}

#[test]
fn drag_and_slip_of_a_disc_in_the_middle() {
    let rows = [16, 32, 64].map(|n| (n, at_disc(n, MIDDLE)));
    let slips: Vec<(usize, f64)> = rows.iter().map(|(n, (_, slip))| (*n, *slip)).collect();
    println!("orders of the slip {:.2}, {:.2}", order(&slips), order(&slips[1..]));
    let (Wrench { force, .. }, slip) = rows[1].1;
    assert!((force.x / 16.5989 - 1.0).abs() < 1e-3);
    assert!(force.y.abs() < 5e-4 * force.x);
    assert!(slip < 5e-3 && order(&slips[1..]) >= 2.5);
}

#[test]
fn drag_lift_and_torque_beside_the_middle() {
    let position = Point::new(0.43, 0.61);
    let (Wrench { force, torque }, _) = at_disc(32, position);
    assert!((force.x / 16.3219 - 1.0).abs() < 1e-3);
    assert!((force.y / -0.86896 - 1.0).abs() < 6e-3);
    assert!((torque / 0.115380 - 1.0).abs() < 3e-3);
    let (Wrench { force: finer, torque: last }, _) = at_disc(64, position);
    let order = |coarse: f64, fine: f64, exact: f64| ((coarse - exact) / (fine - exact)).abs().log2();
    let orders = [order(force.x, finer.x, 16.32190), order(force.y, finer.y, -0.86896), order(torque, last, 0.115380)];
    println!("orders {orders:.2?}");
    assert!(orders.iter().all(|order| *order >= 3.0), "{orders:?}");
}

#[test]
fn errors_of_the_velocity() {
    let of = |n: usize, degree: usize| {
        let disc = fixed(disc(0.1, Point::new(0.43, 0.61)));
        solved_with(&distorted(n, if degree == 2 { 0.0 } else { 0.05 }), ["4*y*(1-y)", "0"], vec![disc], degree)
    };
    let (fine, exact) = of(48, 3);
    let (field, locator) = (velocity(&fine, &exact), Locator::new(&fine.loops.mesh));
    for (n, bounds) in [(16, [6.0e-3, 0.37]), (32, [6.0e-4, 0.1]), (64, [6.5e-5, 0.0275])] {
        let (flow, carried) = of(n, 2);
        let errors = distance(&flow, &carried, (&field, &locator));
        println!("n = {n}: L² {:.3e}, H¹ {:.3e}", errors[0], errors[1]);
        assert!(errors[0] < bounds[0] && errors[1] < bounds[1]);
    }
}
