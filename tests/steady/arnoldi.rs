//! Arnoldi's method on operators whose eigenvalues are known.

use std::convert::Infallible;

use monolayer::solve::arnoldi::Arnoldi;
use nalgebra::{Complex, DMatrix, DVector};

/// `T = P Λ P⁻¹` with real eigenvalues and one complex pair, far from normal.
struct Known {
    operator: DMatrix<f64>,
    gram: DMatrix<f64>,
    values: Vec<Complex<f64>>,
}

/// Size n, eigenvalues `real` and the pair `pair`.
fn known(real: &[f64], pair: Complex<f64>) -> Known {
    let n = real.len() + 2;
    let mut blocks = DMatrix::zeros(n, n);
    for (k, value) in real.iter().enumerate() {
        blocks[(k, k)] = *value;
    }
    let (a, b) = (n - 2, n - 1);
    (blocks[(a, a)], blocks[(b, b)]) = (pair.re, pair.re);
    (blocks[(a, b)], blocks[(b, a)]) = (pair.im, -pair.im);
    let entry = |i: usize, j: usize| ((1 + i * i + 3 * j) as f64).sin();
    let basis = DMatrix::identity(n, n) + 0.2 * DMatrix::from_fn(n, n, entry);
    let half = DMatrix::identity(n, n) * 2.0 + DMatrix::from_fn(n, n, |i, j| entry(j + 1, 2 * i));
    let operator = &basis * blocks * basis.clone().try_inverse().unwrap();
    let mut values: Vec<_> = real.iter().map(|v| Complex::new(*v, 0.0)).collect();
    values.extend([pair, pair.conj()]);
    values.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
    Known { operator, gram: half.transpose() * half, values }
}

impl Known {
    fn extend(&self, arnoldi: &mut Arnoldi, len: usize) {
        let mut apply = |x: &[f64]| Ok::<_, Infallible>(times(&self.operator, x));
        arnoldi.extend(len, &mut apply, &|x| times(&self.gram, x)).unwrap();
    }

    fn start(&self, x: &[f64]) -> Arnoldi {
        Arnoldi::new(x, &|x| times(&self.gram, x))
    }

    /// `(xᵀ G x)^½`
    fn size(&self, x: &[f64]) -> f64 {
        x.iter().zip(times(&self.gram, x)).map(|(a, b)| a * b).sum::<f64>().sqrt()
    }
}

fn times(a: &DMatrix<f64>, x: &[f64]) -> Vec<f64> {
    (a * DVector::from_column_slice(x)).as_slice().to_vec()
}

fn everywhere(n: usize) -> Vec<f64> {
    (0..n).map(|k| 1.0 + (7.0 * k as f64).cos()).collect()
}

/// `‖T φ − θ φ‖` with complex θ and φ.
fn defect(known: &Known, value: Complex<f64>, [re, im]: &[Vec<f64>; 2]) -> f64 {
    let images = [times(&known.operator, re), times(&known.operator, im)];
    let part = |image: &[f64], a: &[f64], b: &[f64], sign: f64| -> Vec<f64> {
        (0..image.len()).map(|i| image[i] - value.re * a[i] + sign * value.im * b[i]).collect()
    };
    known.size(&part(&images[0], re, im, 1.0)).hypot(known.size(&part(&images[1], im, re, -1.0)))
}

#[test]
fn a_full_space_has_all_eigenvalues_with_their_vectors() {
    let known = known(&[3.0, -2.0, 1.0, 0.5, -0.1], Complex::new(0.7, 1.9));
    let mut arnoldi = known.start(&everywhere(7));
    assert!(arnoldi.is_empty());
    known.extend(&mut arnoldi, 7);
    assert_eq!(arnoldi.len(), 7);
    let pairs = arnoldi.pairs(7).unwrap();
    assert_eq!(pairs.len(), 7);
    for (ritz, exact) in pairs.iter().zip(&known.values) {
        assert!((ritz.value - exact).norm() < 1e-9, "{} instead of {exact}", ritz.value);
        assert!(defect(&known, ritz.value, &ritz.vector) < 1e-8, "the vector of {exact}");
        let size = known.size(&ritz.vector[0]).hypot(known.size(&ritz.vector[1]));
        assert!((size - 1.0).abs() < 1e-12, "the vector of {exact} has length {size}");
    }
    let pair: Vec<_> = pairs.iter().filter(|ritz| ritz.value.im != 0.0).collect();
    assert!(pair.len() == 2 && pair[0].value.im > 0.0, "the upper one first");
}

#[test]
fn residuals_of_a_small_space_are_those_of_its_vectors() {
    let real: Vec<f64> = (0..28).map(|k| 0.8 * 0.9_f64.powi(k) * if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
    let known = known(&real, Complex::new(-4.0, 3.0));
    let mut arnoldi = known.start(&everywhere(30));
    // in two portions, as the caller adds them
    known.extend(&mut arnoldi, 5);
    known.extend(&mut arnoldi, 12);
    assert!(arnoldi.len() == 12 && !arnoldi.is_closed());
    let pairs = arnoldi.pairs(12).unwrap();
    for ritz in &pairs {
        let direct = defect(&known, ritz.value, &ritz.vector);
        assert!((ritz.residual - direct).abs() < 1e-9 + 1e-6 * direct, "{}: {direct}", ritz.residual);
    }
    assert!((pairs[0].value - Complex::new(-4.0, 3.0)).norm() < 1e-6, "{}", pairs[0].value);
    assert!(pairs[0].residual < 1e-6 && pairs[11].residual > 1e-4, "outer ones come first");
}

#[test]
fn an_invariant_space_is_closed_and_exact() {
    let known = known(&[3.0, -2.0, 1.0, 0.5, -0.1, 0.2], Complex::new(0.7, 1.9));
    let mut full = known.start(&everywhere(8));
    known.extend(&mut full, 8);
    // a real vector in the plane of the pair, and the vector of −2
    let (pairs, wanted) = (full.pairs(8).unwrap(), [Complex::new(-2.0, 0.0), Complex::new(0.7, 1.9)]);
    let mut start = vec![0.0; 8];
    for value in wanted {
        let ritz = pairs.iter().find(|ritz| (ritz.value - value).norm() < 1e-8).unwrap();
        start.iter_mut().zip(&ritz.vector[0]).for_each(|(s, v)| *s += v);
    }
    let mut arnoldi = known.start(&start);
    known.extend(&mut arnoldi, 8);
    assert!(arnoldi.is_closed(), "dimension {}", arnoldi.len());
    assert_eq!(arnoldi.len(), 3);
    let values = arnoldi.values().unwrap();
    let exact = [wanted[1], wanted[1].conj(), wanted[0]];
    for (value, residual) in &values {
        assert!(exact.iter().any(|e| (e - value).norm() < 1e-8), "{value}");
        assert!(*residual < 1e-12, "{residual}");
    }
    known.extend(&mut arnoldi, 20);
    assert_eq!(arnoldi.len(), 3, "it cannot grow");
}
