//! Gluey contact: bonds that hold as much as they were pressed.

use monolayer::contact::particles::Particles;
use monolayer::contact::{Law, Wall};
use monolayer::mesh::Point;
use monolayer::shape::{Pose, Twist};

use crate::common::{disc, moving, world};

const SMOOTH: Law = Law::Gluey { gamma_min: f64::NEG_INFINITY };

/// A disc of radius and mass 1 over a plane, at a gap of 1/2.
fn over_plane(law: Law) -> Particles {
    let mut body = disc("particle", 1.0, 0.0, 1.5);
    body.mass = 1.0;
    world(vec![body], &[Wall::Segment([Point::new(-9.0, 0.0), Point::new(9.0, 0.0)])], law)
}

/// Pressed until t = 2, pulled after.
fn push_pull(_: usize, t: f64, _: &Pose, _: &Twist) -> [f64; 3] {
    [0.0, if t < 2.0 - 1e-9 { -1.0 } else { 1.0 }, 0.0]
}

/// Times of contact and release, largest error in q.
fn run(law: Law, dt: f64, exact: impl Fn(f64) -> f64) -> (f64, f64, f64) {
    let mut particles = over_plane(law);
    let (mut contact, mut release, mut error) = (f64::NAN, f64::NAN, 0.0f64);
    for k in 0..(6.0 / dt).round() as usize {
        let report = particles.step(dt, &push_pull).expect("the step succeeds");
        let t = (k + 1) as f64 * dt;
        let q = particles.bodies()[0].pose.position.y - 1.0;
        assert!(q >= -5e-12, "overlap {q} at {t}");
        for c in &report.contacts {
            assert!(c.gamma <= 0.0 && (c.gamma * c.gap).abs() <= 1e-11, "Dγ = {} at {t}", c.gamma * c.gap);
        }
        if q <= 1e-10 && contact.is_nan() {
            contact = t;
        }
        if q > 1e-10 && !contact.is_nan() && release.is_nan() {
            release = t;
        }
        error = error.max((q - exact(t)).abs());
    }
    (contact, release, error)
}

#[test]
fn a_particle_is_released_when_it_was_pulled_as_much_as_pressed() {
    let exact = |t: f64| match t {
        t if t < 1.0 => 0.5 - 0.5 * t * t,
        t if t < 4.0 => 0.0,
        t => 0.5 * (t - 4.0).powi(2),
    };
    for dt in [1e-2, 1e-3, 1e-4] {
        let (contact, release, error) = run(SMOOTH, dt, exact);
        println!("dt {dt}: contact {contact}, release {release}, error {error:.3e} = {:.3} dt", error / dt);
        assert!((contact - 1.0).abs() <= 2.0 * dt);
        assert!((release - 4.0).abs() <= 2.0 * dt);
        assert!(error <= 1.5 * dt);
    }
}

#[test]
fn without_glue_it_is_released_at_once_and_like_inelastic_contact() {
    let dry = |t: f64| match t {
        t if t < 1.0 => 0.5 - 0.5 * t * t,
        t if t < 2.0 => 0.0,
        t => 0.5 * (t - 2.0).powi(2),
    };
    let dt = 1e-3;
    let (contact, release, error) = run(Law::Gluey { gamma_min: 0.0 }, dt, dry);
    assert!(
        (contact - 1.0).abs() <= 2.0 * dt && (release - 2.0).abs() <= 2.0 * dt && error <= 4.5 * dt,
        "{release} {error}"
    );
    assert_eq!(run(Law::Inelastic, dt, dry), (contact, release, error));
}

#[test]
fn roughness_limits_how_long_it_holds() {
    // pressed beyond the threshold of 1/2, it holds half a second of pulling
    let (_, release, _) = run(Law::Gluey { gamma_min: -0.5 }, 1e-3, |_| 0.0);
    assert!((release - 2.5).abs() <= 2e-3, "released at {release}");
}

/// Two discs that meet off-centre at t = 0 and are pulled apart afterwards.
#[test]
fn discs_that_meet_off_centre_stick_turn_and_part() {
    let pair = || {
        let one = moving(disc("left", 0.5, -0.55, -0.3), 1.0, 0.0, 0.0);
        vec![one, moving(disc("right", 0.5, 0.55, 0.3), -1.0, 0.0, 0.0)]
    };
    let away = |k: usize, t: f64, _: &Pose, _: &Twist| match t < 1.0 {
        true => [0.0; 3],
        false => [if k == 0 { -1.0 } else { 1.0 }, 0.0, 0.0],
    };
    let mut particles = world(pair(), &[], SMOOTH);
    let angular =
        |p: &Particles| -> f64 { p.bodies().iter().map(|b| b.mass * b.pose.position.perp(&b.twist.velocity)).sum() };
    let start = angular(&particles);
    let (mut turned, mut parted) = (0.0f64, f64::NAN);
    for k in 0..600 {
        let report = particles.step(0.01, &away).expect("the step succeeds");
        let t = (k + 1) as f64 * 0.01;
        let apart = particles.bodies()[1].pose.position - particles.bodies()[0].pose.position;
        for c in &report.contacts {
            assert!(c.gap >= -1e-11 && c.gamma <= 0.0 && c.gamma * c.gap >= -1e-11, "at {t}: {c:?}");
        }
        if t < 1.0 {
            assert!((angular(&particles) - start).abs() < 1e-9, "{start} became {} at {t}", angular(&particles));
            turned = apart.y.atan2(apart.x);
        }
        if t > 0.5 && apart.norm() > 1.0 + 1e-9 && parted.is_nan() {
            parted = t;
        }
    }
    assert!(turned > 1.0, "they turned to {turned} only");
    assert!(parted > 1.05 && parted < 6.0, "they parted at {parted}");
    // without glue they glide past each other
    let mut dry = world(pair(), &[], Law::Inelastic);
    for _ in 0..100 {
        dry.step(0.01, &away).expect("the step succeeds");
    }
    let apart = dry.bodies()[1].pose.position - dry.bodies()[0].pose.position;
    assert!(apart.norm() > 1.01, "{}", apart.norm());
}

/// A chain of glued discs hangs under a plane and comes off when it has been pulled as much as it was pressed.
#[test]
fn bonds_of_a_chain_break_together_and_the_plane_pulls_no_more_than_it_was_pressed() {
    let n = 6;
    let bodies: Vec<_> = (0..n).map(|k| disc(&format!("{k}"), 0.5, 0.0, 0.5 + k as f64)).collect();
    let masses: Vec<f64> = bodies.iter().map(|b| b.mass).collect();
    let mut particles = world(bodies, &[Wall::Segment([Point::new(-9.0, 0.0), Point::new(9.0, 0.0)])], SMOOTH);
    let drive =
        move |k: usize, t: f64, _: &Pose, _: &Twist| [0.0, if t < 1.0 - 1e-9 { -masses[k] } else { masses[k] }, 0.0];
    let (mut impulse, mut free) = (0.0, f64::NAN);
    for k in 0..300 {
        let report = particles.step(0.01, &drive).expect("the step succeeds");
        impulse += 0.01 * report.wall_force.y;
        assert!(report.contacts.iter().all(|c| c.gap >= -1e-11 && c.gamma <= 0.0 && c.gamma * c.gap >= -1e-11));
        if free.is_nan() && particles.bodies()[0].pose.position.y > 0.5 + 1e-9 {
            free = (k + 1) as f64 * 0.01;
        }
    }
    // what the plane was pressed with it has given back; so has every pair of discs, as all are pulled alike
    assert!(impulse.abs() < 1e-9, "the plane keeps {impulse}");
    assert!((free - 2.0).abs() < 0.03, "it comes off at {free}");
    assert!(particles.solver().bonds().all().iter().all(|(_, bond)| bond.gamma > -1e-9));
}
