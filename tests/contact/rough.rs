//! Coulomb's friction and restitution, against what is known of single bodies, and their rules in many.

use monolayer::contact::particles::{Drive, Dynamics, Motion, Particle, Particles, StepReport};
use monolayer::contact::{ContactError, Law, Settings, Solver, Wall};
use monolayer::mesh::Point;
use monolayer::shape::{Pose, Shape, Twist};
use rand::RngExt;

use crate::common::{at, disc, gravity, moving, open_box, rectangle, regular, rng, scattered, shortened};

fn rough(bodies: Vec<Particle>, walls: &[Wall], friction: f64, restitution: f64) -> Particles {
    let settings = Settings { friction, restitution, ..Settings::default() };
    let solver = Solver::new(walls, settings).expect("the settings are good");
    Particles::new(bodies, Dynamics::Inertial { drag: 0.0 }, solver).expect("the start is good")
}

/// A plane through the origin that falls towards the right.
fn incline(angle: f64) -> [Wall; 1] {
    let along = Point::new(angle.cos(), -angle.sin());
    [Wall::Segment([-100.0 * along, 100.0 * along])]
}

/// A body that lies on the plane, turned with it.
fn lying(shape: Shape, height: f64, angle: f64) -> Particle {
    let normal = Point::new(angle.sin(), angle.cos());
    Particle::new("body", shape, Pose { position: height * normal, angle: -angle })
}

#[test]
fn a_block_on_an_incline_stays_or_slides_as_coulomb_says() {
    let angle: f64 = 0.3;
    for friction in [0.1, 0.2, 0.32, 0.5] {
        let mut particles = rough(vec![lying(rectangle(0.4, 0.1), 0.1, angle)], &incline(angle), friction, 0.0);
        let drive = gravity(&particles);
        let start = particles.bodies()[0].pose;
        let steps = 200;
        for _ in 0..steps {
            let report = particles.step(0.01, &drive).expect("the step succeeds");
            let [normal, sliding]: [f64; 2] =
                [report.contacts.iter().map(|c| c.force).sum(), report.contacts.iter().map(|c| c.friction).sum()];
            let mass = particles.bodies()[0].mass;
            assert!((normal - mass * angle.cos()).abs() < 1e-7 * mass, "the plane carries {normal}");
            let expected = mass * angle.sin().min(friction * angle.cos());
            assert!((sliding.abs() - expected).abs() < 1e-7 * mass, "μ = {friction}: {sliding} for {expected}");
        }
        let body = &particles.bodies()[0];
        let acceleration = (angle.sin() - friction * angle.cos()).max(0.0);
        let t = 0.01 * f64::from(steps);
        let speed = body.twist.velocity.norm();
        assert!((speed - acceleration * t).abs() < 1e-9, "μ = {friction}: speed {speed}, not {}", acceleration * t);
        let way = (body.pose.position - start.position).norm();
        let expected = 0.5 * acceleration * t * (t + 0.01);
        assert!((way - expected).abs() < 1e-9, "μ = {friction}: it went {way}, not {expected}");
        assert!((body.pose.angle - start.angle).abs() < 1e-9);
    }
}

#[test]
fn a_disc_rolls_down_an_incline_or_slides_while_it_turns() {
    let angle: f64 = 0.5;
    for friction in [0.1, 0.18, 0.19, 0.6] {
        let mut particles =
            rough(vec![lying(disc("", 0.2, 0.0, 0.0).shape, 0.2, angle)], &incline(angle), friction, 0.0);
        let drive = gravity(&particles);
        for _ in 0..200 {
            particles.step(0.01, &drive).expect("the step succeeds");
        }
        let body = &particles.bodies()[0];
        // rolls where tan α < 3 μ
        let rolls = angle.tan() < 3.0 * friction;
        let acceleration = if rolls { 2.0 / 3.0 * angle.sin() } else { angle.sin() - friction * angle.cos() };
        let spin = if rolls { acceleration / 0.2 } else { 2.0 * friction * angle.cos() / 0.2 };
        let found = [body.twist.velocity.norm(), -body.twist.spin];
        for (found, rate) in found.iter().zip([acceleration, spin]) {
            assert!((found - 2.0 * rate).abs() < 1e-9 * rate, "μ = {friction}: {found}, not {}", 2.0 * rate);
        }
    }
}

#[test]
fn a_bowled_disc_slides_until_it_rolls_at_two_thirds_of_its_speed() {
    let friction = 0.25;
    let mut particles = rough(vec![moving(disc("bowl", 0.1, 0.0, 0.1), 1.0, 0.0, 0.0)], &incline(0.0), friction, 0.0);
    let drive = gravity(&particles);
    let mut rolls = f64::NAN;
    for k in 0..400 {
        let report = particles.step(0.005, &drive).expect("the step succeeds");
        let sliding: f64 = report.contacts.iter().map(|c| c.friction).sum();
        if rolls.is_nan() && sliding.abs() < 1e-9 {
            rolls = 0.005 * f64::from(k);
        }
    }
    let Twist { velocity, spin } = particles.bodies()[0].twist;
    assert!((velocity.x - 2.0 / 3.0).abs() < 1e-9 && (spin + velocity.x / 0.1).abs() < 1e-8, "{velocity} {spin}");
    let expected = 1.0 / (3.0 * friction);
    assert!((rolls - expected).abs() < 0.011, "it rolls at {rolls}, not {expected}");
}

#[test]
fn three_discs_pile_up_where_friction_carries_them() {
    // the upper disc leans on the lower ones at 30°: they stand where μ > tan 15° = 0.268
    for (friction, stands) in [(0.25, false), (0.28, true)] {
        let bodies = vec![
            disc("left", 0.5, -0.5, 0.5),
            disc("right", 0.5, 0.5, 0.5),
            disc("top", 0.5, 0.0, 0.5 + 0.75_f64.sqrt()),
        ];
        let mut particles = rough(bodies, &incline(0.0), friction, 0.0);
        let drive = gravity(&particles);
        for _ in 0..300 {
            particles.step(0.01, &drive).expect("the step succeeds");
        }
        let top = particles.bodies()[2].pose.position.y;
        let start = 0.5 + 0.75_f64.sqrt();
        assert!(
            if stands { (top - start).abs() < 1e-9 } else { top < start - 0.02 },
            "μ = {friction}: {top} of {start}"
        );
    }
}

#[test]
fn a_moving_belt_takes_a_block_along() {
    struct Belt;
    impl Drive for Belt {
        fn load(&self, body: usize, _: f64, _: &Pose, _: &Twist) -> [f64; 3] {
            [0.0, if body == 0 { -0.16 } else { 0.0 }, 0.0]
        }
        fn twist(&self, _: usize, _: f64, _: &Pose) -> Twist {
            Twist { velocity: Point::new(0.5, 0.0), spin: 0.0 }
        }
    }
    let mut belt = Particle::new("belt", rectangle(50.0, 0.1), at(0.0, -0.1, 0.0));
    belt.motion = Motion::Held;
    let block = Particle::new("block", rectangle(0.4, 0.1), at(0.0, 0.1, 0.0));
    let mut particles = rough(vec![block, belt], &[], 0.3, 0.0);
    for k in 0..300 {
        particles.step(0.01, &Belt).expect("the step succeeds");
        let expected = (0.3 * 0.01 * f64::from(k + 1)).min(0.5);
        let speed = particles.bodies()[0].twist.velocity.x;
        assert!((speed - expected).abs() < 1e-9, "{speed} at step {k}, not {expected}");
    }
}

#[test]
fn a_dropped_disc_bounces_to_the_square_of_the_restitution() {
    for restitution in [0.0, 0.5, 0.8, 1.0] {
        let errors = [2e-3, 1e-3].map(|dt| {
            let mut particles = rough(vec![disc("ball", 0.1, 0.0, 1.1)], &incline(0.0), 0.0, restitution);
            let drive = gravity(&particles);
            let (mut top, mut struck) = (0.0_f64, false);
            // it falls for √2, and is at the top again after √2 e
            for _ in 0..((1.0 + 1.3 * restitution) * 2.0_f64.sqrt() / dt) as usize {
                let report = particles.step(dt, &drive).expect("the step succeeds");
                assert!(report.overlap() < 1e-12, "overlap {:e}", report.overlap());
                struck |= report.touching() > 0;
                if struck {
                    top = top.max(particles.bodies()[0].pose.position.y - 0.1);
                }
            }
            assert!(struck);
            (top - restitution * restitution).abs()
        });
        println!("e = {restitution}: {errors:?}");
        assert!(errors[1] < 5e-3 && errors[1] < 0.6 * errors[0] + 1e-9, "e = {restitution}: {errors:?}");
    }
}

#[test]
fn two_discs_part_at_the_share_of_their_speed() {
    for (ratio, restitution) in [(1.0, 1.0), (1.0, 0.3), (100.0, 0.9), (0.01, 0.5)] {
        let mut left = moving(disc("left", 0.2, -0.5, 0.03), 1.0, 0.0, 0.0);
        left.mass *= ratio;
        let mut particles =
            rough(vec![left, moving(disc("right", 0.3, 0.5, 0.0), -0.4, 0.1, 0.0)], &[], 0.0, restitution);
        let (before, mut normal) = ([0, 1].map(|k| particles.bodies()[k].twist.velocity), Point::zeros());
        for _ in 0..100 {
            let report = particles.step(0.01, &|_: usize, _: f64, _: &Pose, _: &Twist| [0.0; 3]).expect("it succeeds");
            if let Some(contact) = report.contacts.iter().find(|contact| contact.force > 0.0) {
                normal = contact.normal;
            }
        }
        let after = [0, 1].map(|k| particles.bodies()[k].twist.velocity);
        let speed = |v: [Point; 2]| normal.dot(&(v[1] - v[0]));
        assert!(normal.norm() > 0.5, "they do not meet");
        // the normal turns by the way of a step
        assert!((speed(after) / speed(before) + restitution).abs() < 0.02, "{} of {}", speed(after), speed(before));
    }
}

/// Energy, momentum and the cone in a crowd that flies together.
#[test]
fn a_rough_crowd_keeps_momentum_gains_no_energy_and_obeys_coulomb() {
    for (friction, restitution) in [(0.3, 0.0), (1.0, 0.0), (0.0, 0.7), (0.4, 0.5), (0.0, 1.0)] {
        let mut rng = rng(5);
        let bodies: Vec<Particle> = (0..25)
            .map(|k| {
                let shape = match k % 3 {
                    0 => disc("", 0.35, 0.0, 0.0).shape,
                    1 => rectangle(0.35, 0.2),
                    _ => regular(5, 0.4),
                };
                let pose = at((k % 5) as f64 - 2.0, (k / 5) as f64 - 2.0, rng.random_range(0.0..6.0));
                let towards = -0.6 * pose.position;
                moving(
                    Particle::new(format!("{k}"), shape, pose),
                    towards.x,
                    towards.y + 0.1,
                    rng.random_range(-1.0..1.0),
                )
            })
            .collect();
        let mut particles = rough(bodies, &[], friction, restitution);
        let momentum = |p: &Particles| {
            p.bodies().iter().fold([0.0; 3], |[x, y, turn], b| {
                let (m, v) = (b.mass, b.twist.velocity);
                [x + m * v.x, y + m * v.y, turn + m * b.pose.position.perp(&v) + b.inertia * b.twist.spin]
            })
        };
        let (start, first) = (momentum(&particles), particles.kinetic_energy());
        let (mut energy, mut met, mut slid) = (first, 0, 0);
        for k in 0..150 {
            let report: StepReport = particles
                .step(0.01, &|_: usize, _: f64, _: &Pose, _: &Twist| [0.0; 3])
                .unwrap_or_else(|e| panic!("μ = {friction}, e = {restitution}, step {k}: {e}"));
            let next = report.kinetic_energy;
            assert!(report.overlap() < 1e-11, "overlap {:e} at step {k}", report.overlap());
            assert!(
                next <= energy * (1.0 + 1e-12),
                "μ = {friction}, e = {restitution}: {energy} to {next} at step {k}"
            );
            for c in &report.contacts {
                assert!(c.force >= 0.0 && c.friction.abs() <= friction * c.force * (1.0 + 1e-12), "{c:?}");
                met += usize::from(c.force > 0.0);
                slid += usize::from(c.force > 0.0 && c.friction.abs() > friction * c.force * (1.0 - 1e-9));
            }
            energy = next;
        }
        for (a, b) in start.iter().zip(momentum(&particles)) {
            assert!(
                (a - b).abs() < 1e-10,
                "μ = {friction}, e = {restitution}: {start:?} to {:?}",
                momentum(&particles)
            );
        }
        println!("μ = {friction}, e = {restitution}: {first} to {energy}, {met} contacts, {slid} of them slide");
        assert!(met > 20);
    }
}

#[test]
fn discs_pour_into_a_rough_box_and_come_to_rest() {
    let mut particles = rough(scattered(20, [0.05, 0.1], 0.9, 4), &open_box(0.9, 6.0), 0.5, 0.2);
    let drive = gravity(&particles);
    let mut last = None;
    for _ in 0..800 {
        for report in shortened(&mut particles, 5e-3, &drive) {
            assert!(report.overlap() < 1e-11);
            last = Some(report);
        }
    }
    let report = last.expect("there were steps");
    let weight: f64 = particles.bodies().iter().map(|b| b.mass).sum();
    assert!(report.kinetic_energy < 1e-6, "an energy of {:e} is left", report.kinetic_energy);
    assert!((report.wall_force.y + weight).abs() < 1e-2 * weight, "the walls carry {}", report.wall_force.y);
}

#[test]
fn settings_out_of_their_ranges_are_refused() {
    let refused = |settings: Settings| match Solver::new(&[], settings) {
        Err(ContactError::Setting { key, .. }) => key,
        other => panic!("{other:?}"),
    };
    for friction in [-0.1, f64::NAN, f64::INFINITY] {
        assert_eq!(refused(Settings { friction, ..Settings::default() }), "friction");
    }
    for restitution in [-0.1, 1.1, f64::NAN] {
        assert_eq!(refused(Settings { restitution, ..Settings::default() }), "restitution");
    }
    let law = Law::Gluey { gamma_min: -1.0 };
    assert_eq!(refused(Settings { law, friction: 0.1, ..Settings::default() }), "friction");
    assert_eq!(refused(Settings { law, restitution: 0.1, ..Settings::default() }), "restitution");
}
