//! The elements of the balance with bodies, and what is multiplied by them.

use super::{Rigidity, Sparse};
use crate::model::immersed::penalty::Immersion;
use crate::model::lagged::{Layout, add_velocity_block};
use crate::solve::symbolic::Element;
use crate::solve::{axpy, dot};

/// Where the bodies' part of an element comes from.
pub(super) struct Source<'s> {
    pub(super) layout: Layout<'s>,
    pub(super) immersion: &'s Immersion,
    pub(super) rigidity: &'s Rigidity,
    pub(super) friction: f64,
    pub(super) exchanged: &'s [usize],
}

/// All that elements are made of.
pub(super) struct Filled<'s> {
    pub(super) source: Source<'s>,
    pub(super) stiffness: &'s [f64],
    pub(super) divergence: &'s [f64],
    pub(super) means: &'s [f64],
}

impl Filled<'_> {
    /// Element `e` of `S A S`.
    pub(super) fn fill_scaled(&self, e: usize, scales: &[f64], out: &mut Element) {
        self.fill(e, out);
        let width = out.columns.len();
        for (&row, values) in out.rows.iter().zip(out.values.chunks_exact_mut(width)) {
            let s = scales[row as usize];
            values.iter_mut().zip(&out.columns).for_each(|(a, &column)| *a *= s * scales[column as usize]);
        }
    }

    /// Powers of four near `1/√A_vv` and near the root of the inverse of `Σ_v b(v,p)²/A_vv`.
    pub(super) fn scales(&self) -> Vec<f64> {
        let layout = &self.source.layout;
        let (space, pressure) = (layout.velocity, layout.pressure.expect("an incompressible flow has a pressure"));
        let (nv, np, free) = (space.cell_dof_count(), pressure.n, layout.frames.free);
        let cells = 0..space.mesh.cells.len();
        let unknowns = |cell: usize, k: usize| layout.frames.of(space.dof(cell, k / space.n, k % space.n));
        let mut size = vec![0.0; layout.first()];
        for cell in cells.clone() {
            for k in 0..nv {
                let a = self.stiffness[(cell * nv + k) * nv + k];
                unknowns(cell, k).for_each(|(unknown, b)| size[unknown] += a * b * b);
            }
        }
        for parts in &self.source.immersion.parts {
            for (&cell, part) in parts {
                let Some(viscosity) = &part.viscosity else { continue };
                for k in 0..nv {
                    let a = viscosity[k * nv + k] * part.strength(self.source.rigidity.epsilon);
                    unknowns(cell, k).for_each(|(unknown, b)| size[unknown] += a * b * b);
                }
            }
        }
        for cell in cells {
            for i in 0..nv {
                for (unknown, a) in unknowns(cell, i) {
                    let Some(share) = Some(a * a / size[unknown]).filter(|s| s.is_finite()) else { continue };
                    for j in 0..np {
                        let b = self.divergence[(cell * nv + i) * np + j];
                        size[free + pressure.dof(cell, 0, j)] += share * b * b;
                    }
                }
            }
        }
        let scale = |size: &f64| if *size > 0.0 { 4f64.powf(-(0.25 * size.log2()).round()) } else { 1.0 };
        let mut scales: Vec<f64> = size.iter().map(scale).collect();
        // rows of means by the sizes of their entries where there are no bodies: they stay when bodies move
        let mut rows = vec![0.0; layout.closed.count()];
        let first = layout.first() - rows.len();
        let mut element = Element::default();
        for k in 0..layout.closed.cells().len() {
            self.fill_mean(k, &mut element);
            let (multiplier, pressures) = element.rows.split_last().expect("the multiplier is the last one");
            let entries = || element.values.chunks_exact(pressures.len() + 1).map(|row| row[pressures.len()]);
            let area: f64 = entries().sum();
            rows[*multiplier as usize - first] += entries().map(|entry| entry * entry / area).sum::<f64>();
        }
        rows.iter().zip(&mut scales[first..]).for_each(|(row, s)| *s = scale(row));
        scales
    }

    /// Element `e` of A: with the penalty, exchanged dofs apart.
    pub(super) fn fill(&self, e: usize, out: &mut Element) {
        let cells = self.source.layout.velocity.mesh.cells.len();
        if e >= cells {
            return self.fill_mean(e - cells, out);
        }
        self.fill_cell(e, out, true);
        let n = out.rows.len();
        for k in 0..n {
            if self.source.exchanged.binary_search(&(out.rows[k] as usize)).is_ok() {
                for l in 0..n {
                    out.values[k * n + l] = 0.0;
                    out.values[l * n + k] = 0.0;
                }
                out.values[k * n + k] = 1.0;
            }
        }
    }

    pub(super) fn fill_cell(&self, cell: usize, out: &mut Element, penalty: bool) {
        let layout = &self.source.layout;
        let pressure = layout.pressure.expect("an incompressible flow has a pressure");
        let (nv, np) = (layout.velocity.cell_dof_count(), pressure.n);
        let maps = layout.unknowns(cell, out);
        let columns = out.columns.len();
        let nf = columns - np;
        out.values.clear();
        out.values.resize(out.rows.len() * columns, 0.0);
        let mut block = self.stiffness[cell * nv * nv..(cell + 1) * nv * nv].to_vec();
        for (parts, friction) in self.source.immersion.parts.iter().zip(&self.source.rigidity.friction) {
            let Some(part) = parts.get(&cell) else { continue };
            if *friction != self.source.friction {
                axpy(friction - self.source.friction, &part.mass, &mut block);
            }
            if let Some(viscosity) = part.viscosity.as_ref().filter(|_| penalty || !part.rigid) {
                axpy(part.strength(self.source.rigidity.epsilon), viscosity, &mut block);
            }
        }
        let values = &mut out.values;
        add_velocity_block(&block, &maps, columns, values);
        for (i, row) in maps.iter().enumerate() {
            for j in 0..np {
                let g = self.divergence[cell * nv * np + i * np + j];
                for (r, a) in row {
                    values[r * columns + nf + j] += a * g;
                    values[(nf + j) * columns + r] += a * g;
                }
            }
        }
    }

    /// `λ ∫ ξ` and its transposed.
    pub(super) fn fill_mean(&self, k: usize, out: &mut Element) {
        let cell = self.source.layout.mean_unknowns(k, out);
        let np = out.rows.len() - 1;
        out.values.clear();
        out.values.resize((np + 1) * (np + 1), 0.0);
        for (j, mean) in self.means[cell * np..(cell + 1) * np].iter().enumerate() {
            out.values[j * (np + 1) + np] = *mean;
            out.values[np * (np + 1) + j] = *mean;
        }
    }

    /// `K q` for a field that lives on some cells.
    pub(super) fn times_field(&self, cells: &[usize], field: &Sparse, size: usize) -> Vec<f64> {
        let mut dense = vec![0.0; size];
        field.iter().for_each(|&(unknown, value)| dense[unknown] = value);
        let mut out = vec![0.0; size];
        let mut element = Element::default();
        for &cell in cells {
            self.fill_cell(cell, &mut element, false);
            add_product(&element, 1.0, &dense, &mut out);
        }
        out
    }

    /// `r ← r − A x`, in the order of the elements.
    pub(super) fn subtract_product(&self, x: &[f64], r: &mut [f64]) {
        let cells = self.source.layout.velocity.mesh.cells.len();
        let mut element = Element::default();
        for e in 0..cells + self.source.layout.closed.cells().len() {
            self.fill(e, &mut element);
            add_product(&element, -1.0, x, r);
        }
    }

    /// `r ← r − (K v, b(v,·))` for nodal values v, on whose rigid parts the penalty vanishes.
    pub(super) fn subtract_start(&self, v: &[f64], r: &mut [f64]) {
        let layout = &self.source.layout;
        let pressure = layout.pressure.expect("an incompressible flow has a pressure");
        let (space, np) = (layout.velocity, pressure.n);
        let nv = space.cell_dof_count();
        for cell in 0..space.mesh.cells.len() {
            let dofs: Vec<usize> = (0..nv).map(|k| space.dof(cell, k / space.n, k % space.n)).collect();
            let local: Vec<f64> = dofs.iter().map(|&dof| v[dof]).collect();
            if local.iter().all(|v| *v == 0.0) {
                continue;
            }
            let mut block = self.stiffness[cell * nv * nv..(cell + 1) * nv * nv].to_vec();
            for (parts, friction) in self.source.immersion.parts.iter().zip(&self.source.rigidity.friction) {
                if let Some(part) = parts.get(&cell) {
                    axpy(friction - self.source.friction, &part.mass, &mut block);
                    if let Some(viscosity) = part.viscosity.as_ref().filter(|_| !part.rigid) {
                        axpy(part.strength(self.source.rigidity.epsilon), viscosity, &mut block);
                    }
                }
            }
            for (k, &dof) in dofs.iter().enumerate() {
                let value = dot(&block[k * nv..(k + 1) * nv], &local);
                layout.frames.of(dof).for_each(|(unknown, a)| r[unknown] -= a * value);
            }
            for j in 0..np {
                let value: f64 = (0..nv).map(|i| self.divergence[cell * nv * np + i * np + j] * local[i]).sum();
                r[layout.frames.free + pressure.dof(cell, 0, j)] -= value;
            }
        }
    }
}

pub(super) fn add_product(element: &Element, scale: f64, x: &[f64], out: &mut [f64]) {
    for (row, values) in element.rows.iter().zip(element.values.chunks_exact(element.columns.len())) {
        let sum: f64 = element.columns.iter().zip(values).map(|(&column, a)| a * x[column as usize]).sum();
        out[*row as usize] += scale * sum;
    }
}

pub(super) fn sparse_dot(a: &Sparse, b: &[f64]) -> f64 {
    a.iter().map(|(k, value)| value * b[*k]).sum()
}
