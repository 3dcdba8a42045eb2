//! The density: its space, and its transport by a given flow   [7.32]

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::form::{Faces, Integrator, mass};
use crate::model::limiter::{Limited, Limiter};
use crate::model::polarity::invert_blocks;
use crate::solve::krylov::gmres;
use crate::solve::rows::{Rows, add_product, times_each};
use crate::solve::{SolveError, axpy, dot, norm};
use crate::space::{Field, Space};

/// Most corrections of a density.
const CORRECTIONS: usize = 40;

/// Products that a transport solve may take.
const KRYLOV_LIMIT: usize = 2000;

/// What never changes in the density's equation.
#[derive(Debug)]
pub struct Density {
    /// Discontinuous, with one component.
    pub space: Arc<Space>,
    /// Keeps ρ from falling below zero.
    pub limiter: Limiter,
    /// Boundary faces through which mass may pass: all but those of slip walls.
    pub open: Faces,
    mass: Vec<f64>,
    mass_inverse: Vec<f64>,
    /// `∫ φ_i`
    pub weights: Vec<f64>,
    /// Cells from left to right.
    order: Arc<Vec<usize>>,
    rank: Arc<Vec<usize>>,
}

impl Density {
    /// Assembles the mass matrix and prepares the limiter; `order` is that of the cells in which solves sweep, `rank`
    /// its inverse.
    ///
    /// # Errors
    /// A degenerate cell.
    pub fn new(
        loops: &Integrator,
        space: &Arc<Space>,
        open: Faces,
        (order, rank): (&Arc<Vec<usize>>, &Arc<Vec<usize>>),
    ) -> Result<Self, SolveError> {
        let mass = loops.cell_blocks(&mass::mass(space), space, space);
        let weights = mass.chunks_exact(space.n).map(|row| row.iter().sum()).collect();
        Ok(Self {
            limiter: Limiter::new(loops, space),
            mass_inverse: invert_blocks(&mass, space.n)?,
            mass,
            weights,
            open,
            space: space.clone(),
            order: order.clone(),
            rank: rank.clone(),
        })
    }

    /// `M x`
    pub fn mass_times(&self, x: &[f64]) -> Vec<f64> {
        times_each(&self.mass, self.space.n, 1, x)
    }

    /// `M⁻¹ f`
    pub fn mass_solve(&self, f: &[f64]) -> Vec<f64> {
        times_each(&self.mass_inverse, self.space.n, 1, f)
    }

    /// `∫ρ`
    pub fn total(&self, rho: &[f64]) -> f64 {
        dot(&self.weights, rho)
    }

    /// Solves `w M u + T ρ(u) = b` from the guess in `u`, ρ(u) the limited u: Newton's method, to rounding, so that
    /// mass is kept. Where nothing is limited, that is one linear system. Returns the products that it took.
    ///
    /// The fluxes are those of the limited density, so that the mean of a cell with `⟨b⟩ ≥ 0` cannot be negative, for
    /// any step: what leaves it vanishes with its mean.
    ///
    /// # Errors
    /// A singular block; an iteration that stalls.
    pub fn solve(&self, w: f64, transport: &Rows, b: &[f64], u: &mut Field) -> Result<usize, SolveError> {
        // a residual of nothing cannot be measured against b
        if b.iter().all(|b| *b == 0.0) {
            u.values.fill(0.0);
            return Ok(0);
        }
        let scale = norm(b).max(f64::MIN_POSITIVE);
        let (mut products, mut relative) = (0, f64::INFINITY);
        for _ in 0..CORRECTIONS {
            let limited = self.limiter.limit_on_the_way(u).map_err(|_| stalled(f64::NAN))?;
            let residual = self.remainder(w, transport, b, u, &limited);
            let last = std::mem::replace(&mut relative, norm(&residual) / scale);
            if relative <= 1e-14 || (relative <= 1e-12 && relative > 0.5 * last) {
                self.close(w, transport, b, u, &limited);
                return Ok(products);
            }
            let operator = self.linearised(w, transport, u, &limited);
            let inverses = invert_general(&operator.own, self.space.n)?;
            let apply = |x: &[f64], y: &mut [f64]| {
                y.fill(0.0);
                operator.times_add(x, y);
            };
            let sweep = |x: &mut [f64]| self.sweep(&operator, &inverses, x);
            let mut change = vec![0.0; b.len()];
            // a linear system is solved once, corrections about a limiter need not be exact
            let share = if limited.cells == 0 { 0.0 } else { 1e-4 };
            let target = (share * norm(&residual)).max(1e-15 * scale);
            products += gmres(&apply, &sweep, &residual, &mut change, target, KRYLOV_LIMIT).iterations;
            axpy(1.0, &change, &mut u.values);
        }
        if relative <= 1e-11 { Ok(products) } else { Err(stalled(relative)) }
    }

    /// `b − w M u − T ρ(u)`
    fn remainder(&self, w: f64, transport: &Rows, b: &[f64], u: &Field, limited: &Limited) -> Vec<f64> {
        let mut image = vec![0.0; b.len()];
        transport.times_add(&limited.rho.values, &mut image);
        axpy(w, &self.mass_times(&u.values), &mut image);
        b.iter().zip(image).map(|(b, a)| b - a).collect()
    }

    /// Rounding leaves a residual whose sum would be mass: all cells take it up in proportion. The limiter allows it,
    /// because `ρ(cu) = cρ(u)`.
    fn close(&self, w: f64, transport: &Rows, b: &[f64], u: &mut Field, limited: &Limited) {
        let whole: f64 = b.iter().sum();
        let missing: f64 = self.remainder(w, transport, b, u, limited).iter().sum();
        let share = missing / (whole - missing);
        if share.is_finite() && share.abs() < 1e-9 {
            u.values.iter_mut().for_each(|r| *r *= 1.0 + share);
        }
    }

    /// `w M + T ∂ρ/∂u`
    fn linearised(&self, w: f64, transport: &Rows, u: &Field, limited: &Limited) -> Rows {
        let mut out = transport.clone();
        if limited.cells > 0 {
            let changes = self.limiter_derivatives(u, limited);
            out.times_columns(&changes);
        }
        out.own.iter_mut().zip(&self.mass).for_each(|(a, m)| *a += w * m);
        out
    }

    /// `∂ρ/∂u` of the cells whose density was limited.
    pub fn limiter_derivatives(&self, u: &Field, limited: &Limited) -> Vec<Option<DMatrix<f64>>> {
        let of_cell = |(cell, theta): (usize, &f64)| (*theta < 1.0).then(|| self.limiter.derivative(limited, u, cell));
        limited.theta.iter().enumerate().map(of_cell).collect()
    }

    /// `w (ρ|z)`, by cell.
    pub fn mass_blocks(&self) -> &[f64] {
        &self.mass
    }

    /// One sweep of block Gauss–Seidel in the order of the cells: nearly exact where the flow goes that way.
    fn sweep(&self, operator: &Rows, inverses: &[f64], x: &mut [f64]) {
        let n = self.space.n;
        let mut here = vec![0.0; n];
        for &cell in self.order.iter() {
            here.copy_from_slice(&x[cell * n..(cell + 1) * n]);
            for (other, block) in operator.off_of(cell) {
                if self.rank[other] < self.rank[cell] {
                    for (row, out) in block.chunks_exact(n).zip(&mut here) {
                        *out -= row.iter().zip(&x[other * n..(other + 1) * n]).map(|(a, x)| a * x).sum::<f64>();
                    }
                }
            }
            let out = &mut x[cell * n..(cell + 1) * n];
            out.fill(0.0);
            add_product(&inverses[cell * n * n..(cell + 1) * n * n], &here, out);
        }
    }
}

fn stalled(residual: f64) -> SolveError {
    SolveError::Inaccurate { system: "density".into(), residual, hint: "take a smaller time step".into() }
}

fn invert_general(blocks: &[f64], n: usize) -> Result<Vec<f64>, SolveError> {
    let mut out = Vec::with_capacity(blocks.len());
    for (cell, block) in blocks.chunks_exact(n * n).enumerate() {
        let inverse = DMatrix::from_row_slice(n, n, block).try_inverse().ok_or_else(|| SolveError::Factorise {
            system: "density".into(),
            reason: format!("the block of cell {cell} is singular"),
            hint: "take a smaller time step".into(),
        })?;
        out.extend(inverse.transpose().iter());
    }
    Ok(out)
}
