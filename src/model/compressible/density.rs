//! The density: its space, and its transport by a given flow   [7.32]

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::form::{Faces, Integrator, mass, transport};
use crate::model::limiter::Limiter;
use crate::model::polarity::invert_blocks;
use crate::solve::blocks::Neighbours;
use crate::solve::krylov::gmres;
use crate::solve::rows::{Rows, add_product};
use crate::solve::{SolveError, dot, norm};
use crate::space::{Field, Space};

/// Products that a transport solve may take.
const KRYLOV_LIMIT: usize = 2000;

/// What never changes in the density's equation.
#[derive(Debug)]
pub struct Density {
    pub space: Arc<Space>,
    pub limiter: Limiter,
    /// Boundary faces through which mass may pass: all but those of slip walls.
    pub open: Faces,
    neighbours: Neighbours,
    mass: Vec<f64>,
    mass_inverse: Vec<f64>,
    /// `∫ φ_i`
    pub weights: Vec<f64>,
    /// Cells from left to right.
    order: Arc<Vec<usize>>,
    rank: Arc<Vec<usize>>,
}

impl Density {
    /// Assembles the mass matrix and prepares the limiter; `order` is that of the cells in which solves sweep, `rank` its inverse.
    ///
    /// # Errors
    /// A degenerate cell.
    pub fn new(
        loops: &Integrator,
        space: &Arc<Space>,
        open: Faces,
        neighbours: &Neighbours,
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
            neighbours: neighbours.clone(),
            space: space.clone(),
            order: order.clone(),
            rank: rank.clone(),
        })
    }

    /// `M x`
    pub fn mass_times(&self, x: &[f64]) -> Vec<f64> {
        self.each_block(&self.mass, x)
    }

    /// `M⁻¹ f`
    pub fn mass_solve(&self, f: &[f64]) -> Vec<f64> {
        self.each_block(&self.mass_inverse, f)
    }

    fn each_block(&self, blocks: &[f64], x: &[f64]) -> Vec<f64> {
        let n = self.space.n;
        let mut out = vec![0.0; x.len()];
        for ((block, x), out) in blocks.chunks_exact(n * n).zip(x.chunks_exact(n)).zip(out.chunks_exact_mut(n)) {
            add_product(block, x, out);
        }
        out
    }

    /// `∫ρ`
    pub fn total(&self, rho: &[f64]) -> f64 {
        dot(&self.weights, rho)
    }

    /// `w (ρ|z) + a_mass(ρ,z;v)`   [7.32]
    pub fn operator(&self, loops: &Integrator, w: f64, flow: &Field) -> Rows {
        let (space, n) = (&*self.space, self.space.n);
        let mut rows = Rows::zero(&self.neighbours, (n, n), true);
        rows.own.iter_mut().zip(&self.mass).for_each(|(a, m)| *a = w * m);
        loops.add_rows(&transport::a_mass(space, flow, self.open), (space, space), &mut rows.own, &mut rows.off);
        rows
    }

    /// Solves `A ρ = b` from the guess in `rho` to rounding, so that mass is kept.
    ///
    /// # Errors
    /// A singular block; an iteration that stalls.
    pub fn solve(&self, operator: &Rows, b: &[f64], rho: &mut [f64]) -> Result<usize, SolveError> {
        let n = self.space.n;
        let inverses = invert_general(&operator.own, n)?;
        let apply = |x: &[f64], y: &mut [f64]| {
            y.fill(0.0);
            operator.times_add(x, y);
        };
        let sweep = |x: &mut [f64]| self.sweep(operator, &inverses, x);
        let outcome = gmres(&apply, &sweep, b, rho, 1e-14 * norm(b), KRYLOV_LIMIT);
        let relative = outcome.residual / norm(b).max(f64::MIN_POSITIVE);
        if relative > 1e-11 || relative.is_nan() {
            let hint = "take a smaller time step".to_owned();
            return Err(SolveError::Inaccurate { system: "density".into(), residual: relative, hint });
        }
        // rounding leaves a residual whose sum would be mass: it is taken up by all cells in proportion
        let ones = self.total_of_rows(operator, rho);
        let missing = b.iter().sum::<f64>() - ones;
        if ones != 0.0 && (missing / ones).abs() < 1e-9 {
            rho.iter_mut().for_each(|r| *r *= 1.0 + missing / ones);
        }
        Ok(outcome.iterations)
    }

    /// `1ᵀAρ`
    fn total_of_rows(&self, operator: &Rows, rho: &[f64]) -> f64 {
        let mut image = vec![0.0; rho.len()];
        operator.times_add(rho, &mut image);
        image.iter().sum()
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

    /// The density less its mean over the domain, of a direction.
    pub fn without_mean(&self, direction: &mut [f64]) {
        let mean = self.total(direction) / self.weights.iter().sum::<f64>();
        direction.iter_mut().for_each(|r| *r -= mean);
    }
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
