//! The dense matrices that the balance is the sum of, each by what it couples.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::domain::Domain;
use super::twists::Twists;
use crate::model::immersed::Ground;
use crate::solve::symbolic::Element;

/// Weight of the ghost penalties of velocity and pressure.
pub(super) const GHOST: f64 = 0.1;

/// A number that an element couples: an unknown, a combination of some, or given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    /// A dof of the velocity.
    Velocity(usize),
    /// A dof of the pressure.
    Pressure(usize),
    /// Component of the motion of a body.
    Twist(usize, usize),
    /// Multiplier of a mean.
    Mean(usize),
    /// An unknown of the velocity that no cell with fluid has.
    Idle(usize),
}

/// A cell that bodies cut or touch: its velocities, its pressures, and the motions of those bodies.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CutCell {
    /// Whose boundaries lie in the cell.
    pub bodies: Vec<usize>,
    /// Square, row-major.
    pub matrix: Vec<f64>,
    /// `∫_{K∖B} ξ`
    pub means: Vec<f64>,
}

/// `γ_v g_S` of one component and `−γ_Π h_S² g_S`, square and row-major, first the cell on the minus side.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct GhostFace {
    pub velocity: Vec<f64>,
    pub pressure: Vec<f64>,
}

/// Matrices cell by cell and face by face.
#[derive(Debug, Clone, Default)]
pub(super) struct Blocks {
    /// Of whole cells, one after the other: of the velocities, of `b(w,ξ)`, and `∫ ξ`.
    pub whole: Arc<[Vec<f64>; 3]>,
    pub cut: BTreeMap<usize, Arc<CutCell>>,
    /// Of all faces that have been needed.
    pub ghosts: BTreeMap<usize, Arc<GhostFace>>,
}

/// What elements are made of. They are numbered: cells, faces for the velocity, faces for the pressure, cells for the
/// means, bodies.
#[derive(Debug, Clone, Copy)]
pub(super) struct Elements<'s> {
    pub ground: Ground<'s>,
    pub domain: &'s Domain,
    pub twists: &'s Twists,
    pub blocks: &'s Blocks,
    /// `c_i` times area and second moment.
    pub friction: &'s [[f64; 3]],
    /// By unknown: whether some cell with fluid has it.
    pub used: &'s [bool],
}

impl Elements<'_> {
    pub fn count(&self) -> usize {
        let mesh = &self.ground.velocity.mesh;
        2 * (mesh.cells.len() + mesh.faces.len()) + self.friction.len()
    }

    /// The first unknown of the bodies, the first multiplier, and how many unknowns there are.
    pub fn firsts(&self) -> [usize; 3] {
        let twists = self.ground.frames.free + self.ground.pressure.dof_count();
        let means = twists + self.twists.count();
        [twists, means, means + self.domain.parts.means.len()]
    }

    /// The unknowns that a quantity is made of, with their coefficients.
    pub fn unknowns(&self, quantity: Quantity) -> impl Iterator<Item = (usize, f64)> {
        let [twists, means, _] = self.firsts();
        let (velocity, twist, single) = match quantity {
            Quantity::Velocity(dof) => (Some(self.ground.frames.of(dof)), None, None),
            Quantity::Pressure(dof) => (None, None, Some(self.ground.frames.free + dof)),
            Quantity::Twist(body, k) => (None, Some(self.twists.of(body, k)), None),
            Quantity::Mean(mean) => (None, None, Some(means + mean)),
            Quantity::Idle(unknown) => (None, None, Some(unknown)),
        };
        let twist = twist.into_iter().flatten().map(move |(unknown, a)| (twists + unknown, a));
        velocity.into_iter().flatten().chain(twist).chain(single.map(|unknown| (unknown, 1.0)))
    }

    /// What element `e` couples.
    pub fn quantities(&self, e: usize) -> Vec<Quantity> {
        let mesh = &self.ground.velocity.mesh;
        let (cells, faces) = (mesh.cells.len(), mesh.faces.len());
        if e < cells {
            return if self.domain.active[e] { self.of_cell(e) } else { self.idle(e) };
        }
        let e = e - cells;
        if e < 2 * faces {
            let face = e % faces;
            if self.domain.ghosts.binary_search(&face).is_err() {
                return Vec::new();
            }
            let face = &mesh.faces[face];
            let sides = [face.minus.cell, face.plus.expect("an interior face").cell];
            return sides.into_iter().flat_map(|cell| self.one_field(cell, e < faces)).collect();
        }
        let e = e - 2 * faces;
        if e < cells {
            return match self.domain.parts.of_cell(e) {
                Some(part) => self.one_field(e, false).chain(self.means_of(part)).collect(),
                None => Vec::new(),
            };
        }
        (0..3).map(|k| Quantity::Twist(e - cells, k)).collect()
    }

    fn one_field(&self, cell: usize, velocity: bool) -> impl Iterator<Item = Quantity> {
        let space = if velocity { self.ground.velocity } else { self.ground.pressure };
        let dof = move |k: usize| space.dof(cell, k / space.n, k % space.n);
        let quantity = if velocity { Quantity::Velocity } else { Quantity::Pressure };
        (0..space.cell_dof_count()).map(move |k| quantity(dof(k)))
    }

    /// The multipliers that have a closed part.
    fn means_of(&self, part: usize) -> impl Iterator<Item = Quantity> {
        let means = self.domain.parts.means.iter().enumerate();
        means.filter(move |(_, weights)| weights[part] != 0.0).map(|(mean, _)| Quantity::Mean(mean))
    }

    fn of_cell(&self, cell: usize) -> Vec<Quantity> {
        let mut all: Vec<Quantity> = self.one_field(cell, true).chain(self.one_field(cell, false)).collect();
        let bodies = self.blocks.cut.get(&cell).into_iter().flat_map(|cut| &cut.bodies);
        all.extend(bodies.flat_map(|&body| (0..3).map(move |k| Quantity::Twist(body, k))));
        all
    }

    /// The unknowns of a cell without fluid that no cell with fluid has.
    fn idle(&self, cell: usize) -> Vec<Quantity> {
        let mut all = Vec::new();
        for quantity in self.one_field(cell, true).chain(self.one_field(cell, false)) {
            for (unknown, _) in self.unknowns(quantity) {
                let idle = Quantity::Idle(unknown);
                if !self.used[unknown] && !all.contains(&idle) {
                    all.push(idle);
                }
            }
        }
        all
    }

    /// The values of element `e`, whose `quantities` are known, row by row.
    fn values(&self, e: usize, quantities: &[Quantity], out: &mut Vec<f64>) {
        let mesh = &self.ground.velocity.mesh;
        let (cells, faces, size) = (mesh.cells.len(), mesh.faces.len(), quantities.len());
        out.clear();
        if e < cells && self.domain.active[e] {
            return self.values_of_cell(e, size, out);
        }
        out.resize(size * size, 0.0);
        if e < cells {
            (0..size).for_each(|k| out[k * size + k] = 1.0);
        } else if e < cells + faces {
            let (n, block) = (self.ground.velocity.n, &self.blocks.ghosts[&(e - cells)].velocity);
            // the block is that of one component: nodes of one cell, then of the other
            let place = |side: usize, c: usize, i: usize| side * 2 * n + c * n + i;
            for (k, value) in block.iter().enumerate() {
                let (i, j) = (k / (2 * n), k % (2 * n));
                for c in 0..2 {
                    out[place(i / n, c, i % n) * size + place(j / n, c, j % n)] = *value;
                }
            }
        } else if e < cells + 2 * faces {
            out.copy_from_slice(&self.blocks.ghosts[&(e - cells - faces)].pressure);
        } else if e < 2 * (cells + faces) {
            self.values_of_means(e - cells - 2 * faces, quantities, out);
        } else {
            let friction = &self.friction[e - 2 * (cells + faces)];
            (0..3).for_each(|k| out[k * size + k] = friction[k]);
        }
    }

    fn values_of_cell(&self, cell: usize, size: usize, out: &mut Vec<f64>) {
        let (nv, np) = (self.ground.velocity.cell_dof_count(), self.ground.pressure.n);
        if let Some(cut) = self.blocks.cut.get(&cell) {
            out.extend(&cut.matrix);
            return;
        }
        out.resize(size * size, 0.0);
        let stiffness = &self.blocks.whole[0][cell * nv * nv..(cell + 1) * nv * nv];
        let divergence = &self.blocks.whole[1][cell * nv * np..(cell + 1) * nv * np];
        place_flow(stiffness, divergence, (nv, np), size, out);
    }

    /// `λ z ∫ ξ` and its transposed.
    fn values_of_means(&self, cell: usize, quantities: &[Quantity], out: &mut [f64]) {
        let Some(part) = self.domain.parts.of_cell(cell) else { return };
        let (np, size) = (self.ground.pressure.n, quantities.len());
        let means = match self.blocks.cut.get(&cell) {
            Some(cut) => &cut.means,
            None => &self.blocks.whole[2][cell * np..(cell + 1) * np],
        };
        for (row, quantity) in quantities.iter().enumerate().skip(np) {
            let Quantity::Mean(mean) = *quantity else { unreachable!("pressures come first, then multipliers") };
            let weight = self.domain.parts.means[mean][part];
            for (j, value) in means.iter().enumerate() {
                out[row * size + j] = weight * value;
                out[j * size + row] = weight * value;
            }
        }
    }

    /// The unknowns of element `e` alone, for the structure of the matrix.
    pub fn pattern(&self, e: usize, out: &mut Element) {
        out.rows.clear();
        for quantity in self.quantities(e) {
            for (unknown, _) in self.unknowns(quantity) {
                if !out.rows.contains(&(unknown as u32)) {
                    out.rows.push(unknown as u32);
                }
            }
        }
        out.columns.clone_from(&out.rows);
    }

    /// Element `e` of `S A S` with the diagonal matrix S.
    pub fn fill(&self, e: usize, scales: &[f64], out: &mut Element) {
        let quantities = self.quantities(e);
        let mut values = Vec::new();
        self.values(e, &quantities, &mut values);
        out.rows.clear();
        let mut places: Vec<Vec<(usize, f64)>> = Vec::with_capacity(quantities.len());
        for quantity in &quantities {
            let place = |(unknown, a): (usize, f64)| {
                let known = out.rows.iter().position(|&u| u == unknown as u32);
                let at = known.unwrap_or_else(|| {
                    out.rows.push(unknown as u32);
                    out.rows.len() - 1
                });
                (at, a * scales[unknown])
            };
            places.push(self.unknowns(*quantity).map(place).collect());
        }
        out.columns.clone_from(&out.rows);
        let width = out.rows.len();
        out.values.clear();
        out.values.resize(width * width, 0.0);
        for (row, values) in places.iter().zip(values.chunks_exact(quantities.len().max(1))) {
            for (column, value) in places.iter().zip(values) {
                for (r, a) in row {
                    column.iter().for_each(|(c, b)| out.values[r * width + c] += a * value * b);
                }
            }
        }
    }

    /// Calls `visit` with the quantities and values of every element that is not empty and that `wanted` asks for.
    fn each(&self, wanted: impl Fn(&[Quantity]) -> bool, mut visit: impl FnMut(&[Quantity], &[f64])) {
        let mut values = Vec::new();
        for e in 0..self.count() {
            let quantities = self.quantities(e);
            if !quantities.is_empty() && wanted(&quantities) {
                self.values(e, &quantities, &mut values);
                visit(&quantities, &values);
            }
        }
    }

    /// The elements that differ from those of another placement of the same bodies, given both scales.
    pub fn changed(&self, scales: &[f64], other: &Elements, others: &[f64]) -> Vec<usize> {
        let differs = |unknown: usize| scales.get(unknown) != others.get(unknown);
        let means = self.domain.parts.means == other.domain.parts.means;
        let first_of_means = self.count() - self.friction.len() - self.domain.active.len();
        let changed = |&e: &usize| {
            let cell = if e < self.domain.active.len() { Some(e) } else { e.checked_sub(first_of_means) };
            let blocks = |elements: &Elements| cell.and_then(|cell| elements.blocks.cut.get(&cell).cloned());
            let quantities = self.quantities(e);
            quantities != other.quantities(e)
                || blocks(self) != blocks(other)
                || (!means && quantities.iter().any(|quantity| matches!(quantity, Quantity::Mean(_))))
                || quantities.iter().any(|quantity| {
                    self.unknowns(*quantity).any(|(unknown, _)| differs(unknown)) || self.turns(other, *quantity)
                })
        };
        (0..self.count()).filter(changed).collect()
    }

    /// Whether a motion is made of other unknowns than in another placement.
    fn turns(&self, other: &Elements, quantity: Quantity) -> bool {
        let Quantity::Twist(body, k) = quantity else { return false };
        !self.twists.of(body, k).eq(other.twists.of(body, k))
    }

    /// `r ← r − A x`, in the order of the elements.
    pub fn subtract_product(&self, x: &[f64], r: &mut [f64]) {
        let value = |quantity: &Quantity| self.unknowns(*quantity).map(|(unknown, a)| a * x[unknown]).sum::<f64>();
        self.each(
            |_| true,
            |quantities, values| {
                let local: Vec<f64> = quantities.iter().map(value).collect();
                self.subtract(quantities, values, &local, r);
            },
        );
    }

    /// `r ← r − A x` for what is given of velocities and motions.
    pub fn subtract_given(&self, prescribed: &[f64], motions: &[[f64; 3]], r: &mut [f64]) {
        self.subtract_state((prescribed, None), motions, r);
    }

    /// `r ← r − A x` for a velocity, a pressure, and motions of the bodies.
    pub fn subtract_state(&self, (v, pi): (&[f64], Option<&[f64]>), motions: &[[f64; 3]], r: &mut [f64]) {
        let value = |quantity: &Quantity| match *quantity {
            Quantity::Velocity(dof) => v[dof],
            Quantity::Pressure(dof) => pi.map_or(0.0, |pi| pi[dof]),
            Quantity::Twist(body, k) => motions[body][k],
            Quantity::Mean(_) | Quantity::Idle(_) => 0.0,
        };
        self.each(
            |quantities| quantities.iter().any(|q| value(q) != 0.0),
            |quantities, values| {
                let local: Vec<f64> = quantities.iter().map(value).collect();
                self.subtract(quantities, values, &local, r);
            },
        );
    }

    fn subtract(&self, quantities: &[Quantity], values: &[f64], local: &[f64], r: &mut [f64]) {
        for (quantity, row) in quantities.iter().zip(values.chunks_exact(quantities.len())) {
            let product = crate::solve::dot(row, local);
            self.unknowns(*quantity).for_each(|(unknown, a)| r[unknown] -= a * product);
        }
    }

    /// Powers of two near `1/√A_ii` of velocities and bodies, and near `1/h` of pressures.
    pub fn scales(&self) -> Vec<f64> {
        let [_, means, count] = self.firsts();
        let mut size = vec![0.0_f64; count];
        self.each(
            |_| true,
            |quantities, values| {
                for (k, quantity) in quantities.iter().enumerate() {
                    let diagonal = values[k * (quantities.len() + 1)];
                    self.unknowns(*quantity).for_each(|(unknown, a)| size[unknown] += a * a * diagonal);
                }
            },
        );
        let (pressure, free) = (self.ground.pressure, self.ground.frames.free);
        for cell in (0..self.domain.active.len()).filter(|&cell| self.domain.active[cell]) {
            for i in 0..pressure.n {
                // whatever the ghost penalty has put there
                size[free + pressure.dof(cell, 0, i)] = 0.0;
            }
        }
        for cell in (0..self.domain.active.len()).filter(|&cell| self.domain.active[cell]) {
            let area = pressure.mesh.cell_area(cell);
            (0..pressure.n).for_each(|i| size[free + pressure.dof(cell, 0, i)] += area);
        }
        let scale = |size: f64| if size > 0.0 { 4f64.powf(-(0.25 * size.log2()).round()) } else { 1.0 };
        let mut scales: Vec<f64> = size.iter().map(|&size| scale(size)).collect();
        let mut rows = vec![0.0; count - means];
        self.each(
            |quantities| matches!(quantities.last(), Some(Quantity::Mean(_))),
            |quantities, values| {
                for (k, quantity) in quantities.iter().enumerate() {
                    let Quantity::Mean(mean) = *quantity else { continue };
                    for (j, other) in quantities.iter().enumerate() {
                        let of_other = self.unknowns(*other).map(|(unknown, _)| scales[unknown]).sum::<f64>();
                        rows[mean] += (values[k * quantities.len() + j] * of_other).powi(2);
                    }
                }
            },
        );
        rows.iter().zip(&mut scales[means..]).for_each(|(row, s)| *s = scale(*row));
        scales
    }
}

/// Puts the blocks of velocity and pressure into a square one.
pub(super) fn place_flow(
    stiffness: &[f64],
    divergence: &[f64],
    (nv, np): (usize, usize),
    size: usize,
    out: &mut [f64],
) {
    for i in 0..nv {
        out[i * size..i * size + nv].copy_from_slice(&stiffness[i * nv..(i + 1) * nv]);
        for j in 0..np {
            out[i * size + nv + j] = divergence[i * np + j];
            out[(nv + j) * size + i] = divergence[i * np + j];
        }
    }
}
