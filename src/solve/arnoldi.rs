//! Arnoldi's method for the eigenvalues of an operator that is only known by its action.

use faer::Mat;
use nalgebra::Complex;
use rayon::prelude::*;

use super::{SolveError, axpy, dot};

/// An approximate eigenpair of the operator.
#[derive(Debug, Clone)]
pub struct Ritz {
    /// The eigenvalue.
    pub value: Complex<f64>,
    /// Real and imaginary part of the eigenvector, of length 1 together in the inner product.
    pub vector: [Vec<f64>; 2],
    /// `‖T φ − θ φ‖` as the recurrence has it.
    pub residual: f64,
}

/// A Ritz value, its residual, and the coordinates of its vector in the basis.
type Small = (Complex<f64>, f64, Vec<Complex<f64>>);

/// Entries that one thread orthogonalises at a time.
const CHUNK: usize = 4096;

/// An orthonormal basis `V` of a Krylov space of `T`, and `H = Vᵀ G T V` with the inner product G.
#[derive(Debug)]
pub struct Arnoldi {
    basis: Vec<Vec<f64>>,
    /// Columns of H, each with one entry below the diagonal.
    columns: Vec<Vec<f64>>,
    /// The space is invariant: nothing is left to be found from its start.
    closed: bool,
}

impl Arnoldi {
    /// Begins with a vector; `gram(x)` is `G x`.
    pub fn new(start: &[f64], gram: &dyn Fn(&[f64]) -> Vec<f64>) -> Self {
        let size = dot(start, &gram(start)).sqrt();
        let first = start.iter().map(|v| v / size).collect();
        Self { basis: vec![first], columns: Vec::new(), closed: false }
    }

    /// Dimension of the Krylov space.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Whether no vector was added yet.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// Whether the space is invariant, so that it cannot grow.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Adds vectors until the space has dimension `len`; `apply(x)` is `T x`.
    ///
    /// # Errors
    /// Those of `apply`.
    pub fn extend<E>(
        &mut self,
        len: usize,
        mut apply: impl FnMut(&[f64]) -> Result<Vec<f64>, E>,
        gram: &dyn Fn(&[f64]) -> Vec<f64>,
    ) -> Result<(), E> {
        while self.columns.len() < len && !self.closed {
            let mut w = apply(self.basis.last().expect("the basis has a start"))?;
            let before = dot(&w, &gram(&w)).sqrt();
            let mut column = vec![0.0; self.basis.len() + 1];
            // twice is enough
            for _ in 0..2 {
                let gw = gram(&w);
                let parts: Vec<f64> = self.basis.par_iter().map(|v| dot(v, &gw)).collect();
                column.iter_mut().zip(&parts).for_each(|(h, part)| *h += part);
                w.par_chunks_mut(CHUNK).enumerate().for_each(|(k, w)| {
                    for (part, v) in parts.iter().zip(&self.basis) {
                        axpy(-part, &v[k * CHUNK..k * CHUNK + w.len()], w);
                    }
                });
            }
            let size = dot(&w, &gram(&w)).sqrt();
            self.closed = size <= 1e-13 * before;
            *column.last_mut().expect("one entry below the diagonal") = if self.closed { 0.0 } else { size };
            self.columns.push(column);
            if !self.closed {
                self.basis.push(w.iter().map(|v| v / size).collect());
            }
        }
        Ok(())
    }

    /// All Ritz values with their residuals, largest modulus first, and their coordinates in the basis.
    fn small(&self) -> Result<Vec<Small>, SolveError> {
        let m = self.columns.len();
        let h = Mat::from_fn(m, m, |i, j| self.columns[j].get(i).copied().unwrap_or(0.0));
        let eigen = h.eigen().map_err(|error| SolveError::Factorise {
            system: "Arnoldi".into(),
            reason: format!("its eigenvalues were not found ({error:?})"),
            hint: "the operator may not be finite".into(),
        })?;
        let below = self.columns.last().map_or(0.0, |column| column[m]);
        let (values, vectors) = (eigen.S(), eigen.U());
        let mut found = Vec::with_capacity(m);
        for k in 0..m {
            let y: Vec<Complex<f64>> = (0..m).map(|i| Complex::new(vectors[(i, k)].re, vectors[(i, k)].im)).collect();
            let size = y.iter().map(|c| c.norm_sqr()).sum::<f64>().sqrt();
            let y: Vec<_> = y.into_iter().map(|c| c / size).collect();
            found.push((Complex::new(values[k].re, values[k].im), below * y[m - 1].norm(), y));
        }
        // conjugates one after the other, the positive imaginary part first
        found.sort_by(|a, b| {
            b.0.norm().total_cmp(&a.0.norm()).then(b.0.re.total_cmp(&a.0.re)).then(b.0.im.total_cmp(&a.0.im))
        });
        Ok(found)
    }

    /// Ritz values and residuals, largest modulus first.
    ///
    /// # Errors
    /// A matrix that is not finite.
    pub fn values(&self) -> Result<Vec<(Complex<f64>, f64)>, SolveError> {
        Ok(self.small()?.into_iter().map(|(value, residual, _)| (value, residual)).collect())
    }

    /// The first `count` Ritz pairs, largest modulus first.
    ///
    /// # Errors
    /// A matrix that is not finite.
    pub fn pairs(&self, count: usize) -> Result<Vec<Ritz>, SolveError> {
        let combine = |part: &dyn Fn(&Complex<f64>) -> f64, y: &[Complex<f64>]| {
            let mut x = vec![0.0; self.basis[0].len()];
            y.iter().zip(&self.basis).for_each(|(c, v)| axpy(part(c), v, &mut x));
            x
        };
        let pair = |(value, residual, y): Small| Ritz {
            value,
            residual,
            vector: [combine(&|c| c.re, &y), combine(&|c| c.im, &y)],
        };
        Ok(self.small()?.into_iter().take(count).map(pair).collect())
    }
}
