//! Factors of `M + Σ σ bbᵀ` against the matrix itself.

use monolayer::solve::gram::{Gram, Rows};
use rand::RngExt;

use crate::common::rng;

type Entries = Vec<(usize, f64)>;

/// Bodies of three unknowns each, rows between neighbours on a grid and of some bodies alone.
fn grid(side: usize, seed: u64) -> (Vec<f64>, Vec<Entries>) {
    let mut rng = rng(seed);
    let mut rows: Vec<Entries> = Vec::new();
    for body in 0..side * side {
        let (i, j) = (body % side, body / side);
        let others = [(i + 1 < side).then_some(body + 1), (j + 1 < side).then_some(body + side), None];
        for other in others.into_iter().filter(|other| other.is_some() || body % 5 == 0) {
            let bodies = std::iter::once(body).chain(other);
            let unknowns = bodies.flat_map(|body| (0..3).map(move |k| 3 * body + k));
            // some coefficients are zero, as those of a floor
            rows.push(unknowns.filter(|k| k % 7 != 3).map(|k| (k, rng.random_range(-1.0..1.0))).collect());
        }
    }
    ((0..3 * side * side).map(|_| rng.random_range(0.5..2.0)).collect(), rows)
}

fn weights(count: usize, share: f64, seed: u64) -> Vec<f64> {
    let mut rng = rng(seed);
    (0..count).map(|_| if rng.random_bool(share) { rng.random_range(1.0..1e3) } else { 0.0 }).collect()
}

fn solved(gram: &mut Gram, right: &[f64]) -> Vec<f64> {
    let mut x = gram.ordered(right);
    gram.solve_in_place(&mut x);
    gram.restored(&x)
}

fn factored(metric: &[f64], rows: &[Entries], weights: &[f64]) -> Gram {
    let mut gram = Gram::new(metric.len(), Rows::new(rows.iter().map(Vec::as_slice)));
    let ordered = gram.ordered(metric);
    gram.factorise(&ordered, weights).expect("the matrix is positive definite");
    gram
}

#[test]
fn the_solution_solves_the_system() {
    for (side, share) in [(1, 1.0), (2, 0.5), (7, 0.0), (7, 0.5), (20, 0.9)] {
        let (metric, rows) = grid(side, 1);
        let weights = weights(rows.len(), share, 2);
        let right: Vec<f64> = (0..metric.len()).map(|k| (k as f64).sin()).collect();
        let x = solved(&mut factored(&metric, &rows, &weights), &right);
        let mut residual: Vec<f64> = (0..x.len()).map(|k| right[k] - metric[k] * x[k]).collect();
        for (row, weight) in rows.iter().zip(&weights) {
            let along: f64 = row.iter().map(|&(k, b)| b * x[k]).sum();
            row.iter().for_each(|&(k, b)| residual[k] -= weight * b * along);
        }
        let worst = residual.iter().fold(0.0, |most: f64, r| most.max(r.abs()));
        assert!(worst < 1e-11, "{side}, {share}: a residual of {worst:e}");
    }
}

#[test]
fn new_weights_of_a_few_rows_give_the_bits_of_new_factors() {
    let (metric, rows) = grid(15, 3);
    let right: Vec<f64> = (0..metric.len()).map(|k| (k as f64).cos()).collect();
    let mut now = weights(rows.len(), 0.7, 4);
    let mut gram = factored(&metric, &rows, &now);
    let first = solved(&mut gram, &right);
    let ordered = gram.ordered(&metric);
    for changed in [vec![], vec![0], vec![5, 6, 300], (0..rows.len()).collect::<Vec<_>>()] {
        for c in changed {
            now[c] = if now[c] == 0.0 { 7.0 } else { 0.0 };
        }
        gram.factorise(&ordered, &now).expect("the matrix is positive definite");
        let found = solved(&mut gram, &right);
        assert_eq!(found, solved(&mut factored(&metric, &rows, &now), &right));
    }
    assert_ne!(first, solved(&mut gram, &right));
}

#[test]
fn a_matrix_that_is_not_positive_definite_is_refused_and_forgotten() {
    let (metric, rows) = grid(5, 5);
    let mut gram = factored(&metric, &rows, &weights(rows.len(), 1.0, 6));
    let ordered = gram.ordered(&metric);
    let mut negative = ordered.clone();
    negative[10] = -1e9;
    let weights = weights(rows.len(), 0.5, 7);
    assert!(gram.factorise(&negative, &weights).is_none());
    gram.factorise(&ordered, &weights).expect("the matrix is positive definite");
    let right = vec![1.0; metric.len()];
    assert_eq!(solved(&mut gram, &right), solved(&mut factored(&metric, &rows, &weights), &right));
}
