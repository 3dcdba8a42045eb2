//! How fast contact is solved: `cargo run --release --example contact [COUNT…]`.
//!
//! Discs of radius 0.015 to 0.025 fall past fixed discs of radius 0.05 to the bottom of a box 2 wide and 6 high, until
//! the pile rests. Then the next step of the resting pile is made by every method, to the same tolerance. At last a
//! particle over a plane is pressed and pulled in gluey contact. Before it the fall is made with larger tolerances, for
//! what they leave of overlap and what they spare. More than 1000 discs get a box as many times as wide.
//! Seconds are those of the processor, where the system tells them.

use std::io::Write;
use std::time::Instant;

use monolayer::contact::particles::{Drive, Dynamics, Motion, Particle, Particles};
use monolayer::contact::{Bonds, ContactError, Law, Method, Settings, Solver, Wall};
use monolayer::mesh::Point;
use monolayer::shape::{Disc, Pose, Shape, Twist};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const WIDTH: f64 = 2.0;
const HEIGHT: f64 = 6.0;
const RADIUS: [f64; 2] = [0.015, 0.025];
/// Height of a row of obstacles, and where they are in it.
const OBSTACLES: [(f64, [f64; 6]); 4] = [
    (1.2, [0.2, 0.5, 0.8, 1.2, 1.5, 1.8]),
    (1.5, [0.05, 0.4, 0.75, 1.1, 1.45, 1.8]),
    (1.8, [0.2, 0.5, 0.8, 1.2, 1.5, 1.8]),
    (2.1, [0.05, 0.4, 0.75, 1.1, 1.45, 1.8]),
];
const STEP: f64 = 0.005;
const SETTLING: usize = 8;
const END: usize = 12;

/// Seconds that this thread has used; those that have passed, where the system does not tell.
struct Watch(Instant);

impl Watch {
    fn seconds(&self) -> f64 {
        let used = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
        let used = used.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
        used.map_or_else(|| self.0.elapsed().as_secs_f64(), |nanoseconds| 1e-9 * nanoseconds)
    }
}

/// `count` discs at random over the obstacles of a box.
fn falling(count: usize, settings: Settings) -> Result<Particles, ContactError> {
    let boxes = count.div_ceil(1000);
    let width = boxes as f64 * WIDTH;
    let mut bodies = Vec::new();
    for (y, row) in OBSTACLES {
        for (k, x) in (0..boxes).flat_map(|k| row.map(|x| (k, x))) {
            let pose = Pose { position: Point::new(k as f64 * WIDTH + x, y), angle: 0.0 };
            let obstacle =
                Particle::new(format!("obstacle-{}", bodies.len()), Shape::from(Disc { radius: 0.05 }), pose);
            bodies.push(Particle { motion: Motion::Fixed, ..obstacle });
        }
    }
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut placed: Vec<(Point, f64)> = Vec::new();
    while placed.len() < count {
        let r = rng.random_range(RADIUS[0]..RADIUS[1]);
        let x = Point::new(rng.random_range(r..width - r), rng.random_range(2.5 + r..HEIGHT - r));
        if placed.iter().all(|(y, s)| (x - y).norm() > r + s) {
            placed.push((x, r));
        }
    }
    bodies.extend(placed.into_iter().enumerate().map(|(k, (position, radius))| {
        Particle::new(format!("disc-{k}"), Shape::from(Disc { radius }), Pose { position, angle: 0.0 })
    }));
    let p = Point::new;
    let walls = [
        Wall::Segment([p(0.0, HEIGHT), p(0.0, 0.0)]),
        Wall::Segment([p(0.0, 0.0), p(width, 0.0)]),
        Wall::Segment([p(width, 0.0), p(width, HEIGHT)]),
    ];
    Particles::new(bodies, Dynamics::Inertial { drag: 0.0 }, Solver::new(&walls, settings)?)
}

fn weight(particles: &Particles) -> impl Drive + use<> {
    let masses: Vec<f64> = particles.bodies().iter().map(|b| b.mass).collect();
    move |k: usize, _: f64, _: &Pose, _: &Twist| [0.0, -masses[k], 0.0]
}

/// The fall in a table, a line per unit of time; the pile while it settles, and at rest.
fn fall(count: usize) -> Result<[Particles; 2], ContactError> {
    let mut particles = falling(count, Settings::default())?;
    let drive = weight(&particles);
    let watch = Watch(Instant::now());
    let (begin, mut carried) = (watch.seconds(), 0);
    let mut settling = particles.clone();
    println!("{count} discs, steps of {STEP}; every line is a mean over a unit of time");
    println!(
        "{:>4} {:>8} {:>8} {:>11} {:>5} {:>8} {:>9} {:>8} {:>14} {:>10}",
        "time",
        "contacts",
        "pairs",
        "iterations",
        "most",
        "factors",
        "overlap/r",
        "ms/step",
        "contact-steps/s",
        "energy"
    );
    let steps = (1.0 / STEP).round() as usize;
    for unit in 1..=END {
        let start = watch.seconds();
        let (mut iterations, mut most, mut factorisations, mut contacts, mut pairs) = (0, 0, 0, 0, 0);
        let mut overlap: f64 = 0.0;
        for _ in 0..steps {
            let report = particles.step(STEP, &drive)?;
            iterations += report.effort.iterations;
            most = most.max(report.effort.iterations);
            factorisations += report.effort.factorisations;
            contacts += report.touching();
            pairs += report.effort.rows;
            overlap = overlap.max(report.overlap() / RADIUS[0]);
        }
        carried += contacts;
        if unit == SETTLING {
            settling = particles.clone();
        }
        let (seconds, mean) = (watch.seconds() - start, |sum: usize| sum as f64 / steps as f64);
        println!(
            "{unit:>4} {:>8.0} {:>8.0} {:>11.2} {most:>5} {:>8.2} {overlap:>9.1e} {:>8.2} {:>14.0} {:>11.1e}",
            mean(contacts),
            mean(pairs),
            mean(iterations),
            mean(factorisations),
            1e3 * seconds / steps as f64,
            contacts as f64 / seconds,
            particles.kinetic_energy()
        );
    }
    let seconds = watch.seconds() - begin;
    println!(
        "all: {seconds:.1} s, {:.0} contact-steps per second (contacts that carry a force)",
        carried as f64 / seconds
    );
    Ok([settling, particles])
}

/// The worst overlap in the fall, and what a step costs, by the tolerance of contact.
fn trade(count: usize) -> Result<(), ContactError> {
    println!("tolerance, worst overlap/r in the fall, ms/step, iterations/step, factors/step");
    let watch = Watch(Instant::now());
    let steps = (END as f64 / STEP).round() as usize;
    for tolerance in [1e-12, 1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3] {
        let mut particles = falling(count, Settings { tolerance, ..Settings::default() })?;
        let drive = weight(&particles);
        let (start, mut overlap) = (watch.seconds(), 0.0_f64);
        let (mut iterations, mut factorisations) = (0, 0);
        for _ in 0..steps {
            let report = particles.step(STEP, &drive)?;
            overlap = overlap.max(report.overlap() / RADIUS[0]);
            iterations += report.effort.iterations;
            factorisations += report.effort.factorisations;
        }
        let (seconds, mean) = (watch.seconds() - start, |sum: usize| sum as f64 / steps as f64);
        println!(
            "{tolerance:>9.0e} {overlap:>8.1e} {:>6.2} {:>6.2} {:>6.2}",
            1e3 * seconds / steps as f64,
            mean(iterations),
            mean(factorisations)
        );
        std::io::stdout().flush().ok();
    }
    Ok(())
}

/// The next step by every method, from the multipliers of the last step or from nothing.
fn compare(particles: &Particles, warm: bool) -> Result<(), ContactError> {
    let from = if warm { "the multipliers of the last step" } else { "nothing" };
    println!(
        "\nat t = {:.0}, the next step from {from}: iterations, seconds, iterations per Newton's",
        particles.time()
    );
    let watch = Watch(Instant::now());
    let mut newton = f64::NAN;
    for method in [Method::Newton, Method::Accelerated, Method::Uzawa] {
        let settings = Settings { method, ..*particles.solver().settings() };
        let solver = Solver::new(particles.solver().walls(), settings)?;
        let mut other = Particles::new(particles.bodies().to_vec(), Dynamics::Inertial { drag: 0.0 }, solver)?;
        let mut state = particles.state();
        if !warm {
            state.bonds = Bonds::default();
        }
        other.restore(state);
        let start = watch.seconds();
        let (iterations, sign, note) = match other.step(STEP, &weight(particles)) {
            Ok(report) => (report.effort.iterations, "", String::new()),
            Err(ContactError::Caught { iterations, miss, .. }) => {
                (iterations, ">", format!("not converged: a gap is missed by {miss:.1e}"))
            }
            Err(error) => return Err(error),
        };
        if method == Method::Newton {
            newton = iterations as f64;
        }
        let (name, seconds) = (format!("{method:?}"), watch.seconds() - start);
        println!(
            "{name:>12} {sign:>1}{iterations:>8} {seconds:>9.4} {sign:>1}{:>9.0} {note}",
            iterations as f64 / newton
        );
        std::io::stdout().flush().ok();
    }
    Ok(())
}

/// Largest error in q, time of contact and of release of a particle over a plane.
fn push_pull(dt: f64) -> Result<[f64; 3], ContactError> {
    let pose = Pose { position: Point::new(0.0, 1.5), angle: 0.0 };
    let mut particle = Particle::new("particle", Shape::from(Disc { radius: 1.0 }), pose);
    particle.mass = 1.0;
    let wall = Wall::Segment([Point::new(-9.0, 0.0), Point::new(9.0, 0.0)]);
    let settings = Settings { law: Law::Gluey { gamma_min: f64::NEG_INFINITY }, ..Settings::default() };
    let mut particles =
        Particles::new(vec![particle], Dynamics::Inertial { drag: 0.0 }, Solver::new(&[wall], settings)?)?;
    let drive = |_: usize, t: f64, _: &Pose, _: &Twist| [0.0, if t < 2.0 - 1e-9 { -1.0 } else { 1.0 }, 0.0];
    let (mut error, mut contact, mut release) = (0.0f64, f64::NAN, f64::NAN);
    for k in 1..=(6.0 / dt).round() as usize {
        particles.step(dt, &drive)?;
        let (t, q) = (k as f64 * dt, particles.bodies()[0].pose.position.y - 1.0);
        let exact = if t < 1.0 { 0.5 - 0.5 * t * t } else { 0.5 * (t - 4.0).max(0.0).powi(2) };
        error = error.max((q - exact).abs());
        if q <= 1e-10 && contact.is_nan() {
            contact = t;
        }
        if q > 1e-10 && !contact.is_nan() && release.is_nan() {
            release = t;
        }
    }
    Ok([error, contact, release])
}

fn main() -> Result<(), ContactError> {
    let asked: Vec<usize> = std::env::args().skip(1).filter_map(|count| count.parse().ok()).collect();
    for count in if asked.is_empty() { vec![1000] } else { asked } {
        let [settling, rest] = fall(count)?;
        compare(&settling, true)?;
        compare(&rest, true)?;
        compare(&rest, false)?;
        println!();
        trade(count)?;
        println!();
    }
    println!("a particle over a plane, pressed and pulled: dt, largest error, contact, release, order");
    let mut last: Option<f64> = None;
    for dt in [1e-2, 1e-3, 1e-4] {
        let [error, contact, release] = push_pull(dt)?;
        let order = last.map_or(String::new(), |last| format!("{:.2}", (last / error).log10()));
        println!("{dt:>8} {error:.3e} {contact:.4} {release:.4} {order}");
        last = Some(error);
    }
    Ok(())
}
