//! Bodies that are held, walls that are discs, and gaps that are kept open.

use monolayer::contact::particles::{Drive, Motion};
use monolayer::contact::{Freedom, Law, Metric, Mover, Partner, Settings, Solver, Wall};
use monolayer::mesh::Point;
use monolayer::shape::{Pose, Twist};

use crate::common::{at, disc, gravity, rectangle, rng, scattered, world};
use rand::RngExt;

/// A flow carries the bodies: every step has velocities of its own, whatever contact made of the last ones.
#[test]
fn bodies_in_a_flow_keep_the_margin() {
    for (margin, discs, dt) in [(0.02, true, 0.02), (0.02, false, 0.004), (0.1, true, 0.02)] {
        let floor = [Wall::Segment([Point::new(-9.0, 0.0), Point::new(9.0, 0.0)])];
        let mut bodies = scattered(24, [0.05, 0.1], 1.5, 7);
        for (k, body) in bodies.iter_mut().enumerate() {
            // farther apart than the margin
            body.pose.position = 2.0 * body.pose.position + Point::new(-1.5, 0.2);
            if !discs && k % 2 == 0 {
                body.shape = rectangle(0.06, 0.04);
            }
        }
        let mut solver =
            Solver::new(&floor, Settings { margin, ..Settings::default() }).expect("the settings are good");
        let (mut rng, mut least, mut touching) = (rng(5), f64::INFINITY, 0);
        for k in 0..(3.0 / dt) as usize {
            let movers: Vec<Mover> = bodies
                .iter()
                .map(|b| {
                    let towards =
                        Point::new(0.0, 0.5) - b.pose.position + 0.1 * Point::new(0.0, rng.random_range(-1.0..1.0));
                    let predicted = Twist { velocity: towards, spin: rng.random_range(-1.0..1.0) };
                    let freedom = Freedom::Free { mass: b.mass, inertia: b.inertia };
                    Mover { name: &b.name, shape: &b.shape, pose: b.pose, predicted, freedom, last: predicted }
                })
                .collect();
            let projected = solver.project(&movers, dt, Metric::Resistance).unwrap_or_else(|e| panic!("step {k}: {e}"));
            assert!(projected.gap >= margin - 1e-11, "gap {} of {margin} at step {k}", projected.gap);
            least = least.min(projected.gap);
            touching = touching.max(projected.contacts.iter().filter(|c| c.force > 0.0).count());
            for (body, pose) in bodies.iter_mut().zip(projected.poses) {
                body.pose = pose;
            }
        }
        assert!(least <= margin + 1e-9 && touching >= 20, "they came to {least} of {margin} in {touching} places");
    }
}

/// Everything that is held goes to the right, turning.
struct Held;

const HELD: Twist = Twist { velocity: Point::new(0.5, 0.0), spin: 0.3 };

impl Drive for Held {
    fn load(&self, _: usize, _: f64, _: &Pose, _: &Twist) -> [f64; 3] {
        [0.0; 3]
    }

    fn twist(&self, _: usize, _: f64, _: &Pose) -> Twist {
        HELD
    }
}

#[test]
fn a_held_body_pushes_others_and_is_not_pushed() {
    let mut ram = disc("ram", 0.5, 0.0, 0.0);
    ram.motion = Motion::Held;
    let mut particles = world(vec![ram, disc("a", 0.25, 1.0, 0.0), disc("b", 0.25, 1.75, 0.0)], &[], Law::Inelastic);
    let mut pushed = 0.0;
    for _ in 0..400 {
        let report = particles.step(0.01, &Held).expect("there is room");
        assert!(report.overlap() < 1e-11, "overlap {:e}", report.overlap());
        pushed += 0.01 * report.forces[1][0] + 0.01 * report.forces[2][0];
    }
    let [ram, a, b] = particles.bodies() else { panic!("three bodies") };
    assert!((ram.pose.position - Point::new(2.0, 0.0)).norm() < 1e-12 && (ram.pose.angle - 1.2).abs() < 1e-12);
    assert!(ram.twist.velocity == HELD.velocity || (ram.twist.velocity - HELD.velocity).norm() < 1e-13);
    // both are carried along, with the momentum that the ram gave them
    assert!((a.pose.position.x - 2.75).abs() < 1e-10 && (b.pose.position.x - 3.25).abs() < 1e-10);
    assert!((pushed - 0.5 * (a.mass + b.mass)).abs() < 1e-10, "momentum {pushed}");
}

#[test]
fn discs_fall_around_a_disc_that_is_a_wall() {
    let wall = [
        Wall::Disc { centre: Point::new(0.7, 0.4), radius: 0.3 },
        Wall::Segment([Point::new(-9.0, 0.0), Point::new(9.0, 0.0)]),
    ];
    let mut bodies = scattered(30, [0.05, 0.1], 1.4, 2);
    bodies.iter_mut().for_each(|b| b.pose.position.y += 0.9);
    // right over the top: it stays there, as nothing turns it
    bodies.push(disc("top", 0.05, 0.7, 0.75));
    let mut particles = world(bodies, &wall, Law::Inelastic);
    let drive = gravity(&particles);
    let mut on_the_wall = 0;
    for k in 0..300 {
        let report = particles.step(0.01, &drive).unwrap_or_else(|e| panic!("step {k}: {e}"));
        assert!(report.overlap() < 1e-11, "overlap {:e} at step {k}", report.overlap());
        for c in report.contacts.iter().filter(|c| c.partner == Partner::Wall(0) && c.force > 0.0) {
            on_the_wall += 1;
            let out = (particles.bodies()[c.body].pose.position - Point::new(0.7, 0.4)).norm();
            assert!(c.normal.dot(&(Point::new(0.7, 0.4) - particles.bodies()[c.body].pose.position)) > 0.99 * out);
        }
        if k == 10 {
            let top = particles.bodies()[30].mass;
            let below = report.contacts.iter().find(|c| c.body == 30 && c.partner == Partner::Wall(0));
            assert!((below.expect("it lies on the wall").force / top - 1.0).abs() < 1e-9);
        }
    }
    assert!(on_the_wall > 100, "{on_the_wall} contacts with the wall");
    assert!(particles.bodies().iter().filter(|b| b.pose.position.y < 0.3).count() > 10);
    for body in particles.bodies() {
        assert!((body.pose.position - at(0.7, 0.4, 0.0).position).norm() > 0.35 - 1e-11);
    }
}
