//! The stepper of particles: conservation, invariants, extremes, and what it refuses.

use monolayer::contact::particles::{Drive, Dynamics, Motion, Particle, Particles};
use monolayer::contact::{ContactError, Law, Method, Settings, Solver, Wall};
use monolayer::mesh::Point;
use monolayer::shape::{Capsule, Disc, Ellipse, Pose, Shape, Twist};
use rand::RngExt;

use crate::common::{
    at, disc, gravity, moving, open_box, rectangle, regular, rng, scattered, settings, shortened, world,
};

fn nothing(_: usize, _: f64, _: &Pose, _: &Twist) -> [f64; 3] {
    [0.0; 3]
}

fn momentum(particles: &Particles) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for b in particles.bodies() {
        let (m, v) = (b.mass, b.twist.velocity);
        sum[0] += m * v.x;
        sum[1] += m * v.y;
        sum[2] += m * b.pose.position.perp(&v) + b.inertia * b.twist.spin;
    }
    sum
}

/// Bodies of all shapes that fly towards the origin.
fn swarm(count: usize, discs: bool, seed: u64) -> Vec<Particle> {
    let mut rng = rng(seed);
    let side = (count as f64).sqrt().ceil() as usize;
    (0..count)
        .map(|k| {
            let shape = match k % 5 {
                _ if discs => Shape::from(Disc { radius: rng.random_range(0.2..0.45) }),
                0 => Shape::from(Disc { radius: 0.4 }),
                1 => Shape::from(Ellipse { semi_axes: [0.45, 0.2] }),
                2 => Shape::from(Capsule { half_length: 0.25, radius: 0.15 }),
                3 => rectangle(0.35, 0.2),
                _ => regular(5, 0.4),
            };
            let place = |j: usize| j as f64 - 0.5 * side as f64;
            let pose = at(place(k % side), place(k / side), rng.random_range(0.0..6.0));
            let body = Particle::new(format!("body-{k}"), shape, pose);
            let towards = -0.8 * pose.position;
            let spin = rng.random_range(-1.0..1.0);
            moving(body, towards.x + rng.random_range(-0.3..0.3), towards.y, spin)
        })
        .collect()
}

#[test]
fn contact_of_bodies_keeps_momentum_and_never_gains_energy() {
    for (discs, dt) in [(true, 0.02), (false, 0.01)] {
        let mut particles = world(swarm(36, discs, 3), &[], Law::Inelastic);
        let start = momentum(&particles);
        let (mut energy, mut most) = (particles.kinetic_energy(), 0);
        for k in 0..100 {
            let report = particles.step(dt, &nothing).expect("the step succeeds");
            assert!(report.overlap() < 1e-11, "overlap {:e} at step {k}", report.overlap());
            assert!(report.kinetic_energy <= energy * (1.0 + 1e-12), "energy {energy} to {}", report.kinetic_energy);
            energy = report.kinetic_energy;
            most = most.max(report.touching());
        }
        let end = momentum(&particles);
        for (a, b) in start.iter().zip(&end) {
            assert!((a - b).abs() < 1e-10, "momentum {start:?} became {end:?}");
        }
        assert!(most > 20, "they met in {most} places only");
    }
}

/// Discs that press an ellipse which has hardly turned between them: its gaps open where it turns.
fn pinched(density: f64, angle: f64) -> Vec<Particle> {
    let disc = |name: &str, x: f64, y: f64| {
        let mut disc = disc(name, 0.2, x, y);
        (disc.mass, disc.inertia) = (10.0 * disc.mass, 10.0 * disc.inertia);
        moving(disc, -x.signum(), 0.0, 0.0)
    };
    let mut ellipse = Particle::new("ellipse", Ellipse { semi_axes: [0.25, 0.1] }.into(), at(0.0, 0.0, angle));
    (ellipse.mass, ellipse.inertia) = (density * ellipse.mass, density * ellipse.inertia);
    vec![disc("left", -0.6, -0.01), disc("right", 0.6, 0.01), ellipse]
}

/// Bodies of all shapes of which one is far heavier than the others.
fn uneven(seed: u64, ratio: f64) -> Vec<Particle> {
    let mut bodies = swarm(16, false, seed);
    let place = seed as usize % 16;
    (bodies[place].mass, bodies[place].inertia) = (ratio * bodies[place].mass, ratio * bodies[place].inertia);
    bodies
}

#[test]
fn no_contact_gives_energy_whatever_the_shapes_and_masses() {
    let mut scenes: Vec<(String, Vec<Particle>)> = Vec::new();
    for (density, angle) in [(0.1, 0.02), (1e-3, 0.02), (10.0, 0.5), (0.1, 1.5)] {
        scenes.push((format!("pinched, density {density}, angle {angle}"), pinched(density, angle)));
    }
    for (seed, ratio) in [(1, 1e4), (2, 1e-4), (3, 1e2), (4, 1e-2), (5, 1e4), (6, 1.0)] {
        scenes.push((format!("uneven {seed}, ratio {ratio:e}"), uneven(seed, ratio)));
    }
    for (name, bodies) in scenes {
        // to the moment before they meet, then three steps, and on until they have parted
        let (mut particles, dt) = (world(bodies, &[], Law::Inelastic), 1e-3);
        let (start, first) = (momentum(&particles), particles.kinetic_energy());
        let size: f64 = particles.bodies().iter().map(|b| b.mass * (b.twist.velocity.norm() + 1.0)).sum();
        let (mut energy, mut met) = (first, 0);
        for k in 0..600 {
            for report in shortened(&mut particles, dt, &nothing) {
                let next = report.kinetic_energy;
                assert!(report.overlap() < 1e-11, "{name}: overlap {:e} at step {k}", report.overlap());
                assert!(next <= energy * (1.0 + 1e-12), "{name}: energy {energy} to {next} at step {k}");
                energy = next;
                met += usize::from(report.touching() > 0);
            }
        }
        for (a, b) in start.iter().zip(&momentum(&particles)) {
            assert!((a - b).abs() < 1e-11 * size, "{name}: momentum {start:?} became {:?}", momentum(&particles));
        }
        println!("{name}: energy {first} to {energy}, {met} steps with contact");
        assert!(met > 0 && energy < first, "{name}: they do not meet");
    }
}

#[test]
fn random_runs_keep_every_rule() {
    for (seed, law) in
        [(1, Law::Inelastic), (2, Law::Gluey { gamma_min: -0.05 }), (3, Law::Gluey { gamma_min: f64::NEG_INFINITY })]
    {
        let mut particles = world(scattered(60, [0.05, 0.1], 1.2, seed), &open_box(1.2, 6.0), law);
        let masses: Vec<f64> = particles.bodies().iter().map(|b| b.mass).collect();
        // shaken up and down, so that bonds break
        let drive = move |k: usize, t: f64, _: &Pose, _: &Twist| {
            [0.3 * masses[k] * (5.0 * t).sin(), -masses[k] * (2.0 * t).cos(), 0.0]
        };
        let mut bonds = 0;
        for k in 0..300 {
            let report = particles.step(0.01, &drive).unwrap_or_else(|e| panic!("{law:?} at step {k}: {e}"));
            assert!(report.overlap() < 1e-11, "{law:?}: overlap {:e} at step {k}", report.overlap());
            for c in &report.contacts {
                assert!(c.gamma <= 0.0);
                assert!(c.gamma * c.gap >= -1e-10, "{law:?}: Dγ = {:e} at step {k}", c.gamma * c.gap);
                match law {
                    Law::Inelastic => assert!(c.force >= 0.0 && c.gamma == 0.0),
                    Law::Gluey { gamma_min } => assert!(c.gamma >= gamma_min),
                }
                bonds += usize::from(c.gamma < 0.0);
            }
        }
        assert_eq!(bonds > 0, law != Law::Inelastic);
    }
}

#[test]
fn a_tower_of_a_hundred_discs_stands_and_weighs_what_it_must() {
    let bodies: Vec<Particle> = (0..100).map(|k| disc(&format!("{k}"), 0.5, 0.0, 0.5 + k as f64)).collect();
    let weight: f64 = bodies.iter().map(|b| b.mass).sum();
    let mut particles = world(bodies, &[Wall::Segment([Point::new(-1.0, 0.0), Point::new(1.0, 0.0)])], Law::Inelastic);
    let drive = gravity(&particles);
    for _ in 0..20 {
        let report = particles.step(0.01, &drive).expect("the step succeeds");
        assert!(report.overlap() < 1e-11, "overlap {:e}", report.overlap());
        assert!((report.wall_force.y + weight).abs() < 1e-8 * weight, "{} against {weight}", report.wall_force.y);
        assert_eq!(report.touching(), 100);
    }
    let top = particles.bodies()[99].pose.position.y;
    assert!((top - 99.5).abs() < 1e-11, "the top is at {top}");
}

#[test]
fn a_gap_of_1e_14_closes_and_opens() {
    let pair = |v: f64| vec![moving(disc("left", 0.5, 0.0, 0.0), v, 0.0, 0.0), disc("right", 0.5, 1.0 + 1e-14, 0.0)];
    let mut closing = world(pair(1.0), &[], Law::Inelastic);
    let report = closing.step(0.1, &nothing).expect("the step succeeds");
    assert!(report.gap >= -1e-12 && report.touching() == 1);
    assert!((closing.bodies()[1].twist.velocity.x - 0.5).abs() < 1e-12);
    let mut opening = world(pair(-1.0), &[], Law::Inelastic);
    assert_eq!(opening.step(0.1, &nothing).expect("the step succeeds").touching(), 0);
    assert_eq!(opening.bodies()[0].twist.velocity.x, -1.0);
}

fn refused(bodies: Vec<Particle>, walls: &[Wall]) -> ContactError {
    let solver = Solver::new(walls, Settings::default()).expect("the settings are good");
    Particles::new(bodies, Dynamics::Inertial { drag: 0.0 }, solver).expect_err("this start is bad")
}

#[test]
fn bad_starts_and_steps_are_refused_by_name() {
    let same = refused(vec![disc("a", 0.5, 1.0, 1.0), disc("b", 0.3, 1.0, 1.0)], &[]);
    assert!(
        matches!(&same, ContactError::Coincident { first, second } if first == "a" && second.contains("\"b\"")),
        "{same}"
    );
    let deep = refused(vec![disc("a", 0.5, 0.0, 0.0), disc("b", 0.5, 0.9, 0.0)], &[]);
    assert!(matches!(&deep, ContactError::Overlap { depth, .. } if (depth - 0.1).abs() < 1e-15), "{deep}");
    let wall = [Wall::Segment([Point::new(-1.0, 0.0), Point::new(1.0, 0.0)])];
    let below = refused(vec![disc("low", 0.5, 0.0, 0.3)], &wall);
    assert!(below.to_string().contains("\"low\" and wall 1 overlap by 2.000e-1"), "{below}");

    let mut particles = world(vec![disc("a", 0.5, 0.0, 1.0)], &wall, Law::Inelastic);
    for dt in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(particles.step(dt, &nothing), Err(ContactError::Step { .. })));
    }
    let before = particles.state();
    let nan = |_: usize, _: f64, _: &Pose, _: &Twist| [0.0, f64::NAN, 0.0];
    let error = particles.step(0.1, &nan).expect_err("a force is not a number");
    assert!(error.to_string().contains("force of body \"a\""), "{error}");
    assert_eq!(particles.state(), before);
    let weightless = Particle { mass: 0.0, ..disc("light", 0.5, 0.0, 1.0) };
    let error = world(vec![weightless], &wall, Law::Inelastic).step(0.1, &nothing).expect_err("no mass");
    assert!(error.to_string().contains("\"light\""), "{error}");
    for settings in [
        Settings { margin: -1.0, ..Settings::default() },
        Settings { tolerance: 0.0, ..Settings::default() },
        Settings { law: Law::Gluey { gamma_min: 1.0 }, ..Settings::default() },
    ] {
        assert!(matches!(Solver::new(&[], settings), Err(ContactError::Setting { .. })));
    }
}

#[test]
fn a_mass_ratio_of_1e9_is_carried_by_the_light_ones() {
    let mut bodies: Vec<Particle> = (0..5).map(|k| disc(&format!("{k}"), 0.5, 0.0, 0.5 + k as f64)).collect();
    bodies[4].mass *= 1e9;
    bodies[2].mass *= 1e9;
    let weight: f64 = bodies.iter().map(|b| b.mass).sum();
    let mut particles = world(bodies, &[Wall::Segment([Point::new(-1.0, 0.0), Point::new(1.0, 0.0)])], Law::Inelastic);
    let drive = gravity(&particles);
    for _ in 0..10 {
        let report = particles.step(0.01, &drive).expect("the step succeeds");
        assert!(report.overlap() < 1e-11, "overlap {:e}", report.overlap());
        assert!((report.wall_force.y / weight + 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_radius_ratio_of_1000() {
    let mut bodies: Vec<Particle> = (0..100)
        .map(|k| disc(&format!("{k}"), 1e-3, -0.11 + 2.2e-3 * k as f64, 1e-3 + 1e-4 * (k % 3) as f64))
        .collect();
    bodies.push(disc("large", 1.0, 0.0, 1.0 + 4e-3));
    let mut particles = world(bodies, &[Wall::Segment([Point::new(-3.0, 0.0), Point::new(3.0, 0.0)])], Law::Inelastic);
    let drive = gravity(&particles);
    for k in 0..60 {
        let report = particles.step(0.01, &drive).unwrap_or_else(|e| panic!("step {k}: {e}"));
        assert!(report.overlap() < 1e-3 * 1e-9, "overlap {:e}", report.overlap());
    }
    let large = particles.bodies()[100].pose.position.y;
    assert!((1.0..1.0 + 2.2e-3).contains(&large), "the large disc lies at {large}");
}

#[test]
fn the_order_of_bodies_does_not_matter() {
    let bodies = scattered(40, [0.05, 0.1], 1.0, 9);
    let mut turned: Vec<Particle> = bodies.clone();
    turned.rotate_left(17);
    turned.reverse();
    let mut runs = [bodies, turned].map(|b| world(b, &open_box(1.0, 6.0), Law::Inelastic));
    for particles in &mut runs {
        let drive = gravity(particles);
        for _ in 0..60 {
            particles.step(0.01, &drive).expect("the step succeeds");
        }
    }
    for body in runs[0].bodies() {
        let other = runs[1].bodies().iter().find(|b| b.name == body.name).expect("the same bodies");
        assert!((body.pose.position - other.pose.position).norm() < 1e-7, "{}", body.name);
    }
}

fn after(threads: usize, steps: usize) -> Particles {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
    let mut particles = world(scattered(80, [0.05, 0.1], 1.2, 4), &open_box(1.2, 6.0), Law::Gluey { gamma_min: -0.1 });
    let drive = gravity(&particles);
    pool.install(|| {
        for _ in 0..steps {
            particles.step(0.01, &drive).expect("the step succeeds");
        }
    });
    particles
}

#[test]
fn threads_and_restarts_do_not_change_a_bit() {
    let whole = after(1, 60);
    assert_eq!(whole.state(), after(4, 60).state());
    let half = after(2, 30);
    let bytes = postcard::to_stdvec(&half.state()).expect("the state can be written");
    let mut other = after(1, 0);
    other.restore(postcard::from_bytes(&bytes).expect("the state can be read"));
    let drive = gravity(&other);
    for _ in 0..30 {
        other.step(0.01, &drive).expect("the step succeeds");
    }
    assert_eq!(whole.state(), other.state());
}

#[test]
fn shapes_rest_on_each_other() {
    let wall = [Wall::Segment([Point::new(-9.0, 0.0), Point::new(9.0, 0.0)])];
    let capsule = Shape::from(Capsule { half_length: 0.5, radius: 0.25 });
    let ellipse = Shape::from(Ellipse { semi_axes: [0.5, 0.25] });
    for shape in [rectangle(0.5, 0.25), capsule, ellipse] {
        let bodies: Vec<Particle> =
            (0..8).map(|k| Particle::new(format!("{k}"), shape.clone(), at(0.0, 0.25 + 0.5 * k as f64, 0.0))).collect();
        let weight: f64 = bodies.iter().map(|b| b.mass).sum();
        let mut particles = world(bodies, &wall, Law::Inelastic);
        let drive = gravity(&particles);
        for _ in 0..50 {
            let report = particles.step(0.01, &drive).unwrap_or_else(|e| panic!("{shape:?}: {e}"));
            assert!(report.overlap() < 1e-11, "{shape:?}: overlap {:e}", report.overlap());
            assert!((report.wall_force.y / weight + 1.0).abs() < 1e-6, "{shape:?}: {}", report.wall_force.y / weight);
        }
        let top = particles.bodies()[7].pose;
        assert!((top.position - Point::new(0.0, 3.75)).norm() < 1e-9 && top.angle.abs() < 1e-9, "{shape:?}: {top:?}");
    }
}

#[test]
fn shapes_of_all_kinds_fall_into_a_box() {
    let mut bodies = swarm(25, false, 8);
    for body in &mut bodies {
        body.pose.position += Point::new(3.0, 3.5);
        body.twist = Twist::ZERO;
    }
    let mut particles = world(bodies, &open_box(6.0, 20.0), Law::Inelastic);
    let drive = gravity(&particles);
    for k in 0..300 {
        let report = particles.step(0.02, &drive).unwrap_or_else(|e| panic!("step {k}: {e}"));
        assert!(report.overlap() < 1e-10, "overlap {:e} at step {k}", report.overlap());
    }
    assert!(particles.bodies().iter().all(|b| b.pose.position.y < 4.0 && b.pose.position.y > 0.0));
}

#[test]
fn a_disc_slides_over_the_joints_of_a_floor() {
    let p = |k: usize| Point::new(0.37 * k as f64, 0.0);
    let floor: Vec<Wall> = (0..12).map(|k| Wall::Segment([p(k), p(k + 1)])).collect();
    for shape in [Shape::from(Disc { radius: 0.2 }), rectangle(0.2, 0.2)] {
        let body = moving(Particle::new("slider", shape, at(0.3, 0.2, 0.0)), 1.0, 0.0, 0.0);
        let mut particles = world(vec![body], &floor, Law::Inelastic);
        let drive = gravity(&particles);
        for _ in 0..350 {
            particles.step(0.01, &drive).expect("the step succeeds");
        }
        let pose = particles.bodies()[0].pose;
        assert!((pose.position - Point::new(3.8, 0.2)).norm() < 1e-9, "it came to {pose:?}");
    }
}

#[test]
fn a_disc_runs_around_inside_of_a_drum() {
    let wall = [Wall::Hollow { centre: Point::new(0.0, 0.0), radius: 1.0 }];
    let mut particles = world(vec![moving(disc("ball", 0.1, 0.9, 0.0), 0.0, 1.0, 0.0)], &wall, Law::Inelastic);
    for _ in 0..1000 {
        let report = particles.step(1e-2, &nothing).expect("the step succeeds");
        assert!(report.overlap() < 1e-12, "overlap {:e}", report.overlap());
    }
    let body = &particles.bodies()[0];
    assert!((body.pose.position.norm() - 0.9).abs() < 0.01);
    // the wall does no work, up to Δt²
    let speed = body.twist.velocity.norm();
    assert!((speed - 1.0).abs() < 1e-4, "speed {speed}");
}

#[test]
fn a_pinned_bar_turns_about_its_pin() {
    let mut bar = Particle::new("bar", rectangle(1.0, 0.1), at(0.0, 0.0, 0.0));
    bar.motion = Motion::Pinned(Point::new(-0.8, 0.0));
    let about = bar.inertia + bar.mass * 0.64;
    let ball = moving(disc("ball", 0.2, 0.8, 0.31), 0.0, -1.0, 0.0);
    let mass = ball.mass;
    let mut particles = world(vec![bar, ball], &[], Law::Inelastic);
    // about the pin
    let momentum = |p: &Particles| {
        let ball = &p.bodies()[1];
        about * p.bodies()[0].twist.spin
            + mass * (ball.pose.position - Point::new(-0.8, 0.0)).perp(&ball.twist.velocity)
    };
    let start = momentum(&particles);
    for _ in 0..50 {
        let report = particles.step(0.02, &nothing).expect("the step succeeds");
        assert!(report.overlap() < 1e-11, "overlap {:e}", report.overlap());
        assert!((momentum(&particles) - start).abs() < 1e-9, "{} became {}", start, momentum(&particles));
        let bar = &particles.bodies()[0];
        assert!((bar.pose.to_space(Point::new(-0.8, 0.0)) - Point::new(-0.8, 0.0)).norm() < 1e-12);
    }
    assert!(particles.bodies()[0].twist.spin < -0.1);
}

/// A plunger on a path that pushes everything against a wall.
struct Plunger {
    stop: f64,
}

impl Drive for Plunger {
    fn load(&self, _: usize, _: f64, _: &Pose, _: &Twist) -> [f64; 3] {
        [0.0; 3]
    }

    fn pose(&self, _: usize, t: f64, _: &Pose) -> Pose {
        at(0.5 + t.min(self.stop), 0.0, 0.0)
    }
}

#[test]
fn obstacles_push_and_bodies_that_are_caught_are_named() {
    let mut plunger = Particle::new("plunger", rectangle(0.5, 1.0), at(0.5, 0.0, 0.0));
    plunger.motion = Motion::Path;
    let bodies = vec![plunger, disc("a", 0.25, 2.0, 0.0), disc("b", 0.25, 3.0, 0.0)];
    let wall = [Wall::Segment([Point::new(4.0, -2.0), Point::new(4.0, 2.0)])];
    let mut particles = world(bodies.clone(), &wall, Law::Inelastic);
    for _ in 0..300 {
        let report = particles.step(0.01, &Plunger { stop: 1.9 }).expect("there is room");
        assert!(report.overlap() < 1e-11, "overlap {:e}", report.overlap());
    }
    assert!(particles.bodies()[1].pose.position.x >= 3.15 - 1e-9);
    let mut particles = world(bodies, &wall, Law::Inelastic);
    let error = (0..300).find_map(|_| particles.step(0.01, &Plunger { stop: 9.0 }).err()).expect("there is no room");
    assert!(matches!(error, ContactError::Caught { .. }), "{error}");
    assert!(particles.time() < 2.1 && particles.time() > 1.9, "caught at {}", particles.time());
}

#[test]
fn overdamped_bodies_move_as_their_forces_and_stop_at_walls() {
    let floor = [Wall::Segment([Point::new(-5.0, 0.0), Point::new(5.0, 0.0)])];
    let solver = Solver::new(&floor, settings(Law::Inelastic)).expect("the settings are good");
    let body = disc("a", 0.5, 0.0, 1.0);
    let mass = body.mass;
    let mut particles = Particles::new(vec![body], Dynamics::Overdamped { drag: 2.0 }, solver).expect("a good start");
    let drive = move |_: usize, _: f64, _: &Pose, _: &Twist| [mass, -mass, 0.0];
    let report = particles.step(0.1, &drive).expect("the step succeeds");
    assert!((particles.bodies()[0].twist.velocity - Point::new(0.5, -0.5)).norm() < 1e-14 && report.touching() == 0);
    let mut report = report;
    for _ in 0..20 {
        report = particles.step(0.1, &drive).expect("the step succeeds");
    }
    assert!((particles.bodies()[0].pose.position.y - 0.5).abs() < 1e-12);
    assert!((report.wall_force.y + mass).abs() < 1e-9, "force {}", report.wall_force.y);
    let solver = Solver::new(&floor, settings(Law::Inelastic)).expect("the settings are good");
    assert!(Particles::new(vec![disc("a", 0.5, 0.0, 1.0)], Dynamics::Overdamped { drag: 0.0 }, solver).is_err());
}

#[test]
fn methods_agree_on_a_pile() {
    let make = |method| {
        let solver = Solver::new(&open_box(0.8, 4.0), Settings { method, tolerance: 1e-10, ..Settings::default() })
            .expect("good");
        Particles::new(scattered(25, [0.05, 0.1], 0.8, 12), Dynamics::Inertial { drag: 0.0 }, solver).expect("good")
    };
    let mut newton = make(Method::Newton);
    let drive = gravity(&newton);
    let mut solves = [0, 0];
    for k in 0..80 {
        let state = newton.state();
        let report = newton.step(0.01, &drive).expect("Newton converges");
        if k % 20 != 19 {
            continue;
        }
        let mut uzawa = make(Method::Uzawa);
        uzawa.restore(state);
        let other = uzawa.step(0.01, &drive).expect("Uzawa converges");
        solves[0] += report.effort.iterations;
        solves[1] += other.effort.iterations;
        for (a, b) in newton.bodies().iter().zip(uzawa.bodies()) {
            assert!((a.twist.velocity - b.twist.velocity).norm() < 1e-5, "{}: {:?} {:?}", a.name, a.twist, b.twist);
        }
    }
    assert!(solves[1] >= 20 * solves[0], "{solves:?} iterations");
}

#[test]
fn a_light_disc_is_not_shot_through_a_wall() {
    // the blow makes it far faster than anything was before
    let heavy = Particle { mass: 1e6, ..moving(disc("heavy", 0.5, 0.0, 0.0), 100.0, 0.0, 0.0) };
    let light = Particle { mass: 1e-3, ..disc("light", 0.01, 0.52, 0.0) };
    let wall = [Wall::Segment([Point::new(2.0, -2.0), Point::new(2.0, 2.0)])];
    let mut particles = world(vec![heavy, light], &wall, Law::Inelastic);
    for _ in 0..10 {
        let report = particles.step(0.01, &nothing).expect("the step succeeds");
        assert!(report.overlap() < 1e-11);
    }
    assert!(particles.bodies().iter().all(|b| b.pose.position.x < 2.0));
}
