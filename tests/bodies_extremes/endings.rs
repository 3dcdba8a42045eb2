//! Runs that must end early, with the last good state written, and bodies that leave in the end.

use crate::common::{Left, REST, disc, has, particles, resume, run, segment, stokes, tissue};

/// The state before the step that failed is in every form; all is finite, and no later than the summary's time.
fn last_state_is_kept(left: &Left, after: f64) {
    assert!(left.summary.time >= after, "it ended at {}", left.summary.time);
    let last = left.rows.last().expect("there are rows");
    assert!((last.time - left.summary.time).abs() < 1e-12, "the table ends at {}", last.time);
    assert!(
        left.rows.iter().all(|row| [row.x, row.y, row.theta, row.vx, row.vy, row.spin].iter().all(|v| v.is_finite()))
    );
    let summary: serde_json::Value = serde_json::from_slice(&left.bytes("summary.json")).unwrap();
    assert_eq!((summary["status"].as_str(), summary["ending"].as_str()), (Some("failed"), Some("failed")));
    assert_eq!(summary["reason"].as_str(), Some(left.reason()));
    assert!(!left.bytes("checkpoint.bin").is_empty());
    has(left.reason(), &["hint: "]);
}

const LATE: &str = "force = [\"0\", \"-1/if(t > 0.25, 0, 1)\"]";

#[test]
fn a_force_that_stops_being_a_number_among_particles() {
    let scene = particles("", &(disc("one", 0.1, 0.0, 0.0, "") + &disc("bad", 0.1, 1.0, 0.0, LATE)), 0.1, 1.0);
    let left = run(&scene);
    has(left.reason(), &["\"bad\"", "force", "t = 0.3"]);
    last_state_is_kept(&left, 0.25);
    // what is left goes on to the same end
    let again = resume(left, &scene);
    has(again.reason(), &["\"bad\""]);
    assert!((again.summary.time - 0.3).abs() < 1e-12);
}

#[test]
fn a_force_that_stops_being_a_number_in_a_flow() {
    let left = run(&stokes(6, REST, &disc("bad", 0.1, 0.5, 0.5, LATE), 0.1, 1.0));
    has(left.reason(), &["-1/if(t > 0.25, 0, 1)", "the force of the body `bad`"]);
    last_state_is_kept(&left, 0.15);
    assert!(!left.bytes("fields.pvd").is_empty());
}

#[test]
fn a_force_that_stops_being_a_number_in_a_tissue() {
    let left = run(&tissue(&disc("bad", 0.6, 0.0, 0.0, LATE), 0.1, 1.0));
    has(left.reason(), &["-1/if(t > 0.25, 0, 1)", "the force of the body `bad`"]);
    last_state_is_kept(&left, 0.15);
}

#[test]
fn a_body_that_leaves_the_flow() {
    let body = disc("leaver", 0.1, 0.5, 0.5, "");
    let scene = stokes(6, "[\"1\", \"0\"]", &body, 0.1, 3.0);
    let left = run(&scene).ended();
    let gone = &left.summary.bodies.as_ref().unwrap().left[0];
    assert_eq!((&*gone.body, &*gone.through), ("leaver", "right"));
    let last = left.last("leaver");
    assert!(last.x < 1.1 && gone.position[0] > 1.1 - 1e-9 && last.time < gone.time, "{last:?}, {gone:?}");
}

#[test]
fn a_body_that_leaves_the_tissue() {
    let left = run(&tissue(&disc("leaver", 0.4, 2.2, 0.0, ""), 0.25, 6.0)).ended();
    let gone = &left.summary.bodies.as_ref().unwrap().left[0];
    assert_eq!((&*gone.body, &*gone.through), ("leaver", "outlet"));
    assert!(left.last("leaver").x < 3.4 && gone.position[0] > 3.4 - 1e-9, "{gone:?}");
}

fn pressed(speed: &str) -> String {
    let push = format!("motion = {{ held = {{ velocity = [\"{speed}\", \"0\"], spin = \"0\" }} }}");
    disc("pusher", 0.1, 0.25, 0.5, &push) + &disc("caught", 0.1, 0.55, 0.5, "")
}

#[test]
fn a_held_body_that_presses_a_free_one_against_a_wall() {
    let begin = std::time::Instant::now();
    for solver in ["newton", "accelerated"] {
        let more = format!("[contact]\nsolver = \"{solver}\"\n");
        let left = run(&particles("", &(pressed("1") + &segment([1.0, 0.0], [1.0, 1.0]) + &more), 0.05, 2.0));
        has(left.reason(), &["caught", "cannot move without overlap"]);
        last_state_is_kept(&left, 0.3);
        assert!(left.most("overlap") < 1e-11 && left.last("caught").x <= 0.9 + 1e-11, "{:?}", left.last("caught"));
    }
    assert!(begin.elapsed().as_secs() < 20, "it took {:?}", begin.elapsed());
}

#[test]
fn a_held_body_that_presses_a_free_one_against_a_wall_of_a_flow() {
    let push = "motion = { held = { velocity = [\"0.5\", \"0\"], spin = \"0\" } }";
    let bodies = disc("pusher", 0.06, 0.35, 0.5, push) + &disc("caught", 0.06, 0.7, 0.5, "");
    // in the flow they share cells before they meet, which no flow can have either
    let flow = run(&stokes(16, REST, &(bodies + "[[wall]]\ntag = \"right\"\n"), 0.05, 2.0));
    assert!(["pusher", "caught"].iter().any(|name| flow.reason().contains(name)), "{}", flow.reason());
    last_state_is_kept(&flow, 0.1);
}
