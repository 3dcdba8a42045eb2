//! Operators on a discontinuous space, stored as dense blocks by cell and neighbour, and their incomplete
//! factorisation.
//!
//! Both components of a vector couple to neighbouring cells in the same way, so a neighbour's block is that of one
//! component, `n × n`; only the block of the cell itself, `2n × 2n`, couples the components. Where something mixes the
//! components across faces, a neighbour has a second block, `2n × 2n`, that is added to it.

use std::sync::Arc;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::SolveError;
use super::sparse::Matrix;
use crate::mesh::Mesh;

/// No neighbour across this face.
pub const NONE: usize = usize::MAX;

/// The neighbours of every cell, by local face; [`NONE`] on the boundary.
pub type Neighbours = Arc<Vec<[usize; 3]>>;

/// Cells next to each cell.
pub fn neighbours(mesh: &Mesh) -> Neighbours {
    let of = |cell: usize| std::array::from_fn(|f| mesh.neighbour(cell, f).map_or(NONE, |s| s.cell));
    Arc::new((0..mesh.cells.len()).map(of).collect())
}

/// An operator that acts on each component alike.
#[derive(Debug, Clone)]
pub struct ScalarBlocks {
    /// Rows of a block.
    pub n: usize,
    /// Which cells have a block beside that of a cell.
    pub neighbours: Neighbours,
    /// `n × n` per cell.
    pub diagonal: Vec<f64>,
    /// `n × n` per cell and local face.
    pub off: Vec<f64>,
}

impl ScalarBlocks {
    /// The zero operator.
    pub fn zero(neighbours: &Neighbours, n: usize) -> Self {
        let cells = neighbours.len();
        Self {
            n,
            neighbours: neighbours.clone(),
            diagonal: vec![0.0; cells * n * n],
            off: vec![0.0; 3 * cells * n * n],
        }
    }

    /// `A x` for a field of two components.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        let (n, size) = (self.n, self.n * self.n);
        let mut y = vec![0.0; x.len()];
        y.par_chunks_mut(2 * n).enumerate().for_each(|(cell, y)| {
            let own = &self.diagonal[cell * size..(cell + 1) * size];
            multiply_each(own, n, &x[cell * 2 * n..(cell + 1) * 2 * n], y, 1.0);
            for (f, &other) in self.neighbours[cell].iter().enumerate() {
                if other != NONE {
                    let block = &self.off[(3 * cell + f) * size..(3 * cell + f + 1) * size];
                    multiply_each(block, n, &x[other * 2 * n..(other + 1) * 2 * n], y, 1.0);
                }
            }
        });
        y
    }
}

/// `y_c += sign A x_c` for both components; `A` is `n × n`, row-major.
fn multiply_each(a: &[f64], n: usize, x: &[f64], y: &mut [f64], sign: f64) {
    match n {
        3 => multiply_each_of::<3>(a, x, y, sign),
        6 => multiply_each_of::<6>(a, x, y, sign),
        10 => multiply_each_of::<10>(a, x, y, sign),
        15 => multiply_each_of::<15>(a, x, y, sign),
        21 => multiply_each_of::<21>(a, x, y, sign),
        other => unreachable!("no Lagrange triangle has {other} functions"),
    }
}

fn multiply_each_of<const N: usize>(a: &[f64], x: &[f64], y: &mut [f64], sign: f64) {
    let x0: &[f64; N] = x[..N].try_into().expect("first component");
    let x1: &[f64; N] = x[N..2 * N].try_into().expect("second component");
    let (y0, y1) = y.split_at_mut(N);
    for ((row, y0), y1) in a.as_chunks::<N>().0.iter().zip(y0).zip(y1) {
        *y0 += sign * product(row, x0);
        *y1 += sign * product(row, x1);
    }
}

/// `y += A x`, `A` dense `2n × 2n` row-major.
fn multiply(a: &[f64], x: &[f64], y: &mut [f64], sign: f64) {
    match x.len() {
        6 => multiply_of::<6>(a, x, y, sign),
        12 => multiply_of::<12>(a, x, y, sign),
        20 => multiply_of::<20>(a, x, y, sign),
        30 => multiply_of::<30>(a, x, y, sign),
        42 => multiply_of::<42>(a, x, y, sign),
        other => unreachable!("no polarity cell has {other} unknowns"),
    }
}

fn multiply_of<const M: usize>(a: &[f64], x: &[f64], y: &mut [f64], sign: f64) {
    let x: &[f64; M] = x.try_into().expect("one value per column");
    for (row, y) in a.as_chunks::<M>().0.iter().zip(y) {
        *y += sign * product(row, x);
    }
}

/// Scalar product in four lanes, so that it needs no chain of dependent additions.
fn product<const N: usize>(a: &[f64; N], x: &[f64; N]) -> f64 {
    let mut lanes = [0.0; 4];
    let whole = N / 4 * 4;
    for k in (0..whole).step_by(4) {
        for l in 0..4 {
            lanes[l] += a[k + l] * x[k + l];
        }
    }
    for k in whole..N {
        lanes[k - whole] += a[k] * x[k];
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}

/// An operator whose own-cell blocks couple the two components.
#[derive(Debug, Clone)]
pub struct VectorBlocks {
    /// Rows of one component of a block.
    pub n: usize,
    /// Which cells have a block beside that of a cell.
    pub neighbours: Neighbours,
    /// `2n × 2n` per cell.
    pub diagonal: Vec<f64>,
    /// `n × n` per cell and local face: what acts on both components alike.
    pub off: Vec<f64>,
    /// `2n × 2n` per cell and local face: what does not; empty where nothing mixes the components across faces.
    mixed: Vec<f64>,
}

impl VectorBlocks {
    /// The zero operator.
    pub fn zero(neighbours: &Neighbours, n: usize) -> Self {
        let cells = neighbours.len();
        Self {
            n,
            neighbours: neighbours.clone(),
            diagonal: vec![0.0; 4 * cells * n * n],
            off: vec![0.0; 3 * cells * n * n],
            mixed: Vec::new(),
        }
    }

    /// All blocks zero, in the same memory, but for those that act on both components alike across faces: those are
    /// `off`, or zero where that is empty.
    pub fn restart(&mut self, off: &[f64]) {
        self.diagonal.fill(0.0);
        match off.is_empty() {
            true => self.off.fill(0.0),
            false => self.off.copy_from_slice(off),
        }
        self.mixed.fill(0.0);
    }

    /// The blocks of the cells, and room for blocks that mix the components across faces.
    pub fn with_mixed(&mut self) -> (&mut [f64], &mut [f64]) {
        if self.mixed.is_empty() {
            self.mixed = vec![0.0; 3 * self.diagonal.len()];
        }
        (&mut self.diagonal, &mut self.mixed)
    }

    /// What mixes the components across a local face of a cell, where anything does.
    pub fn mixed_of(&self, cell: usize, face: usize) -> Option<&[f64]> {
        let size = 4 * self.n * self.n;
        self.mixed.get((3 * cell + face) * size..(3 * cell + face + 1) * size)
    }

    /// `A B` for the block B of the rows of `cell` and the columns of `other`; `None` where there is none.
    pub fn left_product(&self, a: &DMatrix<f64>, cell: usize, other: usize) -> Option<DMatrix<f64>> {
        let (n, m) = (self.n, 2 * self.n);
        if other == cell {
            return Some(a * DMatrix::from_row_slice(m, m, &self.diagonal[cell * m * m..(cell + 1) * m * m]));
        }
        let face = self.neighbours[cell].iter().position(|&o| o == other)?;
        let alike = &self.off[(3 * cell + face) * n * n..(3 * cell + face + 1) * n * n];
        let alike = DMatrix::from_row_slice(n, n, alike);
        let mut product = DMatrix::zeros(a.nrows(), m);
        for c in [0, n] {
            product.columns_mut(c, n).copy_from(&(a.columns(c, n) * &alike));
        }
        if let Some(mixed) = self.mixed_of(cell, face) {
            product += a * DMatrix::from_row_slice(m, m, mixed);
        }
        Some(product)
    }

    /// The whole block `2n × 2n` across a local face of a cell.
    fn whole_off(&self, cell: usize, face: usize) -> DMatrix<f64> {
        let (n, m) = (self.n, 2 * self.n);
        let alike = &self.off[(3 * cell + face) * n * n..(3 * cell + face + 1) * n * n];
        let alike = DMatrix::from_row_slice(n, n, alike);
        let mut whole = match self.mixed_of(cell, face) {
            Some(mixed) => DMatrix::from_row_slice(m, m, mixed),
            None => DMatrix::zeros(m, m),
        };
        for c in [0, n] {
            let mut part = whole.view_mut((c, c), (n, n));
            part += &alike;
        }
        whole
    }

    /// Adds blocks `n × n` per cell that act on both components alike.
    pub fn add_alike(&mut self, diagonal: &[f64]) {
        let (n, size) = (self.n, self.n * self.n);
        self.diagonal.par_chunks_mut(4 * size).zip(diagonal.par_chunks(size)).for_each(|(block, alike)| {
            for (k, a) in alike.iter().enumerate() {
                let at = k / n * 2 * n + k % n;
                block[at] += a;
                block[at + n * (2 * n + 1)] += a;
            }
        });
    }

    /// `A x`.
    pub fn times(&self, x: &[f64], y: &mut [f64]) {
        let (n, size) = (self.n, self.n * self.n);
        y.par_chunks_mut(2 * n).enumerate().for_each(|(cell, y)| {
            y.fill(0.0);
            let own = &self.diagonal[cell * 4 * size..(cell + 1) * 4 * size];
            multiply(own, &x[cell * 2 * n..(cell + 1) * 2 * n], y, 1.0);
            for (f, &other) in self.neighbours[cell].iter().enumerate() {
                if other != NONE {
                    let block = &self.off[(3 * cell + f) * size..(3 * cell + f + 1) * size];
                    multiply_each(block, n, &x[other * 2 * n..(other + 1) * 2 * n], y, 1.0);
                }
            }
        });
        if !self.mixed.is_empty() {
            self.add_mixed_times(x, y);
        }
    }

    /// `y += A x` for the blocks that mix the components across faces.
    fn add_mixed_times(&self, x: &[f64], y: &mut [f64]) {
        let m = 2 * self.n;
        y.par_chunks_mut(m).enumerate().for_each(|(cell, y)| {
            for (f, &other) in self.neighbours[cell].iter().enumerate().filter(|(_, o)| **o != NONE) {
                if let Some(block) = self.mixed_of(cell, f) {
                    multiply(block, &x[other * m..(other + 1) * m], y, 1.0);
                }
            }
        });
    }

    /// The same operator as a sparse matrix.
    pub fn to_sparse(&self) -> Matrix {
        let (n, m) = (self.n, 2 * self.n);
        let mut triplets = Vec::with_capacity(self.diagonal.len() + 2 * self.off.len());
        for (cell, own) in self.diagonal.chunks(m * m).enumerate() {
            triplets.extend(own.iter().enumerate().map(|(k, &v)| (cell * m + k / m, cell * m + k % m, v)));
            for (f, &other) in self.neighbours[cell].iter().enumerate().filter(|(_, o)| **o != NONE) {
                let block = &self.off[(3 * cell + f) * n * n..(3 * cell + f + 1) * n * n];
                for (k, &v) in block.iter().enumerate() {
                    for c in 0..2 {
                        triplets.push((cell * m + c * n + k / n, other * m + c * n + k % n, v));
                    }
                }
                for (k, &v) in self.mixed_of(cell, f).into_iter().flatten().enumerate() {
                    triplets.push((cell * m + k / m, other * m + k % m, v));
                }
            }
        }
        let size = self.neighbours.len() * m;
        Matrix::from_triplets(size, size, &triplets)
    }
}

/// Block incomplete factorisation `A ≈ (D + L) D⁻¹ (D + U)` in a given order of the cells, with
/// `D_i = A_ii − Σ_{j before i} A_ij D_j⁻¹ A_ji`. It is exact when nothing flows back against the order.
#[derive(Debug, Clone)]
pub struct Incomplete {
    n: usize,
    order: Arc<Vec<usize>>,
    rank: Arc<Vec<usize>>,
    /// `D_i⁻¹`.
    inverses: Vec<f64>,
}

impl Incomplete {
    /// Factorises `a` in the order `order` of its cells.
    ///
    /// # Errors
    /// When a pivot block is singular or not finite.
    pub fn new(a: &VectorBlocks, order: &Arc<Vec<usize>>, rank: &Arc<Vec<usize>>) -> Result<Self, SolveError> {
        let (n, m) = (a.n, 2 * a.n);
        let mut inverses = vec![0.0; a.diagonal.len()];
        for &cell in order.iter() {
            let mut pivot = DMatrix::from_row_slice(m, m, &a.diagonal[cell * m * m..(cell + 1) * m * m]);
            for (f, &other) in a.neighbours[cell].iter().enumerate() {
                if other == NONE || rank[other] >= rank[cell] {
                    continue;
                }
                let back = a.neighbours[other].iter().position(|&c| c == cell).expect("neighbours are mutual");
                let inverse = DMatrix::from_row_slice(m, m, &inverses[other * m * m..(other + 1) * m * m]);
                if a.mixed.is_empty() {
                    let block = |k: usize| DMatrix::from_row_slice(n, n, &a.off[k * n * n..(k + 1) * n * n]);
                    let (here, there) = (block(3 * cell + f), block(3 * other + back));
                    for (r, c) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                        let product = &here * inverse.view((r * n, c * n), (n, n)) * &there;
                        let mut part = pivot.view_mut((r * n, c * n), (n, n));
                        part -= product;
                    }
                } else {
                    pivot -= a.whole_off(cell, f) * inverse * a.whole_off(other, back);
                }
            }
            let inverse = pivot.try_inverse().filter(|i| i.iter().all(|v| v.is_finite())).ok_or_else(|| {
                SolveError::Factorise {
                    system: "polarity".into(),
                    reason: format!("the pivot block of cell {cell} is singular"),
                    hint: "take a smaller time step".into(),
                }
            })?;
            inverses[cell * m * m..(cell + 1) * m * m].copy_from_slice(inverse.transpose().as_slice());
        }
        Ok(Self { n, order: order.clone(), rank: rank.clone(), inverses })
    }

    /// `x ← (D + U)⁻¹ D (D + L)⁻¹ x`, with the neighbour blocks of `a` (which may have changed since).
    pub fn solve(&self, a: &VectorBlocks, x: &mut [f64]) {
        let m = 2 * self.n;
        let mut sum = vec![0.0; m];
        for &cell in self.order.iter() {
            sum.copy_from_slice(&x[cell * m..(cell + 1) * m]);
            self.gather(a, cell, x, &mut sum, |other, own| other < own);
            let own = &mut x[cell * m..(cell + 1) * m];
            own.fill(0.0);
            multiply(&self.inverses[cell * m * m..(cell + 1) * m * m], &sum, own, 1.0);
        }
        for &cell in self.order.iter().rev() {
            sum.fill(0.0);
            self.gather(a, cell, x, &mut sum, |other, own| other > own);
            multiply(&self.inverses[cell * m * m..(cell + 1) * m * m], &sum, &mut x[cell * m..(cell + 1) * m], 1.0);
        }
    }

    /// `sum −= Σ A_ij x_j` over the neighbours j whose rank compares with the cell's as `counts` says.
    fn gather(&self, a: &VectorBlocks, cell: usize, x: &[f64], sum: &mut [f64], counts: impl Fn(usize, usize) -> bool) {
        let (n, m) = (self.n, 2 * self.n);
        for (f, &other) in a.neighbours[cell].iter().enumerate() {
            if other != NONE && counts(self.rank[other], self.rank[cell]) {
                let block = &a.off[(3 * cell + f) * n * n..(3 * cell + f + 1) * n * n];
                multiply_each(block, n, &x[other * m..(other + 1) * m], sum, -1.0);
                if let Some(block) = a.mixed_of(cell, f) {
                    multiply(block, &x[other * m..(other + 1) * m], sum, -1.0);
                }
            }
        }
    }
}
