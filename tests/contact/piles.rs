//! What large piles cost.

use monolayer::contact::pairs::{self, Range};
use monolayer::contact::particles::{Dynamics, Particles};
use monolayer::contact::{Law, Settings, Solver, Wall};
use monolayer::mesh::Point;
use rand::RngExt;

use crate::common::{gravity, open_box, rng, scattered, world};

/// Squares of very different sizes, as many per area whatever their number.
fn strewn(count: usize, seed: u64) -> Vec<Range> {
    let mut rng = rng(seed);
    let side = (count as f64).sqrt();
    (0..count)
        .map(|k| {
            let centre = Point::new(rng.random_range(0.0..side), rng.random_range(0.0..side));
            let half = if k % 50 == 0 { 2.0 } else { rng.random_range(0.1..0.5) };
            Range { centre, half, moves: true }
        })
        .collect()
}

#[test]
fn candidates_are_all_that_meet_and_grow_as_the_number_of_bodies() {
    let few = strewn(300, 1);
    let meet = |a: &Range, b: &Range| {
        let apart = a.centre - b.centre;
        apart.x.abs().max(apart.y.abs()) <= a.half + b.half
    };
    let every = (0..300).flat_map(|i| (i + 1..300).map(move |j| (i, j))).filter(|&(i, j)| meet(&few[i], &few[j]));
    let found = pairs::find(&few, &[]);
    assert_eq!((found.pushed.len(), found.given.len()), (every.count(), 0));
    let wall = [Wall::Segment([Point::new(0.0, 0.0), Point::new(200.0, 0.0)])];
    let mut last: Option<f64> = None;
    for count in [2500, 10_000, 40_000] {
        let candidates = pairs::find(&strewn(count, 2), &wall).pushed.len() as f64 / count as f64;
        println!("{count}: {candidates:.3} candidates per body");
        if let Some(last) = last {
            assert!((candidates / last - 1.0).abs() < 0.1, "{last} became {candidates} at {count}");
        }
        last = Some(candidates);
    }
}

#[test]
fn a_pile_takes_few_solves_and_at_rest_hardly_any() {
    let mut particles = world(scattered(60, [0.06, 0.1], 1.3, 3), &open_box(1.3, 6.0), Law::Inelastic);
    let drive = gravity(&particles);
    let (mut most, mut all, mut steps, mut rest) = (0, 0, 0, 0);
    while rest < 100 {
        let report = particles.step(0.01, &drive).unwrap_or_else(|e| panic!("step {steps}: {e}"));
        assert!(report.overlap() < 1e-9 * 0.06, "overlap {:e} at step {steps}", report.overlap());
        most = most.max(report.effort.iterations);
        all += report.effort.iterations;
        steps += 1;
        assert!(steps < 4000, "an energy of {:e} is left", report.kinetic_energy);
        rest = if report.kinetic_energy < 1e-16 { rest + 1 } else { 0 };
        if rest > 10 {
            assert!(report.effort.iterations <= 3 && report.effort.factorisations <= 1, "{:?}", report.effort);
            assert!(report.touching() > 100, "{} contacts", report.touching());
        }
    }
    println!("{:.1} solves per step, at most {most}; at rest after {steps} steps", all as f64 / steps as f64);
    assert!(most <= 60 && all <= 15 * steps, "{all} solves in {steps} steps, at most {most}");
}

#[test]
fn overlaps_are_those_of_the_tolerance_and_the_next_step_takes_them() {
    let mut last = 0.0;
    for tolerance in [1e-12, 1e-8, 1e-5, 1e-3] {
        let settings = Settings { tolerance, ..Settings::default() };
        let solver = Solver::new(&open_box(1.3, 6.0), settings).expect("the settings are good");
        let bodies = scattered(60, [0.06, 0.1], 1.3, 3);
        let mut particles = Particles::new(bodies, Dynamics::Inertial { drag: 0.0 }, solver).expect("no overlap");
        let drive = gravity(&particles);
        let mut overlap: f64 = 0.0;
        for step in 0..600 {
            let report = particles.step(0.01, &drive).unwrap_or_else(|e| panic!("{tolerance:e}, step {step}: {e}"));
            overlap = overlap.max(report.overlap() / 0.06);
        }
        println!("tolerance {tolerance:e}: an overlap of {overlap:.1e} r");
        // what gaps may miss, of bodies up to as large as the largest, and rounding
        assert!(overlap <= 4.0 * tolerance * (0.1 / 0.06) + 1e-12, "{tolerance:e}: {overlap:e}");
        assert!(overlap >= last, "{tolerance:e}: {overlap:e} after {last:e}");
        last = overlap;
    }
}
