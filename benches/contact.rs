//! Contact: search of pairs, and whole steps of a pile of discs. The number after the name is that of the discs.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use monolayer::contact::pairs::{self, Range};
use monolayer::contact::particles::{Dynamics, Particle, Particles};
use monolayer::contact::{Settings, Solver, Wall};
use monolayer::mesh::Point;
use monolayer::shape::{Disc, Pose, Shape, Twist};

const PITCH: f64 = 0.05;

/// A hexagonal pile of equal discs in a box, just above each other.
fn pile(count: usize) -> Particles {
    let columns = (count as f64).sqrt() as usize;
    let disc = |k: usize| {
        let (row, column) = (k / columns, k % columns);
        let x = PITCH * (0.5 + column as f64 + 0.25 * (row % 2) as f64);
        let pose = Pose { position: Point::new(x, PITCH * (0.5 + row as f64)), angle: 0.0 };
        Particle::new(format!("disc-{k}"), Shape::from(Disc { radius: 0.499 * PITCH }), pose)
    };
    let (width, p) = (PITCH * (columns as f64 + 0.5), Point::new);
    let walls = [
        Wall::Segment([p(0.0, 99.0), p(0.0, 0.0)]),
        Wall::Segment([p(0.0, 0.0), p(width, 0.0)]),
        Wall::Segment([p(width, 0.0), p(width, 99.0)]),
    ];
    let solver = Solver::new(&walls, Settings::default()).expect("the settings are good");
    Particles::new((0..count).map(disc).collect(), Dynamics::Inertial { drag: 0.0 }, solver).expect("the start is good")
}

fn weight(particles: &Particles) -> impl Fn(usize, f64, &Pose, &Twist) -> [f64; 3] + use<> {
    let masses: Vec<f64> = particles.bodies().iter().map(|b| b.mass).collect();
    move |k, _, _, _| [0.0, -masses[k], 0.0]
}

fn contact(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("contact");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    for count in [100, 1000, 10_000] {
        let particles = pile(count);
        let range = |b: &Particle| Range { centre: b.pose.position, half: b.shape.circumradius(), moves: true };
        let ranges: Vec<Range> = particles.bodies().iter().map(range).collect();
        group.bench_function(BenchmarkId::new("pairs", count), |b| {
            b.iter(|| pairs::find(black_box(&ranges), particles.solver().walls()));
        });
    }
    for count in [100, 1000] {
        let mut particles = pile(count);
        let drive = weight(&particles);
        for _ in 0..12 {
            particles.step(0.01, &drive).expect("the step succeeds");
        }
        group.bench_function(BenchmarkId::new("step", count), |b| {
            b.iter_batched(|| particles.clone(), |mut p| p.step(0.01, &drive), BatchSize::LargeInput);
        });
    }
    group.finish();
}

criterion_group!(benches, contact);
criterion_main!(benches);
