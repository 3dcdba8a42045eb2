//! Static condensation: the polarity of every cell eliminated from the equations of one step in hybrid form.
//!
//! With c the velocities, pressures and traces of a cell, `R_p = J p + B c` and `R_c = C p + A c`, so that
//!
//! ```text
//! (A − C J⁻¹ B) c = r_c − C J⁻¹ r_p,     p = J⁻¹ r_p − J⁻¹ B c
//! ```
//! The matrices in front of c are the elements of the whole condensed matrix. It is multiplied with element by element
//! and factorised from them.

use std::sync::Arc;

use rayon::prelude::*;

use super::incompressible::Incompressible;
use super::lagged::{Elements, add_velocity_block};
use super::tangent::{CellTangent, HybridTangent};
use crate::solve::SolveError;
use crate::solve::rows::add_product;
use crate::solve::symbolic::Element;

/// What the elimination has left of a cell.
#[derive(Debug)]
struct Cell {
    /// Unknowns of the cell's element.
    unknowns: Vec<u32>,
    /// `J⁻¹`, row-major as all of these.
    inverse: Vec<f64>,
    /// `C J⁻¹`
    fore: Vec<f64>,
    /// `J⁻¹ B`
    back: Vec<f64>,
}

/// The way from a right side for the polarities to one for what is left, and back.
#[derive(Debug)]
pub struct Eliminated {
    cells: Vec<Cell>,
    /// Unknowns of the polarity on a cell.
    m: usize,
    /// Unknowns of the condensed matrix.
    size: usize,
}

/// The condensed matrix.
#[derive(Debug)]
pub struct Condensed {
    elements: Vec<Element>,
    eliminated: Arc<Eliminated>,
}

impl Eliminated {
    /// `−C J⁻¹ r` of a right side r for the polarities.
    pub fn forward(&self, r: &[f64]) -> Vec<f64> {
        let part = |(cell, r): (&Cell, &[f64])| {
            let mut out = vec![0.0; cell.unknowns.len()];
            add_product(&cell.fore, r, &mut out);
            out
        };
        let parts: Vec<Vec<f64>> = self.cells.par_iter().zip(r.par_chunks(self.m)).map(part).collect();
        let mut out = vec![0.0; self.size];
        for (cell, part) in self.cells.iter().zip(parts) {
            cell.unknowns.iter().zip(part).for_each(|(&u, value)| out[u as usize] -= value);
        }
        out
    }

    /// Overwrites a right side r for the polarities by `J⁻¹ r − J⁻¹ B c`.
    pub fn backward(&self, c: &[f64], r: &mut [f64]) {
        r.par_chunks_mut(self.m).zip(&self.cells).for_each(|(r, cell)| {
            let mut p = vec![0.0; r.len()];
            let local: Vec<f64> = cell.unknowns.iter().map(|&u| -c[u as usize]).collect();
            add_product(&cell.inverse, r, &mut p);
            add_product(&cell.back, &local, &mut p);
            r.copy_from_slice(&p);
        });
    }
}

impl Condensed {
    /// Eliminates the polarities.
    ///
    /// # Errors
    /// A cell whose own derivative is singular.
    pub fn new(tangent: &HybridTangent) -> Result<Self, SolveError> {
        let model = tangent.model;
        let (stiffness, divergence) = model.momentum.element_blocks(&model.loops);
        let flow = Flow { model, stiffness, divergence };
        let cells = (0..model.loops.mesh.cells.len()).into_par_iter().map(|cell| flow.condense(tangent, cell));
        let cells: Result<Vec<(Element, Cell)>, SolveError> = cells.collect();
        let (mut elements, cells): (Vec<Element>, Vec<Cell>) = cells?.into_iter().unzip();
        elements.extend(flow.means());
        let (m, layout) = (tangent.sizes()[0], model.layout());
        let size = layout.first() + layout.carried_count();
        Ok(Self { elements, eliminated: Arc::new(Eliminated { cells, m, size }) })
    }

    /// `y = A x`
    pub fn times(&self, x: &[f64], y: &mut [f64]) {
        let part = |element: &Element| {
            let local: Vec<f64> = element.columns.iter().map(|&u| x[u as usize]).collect();
            let mut out = vec![0.0; element.rows.len()];
            add_product(&element.values, &local, &mut out);
            out
        };
        let parts: Vec<Vec<f64>> = self.elements.par_iter().map(part).collect();
        y.fill(0.0);
        for (element, part) in self.elements.iter().zip(parts) {
            element.rows.iter().zip(part).for_each(|(&u, value)| y[u as usize] += value);
        }
    }

    /// What was eliminated.
    pub fn eliminated(&self) -> &Arc<Eliminated> {
        &self.eliminated
    }
}

impl Elements for Condensed {
    fn fill(&self, e: usize, out: &mut Element) {
        out.clone_from(&self.elements[e]);
    }

    fn eliminated(&self) -> Option<Arc<Eliminated>> {
        Some(self.eliminated.clone())
    }
}

/// The matrix of the flow by cells.
struct Flow<'m> {
    model: &'m Incompressible,
    stiffness: Vec<f64>,
    divergence: Vec<f64>,
}

impl Flow<'_> {
    fn condense(&self, tangent: &HybridTangent, cell: usize) -> Result<(Element, Cell), SolveError> {
        let [m, nv, nt] = tangent.sizes();
        let CellTangent { own, by_others, of_others, others } = tangent.of_cell(cell);
        let inverse = own.try_inverse().ok_or_else(|| SolveError::Factorise {
            system: "coupled".into(),
            reason: format!("the derivative of the polarity of cell {cell} is singular"),
            hint: "take a smaller time step".into(),
        })?;
        let back = &inverse * by_others;
        let fore = &of_others * &inverse;
        let condensed = others - of_others * &back;
        let mut element = Element::default();
        let mut places = self.model.layout().unknowns(cell, &mut element);
        let (columns, np) = (element.rows.len(), self.model.momentum.pressure.n);
        // traces of faces on the boundary have no unknowns
        let mut next = columns - nt / 3 * self.inner_faces(cell).filter(|inner| *inner).count();
        let pressures = next - np;
        for inner in self.inner_faces(cell) {
            for _ in 0..nt / 3 {
                places.push(if inner { vec![(next, 1.0)] } else { Vec::new() });
                next += usize::from(inner);
            }
        }
        element.values.resize(columns * columns, 0.0);
        let stiffness = &self.stiffness[cell * nv * nv..(cell + 1) * nv * nv];
        add_velocity_block(stiffness, &places[..nv], columns, &mut element.values);
        // row-major
        add_velocity_block(condensed.transpose().as_slice(), &places, columns, &mut element.values);
        for (i, row) in places[..nv].iter().enumerate() {
            for j in 0..np {
                let g = self.divergence[cell * nv * np + i * np + j];
                for (r, a) in row {
                    element.values[r * columns + pressures + j] += a * g;
                    element.values[(pressures + j) * columns + r] += a * g;
                }
            }
        }
        let (mut mapped_fore, mut mapped_back) = (vec![0.0; columns * m], vec![0.0; m * columns]);
        for (k, place) in places.iter().enumerate() {
            for (u, a) in place {
                for i in 0..m {
                    mapped_fore[u * m + i] += a * fore[(k, i)];
                    mapped_back[i * columns + u] += a * back[(i, k)];
                }
            }
        }
        let inverse = inverse.transpose().as_slice().to_vec();
        let unknowns = element.rows.clone();
        Ok((element, Cell { unknowns, inverse, fore: mapped_fore, back: mapped_back }))
    }

    fn inner_faces(&self, cell: usize) -> impl Iterator<Item = bool> {
        let mesh = &self.model.loops.mesh;
        mesh.cell_faces[cell].into_iter().map(|face| mesh.faces[face].plus.is_some())
    }

    /// `λ ∫ ξ` and its transposed, of closed parts.
    fn means(&self) -> Vec<Element> {
        let momentum = &self.model.momentum;
        let means = if momentum.is_closed() { momentum.cell_means(&self.model.loops) } else { Vec::new() };
        let element = |k: usize| {
            let mut out = Element::default();
            self.model.layout().fill_mean(k, &means, &mut out);
            out
        };
        (0..momentum.closed.cells().len()).map(element).collect()
    }
}
