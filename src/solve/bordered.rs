//! Systems `[A C; R D] [x; y] = [f; g]` with a sparse, factorised `A` and a few bordering rows and columns, solved by
//! block elimination: dense borders never enter the sparse factors.

use nalgebra::{DMatrix, DVector};

use super::sparse::Factored;
use super::{SolveError, dot};

/// A bordered matrix, ready to solve.
#[derive(Debug)]
pub struct Bordered {
    inner: Factored,
    /// Rows of `R`.
    rows: Vec<Vec<f64>>,
    /// `A⁻¹ C`, column by column.
    reach: Vec<Vec<f64>>,
    /// Inverse of the Schur complement `D − R A⁻¹ C`.
    schur_inverse: DMatrix<f64>,
}

impl Bordered {
    /// Prepares the elimination. `columns` are those of `C`, `rows` those of `R`, `corner` is `D`.
    ///
    /// # Errors
    /// A solve with `A` fails, or the Schur complement is singular.
    pub fn new(
        inner: Factored,
        columns: &[Vec<f64>],
        rows: Vec<Vec<f64>>,
        corner: DMatrix<f64>,
    ) -> Result<Self, SolveError> {
        let reach = columns.iter().map(|c| inner.solve(c)).collect::<Result<Vec<_>, _>>()?;
        let m = columns.len();
        let schur = DMatrix::from_fn(m, m, |i, j| corner[(i, j)] - dot(&rows[i], &reach[j]));
        let schur_inverse = schur.try_inverse().ok_or_else(|| SolveError::Factorise {
            system: inner.name().into(),
            reason: "its Schur complement is singular".into(),
            hint: "a boundary condition may be missing".into(),
        })?;
        Ok(Self { inner, rows, reach, schur_inverse })
    }

    /// Solves for `(x, y)`.
    ///
    /// # Errors
    /// Input or solution not finite; a relative residual that shows a singular matrix.
    pub fn solve(&self, f: &[f64], g: &[f64]) -> Result<(Vec<f64>, Vec<f64>), SolveError> {
        let mut x = self.inner.solve(f)?;
        let rest = DVector::from_fn(g.len(), |i, _| g[i] - dot(&self.rows[i], &x));
        let y = &self.schur_inverse * rest;
        for (column, &yj) in self.reach.iter().zip(y.iter()) {
            super::axpy(-yj, column, &mut x);
        }
        if x.iter().chain(y.iter()).any(|v| !v.is_finite()) {
            let hint = "check that the boundary conditions leave no motion free".into();
            return Err(SolveError::NotFinite { system: self.inner.name().into(), hint });
        }
        Ok((x, y.iter().copied().collect()))
    }
}
