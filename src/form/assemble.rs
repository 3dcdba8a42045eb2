//! Assembly: the blocks, rows, triplets and vectors of forms, from the integration loops.
//!
//! Results do not depend on the number of threads: every cell and face computes its own block, and blocks are gathered
//! in a fixed order.

use rayon::prelude::*;

use super::bilinear::{Bilinear, MAX_SLOTS};
use super::integrate::Integrator;
use super::kernel::{Basis, add_vector};
use super::linear::{self, Linear};
use super::words::Jet;
use super::worker::{FaceSide, Worker};
use crate::mesh::Face;
use crate::space::{Continuity, Space};

impl Integrator {
    /// Dense blocks of the cell terms, cell after cell, row-major with test dofs as rows.
    pub fn cell_blocks<U: Jet, V: Jet>(&self, form: &Bilinear<U, V>, trial: &Space, test: &Space) -> Vec<f64> {
        let mut blocks = vec![0.0; self.mesh.cells.len() * block_size::<V>(test) * block_size::<U>(trial)];
        self.add_cell_blocks(form, trial, test, &mut blocks);
        blocks
    }

    /// Adds the cell terms to the dense blocks `blocks`.
    pub fn add_cell_blocks<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        trial: &Space,
        test: &Space,
        blocks: &mut [f64],
    ) {
        let size = block_size::<V>(test) * block_size::<U>(trial);
        blocks.par_chunks_mut(size).enumerate().for_each_init(
            || Worker::new::<U, V>(trial, test),
            |worker, (cell, out)| worker.add_cell(self, form, cell, out),
        );
    }

    /// Dense blocks of the cell terms on some cells alone, in their order.
    pub fn blocks_of<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        (trial, test): (&Space, &Space),
        cells: &[usize],
    ) -> Vec<Vec<f64>> {
        let size = block_size::<V>(test) * block_size::<U>(trial);
        let block = |worker: &mut Worker, &cell: &usize| {
            let mut block = vec![0.0; size];
            worker.add_cell(self, form, cell, &mut block);
            block
        };
        cells.par_iter().map_init(|| Worker::new::<U, V>(trial, test), block).collect()
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
    pub fn add_own_rows<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        (trial, test): (&Space, &Space),
        diagonal: &mut [f64],
    ) {
        let size = block_size::<V>(test) * block_size::<U>(trial);
        diagonal.par_chunks_mut(size).enumerate().for_each_init(
            || (Worker::new::<U, V>(trial, test), vec![0.0; size]),
            |(worker, off), (cell, diagonal)| {
                worker.add_cell(self, form, cell, diagonal);
                for local in 0..3 {
                    self.add_face_of_cell(worker, form, (cell, local), diagonal, off);
                }
            },
        );
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
            let blocks = self.cell_blocks(form, trial, test);
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

    /// The vector of a linear form, by dof of `test`.
    pub fn vector<V: Jet>(&self, form: &Linear<V>, test: &Space) -> Vec<f64> {
        let rows = block_size::<V>(test);
        assert_eq!(rows, test.cell_dof_count(), "test jets and space have different numbers of components");
        let mut local = vec![0.0; self.mesh.cells.len() * rows];
        local.par_chunks_mut(rows).enumerate().for_each_init(
            || (Basis::new(test), [0.0; MAX_SLOTS]),
            |(chi, weights), (cell, block)| {
                for (k, term) in form.cell_terms.iter().enumerate() {
                    let alike = |other: &&linear::CellTerm| other.degree == term.degree;
                    if form.cell_terms[..k].iter().any(|earlier| alike(&earlier)) {
                        continue;
                    }
                    self.each_cell_point(cell, term.degree, &mut |x| {
                        chi.evaluate(&x.site);
                        for term in form.cell_terms[k..].iter().filter(alike) {
                            (term.integrand)(x, weights);
                            add_vector(block, weights, 0, chi, x.weight * term.scale);
                        }
                    });
                }
            },
        );
        self.add_face_terms(form, test, &mut local);
        if test.continuity == Continuity::Discontinuous {
            return local;
        }
        let mut global = vec![0.0; test.dof_count()];
        for (cell, block) in local.chunks(rows).enumerate() {
            for (k, value) in block.iter().enumerate() {
                global[test.dof(cell, k / test.n, k % test.n)] += value;
            }
        }
        global
    }

    /// Faces at work in parallel, each with room of its own; gathered in the order of the faces.
    fn add_face_terms<V: Jet>(&self, form: &Linear<V>, test: &Space, local: &mut [f64]) {
        let concerns = |face: &Face| form.face_terms.iter().any(|t| t.faces.holds(face));
        let faces: Vec<usize> = (0..self.mesh.faces.len()).filter(|&f| concerns(&self.mesh.faces[f])).collect();
        let rows = block_size::<V>(test);
        let mut parts = vec![0.0; 2 * faces.len() * rows];
        parts.par_chunks_mut(2 * rows).zip(&faces).for_each_init(
            || (Basis::new(test), [0.0; MAX_SLOTS]),
            |(chi, weights), (part, &index)| {
                let holds = form.face_terms.iter().filter(|t| t.faces.holds(&self.mesh.faces[index]));
                for term in holds {
                    self.each_face_point(index, term.degree, &mut |s| {
                        (term.integrand)(s, weights);
                        let sides = std::iter::once(&s.minus).chain(&s.plus).zip(part.chunks_exact_mut(rows));
                        for (side, (site, part)) in sides.enumerate() {
                            chi.evaluate(site);
                            add_vector(part, weights, side * V::SLOTS, chi, s.weight * term.scale);
                        }
                    });
                }
            },
        );
        for (part, &index) in parts.chunks_exact(2 * rows).zip(&faces) {
            let face = &self.mesh.faces[index];
            for (side, part) in std::iter::once(face.minus).chain(face.plus).zip(part.chunks_exact(rows)) {
                let block = &mut local[side.cell * rows..(side.cell + 1) * rows];
                block.iter_mut().zip(part).for_each(|(b, p)| *b += p);
            }
        }
    }
}

/// Dofs of one cell that a jet kind sees: a scalar jet on a vector space acts on each component alike.
fn block_size<J: Jet>(space: &Space) -> usize {
    space.n * J::SLOTS / 3
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
