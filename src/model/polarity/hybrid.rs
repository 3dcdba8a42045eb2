//! The polarity in hybrid form: what its traces on the faces are, and what they bring into the equation of a cell.
//!
//! The traces are no unknowns of a time step: they follow from polarity and flow face by face,
//! `Σ_K ∫ τ (p−p̂)·q̂ = Σ_K ∫ κ²∂_np·q̂`. Where linear systems are solved, they are the unknowns, and the polarities of
//! the cells are eliminated (`model::condensed`).

use std::sync::Arc;

use nalgebra::{DMatrix, DMatrixView};
use rayon::prelude::*;

use crate::form::side::HybridSize;
use crate::form::words::Scalar;
use crate::form::{Bilinear, Integrator};
use crate::model::terms::{At, MOLECULAR, POLARITY, Sum};
use crate::solve::blocks::{NONE, VectorBlocks};
use crate::solve::rows::add_product;
use crate::space::{Skeleton, Space, Traces};

/// What the equation of the polarity has beside its cells.
#[derive(Debug)]
pub struct Hybrid {
    /// Where the traces live.
    pub skeleton: Arc<Skeleton>,
    /// Of the blocks of a form that acts on both components alike.
    pub size: HybridSize,
    /// The constant terms: blocks cell by cell, of one component.
    pub constant: Vec<f64>,
}

/// Overwrites the rows r of a face by `−M⁻¹ r`, component by component; M is positive as τ is.
fn solve_face(matrix: DMatrix<f64>, rows: &mut [f64]) {
    let right = DMatrix::from_column_slice(matrix.nrows(), 2, rows);
    match matrix.cholesky().map(|factor| factor.solve(&right)) {
        Some(solved) => rows.iter_mut().zip(solved.iter()).for_each(|(r, s)| *r = -s),
        None => rows.fill(f64::NAN),
    }
}

/// A row-major block, transposed.
fn transposed(block: &[f64], rows: usize, columns: usize) -> DMatrixView<'_, f64> {
    DMatrixView::from_slice(block, columns, rows)
}

impl Hybrid {
    /// Assembles the constant terms, those of a sheet whose `at` has no flow.
    pub fn new(loops: &Integrator, space: &Space, skeleton: Arc<Skeleton>, at: &At) -> Self {
        let size = Integrator::hybrid_size::<Scalar, Scalar>(space, space, &skeleton, true);
        let mut constant = vec![0.0; space.mesh.cells.len() * size.rows() * size.rows()];
        let form = Sum::of(&[MOLECULAR]).constant().by_components(at);
        loops.add_hybrid(&form, (space, space), (&skeleton, true), &mut constant);
        Self { skeleton, size, constant }
    }

    fn block<'b>(&self, blocks: &'b [f64], cell: usize) -> &'b [f64] {
        let size = self.size.rows() * self.size.rows();
        &blocks[cell * size..(cell + 1) * size]
    }

    /// The constant terms in the cells, of polarity and traces, one cell after the other.
    pub fn times(&self, p: &[f64], traces: &Traces) -> Vec<f64> {
        let mut out = vec![0.0; p.len()];
        self.add_own(&self.constant, Some(p), traces, &mut out);
        out
    }

    /// What other traces add to the constant terms in the cells.
    pub fn add_change(&self, change: &Traces, out: &mut [f64]) {
        self.add_own(&self.constant, None, change, out);
    }

    /// The rows of the cells' functions, times polarity and traces.
    fn add_own(&self, blocks: &[f64], p: Option<&[f64]>, traces: &Traces, out: &mut [f64]) {
        let (n, columns) = (self.size.own.0, self.size.columns());
        out.par_chunks_mut(2 * n).enumerate().for_each(|(cell, out)| {
            let block = self.block(blocks, cell);
            for (c, out) in out.chunks_exact_mut(n).enumerate() {
                let mut x = vec![0.0; columns];
                if let Some(p) = p {
                    x[..n].copy_from_slice(&p[(2 * cell + c) * n..(2 * cell + c + 1) * n]);
                }
                self.gather(cell, c, &traces.values, &mut x[n..]);
                add_product(&block[..n * columns], &x, out);
            }
        });
    }

    /// A component of the traces on the local faces of a cell; 0 on the boundary.
    fn gather(&self, cell: usize, c: usize, traces: &[f64], out: &mut [f64]) {
        let modes = self.skeleton.modes();
        for (first, out) in self.skeleton.of_cell(cell).into_iter().zip(out.chunks_exact_mut(modes)) {
            if let Some(first) = first {
                out.copy_from_slice(&traces[first + c * modes..first + (c + 1) * modes]);
            }
        }
    }

    /// The traces of `at.p` in the flow of `at`.
    pub fn traces(&self, loops: &Integrator, at: &At) -> Traces {
        let (modes, p) = (self.skeleton.modes(), &at.p.values);
        let none = Traces::zero(&self.skeleton);
        let at = at.with_traces(Some(&none));
        let sum = Sum::of(&[POLARITY]);
        let mut traces = loops.trace_vector(&sum.value(&at), &self.skeleton);
        let own = loops.trace_blocks(&sum.by_components(&at), &self.skeleton);
        let faces = traces.par_chunks_mut(2 * modes).zip(own.par_chunks(modes * modes)).zip(&self.skeleton.faces);
        faces.for_each(|((values, own), &face)| {
            let mut matrix = DMatrix::from_row_slice(modes, modes, own);
            for (cell, local) in self.sides(face as usize) {
                let block = self.block(&self.constant, cell);
                self.add_to_face(block, (local, p, cell), values, &mut matrix);
            }
            solve_face(matrix, values);
        });
        Traces { values: traces, ..none }
    }

    /// Adds the rows of a face in the block of one of its cells: times the polarity, and their diagonal part.
    fn add_to_face(
        &self,
        block: &[f64],
        (local, p, cell): (usize, &[f64], usize),
        values: &mut [f64],
        matrix: &mut DMatrix<f64>,
    ) {
        let (n, columns, modes) = (self.size.own.0, self.size.columns(), self.skeleton.modes());
        let first = n + local * modes;
        for i in 0..modes {
            let row = &block[(first + i) * columns..(first + i + 1) * columns];
            for c in 0..2 {
                values[c * modes + i] += crate::solve::dot(&row[..n], &p[(2 * cell + c) * n..(2 * cell + c + 1) * n]);
            }
            for j in 0..modes {
                matrix[(i, j)] += row[first + j];
            }
        }
    }

    /// `y` = the rows of the cells' functions of such blocks, times polarity and traces.
    pub fn times_own(&self, blocks: &[f64], p: &[f64], traces: &Traces, y: &mut [f64]) {
        y.fill(0.0);
        self.add_own(blocks, Some(p), traces, y);
    }

    /// The traces that solve the rows of the faces: blocks times polarity and traces, and what `other` adds to the rows
    /// of a local face of a cell.
    pub fn traces_by(&self, blocks: &[f64], p: &[f64], other: impl Fn(usize, usize, &mut [f64]) + Sync) -> Traces {
        let modes = self.skeleton.modes();
        let mut traces = Traces::zero(&self.skeleton);
        traces.values.par_chunks_mut(2 * modes).zip(&self.skeleton.faces).for_each(|(values, &face)| {
            let mut matrix = DMatrix::zeros(modes, modes);
            for (cell, local) in self.sides(face as usize) {
                self.add_to_face(self.block(blocks, cell), (local, p, cell), values, &mut matrix);
                other(cell, local, values);
            }
            solve_face(matrix, values);
        });
        traces
    }

    /// The cells of an inner face with the face's number in each, minus side first.
    fn sides(&self, face: usize) -> impl Iterator<Item = (usize, usize)> {
        let face = &self.skeleton.mesh.faces[face];
        std::iter::once(face.minus).chain(face.plus).map(|side| (side.cell, side.face))
    }

    /// Adds a form of one component, blocks cell by cell, with the traces eliminated face by face: what acts on the
    /// polarities of a cell and of its neighbours. The primal form of the same method.
    pub fn add_primal(&self, blocks: &[f64], out: &mut VectorBlocks) {
        let n = self.size.own.0;
        let inverses: Vec<DMatrix<f64>> =
            self.skeleton.faces.par_iter().map(|&face| self.inverse_of_face(blocks, face as usize)).collect();
        let VectorBlocks { diagonal, off, neighbours, .. } = out;
        diagonal.par_chunks_mut(4 * n * n).zip(off.par_chunks_mut(3 * n * n)).enumerate().for_each(
            |(cell, (diagonal, off))| {
                let block = self.block(blocks, cell);
                let mut own = self.part(block, None, None);
                for (local, &other) in neighbours[cell].iter().enumerate().filter(|(_, other)| **other != NONE) {
                    let face = self.skeleton.mesh.cell_faces[cell][local];
                    let place = self.skeleton.place(face).expect("an inner face");
                    let pull = self.part(block, None, Some(local)) * &inverses[place];
                    own -= &pull * self.part(block, Some(local), None);
                    let across = self.sides(face).find(|side| *side != (cell, local)).expect("two sides");
                    debug_assert_eq!(across.0, other);
                    let seen = pull * self.part(self.block(blocks, across.0), Some(across.1), None);
                    for (entry, value) in off[local * n * n..].iter_mut().zip(seen.transpose().iter()) {
                        *entry -= value;
                    }
                }
                for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                    diagonal[i * 2 * n + j] += own[(i, j)];
                    diagonal[(n + i) * 2 * n + n + j] += own[(i, j)];
                }
            },
        );
    }

    /// The part of a block with the rows and columns of the cell or of a local face.
    fn part(&self, block: &[f64], rows: Option<usize>, columns: Option<usize>) -> DMatrix<f64> {
        let range = |place: Option<usize>| match place {
            None => (0, self.size.own.0),
            Some(local) => (self.size.own.0 + local * self.size.face.0, self.size.face.0),
        };
        let ((row, rows), (column, columns)) = (range(rows), range(columns));
        transposed(block, self.size.rows(), self.size.columns()).view((column, row), (columns, rows)).transpose()
    }

    /// The inverse of what a face's rows have of its traces.
    fn inverse_of_face(&self, blocks: &[f64], face: usize) -> DMatrix<f64> {
        let own = self.sides(face).map(|(cell, local)| self.part(self.block(blocks, cell), Some(local), Some(local)));
        let sum = own.reduce(|a, b| a + b).expect("two sides");
        let modes = sum.nrows();
        sum.try_inverse().unwrap_or_else(|| DMatrix::from_element(modes, modes, f64::NAN))
    }

    /// A form of one component as blocks cell by cell, beginning with the constant terms.
    pub fn with_constant(&self, loops: &Integrator, form: &Bilinear<Scalar, Scalar>, space: &Space) -> Vec<f64> {
        let mut blocks = self.constant.clone();
        loops.add_hybrid(form, (space, space), (&self.skeleton, true), &mut blocks);
        blocks
    }

    /// Adds a block of the cell's functions alone, one component, row-major, to the block of every cell.
    pub fn add_cells(&self, cells: &[f64], scale: f64, blocks: &mut [f64]) {
        let (n, columns) = (self.size.own.0, self.size.columns());
        blocks.par_chunks_mut(columns * columns).zip(cells.par_chunks(n * n)).for_each(|(block, cell)| {
            for (row, own) in block.chunks_exact_mut(columns).zip(cell.chunks_exact(n)) {
                crate::solve::axpy(scale, own, &mut row[..n]);
            }
        });
    }
}
