//! Dense kernels of a front. Large blocks are cut into panels whose sizes are fixed, so that the bits of the result do
//! not depend on the number of threads.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor::{lu_in_place, lu_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_unit_lower_triangular_in_place};
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::traits::RealField;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;
use std::ops::{AddAssign, DivAssign, Mul, SubAssign};

use super::wide::wide;

/// Width of the panels that are worked on in parallel.
const PANEL: usize = 128;
/// Pivots that are factorised at once.
const STEP: usize = 128;

/// The numbers that factors are kept in.
pub trait Real:
    RealField + Copy + AddAssign + SubAssign + DivAssign + Mul<Output = Self> + std::ops::Add<Output = Self>
{
    /// A pivot this small, relative to its row and to its column, holds rounding only.
    const LOST: f64;

    /// The nearest number.
    fn of(value: f64) -> Self;

    /// Its value.
    fn value(self) -> f64;

    /// The unit in which a vector has numbers of moderate size, where their range is small.
    fn unit_of(x: &[f64]) -> f64;
}

impl Real for f64 {
    const LOST: f64 = 1e-13;

    fn of(value: f64) -> Self {
        value
    }

    fn value(self) -> f64 {
        self
    }

    fn unit_of(_: &[f64]) -> f64 {
        1.0
    }
}

impl Real for f32 {
    const LOST: f64 = 1e-6;

    fn of(value: f64) -> Self {
        value as f32
    }

    fn value(self) -> f64 {
        f64::from(self)
    }

    fn unit_of(x: &[f64]) -> f64 {
        let largest = x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        if largest > 0.0 && largest.is_finite() { largest } else { 1.0 }
    }
}

/// The part of a front that stays: with `p` pivots and `b` boundary unknowns, `P F11 = L U`, `F21 U⁻¹` and `L⁻¹ P F12`.
pub(super) struct Factors<T> {
    /// `L` without its diagonal of ones, and `U`; `p × p`, column-major.
    pub lu: Vec<T>,
    /// `F21` or `F21 U⁻¹`; `b × p`, column-major.
    pub lower: Vec<T>,
    /// `F12` or `L⁻¹ P F12`; `p × b`, column-major.
    pub upper: Vec<T>,
    /// Row `i` of `P F11` is row `permutation[i]` of `F11`.
    pub permutation: Vec<u32>,
}

impl<T> Default for Factors<T> {
    fn default() -> Self {
        Self { lu: Vec::new(), lower: Vec::new(), upper: Vec::new(), permutation: Vec::new() }
    }
}

impl<T: Real> Factors<T> {
    /// Takes the memory for `p` pivots and `b` boundary unknowns, and touches it on this thread: pages that several
    /// threads touch for the first time at once may cost more than the elimination.
    pub fn new(p: usize, b: usize) -> Self {
        let touched = |size: usize| vec![T::of(f64::NAN); size];
        Self { lu: touched(p * p), lower: touched(p * b), upper: touched(p * b), permutation: vec![0; p] }
    }

    /// Zeros, and no exchanges of rows.
    pub fn reset(&mut self) {
        for block in [&mut self.lu, &mut self.lower, &mut self.upper] {
            block.fill(T::of(0.0));
        }
        self.permutation.iter_mut().zip(0..).for_each(|(row, i)| *row = i);
    }

    /// Eliminates the pivots: factorises the blocks and subtracts `F21 F11⁻¹ F12` from `schur` (`b × b`, column-major).
    /// Fails with the number of a pivot that is zero to rounding or not finite.
    pub fn eliminate(&mut self, schur: &mut [T]) -> Result<(), usize> {
        let p = self.permutation.len();
        if p == 0 {
            return Ok(());
        }
        let b = self.lower.len() / p;
        let scale = extent(&self.lu, p);
        factorise(MatMut::from_column_major_slice_mut(&mut self.lu, p, p), &mut self.permutation);
        self.check(&scale)?;
        if b == 0 {
            return Ok(());
        }
        let (lu, permutation) = (MatRef::from_column_major_slice(&self.lu, p, p), &self.permutation);
        self.upper.par_chunks_mut(p * PANEL).for_each(|panel| {
            permute_columns(panel, p, permutation);
            let width = panel.len() / p;
            solve_unit_lower_triangular_in_place(lu, MatMut::from_column_major_slice_mut(panel, p, width), Par::Seq);
        });
        let lower = MatMut::from_column_major_slice_mut(&mut self.lower, b, p);
        let divide = |panel: MatMut<'_, T>| {
            solve_lower_triangular_in_place(lu.transpose(), panel.transpose_mut(), Par::Seq);
        };
        lower.par_row_chunks_mut(PANEL).for_each(divide);
        let lower = MatRef::from_column_major_slice(&self.lower, b, p);
        schur.par_chunks_mut(b * PANEL).zip(self.upper.par_chunks(p * PANEL)).for_each(|(schur, upper)| {
            let width = schur.len() / b;
            let schur = MatMut::from_column_major_slice_mut(schur, b, width);
            let upper = MatRef::from_column_major_slice(upper, p, width);
            matmul(schur, Accum::Add, lower, upper, T::of(-1.0), Par::Seq);
        });
        Ok(())
    }

    /// A pivot must not be lost in the rounding of both its row and its column as they were before the elimination.
    fn check(&self, (rows, columns): &(Vec<f64>, Vec<f64>)) -> Result<(), usize> {
        let p = self.permutation.len();
        let is_lost = |j: &usize| {
            let (pivot, row) = (self.lu[j * p + j].value().abs(), rows[self.permutation[*j] as usize]);
            !pivot.is_finite() || pivot <= T::LOST * row.min(columns[*j])
        };
        (0..p).find(is_lost).map_or(Ok(()), Err)
    }
}

/// Largest absolute value of every row and of every column.
fn extent<T: Real>(block: &[T], p: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut rows, mut columns) = (vec![0.0_f64; p], Vec::with_capacity(p));
    for column in block.chunks_exact(p) {
        rows.iter_mut().zip(column).for_each(|(r, v)| *r = r.max(v.value().abs()));
        columns.push(column.iter().fold(0.0_f64, |m, v| m.max(v.value().abs())));
    }
    (rows, columns)
}

/// `P A = L U`, by block columns; the rest to the right is updated in parallel panels.
fn factorise<T: Real>(mut matrix: MatMut<'_, T>, permutation: &mut [u32]) {
    let p = matrix.nrows();
    for k in (0..p).step_by(STEP) {
        let width = STEP.min(p - k);
        let (mut left, rest) = matrix.rb_mut().split_at_col_mut(k);
        let (panel, right) = rest.split_at_col_mut(width);
        let mut panel = panel.subrows_mut(k, p - k);
        let local = factorise_panel(panel.rb_mut());
        let swap = |mut block: MatMut<'_, T>| {
            let mut old = vec![T::of(0.0); p - k];
            for mut column in block.rb_mut().col_iter_mut() {
                old.iter_mut().zip(column.rb().subrows(k, p - k).iter()).for_each(|(o, v)| *o = *v);
                column.rb_mut().subrows_mut(k, p - k).iter_mut().zip(&local).for_each(|(v, &i)| *v = old[i as usize]);
            }
        };
        swap(left.rb_mut());
        let old = permutation[k..].to_vec();
        permutation[k..].iter_mut().zip(&local).for_each(|(q, &i)| *q = old[i as usize]);
        let (corner, below) = panel.rb().split_at_row(width);
        right.par_col_chunks_mut(PANEL).for_each(|mut block| {
            swap(block.rb_mut());
            let (mut top, bottom) = block.subrows_mut(k, p - k).split_at_row_mut(width);
            solve_unit_lower_triangular_in_place(corner, top.rb_mut(), Par::Seq);
            matmul(bottom, Accum::Add, below, top.rb(), T::of(-1.0), Par::Seq);
        });
    }
}

/// `P A = L U` of a tall panel; returns `P`.
fn factorise_panel<T: Real>(panel: MatMut<'_, T>) -> Vec<u32> {
    let (rows, width) = (panel.nrows(), panel.ncols());
    let (mut forward, mut inverse) = (vec![0_u32; rows], vec![0_u32; rows]);
    let mut memory = MemBuffer::new(lu_in_place_scratch::<u32, T>(rows, width, Par::Seq, Default::default()));
    let stack = MemStack::new(&mut memory);
    lu_in_place(panel, &mut forward, &mut inverse, Par::Seq, stack, Default::default());
    forward
}

/// Permutes every column of a `p`-row block.
fn permute_columns<T: Real>(block: &mut [T], p: usize, permutation: &[u32]) {
    let mut old = vec![T::of(0.0); p];
    for column in block.chunks_exact_mut(p) {
        old.copy_from_slice(column);
        column.iter_mut().zip(permutation).for_each(|(v, &i)| *v = old[i as usize]);
    }
}

/// `y −= A x` for a column-major `A` with `y.len()` rows and columns `stride` apart; reads `A` once, four columns at a
/// time.
pub(super) fn subtract_product<T: Real>(a: &[T], stride: usize, x: &[T], y: &mut [T]) {
    wide(|| subtract_columns(a, stride, x, y));
}

#[inline(always)]
fn subtract_columns<T: Real>(a: &[T], stride: usize, x: &[T], y: &mut [T]) {
    let rows = y.len();
    let mut j = 0;
    while j + 4 <= x.len() {
        let column = |i: usize| &a[(j + i) * stride..(j + i) * stride + rows];
        let (a, b, c, d) = (column(0), column(1), column(2), column(3));
        let (xa, xb, xc, xd) = (x[j], x[j + 1], x[j + 2], x[j + 3]);
        for i in 0..rows {
            y[i] -= (a[i] * xa + b[i] * xb) + (c[i] * xc + d[i] * xd);
        }
        j += 4;
    }
    for (j, &factor) in x.iter().enumerate().skip(j) {
        let column = &a[j * stride..j * stride + rows];
        y.iter_mut().zip(column).for_each(|(y, a)| *y -= factor * *a);
    }
}

/// Width of the diagonal blocks in triangular solves.
const BLOCK: usize = 8;

/// `x ← L⁻¹ x`, `L` unit lower triangular inside the packed `lu`.
pub(super) fn solve_lower<T: Real>(lu: &[T], x: &mut [T]) {
    let p = x.len();
    for k in (0..p).step_by(BLOCK) {
        let end = (k + BLOCK).min(p);
        for j in k..end {
            for i in j + 1..end {
                let update = lu[j * p + i] * x[j];
                x[i] -= update;
            }
        }
        let (done, rest) = x.split_at_mut(end);
        subtract_product(&lu[(k * p + end).min(lu.len())..], p, &done[k..], rest);
    }
}

/// `x ← U⁻¹ x`.
pub(super) fn solve_upper<T: Real>(lu: &[T], x: &mut [T]) {
    let p = x.len();
    for k in (0..p).step_by(BLOCK).rev() {
        let end = (k + BLOCK).min(p);
        for j in (k..end).rev() {
            x[j] /= lu[j * p + j];
            for i in k..j {
                let update = lu[j * p + i] * x[j];
                x[i] -= update;
            }
        }
        let (rest, done) = x.split_at_mut(k);
        subtract_product(&lu[k * p..], p, &done[..end - k], rest);
    }
}
