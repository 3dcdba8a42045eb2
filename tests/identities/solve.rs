use std::sync::Arc;

use monolayer::solve::anderson::Anderson;
use monolayer::solve::blocks::{Incomplete, NONE, Neighbours, VectorBlocks};
use monolayer::solve::bordered::Bordered;
use monolayer::solve::sparse::{Factored, Matrix};
use monolayer::solve::{SolveError, krylov};
use nalgebra::{DMatrix, DVector};

fn laplacian(n: usize) -> Matrix {
    let mut triplets = Vec::new();
    for i in 0..n {
        triplets.push((i, i, 2.5));
        if i + 1 < n {
            triplets.push((i, i + 1, -1.0));
            triplets.push((i + 1, i, -1.2));
        }
    }
    Matrix::from_triplets(n, n, &triplets)
}

#[test]
fn a_bordered_system_is_the_dense_one() {
    let n = 12;
    let a = laplacian(n);
    let columns = [vec![1.0; n], (0..n).map(|i| (i as f64).sin()).collect::<Vec<_>>()];
    let rows = vec![(0..n).map(|i| (i as f64).cos()).collect::<Vec<_>>(), vec![0.5; n]];
    let corner = DMatrix::from_row_slice(2, 2, &[0.0, 0.3, 0.2, 0.0]);
    let mut dense = DMatrix::zeros(n + 2, n + 2);
    for (i, j, v) in a.triplets() {
        dense[(i, j)] += v;
    }
    for k in 0..2 {
        for i in 0..n {
            dense[(i, n + k)] = columns[k][i];
            dense[(n + k, i)] = rows[k][i];
        }
        for l in 0..2 {
            dense[(n + k, n + l)] = corner[(k, l)];
        }
    }
    let f: Vec<f64> = (0..n).map(|i| 1.0 / (i as f64 + 1.0)).collect();
    let g = [0.7, -0.4];
    let bordered = Bordered::new(Factored::new("test", a).unwrap(), &columns, rows, corner).unwrap();
    let (x, y) = bordered.solve(&f, &g).unwrap();
    let right = DVector::from_iterator(n + 2, f.iter().chain(&g).copied());
    let exact = dense.lu().solve(&right).unwrap();
    for (found, exact) in x.iter().chain(&y).zip(exact.iter()) {
        assert!((found - exact).abs() < 1e-12);
    }
}

#[test]
fn a_singular_matrix_is_an_error_that_names_the_system() {
    // faer returns factors of this matrix without complaint
    let singular = Matrix::from_triplets(2, 2, &[(0, 0, 1.0), (0, 1, 2.0), (1, 0, 2.0), (1, 1, 4.0)]);
    let message = match Factored::new("toy", singular) {
        Err(error) => error.to_string(),
        Ok(factors) => factors.solve(&[1.0, 0.0]).unwrap_err().to_string(),
    };
    assert!(message.contains("toy") && message.contains("hint"), "{message}");
}

#[test]
fn a_right_hand_side_that_is_not_finite_is_refused() {
    let factors = Factored::new("toy", laplacian(3)).unwrap();
    let error = factors.solve(&[0.0, f64::NAN, 1.0]).unwrap_err();
    assert!(matches!(error, SolveError::NotFiniteInput { index: 1, .. }), "{error}");
}

#[test]
fn gmres_solves_across_restarts() {
    let n = 200;
    let a = laplacian(n);
    let b: Vec<f64> = (0..n).map(|i| ((3 * i) as f64).sin()).collect();
    let mut x = vec![0.0; n];
    let apply = |v: &[f64], out: &mut [f64]| out.copy_from_slice(&a.times(v));
    let outcome = krylov::gmres(&apply, &|_| {}, &b, &mut x, 1e-12, 1000);
    let residual: f64 = a.times(&x).iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    assert!(outcome.converged && residual <= 1e-12, "{outcome:?} {residual}");
    assert!(outcome.iterations > 40, "the restart was not exercised: {outcome:?}");
}

#[test]
fn anderson_solves_a_linear_fixed_point_that_diverges_plainly() {
    // x = G(x) with spectral radius 1.5: exact after as many differences as there are unknowns
    let image = |x: &[f64]| vec![-1.5 * x[0] + 0.4 * x[1] + 1.0, 0.2 * x[0] - 1.1 * x[1] - 2.0, 0.3 * x[2] + 0.5];
    let mut anderson = Anderson::new(5);
    let mut x = vec![0.0; 3];
    for _ in 0..8 {
        let g = image(&x);
        x = anderson.next(&x, &g);
    }
    let worst = image(&x).iter().zip(&x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-9, "{worst}");
}

/// On a chain of cells incomplete factors are exact.
#[test]
fn blocks_that_mix_components_across_faces_are_in_products_and_factors() {
    let (cells, n) = (7, 3);
    let beside = |c: usize| [if c > 0 { c - 1 } else { NONE }, if c + 1 < cells { c + 1 } else { NONE }, NONE];
    let neighbours: Neighbours = Arc::new((0..cells).map(beside).collect());
    let number = |k: usize, seed: f64| (12.9898 * k as f64 + seed).sin();
    let mut a = VectorBlocks::zero(&neighbours, n);
    let m = 2 * n;
    for cell in 0..cells {
        for k in 0..m * m {
            let at = cell * m * m + k;
            a.diagonal[at] = number(at, 0.3) + if k / m == k % m { 8.0 } else { 0.0 };
        }
    }
    let faces = || (0..3 * cells).filter(|face| neighbours[face / 3][face % 3] != NONE);
    faces().for_each(|face| (0..n * n).for_each(|k| a.off[face * n * n + k] = number(k, face as f64)));
    let plain = a.clone();
    assert!(plain.mixed_of(1, 0).is_none(), "nothing is stored where nothing mixes");
    let (_, mixed) = a.with_mixed();
    faces().for_each(|face| (0..m * m).for_each(|k| mixed[face * m * m + k] = number(k, 0.7 * face as f64)));
    let x: Vec<f64> = (0..cells * m).map(|k| number(k, 1.1)).collect();
    for (operator, name) in [(&plain, "alike"), (&a, "mixed")] {
        let mut image = vec![0.0; x.len()];
        operator.times(&x, &mut image);
        for (found, exact) in image.iter().zip(operator.to_sparse().times(&x)) {
            assert!((found - exact).abs() < 1e-12, "{name}: {found}, not {exact}");
        }
        let order = Arc::new((0..cells).rev().collect::<Vec<usize>>());
        let factors = Incomplete::new(operator, &order, &order).unwrap();
        factors.solve(operator, &mut image);
        for (found, exact) in image.iter().zip(&x) {
            assert!((found - exact).abs() < 1e-11, "{name}: {found}, not {exact}");
        }
        // a row of blocks against the cells beside it
        let part = DMatrix::from_fn(2, m, |i, j| number(i * m + j, 2.0));
        let dense = |row: usize, column: usize| {
            let mut block = DMatrix::zeros(m, m);
            for (i, j, value) in operator.to_sparse().triplets() {
                if i / m == row && j / m == column {
                    block[(i % m, j % m)] += value;
                }
            }
            block
        };
        for other in [2, 3, 4] {
            let found = operator.left_product(&part, 3, other).unwrap();
            assert!((found - &part * dense(3, other)).norm() < 1e-12, "{name}, cell {other}");
        }
        assert!(operator.left_product(&part, 3, 5).is_none());
    }
}
