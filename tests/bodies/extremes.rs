//! Bodies where they are hard to have.

use monolayer::body::{Body, Hold};
use monolayer::form::Linear;
use monolayer::mesh::Point;
use monolayer::model::momentum::MomentumError;

use crate::common::{MIDDLE, disc, flow_of, formula, full, penalty, pushed, solved, square, usual, walls};

/// The messages of a flow that must not be, by every method.
fn refusals(velocity: [&str; 2], bodies: impl Fn() -> Vec<Body>) -> [String; 3] {
    let error = |e: MomentumError| e.to_string();
    [usual(), penalty(1e-8), full(1e-8)].map(|method| {
        match flow_of(&square(8), &walls(velocity), bodies(), method).map_err(error) {
            Err(message) => message,
            Ok(flow) => flow.solve(&Linear::zero()).map_err(error).expect_err("it must be refused"),
        }
    })
}

/// A triangle turns a little with the strain too.
#[test]
fn a_body_in_one_cell_turns_like_the_flow() {
    for radius in [1e-2, 1e-4, 1e-6] {
        for method in [usual(), penalty(1e-2), penalty(1e-8), penalty(1e-14), full(1e-8)] {
            let (_, carried) = solved(&square(8), ["0", "x"], vec![disc(radius, Point::new(0.53, 0.49))], method);
            let twist = carried.twists[0];
            assert!((twist.spin - 0.5).abs() < 0.15, "radius {radius:e}, {method:?}: {twist:?}");
            assert!((twist.velocity.y - 0.53).abs() < 0.02, "radius {radius:e}, {method:?}: {twist:?}");
        }
    }
}

/// Two small discs near each other, one of which is pushed.
fn pair() -> Vec<Body> {
    vec![pushed(disc(0.02, Point::new(0.52, 0.51)), [1.0, 0.0], 0.0), disc(0.02, Point::new(0.57, 0.52))]
}

/// By the full penalty two bodies that share a cell move as one, whatever ε.
#[test]
fn two_bodies_in_a_cell_move_together() {
    for epsilon in [1e-6, 1e-10, 1e-14] {
        let (flow, carried) = solved(&square(8), ["0", "0"], pair(), full(epsilon));
        let [first, second] = carried.twists[..] else { panic!("two bodies") };
        let [a, b] = [0, 1].map(|body: usize| flow.motion.poses[body].position);
        assert!(first.velocity.x > 0.0);
        let apart = (first.at(b, a) - second.velocity).norm();
        assert!(apart < 1e3 * epsilon.max(1e-10) * first.velocity.norm(), "ε {epsilon:e}: {apart:e}");
    }
}

/// Otherwise such bodies leave their cell fluid: the pushed one is the faster one, and the penalty, which fills no
/// cell, does not matter.
#[test]
fn two_bodies_in_a_cell_move_with_its_flow() {
    let twists = |epsilon: f64| solved(&square(8), ["0", "0"], pair(), penalty(epsilon)).1.twists;
    let last = twists(1e-14);
    assert!(last[0].velocity.x > last[1].velocity.x && last[1].velocity.x > 0.0, "{last:?}");
    for epsilon in [1e-4, 1e-8, 1e-12] {
        let now = twists(epsilon);
        let apart = now.iter().zip(&last).map(|(a, b)| (a.velocity - b.velocity).norm()).fold(0.0, f64::max);
        assert!(apart < (10.0 * epsilon).max(1e-11) * last[0].velocity.norm(), "ε {epsilon:e}: {apart:e}");
    }
}

/// On cells a sixteenth as long they have the speeds 0.1637 and 0.1385: near as they are, they do not move together.
#[test]
fn two_bodies_in_a_cell_move_nearly_as_in_fine_ones() {
    let twists = solved(&square(8), ["0", "0"], pair(), usual()).1.twists;
    let [first, second] = [0, 1].map(|body: usize| twists[body].velocity.x);
    assert!((first / 0.1637 - 1.0).abs() < 0.06 && (second / 0.1385 - 1.0).abs() < 0.1, "{twists:?}");
}

fn on_wall(place: Point) -> Body {
    pushed(disc(0.15, place), [0.0, -1.0], 0.0)
}

#[test]
fn a_body_on_a_wall_at_rest_rests() {
    let by_penalty = [1e-4, 1e-8, 1e-14].map(|epsilon: f64| (full(epsilon), 10.0 * epsilon.max(1e-13)));
    for (method, bound) in std::iter::once((usual(), 1e-12)).chain(by_penalty) {
        let (_, carried) = solved(&square(10), ["0", "0"], vec![on_wall(Point::new(0.02, 0.5))], method);
        let speed = carried.twists[0].velocity.norm();
        assert!(speed < bound, "{method:?}: {speed:e}");
    }
}

/// By the softer penalty the cells that it fills rest, and those that it cuts yield to its force a little.
#[test]
fn a_body_on_a_wall_at_rest_hardly_moves() {
    let speed = |place, epsilon| {
        solved(&square(10), ["0", "0"], vec![on_wall(place)], penalty(epsilon)).1.twists[0].velocity.norm()
    };
    let free = speed(MIDDLE, 1e-8);
    let speeds = [1e-4, 1e-8, 1e-14].map(|epsilon| speed(Point::new(0.02, 0.5), epsilon));
    assert!(speeds.iter().all(|speed| *speed < 0.05 * free), "{speeds:?} of {free}");
    assert!((speeds[2] - speeds[1]).abs() < 1e-6 * free && (speeds[2] - speeds[0]).abs() < 1e-2 * free, "{speeds:?}");
}

#[test]
fn a_body_on_a_wall_that_no_rigid_motion_has_is_blamed() {
    for message in refusals(["0", "y*(1-y)"], || vec![disc(0.2, Point::new(0.02, 0.5))]) {
        assert!(message.contains("`disc`") && message.contains("hint"), "{message}");
    }
}

#[test]
fn a_fixed_body_may_lie_on_a_wall_at_rest_but_a_moving_one_may_not() {
    let place = Point::new(0.02, 0.5);
    for method in [usual(), full(1e-8)] {
        let fixed = Body { hold: Hold::Fixed, ..disc(0.15, place) };
        let moving = pushed(disc(0.1, Point::new(0.6, 0.5)), [0.0, 1.0], 0.0);
        let (_, carried) = solved(&square(10), ["0", "0"], vec![fixed, moving], method);
        assert!(carried.twists[0].velocity.norm() < 1e-8 && carried.twists[1].velocity.y > 0.0, "{:?}", carried.twists);
    }
    let hold = Hold::Held { velocity: [formula("1"), formula("0")], spin: formula("0") };
    for message in refusals(["0", "0"], || vec![Body { hold: hold.clone(), ..disc(0.15, place) }]) {
        assert!(message.contains("contradicts"), "{message}");
    }
}

#[test]
fn a_body_outside_of_the_mesh_or_all_over_it_is_refused() {
    for message in refusals(["0", "0"], || vec![disc(0.1, Point::new(3.0, 0.5))]) {
        assert!(message.contains("no part of the body `disc`"), "{message}");
    }
    for message in refusals(["0", "0"], || vec![disc(3.0, MIDDLE)]) {
        assert!(message.contains("whole domain"), "{message}");
    }
}

/// Slivers of every size as a disc passes a line of the mesh: the speed must not jump by more than the cell's own
/// rigidity makes it.
#[test]
fn slivers_are_harmless() {
    let mesh = square(8);
    for offset in [0.0, 1e-15, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3] {
        for method in [usual(), penalty(1e-8), penalty(1e-14)] {
            let body = pushed(disc(0.125 + offset, MIDDLE), [0.0, -1.0], 0.0);
            let (_, carried) = solved(&mesh, ["0", "0"], vec![body], method);
            let fall = carried.twists[0].velocity.y;
            assert!((-0.1..-0.01).contains(&fall), "offset {offset:e}, {method:?}: {fall}");
        }
    }
}
