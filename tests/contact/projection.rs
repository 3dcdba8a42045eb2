//! The projection against its conditions and against Uzawa's method.

use monolayer::contact::Method;
use monolayer::contact::projection::{Problem, Projection, Row};
use rand::RngExt;

use crate::common::rng;

/// Rows with a common admissible point, some of them through it, some of them twice.
fn random(seed: u64, unknowns: usize, rows: usize, equations: bool) -> Problem {
    let mut rng = rng(seed);
    let inside: Vec<f64> = (0..unknowns).map(|_| rng.random_range(-1.0..1.0)).collect();
    let mut made: Vec<Row> = Vec::new();
    for c in 0..rows {
        if c % 7 == 6 {
            let copy = made[c - 3].clone();
            made.push(copy);
            continue;
        }
        let first = rng.random_range(0..unknowns - 3);
        let entries: Vec<(usize, f64)> = (0..4).map(|k| (first + k, rng.random_range(-1.0..1.0))).collect();
        let mut row = Row { entries, slack: 1e-12, ..Row::default() };
        let room = if rng.random_bool(0.5) { 0.0 } else { rng.random_range(0.0..0.5) };
        row.offset = -row.times(&inside);
        match c % 5 {
            0 if equations => row.bound = f64::NEG_INFINITY,
            1 if equations => row.bound = -0.05,
            _ => row.offset += room,
        }
        made.push(row);
    }
    let metric = (0..unknowns).map(|_| rng.random_range(0.5..2.0)).collect();
    let target = inside.iter().map(|u| u + rng.random_range(-2.0..2.0)).collect();
    Problem { metric, target, rows: made, tolerance: 1e-12 }
}

/// Balance, feasibility, signs and complementarity, all from their definitions.
fn check(problem: &Problem, found: &Projection, what: &str) {
    let mut balance: Vec<f64> =
        (0..problem.metric.len()).map(|k| problem.metric[k] * (found.velocity[k] - problem.target[k])).collect();
    for (row, mu) in problem.rows.iter().zip(&found.multipliers) {
        let w = row.offset + row.entries.iter().map(|&(k, b)| b * found.velocity[k]).sum::<f64>();
        let equation = row.bound == f64::NEG_INFINITY;
        assert!(if equation { w.abs() <= 1e-11 } else { w >= -1e-11 }, "{what}: w = {w:e}");
        assert!(equation || *mu >= row.bound, "{what}: μ = {mu:e}");
        assert!(equation || (mu - row.bound) * w <= 1e-10, "{what}: μw = {:e}", (mu - row.bound) * w);
        for &(k, b) in &row.entries {
            balance[k] -= b * mu;
        }
    }
    assert!(balance.iter().all(|r| r.abs() < 1e-10), "{what}: balance {balance:?}");
}

#[test]
fn newton_and_uzawa_find_the_same_velocities() {
    for seed in 0..40 {
        let (unknowns, rows) = [(8, 4), (10, 10), (16, 40), (30, 15)][seed as usize % 4];
        let problem = random(seed, unknowns, rows, seed % 3 > 0);
        let nothing = vec![0.0; rows];
        let newton = problem.solve(Method::Newton, &nothing).expect("Newton converges");
        check(&problem, &newton, &format!("seed {seed}"));
        assert!(newton.iterations < 60, "seed {seed}: {} solves", newton.iterations);
        if rows > unknowns / 2 {
            // Uzawa's method needs millions of steps where rows nearly repeat each other
            continue;
        }
        let mut loose = problem.clone();
        loose.rows.iter_mut().for_each(|row| row.slack = 1e-9);
        for method in [Method::Uzawa, Method::Accelerated] {
            let other = loose.solve(method, &nothing).expect("Uzawa converges");
            let apart = newton.velocity.iter().zip(&other.velocity).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-5, "seed {seed}, {method:?}: {apart:e} apart");
        }
    }
}

#[test]
fn any_start_leads_to_the_same_velocities() {
    for seed in 0..10 {
        let problem = random(100 + seed, 20, 30, true);
        let mut rng = rng(seed);
        let cold = problem.solve(Method::Newton, &[0.0; 30]).expect("converges");
        let start: Vec<f64> = (0..30).map(|_| rng.random_range(-3.0..3.0)).collect();
        let warm = problem.solve(Method::Newton, &start).expect("converges");
        let again = problem.solve(Method::Newton, &cold.multipliers).expect("converges");
        for other in [&warm, &again] {
            check(&problem, other, &format!("seed {seed}"));
            let apart = cold.velocity.iter().zip(&other.velocity).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-9, "seed {seed}: {apart:e} apart");
        }
        assert!(again.iterations <= 4, "a warm start from the answer takes {} solves", again.iterations);
    }
}

#[test]
fn admissible_velocities_stay_to_the_bit() {
    let mut problem = random(5, 10, 8, false);
    problem.target = vec![0.25; 10];
    for row in &mut problem.rows {
        row.offset = 1e-3 - row.times(&[0.25; 10]);
    }
    let found = problem.solve(Method::Newton, &[1.0; 8]).expect("converges");
    assert_eq!(found.velocity, problem.target);
    assert_eq!(found.multipliers, vec![0.0; 8]);
}

#[test]
fn rows_that_contradict_each_other_are_an_error() {
    let row = |b: f64, offset: f64| Row { entries: vec![(0, b)], offset, bound: 0.0, slack: 1e-12 };
    let problem =
        Problem { metric: vec![1.0], target: vec![0.0], rows: vec![row(1.0, -1.0), row(-1.0, 0.0)], tolerance: 1e-12 };
    let unsolved = problem.solve(Method::Newton, &[0.0; 2]).expect_err("u ≥ 1 and u ≤ 0");
    assert!(unsolved.excess > 1.0);
    // the method without factors was the last to be tried
    assert!(unsolved.iterations > 20_000, "{} iterations", unsolved.iterations);
}

#[test]
fn an_unknown_at_rest_without_a_row_does_not_keep_the_balance_from_its_tolerance() {
    let row = Row { entries: vec![(0, 1.0)], slack: 1e-12, ..Row::default() };
    let (metric, target) = (vec![1.0; 2], vec![-1.0, 0.0]);
    let problem = Problem { metric, target, rows: vec![row], tolerance: 1e-12 };
    assert!(problem.imbalance(&[0.0, 1e-25], &[1.0]) < 1e-24);
    assert!(problem.imbalance(&[0.0, 1e-6], &[1.0]) > 1e-7);
    assert!(problem.imbalance(&[0.0, 0.0], &[1.0 + 1e-6]) > 1e-7);
}

/// Bodies in a row between walls, pushed to one side; every second one is 1e9 times heavier.
#[test]
fn metrics_of_very_different_sizes() {
    let n = 20;
    let mut rows = Vec::new();
    for k in 0..n - 1 {
        rows.push(Row { entries: vec![(k, -1.0), (k + 1, 1.0)], slack: 1e-12, ..Row::default() });
    }
    rows.push(Row { entries: vec![(n - 1, -1.0)], slack: 1e-12, ..Row::default() });
    let metric: Vec<f64> = (0..n).map(|k| if k % 2 == 0 { 1e9 } else { 1.0 }).collect();
    let problem = Problem { target: vec![1.0; n], rows, tolerance: 1e-12, metric: metric.clone() };
    let found = problem.solve(Method::Newton, &vec![0.0; n]).expect("converges");
    assert!(found.velocity.iter().all(|u| u.abs() < 1e-9), "{:?}", found.velocity);
    // the wall carries the momentum of all
    let total: f64 = metric.iter().sum();
    assert!((found.multipliers[n - 1] / total - 1.0).abs() < 1e-9);
}
