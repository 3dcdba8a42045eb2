//! Matrices of bilinear forms: blocks by cell and neighbour, or triplets.

use rayon::prelude::*;

use super::Bilinear;
use super::integrate::{Integrator, block_size};
use super::words::{Jet, Vector};
use super::worker::{FaceSide, Worker};
use crate::solve::blocks::{Neighbours, VectorBlocks};
use crate::solve::rows::Rows;
use crate::space::Space;

impl Integrator {
    /// Dense blocks of a form over cells, cell after cell, row-major with test dofs as rows.
    ///
    /// # Panics
    /// A form with integrals over faces, for which there is no room: [`Integrator::rows`] has it.
    pub fn cell_blocks<U: Jet, V: Jet>(&self, form: &Bilinear<U, V>, trial: &Space, test: &Space) -> Vec<f64> {
        let mut blocks = vec![0.0; self.mesh.cells.len() * block_size::<V>(test) * block_size::<U>(trial)];
        self.add_cell_blocks(form, trial, test, &mut blocks);
        blocks
    }

    /// Adds a form over cells to the dense blocks `blocks`.
    ///
    /// # Panics
    /// As [`Integrator::cell_blocks`].
    pub fn add_cell_blocks<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        trial: &Space,
        test: &Space,
        blocks: &mut [f64],
    ) {
        assert!(!form.has_faces(), "blocks of cells have no room for integrals over faces");
        self.add_cell_terms(form, trial, test, blocks);
    }

    /// The integrals over cells alone; whoever asks takes care of those over faces.
    fn add_cell_terms<U: Jet, V: Jet>(&self, form: &Bilinear<U, V>, trial: &Space, test: &Space, blocks: &mut [f64]) {
        let size = block_size::<V>(test) * block_size::<U>(trial);
        blocks.par_chunks_mut(size).enumerate().for_each_init(
            || Worker::new::<U, V>(trial, test),
            |worker, (cell, out)| worker.add_cell(self, form, cell, out),
        );
    }

    /// Dense blocks of a form over cells, on some cells alone, in their order.
    ///
    /// # Panics
    /// As [`Integrator::cell_blocks`].
    pub fn blocks_of<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        (trial, test): (&Space, &Space),
        cells: &[usize],
    ) -> Vec<Vec<f64>> {
        assert!(!form.has_faces(), "blocks of cells have no room for integrals over faces");
        let size = block_size::<V>(test) * block_size::<U>(trial);
        let block = |worker: &mut Worker, &cell: &usize| {
            let mut block = vec![0.0; size];
            worker.add_cell(self, form, cell, &mut block);
            block
        };
        cells.par_iter().map_init(|| Worker::new::<U, V>(trial, test), block).collect()
    }

    /// The rows of a form between spaces whose functions are taken cell by cell: cells see their neighbours where the
    /// form has integrals over the faces between them, and only there.
    pub fn rows<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        (trial, test): (&Space, &Space),
        neighbours: &Neighbours,
    ) -> Rows {
        let size = (block_size::<V>(test), block_size::<U>(trial));
        let mut rows = Rows::zero(neighbours, size, form.couples_cells());
        match (form.has_faces(), form.couples_cells()) {
            (false, _) => self.add_cell_blocks(form, trial, test, &mut rows.own),
            (true, false) => self.add_own_rows(form, (trial, test), &mut rows.own),
            (true, true) => self.add_rows(form, (trial, test), &mut rows.own, &mut rows.off),
        }
        rows
    }

    /// Adds a form that mixes the components of a field to an operator on its space: blocks that mix them across faces
    /// are stored where the form has integrals there, and only there.
    pub fn add_mixed(&self, form: &Bilinear<Vector, Vector>, space: &Space, out: &mut VectorBlocks) {
        match (form.has_faces(), form.couples_cells()) {
            (false, _) => self.add_cell_blocks(form, space, space, &mut out.diagonal),
            (true, false) => self.add_own_rows(form, (space, space), &mut out.diagonal),
            (true, true) => {
                let (diagonal, mixed) = out.with_mixed();
                self.add_rows(form, (space, space), diagonal, mixed);
            }
        }
    }

    /// The rows of a form, cell by cell: the block of the cell's own trial functions, and those of the three neighbours
    /// across local faces 0, 1, 2, added to `diagonal` and `off`. Each cell visits its own faces.
    pub fn add_rows<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        (trial, test): (&Space, &Space),
        diagonal: &mut [f64],
        off: &mut [f64],
    ) {
        let size = block_size::<V>(test) * block_size::<U>(trial);
        let cells = diagonal.par_chunks_mut(size).zip(off.par_chunks_mut(3 * size)).enumerate();
        cells.for_each_init(
            || Worker::new::<U, V>(trial, test),
            |worker, (cell, (diagonal, off))| {
                worker.add_cell(self, form, cell, diagonal);
                for (local, off) in off.chunks_exact_mut(size).enumerate() {
                    self.add_face_of_cell(worker, form, (cell, local), diagonal, off);
                }
            },
        );
    }

    /// As [`Integrator::add_rows`] for a form whose rows only see their own cell.
    ///
    /// # Panics
    /// A form whose rows see other cells.
    pub fn add_own_rows<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        (trial, test): (&Space, &Space),
        diagonal: &mut [f64],
    ) {
        let size = block_size::<V>(test) * block_size::<U>(trial);
        diagonal.par_chunks_mut(size).enumerate().for_each_init(
            || (Worker::new::<U, V>(trial, test), vec![0.0; size]),
            |(worker, off), (cell, diagonal)| self.add_own_row(worker, form, cell, diagonal, off),
        );
    }

    /// As [`Integrator::add_own_rows`], on some cells alone, in their order.
    ///
    /// # Panics
    /// A form whose rows see other cells.
    pub fn own_rows_of<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        (trial, test): (&Space, &Space),
        cells: &[usize],
    ) -> Vec<Vec<f64>> {
        let size = block_size::<V>(test) * block_size::<U>(trial);
        let row = |(worker, off): &mut (Worker, Vec<f64>), &cell: &usize| {
            let mut block = vec![0.0; size];
            self.add_own_row(worker, form, cell, &mut block, off);
            block
        };
        cells.par_iter().map_init(|| (Worker::new::<U, V>(trial, test), vec![0.0; size]), row).collect()
    }

    /// `off` stays zero.
    fn add_own_row<U: Jet, V: Jet>(
        &self,
        worker: &mut Worker,
        form: &Bilinear<U, V>,
        cell: usize,
        diagonal: &mut [f64],
        off: &mut [f64],
    ) {
        worker.add_cell(self, form, cell, diagonal);
        for local in 0..3 {
            self.add_face_of_cell(worker, form, (cell, local), diagonal, off);
        }
        assert!(off.iter().all(|value| *value == 0.0), "the rows of a cell see another one");
    }

    /// The integrals over a cell and over its faces on the boundary.
    pub(super) fn add_own_terms<U: Jet, V: Jet>(
        &self,
        worker: &mut Worker,
        form: &Bilinear<U, V>,
        cell: usize,
        own: &mut [f64],
    ) {
        worker.add_cell(self, form, cell, own);
        for local in (0..3).filter(|&local| self.mesh.faces[self.mesh.cell_faces[cell][local]].plus.is_none()) {
            self.add_face_of_cell(worker, form, (cell, local), own, &mut []);
        }
    }

    fn add_face_of_cell<U: Jet, V: Jet>(
        &self,
        worker: &mut Worker,
        form: &Bilinear<U, V>,
        (cell, local): (usize, usize),
        diagonal: &mut [f64],
        off: &mut [f64],
    ) {
        let index = self.mesh.cell_faces[cell][local];
        let face = &self.mesh.faces[index];
        let side = usize::from(face.minus.cell != cell || face.minus.face != local);
        worker.add_face_row(self, form, FaceSide { face: index, side }, diagonal, off);
    }

    /// The whole matrix as triplets `(row, column, value)`; rows are test dofs. Duplicates are to be added.
    pub fn triplets<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        trial: &Space,
        test: &Space,
    ) -> Vec<(usize, usize, f64)> {
        let mut triplets = Vec::new();
        let size = block_size::<V>(test) * block_size::<U>(trial);
        if !form.cell_terms.is_empty() {
            let mut blocks = vec![0.0; self.mesh.cells.len() * size];
            self.add_cell_terms(form, trial, test, &mut blocks);
            for (cell, block) in blocks.chunks(size).enumerate() {
                scatter::<U>(&mut triplets, block, (test, cell), (trial, cell));
            }
        }
        let mut worker = Worker::new::<U, V>(trial, test);
        let (mut own, mut other) = (vec![0.0; size], vec![0.0; size]);
        for (index, face) in self.mesh.faces.iter().enumerate() {
            if !form.face_terms.iter().any(|t| t.faces.holds(face)) {
                continue;
            }
            let cells: Vec<usize> = std::iter::once(face.minus).chain(face.plus).map(|s| s.cell).collect();
            for (side, &cell) in cells.iter().enumerate() {
                own.fill(0.0);
                other.fill(0.0);
                worker.add_face_row(self, form, FaceSide { face: index, side }, &mut own, &mut other);
                scatter::<U>(&mut triplets, &own, (test, cell), (trial, cell));
                if let Some(&across) = cells.get(1 - side) {
                    scatter::<U>(&mut triplets, &other, (test, cell), (trial, across));
                }
            }
        }
        triplets
    }
}

/// Appends a dense block.
fn scatter<U: Jet>(
    triplets: &mut Vec<(usize, usize, f64)>,
    block: &[f64],
    test: (&Space, usize),
    trial: (&Space, usize),
) {
    let columns = block_size::<U>(trial.0);
    assert_eq!(
        (columns, block.len()),
        (trial.0.cell_dof_count(), columns * test.0.cell_dof_count()),
        "jets and spaces have different numbers of components"
    );
    for (k, &value) in block.iter().enumerate() {
        if value != 0.0 {
            let (i, j) = (k / columns, k % columns);
            let row = test.0.dof(test.1, i / test.0.n, i % test.0.n);
            let column = trial.0.dof(trial.1, j / trial.0.n, j % trial.0.n);
            triplets.push((row, column, value));
        }
    }
}
