//! The whole coupled matrix of one step, factorised: velocity, pressure and polarity, with the molecular field eliminated
//! cell by cell.
//!
//! ```text
//! [ K    G    −F′   ]        rows: momentum, volume, polarity
//! [ Gᵀ   0     0    ]        F′ = F_p + F_L M⁻¹ Λ′
//! [ D    0    J_pp  ]
//! ```
//! Unknowns are numbered `û | Π | λ | p`, where λ is the multiplier of the pressure's zero mean and only there in a closed
//! domain. The energy-consistent force couples cells two faces apart; these factors take the local force in its stead, which
//! is close enough for a preconditioner.

use nalgebra::DMatrix;

use super::incompressible::Incompressible;
use super::parameters::ElasticForce;
use super::tangent::{ForceTangent, Tangent};
use crate::solve::SolveError;
use crate::solve::blocks::NONE;
use crate::solve::sparse::{Factored, Matrix};

/// Factors of the coupled matrix at one state.
#[derive(Debug)]
pub struct Lagged {
    factors: Factored,
    /// Where the polarity begins.
    first: usize,
}

/// A dense part of the matrix: its unknowns, and values by rows; columns are all unknowns, rows the first of them.
#[derive(Debug, Default)]
pub struct Element {
    pub unknowns: Vec<usize>,
    pub rows: usize,
    pub values: Vec<f64>,
}

/// What the elements of the coupled matrix are made of.
struct Parts<'t> {
    tangent: &'t Tangent<'t>,
    local: Option<ForceTangent>,
    stiffness: Vec<f64>,
    divergence: Vec<f64>,
    /// `∫ ξ` of every pressure function on every cell, in a closed domain.
    means: Vec<f64>,
}

impl Lagged {
    /// Factorises the derivative.
    ///
    /// # Errors
    /// A singular matrix.
    pub fn new(tangent: &Tangent) -> Result<Self, SolveError> {
        let model = tangent.model;
        let parts = Parts::new(tangent);
        let mut triplets = Vec::new();
        let mut element = Element::default();
        for cell in 0..model.loops.mesh.cells.len() {
            parts.fill(cell, &mut element);
            let columns = element.unknowns.len();
            for (k, &v) in element.values.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                triplets.push((element.unknowns[k / columns], element.unknowns[k % columns], v));
            }
        }
        let first = model.momentum.unknowns() + usize::from(model.momentum.is_closed());
        let size = first + model.polarity.space.dof_count();
        Ok(Self { factors: Factored::new("coupled", Matrix::from_triplets(size, size, &triplets))?, first })
    }

    /// Overwrites the residual of the polarity equation by the polarity of `A⁻¹ (0, 0, r)`; NaN where the factors fail.
    pub fn solve(&self, r: &mut [f64]) {
        let mut x = vec![0.0; self.first];
        x.extend_from_slice(r);
        match self.factors.solve(&x) {
            Ok(x) => r.copy_from_slice(&x[self.first..]),
            Err(_) => r.fill(f64::NAN),
        }
    }
}

impl<'t> Parts<'t> {
    fn new(tangent: &'t Tangent<'t>) -> Self {
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

    /// The element of a cell: rows are its free velocities, pressures, multiplier and polarity; columns those and the
    /// polarities of its neighbours.
    fn fill(&self, cell: usize, out: &mut Element) {
        let model = self.model();
        let (velocity, pressure, space) =
            (&*model.momentum.velocity, &*model.momentum.pressure, &*model.polarity.space);
        let (nv, np, n) = (velocity.cell_dof_count(), pressure.n, space.cell_dof_count());
        let frames = &model.momentum.frames;
        out.unknowns.clear();
        // local velocity dof → positions among the element's unknowns
        let mut maps: Vec<Vec<(usize, f64)>> = Vec::with_capacity(nv);
        for k in 0..nv {
            let entries = frames.of(velocity.dof(cell, k / velocity.n, k % velocity.n));
            let known = |unknowns: &mut Vec<usize>, free: usize| {
                unknowns.iter().position(|&u| u == free).unwrap_or_else(|| {
                    unknowns.push(free);
                    unknowns.len() - 1
                })
            };
            maps.push(entries.map(|(free, a)| (known(&mut out.unknowns, free), a)).collect());
        }
        let nf = out.unknowns.len();
        out.unknowns.extend((0..np).map(|i| frames.free + pressure.dof(cell, 0, i)));
        let closed = usize::from(!self.means.is_empty());
        out.unknowns.extend((0..closed).map(|_| model.momentum.unknowns()));
        let (p0, first) = (nf + np + closed, model.momentum.unknowns() + closed);
        out.unknowns.extend(cell * n + first..(cell + 1) * n + first);
        out.rows = p0 + n;
        let neighbours = self.tangent.operator.neighbours[cell];
        for other in neighbours.into_iter().filter(|&o| o != NONE) {
            out.unknowns.extend(other * n + first..(other + 1) * n + first);
        }
        let columns = out.unknowns.len();
        out.values.clear();
        out.values.resize(out.rows * columns, 0.0);
        let values = &mut out.values;
        for (i, row) in maps.iter().enumerate() {
            for (j, column) in maps.iter().enumerate() {
                let k = self.stiffness[cell * nv * nv + i * nv + j];
                for (r, a) in row {
                    for (c, b) in column {
                        values[r * columns + c] += a * k * b;
                    }
                }
            }
            for j in 0..np {
                let g = self.divergence[cell * nv * np + i * np + j];
                for (r, a) in row {
                    values[r * columns + nf + j] += a * g;
                    values[(nf + j) * columns + r] += a * g;
                }
            }
            let drag = &self.tangent.drag[cell * n * nv..(cell + 1) * n * nv];
            for q in 0..n {
                for (r, a) in row {
                    values[(p0 + q) * columns + r] += a * drag[q * nv + i];
                }
            }
        }
        for (j, mean) in self.means.iter().skip(cell * np).take(np).enumerate() {
            values[(nf + j) * columns + nf + np] += mean;
            values[(nf + np) * columns + nf + j] += mean;
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
            at += m;
        }
    }

    /// `−(F_p + F_L M⁻¹ Λ′)`.
    fn fill_force(&self, cell: usize, maps: &[Vec<(usize, f64)>], p0: usize, columns: usize, values: &mut [f64]) {
        let (force, well) = (self.force(), &self.tangent.molecular);
        let (nv, n, m) = (maps.len(), well.n, 2 * well.n);
        let block = |all: &[f64]| DMatrix::from_row_slice(nv, m, &all[cell * nv * m..(cell + 1) * nv * m]);
        let mut add = |at: usize, part: &DMatrix<f64>| {
            for (i, row) in maps.iter().enumerate() {
                for (r, a) in row {
                    for j in 0..part.ncols() {
                        values[r * columns + at + j] -= a * part[(i, j)];
                    }
                }
            }
        };
        add(p0, &block(&force.by_polarity.own));
        let Some(by_field) = &force.by_field else { return };
        // F_L M⁻¹, component by component
        let mut pushed = block(&by_field.own);
        let inverse = self.model().polarity.mass_inverse_of(cell);
        for c in [0, n] {
            let part = pushed.columns(c, n) * &inverse;
            pushed.columns_mut(c, n).copy_from(&part);
        }
        add(p0, &(&pushed * DMatrix::from_row_slice(m, m, &well.diagonal[cell * m * m..(cell + 1) * m * m])));
        let mut at = p0 + m;
        for (f, _) in well.neighbours[cell].iter().enumerate().filter(|(_, o)| **o != NONE) {
            let off = DMatrix::from_row_slice(n, n, &well.off[(3 * cell + f) * n * n..(3 * cell + f + 1) * n * n]);
            for c in [0, n] {
                add(at + c, &(pushed.columns(c, n) * &off));
            }
            at += m;
        }
    }
}
