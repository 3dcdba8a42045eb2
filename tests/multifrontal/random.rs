//! The multifrontal factorisation on random unsymmetric matrices, against dense LU and in itself.

use std::sync::Arc;

use super::grid::{Problem, Random, product};
use monolayer::solve::SolveError;
use monolayer::solve::dissection::{Group, Tree, TreeNode, dissect};
use monolayer::solve::multifrontal::Multifrontal;
use monolayer::solve::symbolic::{Element, Symbolic};
use nalgebra::{DMatrix, DVector};

fn everywhere(_: usize, _: usize) -> bool {
    true
}

fn same(p: [f64; 2]) -> [f64; 2] {
    p
}

fn factorise(problem: &Problem, leaf: usize) -> Result<Multifrontal, SolveError> {
    let symbolic = Arc::new(problem.symbolic(leaf)?);
    Multifrontal::new(symbolic, |e, element| element.clone_from(&problem.elements[e]))
}

fn random_vector(n: usize) -> Vec<f64> {
    let mut random = Random(3);
    (0..n).map(|_| random.next()).collect()
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn assert_inverts(problem: &Problem, leaf: usize) {
    let lu = factorise(problem, leaf).expect("a regular matrix");
    let exact = random_vector(problem.unknowns);
    let mut x = product(&problem.elements, &exact);
    lu.solve_in_place(&mut x);
    assert!(largest(&x, &exact) < 1e-9, "error {}", largest(&x, &exact));
}

#[test]
fn agrees_with_dense_lu() {
    let problem = Problem::new([6, 5], 4, everywhere, same);
    let n = problem.unknowns;
    let mut dense = DMatrix::zeros(n, n);
    for element in &problem.elements {
        for (&r, values) in element.rows.iter().zip(element.values.chunks_exact(element.columns.len())) {
            for (&c, v) in element.columns.iter().zip(values) {
                dense[(r as usize, c as usize)] += v;
            }
        }
    }
    let b = random_vector(n);
    let expected = dense.lu().solve(&DVector::from_vec(b.clone())).expect("regular");
    for leaf in [1, 10, 40, 10_000] {
        let mut x = b.clone();
        factorise(&problem, leaf).expect("regular").solve_in_place(&mut x);
        assert!(largest(&x, expected.as_slice()) < 1e-10, "leaf {leaf}: {}", largest(&x, expected.as_slice()));
    }
}

#[test]
fn inverts_on_rings_and_racetracks() {
    let ring = |i: usize, j: usize| !(5..11).contains(&i) || !(5..11).contains(&j);
    assert_inverts(&Problem::new([16, 16], 5, ring, same), 60);
    let track = |i: usize, j: usize| !(2..28).contains(&i) || !(2..4).contains(&j);
    assert_inverts(&Problem::new([30, 6], 5, track, |[x, y]| [0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y]), 60);
}

#[test]
fn inverts_on_parts_that_do_not_touch() {
    assert_inverts(&Problem::new([15, 6], 5, |i, _| i % 5 != 2, same), 60);
}

#[test]
fn inverts_on_stretched_meshes_as_cheaply() {
    let cost = |map: fn([f64; 2]) -> [f64; 2]| {
        let problem = Problem::new([16, 16], 5, everywhere, map);
        assert_inverts(&problem, 60);
        problem.symbolic(60).expect("a tree").factor_entries()
    };
    let (even, stretched) = (cost(same), cost(|[x, y]| [1000.0 * x, y]));
    assert!(stretched * 10 < even * 13, "{stretched} entries against {even}");
}

#[test]
fn dissection_beats_a_band() {
    let problem = Problem::new([24, 24], 6, everywhere, same);
    let symbolic = problem.symbolic(60).expect("a tree");
    // A banded elimination, row of squares by row of squares, holds two triangles of the front's width at every
    // unknown.
    let band = 2 * problem.unknowns * (24 * 2 * 6);
    assert!(symbolic.factor_entries() * 2 < band, "{} entries, band {band}", symbolic.factor_entries());
}

#[test]
fn bits_do_not_depend_on_threads() {
    let problem = Problem::new([24, 24], 10, everywhere, same);
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let mut x = random_vector(problem.unknowns);
            let lu = factorise(&problem, 80).expect("regular");
            assert!(lu.symbolic().flops() > 5e8, "too small to be done in parallel: {}", lu.symbolic().flops());
            lu.solve_in_place(&mut x);
            x.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        })
    };
    let one = solve(1);
    assert!(one == solve(2), "two threads");
    assert!(one == solve(3), "three threads");
}

fn in_single(problem: &Problem, leaf: usize) -> Result<Multifrontal<f32>, SolveError> {
    let symbolic = Arc::new(problem.symbolic(leaf)?);
    Multifrontal::new(symbolic, |e, element| element.clone_from(&problem.elements[e]))
}

#[test]
fn single_precision_is_refined_to_double() {
    let problem = Problem::new([12, 12], 5, everywhere, same);
    let lu = in_single(&problem, 60).expect("a regular matrix");
    // whatever the unit of the right side
    for unit in [1.0, 1e60, 1e-60] {
        let exact: Vec<f64> = random_vector(problem.unknowns).iter().map(|v| unit * v).collect();
        let right = product(&problem.elements, &exact);
        let mut x = vec![0.0; exact.len()];
        let mut errors = Vec::new();
        for _ in 0..5 {
            let mut change: Vec<f64> = product(&problem.elements, &x).iter().zip(&right).map(|(a, b)| b - a).collect();
            lu.solve_in_place(&mut change);
            x.iter_mut().zip(&change).for_each(|(x, c)| *x += c);
            errors.push(largest(&x, &exact) / unit);
        }
        // seven digits at most of the first solve, sixteen in the end
        assert!(errors[0] > 1e-9 && errors[0] < 1e-2, "{errors:?}");
        assert!(errors[4] < 1e-10 && errors[1] < 0.05 * errors[0], "{errors:?}");
    }
}

#[test]
fn what_single_precision_cannot_hold_is_reported() {
    let mut large = Problem::new([6, 6], 4, everywhere, same);
    large.elements.iter_mut().flat_map(|element| &mut element.values).for_each(|v| *v *= 1e60);
    assert!(factorise(&large, 30).is_ok());
    let error = in_single(&large, 30).expect_err("numbers out of range").to_string();
    assert!(error.contains("not finite"), "{error}");
}

#[test]
fn bits_of_single_precision_do_not_depend_on_threads() {
    let problem = Problem::new([24, 24], 10, everywhere, same);
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let mut x = random_vector(problem.unknowns);
            in_single(&problem, 80).expect("regular").solve_in_place(&mut x);
            x.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        })
    };
    let one = solve(1);
    assert!(one == solve(2) && one == solve(3));
}

#[test]
fn refactors_in_place() {
    let problem = Problem::new([8, 8], 5, everywhere, same);
    let mut lu = factorise(&problem, 60).expect("regular");
    lu.refactor(|e, element: &mut Element| {
        element.clone_from(&problem.elements[e]);
        element.values.iter_mut().for_each(|v| *v *= 2.0);
    })
    .expect("regular");
    let exact = random_vector(problem.unknowns);
    let mut x = product(&problem.elements, &exact);
    lu.solve_in_place(&mut x);
    x.iter_mut().for_each(|v| *v *= 2.0);
    assert!(largest(&x, &exact) < 1e-9);
}

#[test]
fn a_singular_matrix_is_reported() {
    let broken = |change: &dyn Fn(&mut Element)| {
        let mut problem = Problem::new([6, 6], 4, everywhere, same);
        problem.elements.iter_mut().for_each(change);
        factorise(&problem, 30).expect_err("a singular matrix").to_string()
    };
    let no_row = broken(&|element| {
        let width = element.columns.len();
        let rows = element.rows.iter().zip(element.values.chunks_exact_mut(width));
        rows.filter(|(r, _)| **r == 77).for_each(|(_, values)| values.fill(0.0));
    });
    assert!(no_row.contains("the test matrix") && no_row.contains("pivot"), "{no_row}");
    let constant = broken(&|element| {
        for (i, values) in element.values.chunks_exact_mut(element.columns.len()).enumerate() {
            values[i] -= values.iter().sum::<f64>();
        }
    });
    assert!(constant.contains("zero to rounding"), "{constant}");
    let not_finite = broken(&|element| element.values[3] = f64::NAN);
    assert!(not_finite.contains("not finite"), "{not_finite}");
}

#[test]
fn a_tree_that_does_not_fit_is_refused() {
    let mut problem = Problem::new([6, 6], 4, everywhere, same);
    let far = [problem.elements[0].rows[0], problem.elements[70].rows[0]];
    problem.elements.push(Element { rows: vec![far[0]], columns: vec![far[1]], values: vec![1.0] });
    let message = problem.symbolic(10).expect_err("unrelated unknowns").to_string();
    assert!(message.contains("couples"), "{message}");
    problem.elements.pop();
    problem.unknowns += 1;
    let message = problem.symbolic(10).expect_err("a missing unknown").to_string();
    assert!(message.contains("lacks unknown"), "{message}");
}

#[test]
fn long_thin_meshes_do_not_overflow_the_stack() {
    // a ladder that is cut along its length as well: augmenting paths run from end to end
    let n = 60_000;
    let group = |k: usize| Group { unknowns: vec![k as u32], position: [(k / 2) as f64, (k % 2) as f64] };
    let groups: Vec<Group> = (0..n).map(group).collect();
    let near = |k: usize| [k.checked_sub(2), Some(k ^ 1), Some(k + 2)];
    let adjacency: Vec<Vec<u32>> =
        (0..n).map(|k| near(k).into_iter().flatten().filter(|&j| j < n).map(|j| j as u32).collect()).collect();
    let tree = dissect(&groups, &adjacency, &[], &[], 40);
    assert_eq!(tree.nodes.iter().map(|node| node.pivots.len()).sum::<usize>(), n);
}

#[test]
fn memory_is_counted_as_by_hand() {
    // a chain of four elements over five unknowns: 0-1, 1-2, 2-3, 3-4; separators 2, then 1 and 3
    let leaf = |pivot| TreeNode { pivots: vec![pivot], children: Vec::new() };
    let above = |pivot, child| TreeNode { pivots: vec![pivot], children: vec![child] };
    let root = TreeNode { pivots: vec![2], children: vec![1, 3] };
    let tree = Tree { nodes: vec![leaf(0), above(1, 0), leaf(4), above(3, 2), root] };
    let symbolic = Symbolic::new("chain", 5, &tree, 4, |e, element| {
        element.rows = vec![e as u32, e as u32 + 1];
        element.columns.clone_from(&element.rows);
    });
    let symbolic = symbolic.expect("a tree");
    // four fronts with one pivot and one boundary unknown, and the root
    assert_eq!(symbolic.factor_entries(), 4 * 3 + 1);
    // one thread: the contribution of the first half waits while the second is at its own peak of two; two threads:
    // both
    assert_eq!((symbolic.stack_entries(1), symbolic.stack_entries(2), symbolic.stack_entries(9)), (3, 4, 4));
    // 1-2 waits for the root, while 3-4 and then 2-3 are held as well
    assert_eq!(symbolic.waiting_entries(), 3 * 4);
}
