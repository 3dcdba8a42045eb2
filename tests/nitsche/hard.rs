//! Slivers, mesh lines, thin bodies, walls.

use std::f64::consts::PI;

use monolayer::body::Body;
use monolayer::form::Linear;
use monolayer::mesh::Point;
use monolayer::model::Conditions;
use monolayer::model::immersed::FlowWithBodies;
use monolayer::model::momentum::MomentumError;
use monolayer::shape::{Capsule, Polygon, Shape, Twist};

use crate::common::*;

#[test]
fn mesh_lines_and_slivers_do_no_harm() {
    let mesh = square(16);
    // tangent to four mesh lines, and through vertices
    for (radius, y) in [(0.125, 0.5), (0.125, 0.53125), (0.09375, 0.5)] {
        let of = |shift: f64| {
            let body = fixed(disc(radius, Point::new(0.5 + shift, y)));
            let (flow, carried) = solved(&mesh, ["4*y*(1-y)", "0"], vec![body]);
            (carried.wrenches[0].force.x, slip(&flow, &carried), carried.pi)
        };
        let (still, _, pi) = of(0.0);
        let largest = |pi: &[f64]| pi.iter().fold(0.0_f64, |most, p| most.max(p.abs()));
        for size in [1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-8, 1e-6, 1e-5] {
            for shift in [size, -size] {
                let (drag, slip, there) = of(shift);
                assert!((drag / still - 1.0).abs() < 4e-4, "{shift:e}: {drag} and {still}");
                assert!(slip < 1.6e-2 && largest(&there) < 1.2 * largest(&pi), "{shift:e}: slip {slip:e}");
            }
        }
    }
}

/// A box in the middle of the square.
fn plate(length: f64, width: f64, angle: f64) -> Body {
    let (a, b) = (0.5 * length, 0.5 * width);
    let vertices = vec![Point::new(-a, -b), Point::new(a, -b), Point::new(a, b), Point::new(-a, b)];
    Body::new("plate", Shape::from(Polygon { vertices }), at(0.5, 0.5, angle))
}

#[test]
fn thin_plates_converge() {
    // from a third of a cell to one and a half; the corners make the pressure singular
    for (angle, exact, within) in [(0.0, 12.17, [0.03, 0.015, 0.01]), (0.5 * PI, 39.2, [0.17, 0.06, 0.02])] {
        for (n, within) in [16, 32, 64].into_iter().zip(within) {
            let (flow, carried) = solved(&square(n), ["4*y*(1-y)", "0"], vec![fixed(plate(0.42, 0.02, angle))]);
            let (drag, slip) = (carried.wrenches[0].force.x, slip(&flow, &carried));
            println!("plate at {angle:.2}, n = {n}: drag {drag:.4}, slip {slip:.2e}");
            assert!((drag / exact - 1.0).abs() < within, "n = {n}: {drag}");
        }
    }
}

fn channel(n: usize, velocity: [&str; 2], bodies: Vec<Body>) -> Result<FlowWithBodies, MomentumError> {
    let mesh = square(n);
    let flow = try_flow(&mesh, &walls(&mesh, velocity), bodies, (2, 0.0))?;
    flow.solve(&Linear::zero())
}

#[test]
fn bodies_at_walls_neither_break_nor_stick() {
    let h = 1.0 / 16.0;
    let fall = |gap: f64| {
        let body = pushed(disc(0.1, Point::new(0.5, 0.1 + gap * h)), [0.0, -1.0], 0.0);
        channel(16, ["0", "0"], vec![body]).expect("a flow").twists[0].velocity.y
    };
    // the last gap is not resolved, but the body is slower the nearer it is, and a touch changes nothing
    let speeds = [2.0, 1.0, 0.5, 0.1, 1e-2].map(fall);
    assert!(speeds.windows(2).all(|pair| pair[0] < pair[1] && pair[1] < 0.0), "{speeds:?}");
    for gap in [1e-4, 1e-8, 1e-12, 0.0, -1e-12, -1e-8, -1e-4] {
        let speed = fall(gap);
        assert!((0.5..1.5).contains(&(speed / speeds[4])), "{gap:e}: {speed} after {}", speeds[4]);
    }
    // one that stands in the wall by more cannot leave it: nothing flows in beneath
    assert!(fall(-0.5).abs() < 1e-10);
}

/// It has the velocity that is prescribed there, or what of it is prescribed.
#[test]
fn a_body_in_a_wall_moves_as_the_wall_lets_it() {
    let mesh = square(16);
    let bottom = mesh.tags.iter().position(|tag| tag == "bottom").expect("a side");
    let twist = |wall: Conditions, y: f64| {
        let mut conditions = walls(&mesh, ["0", "0"]);
        conditions[bottom] = wall;
        let body = pushed(disc(0.1, Point::new(0.5, y)), [1.0, -2.0], 0.3);
        let flow = try_flow(&mesh, &conditions, vec![body], (2, 0.0)).expect("a flow");
        flow.solve(&Linear::zero()).map(|carried| carried.twists[0])
    };
    let Twist { velocity, spin } = twist(Conditions::no_slip(), 0.05).expect("a flow");
    assert!(velocity.norm() < 1e-12 && spin.abs() < 1e-11, "{velocity} {spin}");
    let sliding = twist(Conditions::slip(), 0.05).expect("a flow");
    assert!(sliding.velocity.x > 1e-3, "{sliding:?}");
    assert!(sliding.velocity.y.abs() < 1e-12 && sliding.spin.abs() < 1e-11, "{sliding:?}");
    // rolling off nothing prescribes, and it falls through an opening
    let fallen = twist(Conditions::open(), 0.05).expect("a flow");
    assert!(fallen.velocity.y < -1e-3 && fallen.spin.abs() > 1e-3, "{fallen:?}");
    let error = twist(Conditions::flow(["x*(1-x)", "0"].map(formula)), 0.05).expect_err("no rigid motion");
    assert!(error.to_string().contains("no rigid motion has"), "{error}");
}

fn rod(half: f64, radius: f64) -> Body {
    Body::new("rod", Shape::from(Capsule { half_length: half, radius }), at(0.5, 0.5, 0.5 * PI))
}

#[test]
fn plugs_move_with_what_comes_in() {
    let plug = channel(16, ["4*y*(1-y)", "0"], vec![rod(0.6, 0.2)]).expect("a flow");
    assert!((plug.twists[0].velocity.x - 2.0 / 3.0).abs() < 0.01, "{:?}", plug.twists);
}

#[test]
fn plugs_may_not_be_fixed_where_something_comes_in() {
    let error = channel(16, ["4*y*(1-y)", "0"], vec![fixed(rod(0.6, 0.2))]).expect_err("nothing can pass");
    assert!(matches!(error, MomentumError::Flux { .. }), "{error}");
    assert!(channel(16, ["0", "0"], vec![fixed(rod(0.6, 0.2))]).is_ok());
}

/// A wide plug parts the pressures: the load on it is their difference.
#[test]
fn plugs_part_the_pressures() {
    let pushed_plug = channel(16, ["0", "0"], vec![pushed(rod(0.6, 0.2), [3.0, 0.0], 0.0)]).expect("a flow");
    assert!(pushed_plug.twists[0].velocity.x.abs() < 1e-9, "{:?}", pushed_plug.twists);
    assert!((pushed_plug.wrenches[0].force.x + 3.0).abs() < 1e-9);
}

/// The fluids on both sides share pressures within a free plug that is thinner than two cells: it is refused, and a
/// finer mesh has it.
#[test]
fn thin_plugs_need_two_cells() {
    let plug = |n: usize| channel(n, ["4*y*(1-y)", "0"], vec![rod(0.6, 0.06)]);
    assert!(matches!(plug(16), Err(MomentumError::Solve(_))));
    let twist = plug(32).expect("a flow").twists[0];
    assert!((twist.velocity.x - 2.0 / 3.0).abs() < 1e-9, "{twist:?}");
}

#[test]
fn what_cannot_be_is_refused() {
    let error = channel(6, ["0", "0"], vec![disc(0.1, Point::new(3.0, 0.5))]).expect_err("outside");
    assert!(error.to_string().contains("no part of the body `disc` lies inside the mesh"), "{error}");
    let error = channel(6, ["0", "0"], vec![disc(3.0, MIDDLE)]).expect_err("everywhere");
    assert!(error.to_string().contains("covers the whole domain"), "{error}");
}
