//! Bodies where they are hard to have.

use monolayer::body::{Body, Hold};
use monolayer::form::Linear;
use monolayer::mesh::Point;
use monolayer::model::momentum::MomentumError;

use crate::common::{MIDDLE, disc, flow_of, formula, pushed, solved, square, walls};

/// The message of a flow that must not be.
fn refusal(velocity: [&str; 2], bodies: Vec<Body>) -> String {
    let error = |e: MomentumError| e.to_string();
    match flow_of(&square(8), &walls(velocity), bodies, 1e-8).map_err(error) {
        Err(message) => message,
        Ok(flow) => flow.solve(&Linear::zero()).map_err(error).expect_err("it must be refused"),
    }
}

/// A triangle turns a little with the strain too.
#[test]
fn a_body_in_one_cell_turns_like_the_flow() {
    for radius in [1e-2, 1e-4, 1e-6] {
        for epsilon in [1e-2, 1e-8, 1e-14] {
            let (_, carried) = solved(&square(8), ["0", "x"], vec![disc(radius, Point::new(0.53, 0.49))], epsilon);
            let twist = carried.twists[0];
            assert!((twist.spin - 0.5).abs() < 0.15, "radius {radius:e}, ε {epsilon:e}: {twist:?}");
            assert!((twist.velocity.y - 0.53).abs() < 0.02, "radius {radius:e}, ε {epsilon:e}: {twist:?}");
        }
    }
}

/// Two bodies that share a cell leave it fluid: the pushed one is the faster one, and the penalty, which fills no cell,
/// does not matter.
#[test]
fn two_bodies_in_a_cell_move_with_its_flow() {
    let (a, b) = (Point::new(0.52, 0.51), Point::new(0.57, 0.52));
    let twists = |epsilon: f64| {
        let bodies = vec![pushed(disc(0.02, a), [1.0, 0.0], 0.0), disc(0.02, b)];
        solved(&square(8), ["0", "0"], bodies, epsilon).1.twists
    };
    let last = twists(1e-14);
    assert!(last[0].velocity.x > last[1].velocity.x && last[1].velocity.x > 0.0, "{last:?}");
    for epsilon in [1e-4, 1e-8, 1e-12] {
        let now = twists(epsilon);
        let apart = now.iter().zip(&last).map(|(a, b)| (a.velocity - b.velocity).norm()).fold(0.0, f64::max);
        assert!(apart < (10.0 * epsilon).max(1e-11) * last[0].velocity.norm(), "ε {epsilon:e}: {apart:e}");
    }
}

/// The cells that it fills rest, those that it cuts yield to its force a little.
#[test]
fn a_body_on_a_wall_at_rest_hardly_moves() {
    let on_wall = |place| pushed(disc(0.15, place), [0.0, -1.0], 0.0);
    let speed =
        |place, epsilon| solved(&square(10), ["0", "0"], vec![on_wall(place)], epsilon).1.twists[0].velocity.norm();
    let free = speed(MIDDLE, 1e-8);
    let speeds = [1e-4, 1e-8, 1e-14].map(|epsilon| speed(Point::new(0.02, 0.5), epsilon));
    assert!(speeds.iter().all(|speed| *speed < 0.05 * free), "{speeds:?} of {free}");
    assert!((speeds[2] - speeds[1]).abs() < 1e-6 * free && (speeds[2] - speeds[0]).abs() < 1e-2 * free, "{speeds:?}");
}

#[test]
fn a_body_on_a_wall_that_no_rigid_motion_has_is_blamed() {
    let message = refusal(["0", "y*(1-y)"], vec![disc(0.2, Point::new(0.02, 0.5))]);
    assert!(message.contains("`disc`") && message.contains("hint"), "{message}");
}

#[test]
fn a_fixed_body_may_lie_on_a_wall_at_rest_but_a_moving_one_may_not() {
    let place = Point::new(0.02, 0.5);
    let fixed = Body { hold: Hold::Fixed, ..disc(0.15, place) };
    let (_, carried) =
        solved(&square(10), ["0", "0"], vec![fixed, pushed(disc(0.1, Point::new(0.6, 0.5)), [0.0, 1.0], 0.0)], 1e-8);
    let [fixed, moving] = [carried.twists[0].velocity.norm(), carried.twists[1].velocity.y];
    assert!(moving > 0.0 && fixed < 2e-2 * moving, "{:?}", carried.twists);
    let hold = Hold::Held { velocity: [formula("1"), formula("0")], spin: formula("0") };
    let message = refusal(["0", "0"], vec![Body { hold, ..disc(0.15, place) }]);
    assert!(message.contains("contradicts"), "{message}");
}

#[test]
fn a_body_outside_of_the_mesh_or_all_over_it_is_refused() {
    let message = refusal(["0", "0"], vec![disc(0.1, Point::new(3.0, 0.5))]);
    assert!(message.contains("no part of the body `disc`"), "{message}");
    let message = refusal(["0", "0"], vec![disc(3.0, MIDDLE)]);
    assert!(message.contains("whole domain"), "{message}");
}

/// Slivers of every size as a disc passes a line of the mesh: the speed must not jump by more than the cell's own
/// rigidity makes it.
#[test]
fn slivers_are_harmless() {
    let mesh = square(8);
    for offset in [0.0, 1e-15, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3] {
        for epsilon in [1e-8, 1e-14] {
            let body = pushed(disc(0.125 + offset, MIDDLE), [0.0, -1.0], 0.0);
            let (_, carried) = solved(&mesh, ["0", "0"], vec![body], epsilon);
            let fall = carried.twists[0].velocity.y;
            assert!((-0.1..-0.01).contains(&fall), "offset {offset:e}, ε {epsilon:e}: {fall}");
        }
    }
}
