//! Gluey contact: bonds that hold as much as they were pressed.

use monolayer::body::{Pose, Twist};
use monolayer::contact::particles::Particles;
use monolayer::contact::{Law, Wall};
use monolayer::mesh::Point;

use crate::common::{disc, world};

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
        assert!(q >= -1e-12, "overlap {q} at {t}");
        for c in &report.contacts {
            assert!(c.gamma <= 0.0 && (c.gamma * c.gap).abs() <= 1e-11, "Dγ = {} at {t}", c.gamma * c.gap);
        }
        if q <= 1e-12 && contact.is_nan() {
            contact = t;
        }
        if q > 1e-12 && !contact.is_nan() && release.is_nan() {
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
