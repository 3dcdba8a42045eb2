//! Bodies of the tests.

use monolayer::contact::particles::{Drive, Dynamics, Particle, Particles, StepReport};
use monolayer::contact::{Law, Settings, Solver, Wall};
use monolayer::mesh::Point;
use monolayer::shape::{Disc, Polygon, Pose, Shape, Twist};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub fn at(x: f64, y: f64, angle: f64) -> Pose {
    Pose { position: Point::new(x, y), angle }
}

pub fn disc(name: &str, radius: f64, x: f64, y: f64) -> Particle {
    Particle::new(name, Shape::from(Disc { radius }), at(x, y, 0.0))
}

pub fn moving(mut particle: Particle, vx: f64, vy: f64, spin: f64) -> Particle {
    particle.twist = Twist { velocity: Point::new(vx, vy), spin };
    particle
}

/// A rectangle about its centre.
pub fn rectangle(half_width: f64, half_height: f64) -> Shape {
    let (w, h) = (half_width, half_height);
    let corners = [(-w, -h), (w, -h), (w, h), (-w, h)];
    Shape::from(Polygon { vertices: corners.into_iter().map(|(x, y)| Point::new(x, y)).collect() })
}

/// A regular polygon.
pub fn regular(sides: usize, radius: f64) -> Shape {
    let corner = |k: usize| {
        let (s, c) = (std::f64::consts::TAU * k as f64 / sides as f64).sin_cos();
        Point::new(radius * c, radius * s)
    };
    Shape::from(Polygon { vertices: (0..sides).map(corner).collect() })
}

/// A floor and two walls, open above.
pub fn open_box(width: f64, height: f64) -> Vec<Wall> {
    let corner = |x, y| Point::new(x, y);
    vec![
        Wall::Segment([corner(0.0, height), corner(0.0, 0.0)]),
        Wall::Segment([corner(0.0, 0.0), corner(width, 0.0)]),
        Wall::Segment([corner(width, 0.0), corner(width, height)]),
    ]
}

pub fn settings(law: Law) -> Settings {
    Settings { law, ..Settings::default() }
}

pub fn world(bodies: Vec<Particle>, walls: &[Wall], law: Law) -> Particles {
    let solver = Solver::new(walls, settings(law)).expect("the settings are good");
    Particles::new(bodies, Dynamics::Inertial { drag: 0.0 }, solver).expect("the start is good")
}

/// Weight of every body.
pub fn gravity(particles: &Particles) -> impl Drive + use<> {
    let masses: Vec<f64> = particles.bodies().iter().map(|b| b.mass).collect();
    move |k: usize, _: f64, _: &Pose, _: &Twist| [0.0, -masses[k], 0.0]
}

/// Discs of random radii on a jittered grid, without overlap.
pub fn scattered(count: usize, radius: [f64; 2], width: f64, seed: u64) -> Vec<Particle> {
    let mut rng = rng(seed);
    let pitch = 2.05 * radius[1];
    let columns = ((width - pitch) / pitch) as usize + 1;
    let place = |k: usize| ((0.5 + (k % columns) as f64) * pitch, (0.5 + (k / columns) as f64) * pitch);
    let one = |k: usize| {
        let r = rng.random_range(radius[0]..=radius[1]);
        let (x, y) = place(k);
        let free = 0.5 * pitch - r;
        disc(&format!("disc-{k}"), r, x + rng.random_range(-free..free), y + rng.random_range(-free..free))
    };
    (0..count).map(one).collect()
}

/// A step, in halves where it asks for smaller ones.
pub fn shortened(particles: &mut Particles, dt: f64, drive: &dyn Drive) -> Vec<StepReport> {
    match particles.step(dt, drive) {
        Ok(report) => vec![report],
        Err(error) if error.is_cured_by_a_smaller_step() && dt > 1e-9 => {
            let mut reports = shortened(particles, 0.5 * dt, drive);
            reports.extend(shortened(particles, 0.5 * dt, drive));
            reports
        }
        Err(error) => panic!("{error}"),
    }
}
