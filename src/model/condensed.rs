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
use super::lagged::Elements;
use super::polarity::Hybrid;
use super::tangent::{CellTangent, HybridTangent};
use crate::solve::rows::add_combined;
use crate::solve::symbolic::Element;
use crate::solve::wide::wide;
use crate::solve::{SolveError, axpy};

/// Unknowns of the elements of the cells, in one row.
#[derive(Debug, Default)]
struct Unknowns {
    /// Of all cells.
    all: Vec<u32>,
    /// Where those of a cell begin, and the end.
    first: Vec<usize>,
}

impl Unknowns {
    fn of(&self, cell: usize) -> &[u32] {
        &self.all[self.first[cell]..self.first[cell + 1]]
    }

    fn cells(&self) -> usize {
        self.first.len() - 1
    }
}

/// The way from a right side for the polarities to one for what is left, and back.
#[derive(Debug)]
pub struct Eliminated {
    unknowns: Arc<Unknowns>,
    /// `(C J⁻¹)ᵀ`, a row per unknown of the polarity; all of a cell's are in one piece, for as many columns as the
    /// largest element has.
    fore: Vec<f64>,
    /// `(J⁻¹ B)ᵀ`, a row per unknown of the element.
    back: Vec<f64>,
    /// `J⁻ᵀ`
    inverse: Vec<f64>,
    /// Unknowns of the polarity on a cell, and the most that an element has.
    m: usize,
    most: usize,
    /// Unknowns of the condensed matrix.
    size: usize,
}

/// The condensed matrix.
#[derive(Debug)]
pub struct Condensed {
    /// Of the cells, by columns.
    values: Vec<f64>,
    frame: Arc<Frame>,
    eliminated: Arc<Eliminated>,
}

impl Eliminated {
    /// `−C J⁻¹ r` of a right side r for the polarities.
    pub fn forward(&self, r: &[f64]) -> Vec<f64> {
        let (m, most) = (self.m, self.most);
        let mut parts = vec![0.0; self.unknowns.cells() * most];
        parts.par_chunks_mut(most).zip(r.par_chunks(m)).enumerate().for_each(|(cell, (out, r))| {
            let count = self.unknowns.of(cell).len();
            let fore = &self.fore[cell * m * most..][..m * count];
            wide(|| add_combined(-1.0, r, fore, &mut out[..count]));
        });
        let mut out = vec![0.0; self.size];
        self.scatter(&parts, &mut out);
        out
    }

    /// Adds the parts of all cells.
    fn scatter(&self, parts: &[f64], out: &mut [f64]) {
        for (cell, part) in parts.chunks_exact(self.most).enumerate() {
            self.unknowns.of(cell).iter().zip(part).for_each(|(&u, value)| out[u as usize] += value);
        }
    }

    /// Overwrites a right side r for the polarities by `J⁻¹ r − J⁻¹ B c`.
    pub fn backward(&self, c: &[f64], r: &mut [f64]) {
        let (m, most) = (self.m, self.most);
        r.par_chunks_mut(m).enumerate().for_each_init(
            || (vec![0.0; m], vec![0.0; most]),
            |(p, local), (cell, r)| {
                let unknowns = self.unknowns.of(cell);
                unknowns.iter().zip(local.iter_mut()).for_each(|(&u, local)| *local = c[u as usize]);
                p.fill(0.0);
                wide(|| {
                    add_combined(1.0, r, &self.inverse[cell * m * m..(cell + 1) * m * m], p);
                    add_combined(-1.0, &local[..unknowns.len()], &self.back[cell * m * most..(cell + 1) * m * most], p);
                });
                r.copy_from_slice(p);
            },
        );
    }
}

impl Condensed {
    /// Eliminates the polarities.
    ///
    /// # Errors
    /// A cell whose own derivative is singular.
    pub fn new(frame: &Arc<Frame>, tangent: &HybridTangent) -> Result<Self, SolveError> {
        let ([m, _, _], most, cells) = (tangent.sizes(), frame.most, frame.places.len());
        let mut values = vec![0.0; cells * most * most];
        let [mut fore, mut back] = [(); 2].map(|()| vec![0.0; cells * m * most]);
        let mut inverse = vec![0.0; cells * m * m];
        let parts = values
            .par_chunks_mut(most * most)
            .zip(fore.par_chunks_mut(m * most))
            .zip(back.par_chunks_mut(m * most))
            .zip(inverse.par_chunks_mut(m * m));
        let condensed: Result<(), SolveError> =
            parts.enumerate().try_for_each_init(Room::default, |room, (cell, (((values, fore), back), inverse))| {
                frame.condense(tangent, cell, room, Parts { values, fore, back, inverse })
            });
        condensed?;
        let layout = tangent.model.layout();
        let size = layout.first() + layout.carried_count();
        let eliminated = Eliminated { unknowns: frame.unknowns.clone(), fore, back, inverse, m, most, size };
        Ok(Self { values, frame: frame.clone(), eliminated: Arc::new(eliminated) })
    }

    /// `y = A x`
    pub fn times(&self, x: &[f64], y: &mut [f64]) {
        let Eliminated { unknowns, most, .. } = &*self.eliminated;
        let mut parts = vec![0.0; unknowns.cells() * most];
        parts.par_chunks_mut(*most).enumerate().for_each_init(
            || vec![0.0; *most],
            |local, (cell, out)| {
                let own = unknowns.of(cell);
                own.iter().zip(local.iter_mut()).for_each(|(&u, local)| *local = x[u as usize]);
                let columns = &self.values[cell * most * most..][..own.len() * own.len()];
                wide(|| add_combined(1.0, &local[..own.len()], columns, &mut out[..own.len()]));
            },
        );
        y.fill(0.0);
        self.eliminated.scatter(&parts, y);
        for Element { rows, columns, values } in &self.frame.means {
            for (row, values) in rows.iter().zip(values.chunks_exact(columns.len())) {
                y[*row as usize] += columns.iter().zip(values).map(|(&u, a)| a * x[u as usize]).sum::<f64>();
            }
        }
    }

    /// What was eliminated.
    pub fn eliminated(&self) -> &Arc<Eliminated> {
        &self.eliminated
    }
}

impl Elements for Condensed {
    fn fill(&self, e: usize, out: &mut Element) {
        let Eliminated { unknowns, most, .. } = &*self.eliminated;
        let Some(mean) = e.checked_sub(unknowns.cells()) else {
            let own = unknowns.of(e);
            let columns = &self.values[e * most * most..][..own.len() * own.len()];
            out.rows.clear();
            out.rows.extend_from_slice(own);
            out.columns.clone_from(&out.rows);
            out.values.clear();
            out.values.extend((0..own.len()).flat_map(|i| columns[i..].iter().step_by(own.len())));
            return;
        };
        out.clone_from(&self.frame.means[mean]);
    }

    fn eliminated(&self) -> Option<Arc<Eliminated>> {
        Some(self.eliminated.clone())
    }
}

/// What no state changes: the matrix of the flow by cells, and how their own velocities and traces stand among the
/// unknowns of their elements.
#[derive(Debug)]
pub struct Frame {
    stiffness: Vec<f64>,
    divergence: Vec<f64>,
    unknowns: Arc<Unknowns>,
    /// By cell, velocities and then traces of all local faces, those of the boundary without any; before them the
    /// pressures.
    places: Vec<Place>,
    means: Vec<Element>,
    /// Of velocities and traces of a cell, and of its pressures.
    counts: [usize; 3],
    most: usize,
}

/// Where the velocities and traces of a cell stand in its element, with coefficients.
#[derive(Debug)]
struct Place {
    first: Vec<u16>,
    of: Vec<(u16, f64)>,
    pressures: usize,
}

impl Place {
    fn of(&self, k: usize) -> &[(u16, f64)] {
        &self.of[usize::from(self.first[k])..usize::from(self.first[k + 1])]
    }
}

impl Frame {
    /// Of a model in hybrid form.
    pub fn new(model: &Incompressible, hybrid: &Hybrid) -> Self {
        let (stiffness, divergence) = model.momentum.element_blocks(&model.loops);
        let (layout, mesh) = (model.layout(), &model.loops.mesh);
        let (mut unknowns, mut element) = (Unknowns { all: Vec::new(), first: vec![0] }, Element::default());
        let (mut places, mut most) = (Vec::with_capacity(mesh.cells.len()), 0);
        let [nv, np] = [model.momentum.velocity.cell_dof_count(), model.momentum.pressure.n];
        let count = hybrid.skeleton.face_dof_count();
        for cell in 0..mesh.cells.len() {
            let mut maps = layout.unknowns(cell, &mut element);
            // traces of faces on the boundary have no unknowns
            let inner = mesh.cell_faces[cell].map(|face| mesh.faces[face].plus.is_some());
            let mut next = element.rows.len() - count * inner.iter().filter(|inner| **inner).count();
            let pressures = next - np;
            for inner in inner {
                for _ in 0..count {
                    maps.push(if inner { vec![(next, 1.0)] } else { Vec::new() });
                    next += usize::from(inner);
                }
            }
            let mut place = Place { first: vec![0], of: Vec::new(), pressures };
            for map in maps {
                place.of.extend(map.into_iter().map(|(u, a)| (u as u16, a)));
                place.first.push(place.of.len() as u16);
            }
            places.push(place);
            most = most.max(element.rows.len());
            unknowns.all.extend_from_slice(&element.rows);
            unknowns.first.push(unknowns.all.len());
        }
        let counts = [nv, 3 * count, np];
        Self { stiffness, divergence, unknowns: Arc::new(unknowns), places, means: means(model), counts, most }
    }
}

/// `λ ∫ ξ` and its transposed, of closed parts.
fn means(model: &Incompressible) -> Vec<Element> {
    let momentum = &model.momentum;
    let means = if momentum.is_closed() { momentum.cell_means(&model.loops) } else { Vec::new() };
    let element = |k: usize| {
        let mut out = Element::default();
        model.layout().fill_mean(k, &means, &mut out);
        out
    };
    (0..momentum.closed.cells().len()).map(element).collect()
}

/// What one thread needs.
#[derive(Default)]
struct Room {
    cell: CellTangent,
    /// `[J⁻¹ B | J⁻¹]`
    right: Vec<f64>,
    fore: Vec<f64>,
}

/// What is made of a cell.
struct Parts<'a> {
    values: &'a mut [f64],
    fore: &'a mut [f64],
    back: &'a mut [f64],
    inverse: &'a mut [f64],
}

impl Frame {
    fn condense(&self, tangent: &HybridTangent, cell: usize, room: &mut Room, out: Parts) -> Result<(), SolveError> {
        let [nv, nt, _] = self.counts;
        let (m, c) = (tangent.sizes()[0], nv + nt);
        let (width, Room { cell: part, right, fore, .. }) = (c + m, &mut *room);
        tangent.of_cell(cell, part);
        right.clear();
        right.resize(m * width, 0.0);
        for (i, (row, by)) in right.chunks_exact_mut(width).zip(part.by_others.chunks_exact(c)).enumerate() {
            row[..c].copy_from_slice(by);
            row[c + i] = 1.0;
        }
        if !wide(|| solve(&mut part.own, right, m, width)) {
            return Err(SolveError::Factorise {
                system: "coupled".into(),
                reason: format!("the derivative of the polarity of cell {cell} is singular"),
                hint: "take a smaller time step".into(),
            });
        }
        // [C J⁻¹ B | C J⁻¹]
        fore.clear();
        fore.resize(c * width, 0.0);
        wide(|| {
            for (of, fore) in part.of_others.chunks_exact(m).zip(fore.chunks_exact_mut(width)) {
                add_combined(1.0, of, right, fore);
            }
        });
        let stiffness = &self.stiffness[cell * nv * nv..(cell + 1) * nv * nv];
        for (i, (others, fore)) in part.others.chunks_exact_mut(c).zip(fore.chunks_exact(width)).enumerate() {
            axpy(-1.0, &fore[..c], others);
            if i < nv {
                axpy(1.0, &stiffness[i * nv..(i + 1) * nv], &mut others[..nv]);
            }
        }
        self.map(cell, m, room, out);
        Ok(())
    }

    /// From the cell's own velocities and all of its faces to the unknowns of its element.
    fn map(&self, cell: usize, m: usize, room: &Room, out: Parts) {
        let [nv, nt, np] = self.counts;
        let (c, count, place) = (nv + nt, self.unknowns.of(cell).len(), &self.places[cell]);
        let width = c + m;
        let Room { cell: part, right, fore } = room;
        for (i, others) in part.others.chunks_exact(c).enumerate() {
            for &(row, a) in place.of(i) {
                for (j, value) in others.iter().enumerate() {
                    for &(column, b) in place.of(j) {
                        out.values[usize::from(column) * count + usize::from(row)] += a * value * b;
                    }
                }
            }
        }
        for i in 0..nv {
            for j in 0..np {
                let (g, pressure) = (self.divergence[cell * nv * np + i * np + j], place.pressures + j);
                for &(row, a) in place.of(i) {
                    out.values[pressure * count + usize::from(row)] += a * g;
                    out.values[usize::from(row) * count + pressure] += a * g;
                }
            }
        }
        for k in 0..c {
            for &(u, a) in place.of(k) {
                let u = usize::from(u);
                for i in 0..m {
                    out.fore[i * count + u] += a * fore[k * width + c + i];
                    out.back[u * m + i] += a * right[i * width + k];
                }
            }
        }
        for (i, j) in (0..m).flat_map(|i| (0..m).map(move |j| (i, j))) {
            out.inverse[j * m + i] = right[i * width + c + j];
        }
    }
}

/// Overwrites `right`, rows of `width`, by `A⁻¹ right`, A of m rows, by Gauss–Jordan elimination with row pivoting;
/// false where A is singular.
#[inline(always)]
fn solve(a: &mut [f64], right: &mut [f64], m: usize, width: usize) -> bool {
    for k in 0..m {
        let pivot = (k..m).max_by(|&i, &j| a[i * m + k].abs().total_cmp(&a[j * m + k].abs())).unwrap_or(k);
        let inverse = 1.0 / a[pivot * m + k];
        if !inverse.is_finite() {
            return false;
        }
        for j in 0..m {
            a.swap(k * m + j, pivot * m + j);
        }
        for j in 0..width {
            right.swap(k * width + j, pivot * width + j);
        }
        a[k * m..(k + 1) * m].iter_mut().for_each(|v| *v *= inverse);
        right[k * width..(k + 1) * width].iter_mut().for_each(|v| *v *= inverse);
        for i in (0..m).filter(|i| *i != k) {
            let factor = -a[i * m + k];
            subtract_row(a, m, (i, k), factor);
            subtract_row(right, width, (i, k), factor);
        }
    }
    true
}

/// Adds `factor` times row k to row i.
#[inline(always)]
fn subtract_row(a: &mut [f64], width: usize, (i, k): (usize, usize), factor: f64) {
    let (low, high) = a.split_at_mut(i.max(k) * width);
    let (low, high) = (&mut low[i.min(k) * width..][..width], &mut high[..width]);
    let (to, from) = if i < k { (low, high) } else { (high, low) };
    to.iter_mut().zip(from.iter()).for_each(|(to, from)| *to += factor * from);
}
