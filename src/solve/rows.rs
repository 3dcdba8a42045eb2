//! Dense blocks by cell and neighbour, between any two spaces whose functions are numbered cell by cell.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::blocks::{NONE, Neighbours};

/// An operator with dense blocks, row-major: own cell, and the cells across the three local faces where it sees them.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Rows and columns of a block.
    pub size: (usize, usize),
    pub neighbours: Neighbours,
    pub own: Vec<f64>,
    /// By cell and local face; empty where a cell only sees itself.
    pub off: Vec<f64>,
}

impl Rows {
    /// The zero operator; `wide` where cells see their neighbours.
    pub fn zero(neighbours: &Neighbours, size: (usize, usize), wide: bool) -> Self {
        let count = neighbours.len() * size.0 * size.1;
        let off = if wide { vec![0.0; 3 * count] } else { Vec::new() };
        Self { size, neighbours: neighbours.clone(), own: vec![0.0; count], off }
    }

    /// The block of a cell with itself.
    pub fn own_of(&self, cell: usize) -> &[f64] {
        let size = self.size.0 * self.size.1;
        &self.own[cell * size..(cell + 1) * size]
    }

    /// The blocks of a cell with its neighbours, and who they are, by local face.
    pub fn off_of(&self, cell: usize) -> impl Iterator<Item = (usize, &[f64])> {
        let size = self.size.0 * self.size.1;
        let blocks = self.off.get(3 * cell * size..3 * (cell + 1) * size).unwrap_or(&[]).chunks_exact(size);
        self.neighbours[cell].into_iter().zip(blocks).filter(|(other, _)| *other != NONE)
    }

    /// The block of the rows of `cell` and the columns of `other`, where there is one.
    pub fn block(&self, cell: usize, other: usize) -> Option<&[f64]> {
        match other == cell {
            true => Some(self.own_of(cell)),
            false => self.off_of(cell).find(|(seen, _)| *seen == other).map(|(_, block)| block),
        }
    }

    /// `A C` for a C that acts on single cells: its blocks where it is not the identity.
    pub fn times_columns(&mut self, changes: &[Option<DMatrix<f64>>]) {
        let (rows, columns) = self.size;
        let change_block = |block: &mut [f64], cell: usize| {
            if let Some(change) = changes.get(cell).and_then(Option::as_ref) {
                let product = DMatrix::from_row_slice(rows, columns, block) * change;
                block.copy_from_slice(product.transpose().as_slice());
            }
        };
        let size = rows * columns;
        for (cell, block) in self.own.chunks_exact_mut(size).enumerate() {
            change_block(block, cell);
        }
        for (k, block) in self.off.chunks_exact_mut(size).enumerate() {
            change_block(block, self.neighbours[k / 3][k % 3]);
        }
    }

    /// `y += A x`, both cell by cell.
    pub fn times_add(&self, x: &[f64], y: &mut [f64]) {
        let (rows, columns) = self.size;
        y.par_chunks_mut(rows).enumerate().for_each(|(cell, y)| {
            add_product(self.own_of(cell), &x[cell * columns..(cell + 1) * columns], y);
            for (other, block) in self.off_of(cell) {
                add_product(block, &x[other * columns..(other + 1) * columns], y);
            }
        });
    }
}

/// `y = B x` with a block `n × n` per cell, row-major, that acts alike on each of so many components.
pub fn times_each(blocks: &[f64], n: usize, components: usize, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    y.par_chunks_mut(n).zip(x.par_chunks(n)).enumerate().for_each(|(k, (y, x))| {
        let cell = k / components;
        add_product(&blocks[cell * n * n..(cell + 1) * n * n], x, y);
    });
    y
}

/// `y += A x`, A row-major.
pub fn add_product(a: &[f64], x: &[f64], y: &mut [f64]) {
    for (row, y) in a.chunks_exact(x.len()).zip(y) {
        *y += row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
    }
}

/// `y += scale Σ_k x_k A_k`, the rows of A, row-major: `y += scale Aᵀ x`.
#[inline(always)]
pub fn add_combined(scale: f64, x: &[f64], a: &[f64], y: &mut [f64]) {
    for (x, row) in x.iter().zip(a.chunks_exact(y.len())) {
        let factor = scale * x;
        y.iter_mut().zip(row).for_each(|(y, a)| *y += factor * a);
    }
}
