//! How fast contact is solved: `cargo run --release --example contact`.
//!
//! Discs fall into a box; every step is projected by the Newton method, and some of the steps by Uzawa's method and its accelerated form as well,
//! to the same tolerance and from nothing. Then a particle over a plane is pressed and pulled in gluey contact.

use std::time::Instant;

use monolayer::body::{Pose, Shape, Twist};
use monolayer::contact::particles::{Dynamics, Particle, Particles};
use monolayer::contact::{ContactError, Law, Method, Settings, Solver, Wall};
use monolayer::mesh::Point;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A box with about square piles of `count` discs of radius 0.015 to 0.025.
fn pile(count: usize, settings: Settings) -> Result<Particles, ContactError> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let pitch = 0.0502;
    let columns = (count as f64).sqrt().ceil();
    let width = columns * pitch;
    let discs = (0..count).map(|k| {
        let radius = rng.random_range(0.015..0.025);
        let x = (0.5 + (k as f64 % columns).floor()) * pitch + rng.random_range(-1e-4..1e-4);
        let y = (0.5 + (k as f64 / columns).floor()) * pitch;
        let pose = Pose { position: Point::new(x, y), angle: 0.0 };
        Particle::new(format!("disc-{k}"), Shape::Disc { radius }, pose)
    });
    let p = Point::new;
    let walls = [
        Wall::Segment([p(0.0, 9.0), p(0.0, 0.0)]),
        Wall::Segment([p(0.0, 0.0), p(width, 0.0)]),
        Wall::Segment([p(width, 0.0), p(width, 9.0)]),
    ];
    Particles::new(discs.collect(), Dynamics::Inertial { drag: 0.0 }, Solver::new(&walls, settings)?)
}

/// Steps of a pile; iterations per step on the mean over the second half, and what the same projections take cold by the other methods.
fn fall(count: usize, dt: f64, end: f64) -> Result<(), ContactError> {
    let settings = Settings::default();
    let mut particles = pile(count, settings)?;
    let masses: Vec<f64> = particles.bodies().iter().map(|b| b.mass).collect();
    let drive = move |k: usize, _: f64, _: &Pose, _: &Twist| [0.0, -masses[k], 0.0];
    let steps = (end / dt).round() as usize;
    let (mut iterations, mut factorisations, mut contacts, mut most, mut overlap) = (0, 0, 0, 0, 0.0f64);
    let mut seconds = 0.0;
    for _ in 0..steps {
        let begin = Instant::now();
        let report = particles.step(dt, &drive)?;
        seconds += begin.elapsed().as_secs_f64();
        iterations += report.effort.iterations;
        factorisations += report.effort.factorisations;
        most = most.max(report.effort.iterations);
        contacts += report.touching();
        overlap = overlap.max(report.overlap() / 0.015);
    }
    let mut methods = Vec::new();
    for method in [Method::Newton, Method::Accelerated, Method::Uzawa] {
        let solver = Solver::new(particles.solver().walls(), Settings { method, ..settings })?;
        let mut cold = Particles::new(particles.bodies().to_vec(), Dynamics::Inertial { drag: 0.0 }, solver)?;
        let begin = Instant::now();
        methods.push(match cold.step(dt, &drive) {
            Ok(report) => format!("{:>9} {:>8.3}", report.effort.iterations, begin.elapsed().as_secs_f64()),
            Err(_) => format!("{:>9} {:>8.3}", "none", begin.elapsed().as_secs_f64()),
        });
    }
    println!(
        "{count:>6} {dt:>8} {steps:>6} {:>9.1} {:>8.2} {:>8.2} {most:>6} {overlap:>9.1e} {:>12.0}   {}",
        contacts as f64 / steps as f64,
        iterations as f64 / steps as f64,
        factorisations as f64 / steps as f64,
        contacts as f64 / seconds,
        methods.join("   ")
    );
    Ok(())
}

/// Largest error in q, time of contact and of release of a particle over a plane.
fn push_pull(dt: f64) -> Result<[f64; 3], ContactError> {
    let pose = Pose { position: Point::new(0.0, 1.5), angle: 0.0 };
    let mut particle = Particle::new("particle", Shape::Disc { radius: 1.0 }, pose);
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
        if q <= 1e-12 && contact.is_nan() {
            contact = t;
        }
        if q > 1e-12 && !contact.is_nan() && release.is_nan() {
            release = t;
        }
    }
    Ok([error, contact, release])
}

fn main() -> Result<(), ContactError> {
    println!(
        "discs falling into a box; per step: contacts, solves, factorisations; most solves; overlap in radii; contact-steps per second"
    );
    println!("one more step from nothing: iterations and seconds of Newton, accelerated Uzawa, Uzawa");
    let full = std::env::args().nth(1).is_some_and(|size| size == "full");
    let sizes: &[usize] = if full { &[100, 300, 1000, 3000] } else { &[100, 1000] };
    for &count in sizes {
        for dt in [1e-2, 1e-3] {
            fall(count, dt, if dt > 5e-3 { 1.0 } else { 0.3 })?;
        }
    }
    println!("\na particle over a plane, pressed and pulled: dt, largest error, contact, release, order");
    let mut last: Option<f64> = None;
    for dt in [1e-2, 1e-3, 1e-4] {
        let [error, contact, release] = push_pull(dt)?;
        let order = last.map_or(String::new(), |last| format!("{:.2}", (last / error).log10()));
        println!("{dt:>8} {error:.3e} {contact:.4} {release:.4} {order}");
        last = Some(error);
    }
    Ok(())
}
