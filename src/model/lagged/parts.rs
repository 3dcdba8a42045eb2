//! The elements of the coupled matrix of an incompressible sheet.

use nalgebra::DMatrix;

use super::{Elements, add_velocity_block};
use crate::model::incompressible::Incompressible;
use crate::model::parameters::ElasticForce;
use crate::model::pushed::Pushed;
use crate::model::tangent::{ForceTangent, Tangent};
use crate::solve::blocks::NONE;
use crate::solve::symbolic::Element;

impl Elements for Parts<'_> {
    /// The element of a cell, rows its free velocities, pressures and polarity, columns those and the polarities of its
    /// neighbours; after those of all cells, what they give to the pressure's mean.
    fn fill(&self, e: usize, out: &mut Element) {
        let cells = self.model().loops.mesh.cells.len();
        if e < cells {
            self.fill_cell(e, out);
        } else {
            self.model().layout().fill_mean(e - cells, &self.means, out);
        }
    }
}

/// What the elements of the coupled matrix of an incompressible sheet are made of.
pub struct Parts<'t> {
    tangent: &'t Tangent<'t>,
    local: Option<ForceTangent>,
    stiffness: Vec<f64>,
    divergence: Vec<f64>,
    /// `∫ ξ` of every pressure function on every cell, where there are closed parts.
    means: Vec<f64>,
}

impl<'t> Parts<'t> {
    /// Assembles what does not come from the tangent.
    pub fn new(tangent: &'t Tangent<'t>) -> Self {
        let model = tangent.model;
        let (stiffness, divergence) = model.momentum.element_blocks(&model.loops);
        let local = match model.parameters.elastic_force {
            ElasticForce::Stress => None,
            ElasticForce::Energy => Some(tangent.local_force()),
        };
        let means = if model.momentum.is_closed() { model.momentum.cell_means(&model.loops) } else { Vec::new() };
        Self { tangent, local, stiffness, divergence, means }
    }

    fn force(&self) -> &ForceTangent {
        self.local.as_ref().unwrap_or(&self.tangent.force)
    }

    fn model(&self) -> &Incompressible {
        self.tangent.model
    }

    fn fill_cell(&self, cell: usize, out: &mut Element) {
        let model = self.model();
        let (velocity, np) = (&*model.momentum.velocity, model.momentum.pressure.n);
        let (nv, n) = (velocity.cell_dof_count(), model.polarity.space.cell_dof_count());
        let maps = model.layout().unknowns(cell, out);
        let (columns, p0) = (out.columns.len(), out.rows.len() - n);
        let nf = p0 - np;
        out.values.clear();
        out.values.resize(out.rows.len() * columns, 0.0);
        let values = &mut out.values;
        add_velocity_block(&self.stiffness[cell * nv * nv..(cell + 1) * nv * nv], &maps, columns, values);
        for (i, row) in maps.iter().enumerate() {
            for j in 0..np {
                let g = self.divergence[cell * nv * np + i * np + j];
                for (r, a) in row {
                    values[r * columns + nf + j] += a * g;
                    values[(nf + j) * columns + r] += a * g;
                }
            }
            let drag = self.tangent.drag.own_of(cell);
            for q in 0..n {
                for (r, a) in row {
                    values[(p0 + q) * columns + r] += a * drag[q * nv + i];
                }
            }
        }
        self.fill_polarity(cell, p0, columns, values);
        self.fill_force(cell, &maps, p0, columns, values);
    }

    /// `J_pp`.
    fn fill_polarity(&self, cell: usize, p0: usize, columns: usize, values: &mut [f64]) {
        let operator = &self.tangent.operator;
        let (n, m) = (operator.n, 2 * operator.n);
        for (k, a) in operator.diagonal[cell * m * m..(cell + 1) * m * m].iter().enumerate() {
            values[(p0 + k / m) * columns + p0 + k % m] += a;
        }
        let mut at = p0 + m;
        for (f, _) in operator.neighbours[cell].iter().enumerate().filter(|(_, o)| **o != NONE) {
            for (k, a) in operator.off[(3 * cell + f) * n * n..(3 * cell + f + 1) * n * n].iter().enumerate() {
                for c in [0, n] {
                    values[(p0 + c + k / n) * columns + at + c + k % n] += a;
                }
            }
            for (k, a) in operator.mixed_of(cell, f).into_iter().flatten().enumerate() {
                values[(p0 + k / m) * columns + at + k % m] += a;
            }
            at += m;
        }
    }

    /// `−(F_p + F_L M⁻¹ Λ′)`, without what F_L sees two faces away.
    fn fill_force(&self, cell: usize, maps: &[Vec<(usize, f64)>], p0: usize, columns: usize, values: &mut [f64]) {
        let (force, well) = (self.force(), &self.tangent.molecular);
        let (nv, m) = (maps.len(), 2 * well.n);
        let mut add = |at: usize, part: &DMatrix<f64>| {
            for (i, row) in maps.iter().enumerate() {
                for (r, a) in row {
                    for j in 0..part.ncols() {
                        values[r * columns + at + j] -= a * part[(i, j)];
                    }
                }
            }
        };
        let pushed = force.by_field.as_ref().map(|rows| Pushed::new(rows, &self.model().polarity, cell));
        let others = well.neighbours[cell].into_iter().filter(|o| *o != NONE);
        for (k, seen) in std::iter::once(cell).chain(others).enumerate() {
            let at = p0 + k * m;
            if let Some(block) = force.by_polarity.block(cell, seen) {
                add(at, &DMatrix::from_row_slice(nv, m, block));
            }
            pushed.iter().flat_map(|pushed| pushed.by_polarity(well, seen)).for_each(|part| add(at, &part));
        }
    }
}
