//! From the coefficients of an integrand at one point to its part of a dense block.

use super::bilinear::Stencil;
use super::linear::Weights;
use crate::element::tables::{MAX_STRIDE, stride};
use crate::mesh::Point;
use crate::space::field::Site;
use crate::space::skeleton::legendre;
use crate::space::{Skeleton, Space};

/// Values and physical gradients of one basis at one point, slot by slot, padded with zeros.
pub(super) struct Basis {
    n: usize,
    degree: usize,
    rows: [[f64; MAX_STRIDE]; 3],
}

impl Basis {
    pub fn new(space: &Space) -> Self {
        Self { n: space.n, degree: space.degree, rows: [[0.0; MAX_STRIDE]; 3] }
    }

    /// The polynomials on a face.
    pub fn of_trace(skeleton: &Skeleton) -> Self {
        Self { n: skeleton.modes(), degree: skeleton.degree, rows: [[0.0; MAX_STRIDE]; 3] }
    }

    /// Those polynomials at a place along the face.
    pub fn evaluate_on_face(&mut self, along: f64) {
        let values = legendre(self.degree, along);
        self.rows[0][..values.len()].copy_from_slice(&values);
    }

    pub fn evaluate(&mut self, site: &Site) {
        let table = site.table(self.degree);
        let m = &site.inverse_transposed;
        let [values, dx, dy] = &mut self.rows;
        let (a, b) = (table.slopes(site.q, 0), table.slopes(site.q, 1));
        values[..a.len()].copy_from_slice(table.values(site.q));
        for (k, (a, b)) in a.iter().zip(b).enumerate() {
            dx[k] = m.m11 * a + m.m12 * b;
            dy[k] = m.m21 * a + m.m22 * b;
        }
    }

    /// Value and gradient of function `i`.
    pub fn at(&self, i: usize) -> (f64, Point) {
        let [value, dx, dy] = self.rows.each_ref().map(|row| row[i]);
        (value, Point::new(dx, dy))
    }
}

/// A dense block under construction, rows padded; row-major with test functions as rows.
pub(super) struct Block {
    test: (usize, usize),
    trial: (usize, usize),
    values: Vec<f64>,
}

impl Block {
    /// A block for `components` of (test, trial) jets.
    pub fn new(test: &Space, trial: &Space, components: (usize, usize)) -> Self {
        Self::of(test.n, trial.n, components)
    }

    /// Of so many test and trial functions of one component.
    pub fn of(test: usize, trial: usize, components: (usize, usize)) -> Self {
        let (test, trial) = ((test, components.0), (trial, components.1));
        Self { test, trial, values: vec![0.0; test.0 * test.1 * trial.1 * stride(trial.0)] }
    }

    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Adds `weight Σ_st B_s,i c[s][t] B_t,j`; the coefficients begin at `corner` of the stencil.
    pub fn add(&mut self, stencil: &Stencil, corner: (usize, usize), test: &Basis, trial: &Basis, weight: f64) {
        match stride(trial.n) {
            4 => self.add_padded::<4>(stencil, corner, test, trial, weight),
            8 => self.add_padded::<8>(stencil, corner, test, trial, weight),
            12 => self.add_padded::<12>(stencil, corner, test, trial, weight),
            16 => self.add_padded::<16>(stencil, corner, test, trial, weight),
            24 => self.add_padded::<24>(stencil, corner, test, trial, weight),
            other => unreachable!("no Lagrange triangle and no face has {other} padded functions"),
        }
    }

    fn add_padded<const P: usize>(
        &mut self,
        stencil: &Stencil,
        corner: (usize, usize),
        test: &Basis,
        trial: &Basis,
        weight: f64,
    ) {
        let [values, dx, dy] = trial.rows.each_ref().map(|r| r.first_chunk::<P>().expect("rows are padded"));
        let row_length = self.trial.1 * P;
        for a in 0..self.test.1 {
            for s in 0..3 {
                let row_of = &stencil.c[corner.0 + 3 * a + s];
                for b in 0..self.trial.1 {
                    let c: [f64; 3] = std::array::from_fn(|t| weight * row_of[corner.1 + 3 * b + t]);
                    if c == [0.0; 3] {
                        continue;
                    }
                    let combined: [f64; P] = std::array::from_fn(|j| c[0] * values[j] + c[1] * dx[j] + c[2] * dy[j]);
                    for (i, chi) in test.rows[s][..test.n].iter().enumerate() {
                        let start = (a * test.n + i) * row_length + b * P;
                        let entries: &mut [f64; P] =
                            (&mut self.values[start..start + P]).try_into().expect("a padded row");
                        for (entry, phi) in entries.iter_mut().zip(&combined) {
                            *entry += chi * phi;
                        }
                    }
                }
            }
        }
    }

    /// Adds the block, without padding, to `out`.
    pub fn add_to(&self, out: &mut [f64]) {
        let (n, padded) = (self.trial.0, stride(self.trial.0));
        for (out, row) in out.chunks_exact_mut(n).zip(self.values.chunks_exact(padded)) {
            for (out, value) in out.iter_mut().zip(row) {
                *out += value;
            }
        }
    }

    /// Adds the block, without padding, to rows of `columns` entries, beginning at a corner.
    pub fn add_into(&self, out: &mut [f64], corner: (usize, usize), columns: usize) {
        let (n, padded) = (self.trial.0, stride(self.trial.0));
        for (i, row) in self.values.chunks_exact(padded * self.trial.1).enumerate() {
            let start = (corner.0 + i) * columns + corner.1;
            for (component, row) in row.chunks_exact(padded).enumerate() {
                let out = &mut out[start + component * n..][..n];
                out.iter_mut().zip(row).for_each(|(out, value)| *out += value);
            }
        }
    }
}

/// Adds `weight Σ_s B_s,i w[s]` for every component; the weights begin at `from`.
pub(super) fn add_vector(block: &mut [f64], weights: &Weights, from: usize, test: &Basis, weight: f64) {
    for (a, block) in block.chunks_exact_mut(test.n).enumerate() {
        for s in 0..3 {
            let c = weight * weights[from + 3 * a + s];
            if c != 0.0 {
                for (entry, chi) in block.iter_mut().zip(&test.rows[s]) {
                    *entry += c * chi;
                }
            }
        }
    }
}
