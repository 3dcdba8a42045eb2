//! Block elimination of rigid motions and multipliers.

use nalgebra::{DMatrix, DVector};

use super::Immersed;
use super::balance::Filled;
use super::constraints::Constraints;
use crate::solve::{DIRECT_TOLERANCE, SolveError, axpy, dot, norm};

/// The whole system for some constraints.
pub(super) struct Bordering<'s> {
    pub(super) immersed: &'s Immersed,
    pub(super) columns: Vec<Vec<f64>>,
    pub(super) reach: Vec<Vec<f64>>,
    pub(super) corner: DMatrix<f64>,
    pub(super) inverse: DMatrix<f64>,
}

impl<'s> Bordering<'s> {
    pub(super) fn new(immersed: &'s Immersed, constraints: &Constraints) -> Result<Self, SolveError> {
        let (d, m) = (immersed.columns.len(), constraints.rows.len());
        let (mut columns, mut reach) = (immersed.columns.clone(), immersed.reach.clone());
        let size = immersed.factors.symbolic().unknowns();
        for row in &constraints.rows {
            let mut column = vec![0.0; size];
            column.iter_mut().zip(row).for_each(|(c, r)| *c = -r);
            immersed.kernel.exchanged.iter().for_each(|&dof| column[dof] = 0.0);
            reach.push(immersed.inverse(&column));
            columns.push(column);
        }
        let corner = DMatrix::from_fn(d + m, d + m, |i, j| match (i < d, j < d) {
            (true, true) => immersed.corner[(i, j)],
            (true, false) => -constraints.on_kernel[(j - d, i)],
            (false, true) => -constraints.on_kernel[(i - d, j)],
            (false, false) => 0.0,
        });
        let schur = DMatrix::from_fn(d + m, d + m, |i, j| corner[(i, j)] - dot(&columns[i], &reach[j]));
        if d + m == 0 {
            return Ok(Self { immersed, columns, reach, corner, inverse: schur });
        }
        let inverse = schur.try_inverse().filter(|s| s.iter().all(|v| v.is_finite())).ok_or_else(singular)?;
        Ok(Self { immersed, columns, reach, corner, inverse })
    }

    /// Solves, with steps of iterative refinement while rounding left more than [`REFINED`]. Constraints
    /// count with the sign of `−ℓ`.
    pub(super) fn solve(&self, filled: &Filled, f: &[f64], g: &[f64]) -> Result<(Vec<f64>, Vec<f64>), SolveError> {
        if let Some(index) = f.iter().chain(g).position(|v| !v.is_finite()) {
            return Err(SolveError::NotFiniteInput { system: "Stokes".into(), index });
        }
        let d = self.immersed.columns.len();
        let g: Vec<f64> = g.iter().enumerate().map(|(i, v)| if i < d { *v } else { -v }).collect();
        let (mut x, mut y) = self.eliminate(f, &g);
        let size = |r: &[f64], g: &[f64]| self.immersed.scaled_norm(r) + norm(g);
        let scale = size(f, &g);
        let (mut rf, mut rg) = self.residual(filled, (f, &g), (&x, &y));
        for _ in 0..REFINEMENTS {
            if size(&rf, &rg) <= REFINED * scale {
                break;
            }
            let (dx, dy) = self.eliminate(&rf, &rg);
            axpy(1.0, &dx, &mut x);
            axpy(1.0, &dy, &mut y);
            (rf, rg) = self.residual(filled, (f, &g), (&x, &y));
        }
        if x.iter().chain(&y).any(|v| !v.is_finite()) {
            return Err(SolveError::NotFinite { system: "Stokes".into(), hint: HINT.into() });
        }
        let relative = size(&rf, &rg) / scale.max(f64::MIN_POSITIVE);
        if relative > DIRECT_TOLERANCE {
            return Err(SolveError::Inaccurate { system: "Stokes".into(), residual: relative, hint: HINT.into() });
        }
        Ok((x, y))
    }

    pub(super) fn eliminate(&self, f: &[f64], g: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut x = self.immersed.inverse(f);
        let rest = DVector::from_fn(g.len(), |i, _| g[i] - dot(&self.columns[i], &x));
        let y = &self.inverse * rest;
        self.reach.iter().zip(y.iter()).for_each(|(column, &yj)| axpy(-yj, column, &mut x));
        (x, y.as_slice().to_vec())
    }

    pub(super) fn residual(
        &self,
        filled: &Filled,
        (f, g): (&[f64], &[f64]),
        (x, y): (&[f64], &[f64]),
    ) -> (Vec<f64>, Vec<f64>) {
        let mut rf = f.to_vec();
        filled.subtract_product(x, &mut rf);
        self.columns.iter().zip(y).for_each(|(column, &yj)| axpy(-yj, column, &mut rf));
        let corner = &self.corner * DVector::from_column_slice(y);
        let rg = (0..g.len()).map(|i| g[i] - dot(&self.columns[i], x) - corner[i]).collect();
        (rf, rg)
    }
}

/// Steps of iterative refinement.
pub(super) const REFINEMENTS: usize = 4;
/// Relative residual above which there is one more.
pub(super) const REFINED: f64 = 1e-5 * DIRECT_TOLERANCE;

const HINT: &str =
    "check that the boundary conditions or a friction hold the flow and that `rigid.epsilon` is not extreme";

pub(super) fn singular() -> SolveError {
    SolveError::Factorise {
        system: "Stokes".into(),
        reason: "the balance of the bodies' forces is singular: nothing determines a rigid motion".into(),
        hint: HINT.into(),
    }
}
