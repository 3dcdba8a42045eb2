//! The derivative of one step's equations [7.34] at a state, with the velocity eliminated.
//!
//! ```text
//! R_v = K(ρ) v − F(ρ,p),   R_ρ = w_ρ (u|z) + a_mass(ρ,z;v) − …,   R_p = Pe (ρ ∂_t p|q) + … + (1/B) L_h(ρ,p)
//! ```
//! The unknown is the density `u` before the limiter; everything but its own rate sees the limited one, `ρ = ρ(u)`.
//! With the molecular field eliminated cell by cell and `K δv = F′`, what remains is `R′ = J + D K⁻¹ F′`.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::Compressible;
use super::viscous::Viscous;
use crate::form::mass;
use crate::model::State;
use crate::model::fields::{DENSITY, POLARITY, VELOCITY};
use crate::model::incompressible::Inputs;
use crate::model::lagged::{Elements, add_velocity_block};
use crate::model::limiter::Limited;
use crate::model::momentum::MomentumError;
use crate::model::pushed::Pushed;
use crate::model::terms::{self, MASS, MOLECULAR, MOMENTUM, Sum};
use crate::solve::axpy;
use crate::solve::blocks::{NONE, VectorBlocks};
use crate::solve::rows::Rows;
use crate::solve::symbolic::Element;
use crate::space::Field;

/// What an evaluation of the equations found on its way.
#[derive(Debug)]
pub struct Evaluated {
    /// The density before the limiter, and what the limiter did.
    pub u: Field,
    /// The density, limited, with its derivative.
    pub limited: Limited,
    /// The matrix of the flow in it, factorised.
    pub viscous: Viscous,
    /// `L_h/B`
    pub molecular: Option<Field>,
}

/// The derivative at a state.
#[derive(Debug)]
pub struct Tangent<'m> {
    /// Whose derivative this is.
    pub model: &'m Compressible,
    at: Arc<Evaluated>,
    /// By the density, all with `∂ρ/∂u` of the limiter: `∂R_ρ/∂u`; `∂R_ρ/∂v`
    density: Rows,
    density_drag: Rows,
    /// `∂R_p/∂ρ`, `∂R_p/∂p`, `∂R_p/∂v`
    by_density: Rows,
    operator: VectorBlocks,
    drag: Rows,
    /// `∂Λ/∂ρ`, `∂Λ/∂p`
    well_by_density: Rows,
    well: VectorBlocks,
    /// `∂F/∂ρ` with the viscous force, `∂F/∂p`, `∂F/∂(L_h/B)`
    force_by_density: Rows,
    force_by_polarity: Rows,
    force_by_field: Option<Rows>,
}

impl<'m> Tangent<'m> {
    /// Linearises at `state`, which has the weights `w = [w_ρ, w_p]`; `rate` is the polarity's time derivative that the
    /// equations have.
    pub fn new(
        model: &'m Compressible,
        at: &Arc<Evaluated>,
        state: &State,
        rate: &Field,
        w: [f64; 2],
        inputs: &Inputs,
    ) -> Self {
        let loops = &model.loops;
        let (velocity, density_space, space) = (&*model.velocity, &*model.density.space, &*model.polarity.space);
        let (rho, p, v) = (&state[DENSITY], &state[POLARITY], &state[VELOCITY]);
        let given = model.given(inputs.t);
        let here = model.at(rho, p, v, &given).with_field(at.molecular.as_ref());
        let [momentum, polarity] = [Sum::of(&[MOMENTUM]), Sum::of(&[terms::POLARITY])];
        let [molecular, whole] = [Sum::of(&[MOLECULAR]), Sum::of(&[terms::POLARITY, MOLECULAR])];
        let sizes = [density_space.n, space.cell_dof_count(), velocity.cell_dof_count()];
        let rows = |size: (usize, usize), wide: bool| Rows::zero(model.polarity.neighbours(), size, wide);

        let mut density_drag = rows((sizes[0], sizes[2]), false);
        let by_flow = Sum::of(&[MASS]).by_velocity(&here);
        loops.add_own_rows(&by_flow, (velocity, density_space), &mut density_drag.own);

        let mut drag = rows((sizes[1], sizes[2]), false);
        loops.add_own_rows(&whole.by_velocity(&here), (velocity, space), &mut drag.own);

        let mut well_by_density = rows((sizes[1], sizes[0]), true);
        let form = molecular.by_density(&here);
        loops.add_rows(&form, (density_space, space), &mut well_by_density.own, &mut well_by_density.off);
        let mut by_density = well_by_density.clone();
        let pushed = mass::load_by_density(space, density_space, rate.space.degree, |x| rate.vector(&x.site));
        let form = model.parameters.peclet * pushed + polarity.by_density(&here);
        loops.add_rows(&form, (density_space, space), &mut by_density.own, &mut by_density.off);

        let mut well = model.polarity.empty_operator();
        model.add_alike(&molecular.by_components(&here), &mut well);
        loops.add_mixed(&molecular.by_polarity(&here), space, &mut well);
        let mut operator = well.clone();
        model.add_alike(&(polarity.by_components(&here) + model.inertia_form(rho, w[1])), &mut operator);
        loops.add_mixed(&polarity.by_polarity(&here), space, &mut operator);

        let neighbours = model.polarity.neighbours();
        let mut force_by_density = loops.rows(&-momentum.by_density(&here), (density_space, velocity), neighbours);
        let force_by_polarity = loops.rows(&-momentum.by_polarity(&here), (space, velocity), neighbours);
        let of_field = |_: &Field| loops.rows(&-momentum.by_field(&here), (space, velocity), neighbours);
        let force_by_field = at.molecular.as_ref().map(of_field);
        let limiter = model.density.limiter_derivatives(&at.u, &at.limited);
        // everything sees the limited density
        let mut density = model.transport_by_density(rho, v, inputs.t);
        for rows in [&mut density, &mut by_density, &mut well_by_density, &mut force_by_density] {
            rows.times_columns(&limiter);
        }
        density.own.iter_mut().zip(model.density.mass_blocks()).for_each(|(a, m)| *a += w[0] * m);
        Self {
            model,
            at: at.clone(),
            density,
            density_drag,
            by_density,
            operator,
            drag,
            well_by_density,
            well,
            force_by_density,
            force_by_polarity,
            force_by_field,
        }
    }

    /// `y = (J + D K⁻¹ F′) φ`
    ///
    /// # Errors
    /// As [`Viscous::solve`].
    pub fn times(&self, phi: &[f64], y: &mut [f64]) -> Result<(), MomentumError> {
        let model = self.model;
        let (du, dp) = phi.split_at(model.density.space.dof_count());
        let velocity = &model.velocity;
        let mut local = vec![0.0; model.loops.mesh.cells.len() * velocity.cell_dof_count()];
        self.force_by_density.times_add(du, &mut local);
        self.force_by_polarity.times_add(dp, &mut local);
        if let Some(rows) = &self.force_by_field {
            let mut well = vec![0.0; dp.len()];
            self.well.times(dp, &mut well);
            self.well_by_density.times_add(du, &mut well);
            rows.times_add(&model.polarity.mass_solve(&well), &mut local);
        }
        let force = velocity.assembled(&local);
        let rest = vec![0.0; force.len()];
        let dv = velocity.by_cell(&self.at.viscous.solve(model, &force, &rest)?);
        let (y_rho, y_p) = y.split_at_mut(du.len());
        y_rho.fill(0.0);
        self.density.times_add(du, y_rho);
        self.density_drag.times_add(&dv, y_rho);
        self.operator.times(dp, y_p);
        self.by_density.times_add(du, y_p);
        self.drag.times_add(&dv, y_p);
        Ok(())
    }
}

impl Elements for Tangent<'_> {
    /// Rows: the free velocities, density and polarity of a cell; columns: those, and density and polarity of the
    /// neighbours.
    fn fill(&self, cell: usize, out: &mut Element) {
        let model = self.model;
        let places = model.layout().unknowns(cell, out);
        let (n, m) = (model.density.space.n, model.polarity.space.cell_dof_count());
        let columns = out.columns.len();
        let (p0, r0) = (out.rows.len() - m, out.rows.len() - m - n);
        out.values.clear();
        out.values.resize(out.rows.len() * columns, 0.0);
        let mut draft = Draft { places: &places, columns, values: &mut out.values };
        add_velocity_block(self.at.viscous.blocks.own_of(cell), &places, columns, draft.values);
        draft.add_drag(r0, self.density_drag.own_of(cell));
        draft.add_drag(p0, self.drag.own_of(cell));
        let wide = self.operator.n;
        draft.add_dense(r0, r0, n, self.density.own_of(cell));
        draft.add_dense(p0, r0, n, self.by_density.own_of(cell));
        let square = m * m;
        draft.add_dense(p0, p0, m, &self.operator.diagonal[cell * square..(cell + 1) * square]);
        let others = self.operator.neighbours[cell].into_iter().enumerate().filter(|(_, other)| *other != NONE);
        // the neighbours follow, each with its density and its polarity
        let (mut at, size) = (r0 + n + m, wide * wide);
        for (f, _) in others.clone() {
            let block = 3 * cell + f;
            draft.add_dense(r0, at, n, &self.density.off[block * n * n..(block + 1) * n * n]);
            draft.add_dense(p0, at, n, &self.by_density.off[block * m * n..(block + 1) * m * n]);
            let alike = &self.operator.off[block * size..(block + 1) * size];
            draft.add_dense(p0, at + n, wide, alike);
            draft.add_dense(p0 + wide, at + n + wide, wide, alike);
            if let Some(mixed) = self.operator.mixed_of(cell, f) {
                draft.add_dense(p0, at + n, m, mixed);
            }
            at += n + m;
        }
        let seen = std::iter::once(cell).chain(others.map(|(_, other)| other));
        self.fill_force(cell, seen.enumerate().map(|(k, other)| (other, r0 + k * (n + m))), &mut draft);
    }
}

impl Tangent<'_> {
    /// `−(F_ρ + F_L M⁻¹ ∂Λ/∂ρ)` and `−(F_p + F_L M⁻¹ ∂Λ/∂p)` by the carried fields of some cells, which begin at some
    /// columns, without what F_L sees two faces away.
    fn fill_force(&self, cell: usize, seen: impl Iterator<Item = (usize, usize)>, draft: &mut Draft) {
        let (n, m) = (self.force_by_density.size.1, self.force_by_polarity.size.1);
        let pushed = self.force_by_field.as_ref().map(|rows| Pushed::new(rows, &self.model.polarity, cell));
        let by_row = |part: DMatrix<f64>| part.transpose().as_slice().to_vec();
        for (other, at) in seen {
            if let Some(block) = self.force_by_density.block(cell, other) {
                draft.add_force(at, n, block);
            }
            if let Some(block) = self.force_by_polarity.block(cell, other) {
                draft.add_force(at + n, m, block);
            }
            if let Some(pushed) = &pushed {
                pushed.by_density(&self.well_by_density, other).for_each(|part| draft.add_force(at, n, &by_row(part)));
                pushed.by_polarity(&self.well, other).for_each(|part| draft.add_force(at + n, m, &by_row(part)));
            }
        }
    }

    /// Whether the factors of the elements invert the derivative exactly: no force sees the field of other cells.
    pub fn factors_are_exact(&self) -> bool {
        self.force_by_field.as_ref().is_none_or(|rows| rows.off.is_empty())
    }
}

/// An element under construction.
struct Draft<'s> {
    places: &'s [Vec<(usize, f64)>],
    columns: usize,
    values: &'s mut Vec<f64>,
}

impl Draft<'_> {
    /// Adds a dense block with `width` columns at a row and a column.
    fn add_dense(&mut self, row: usize, column: usize, width: usize, block: &[f64]) {
        for (i, block) in block.chunks_exact(width).enumerate() {
            let start = (row + i) * self.columns + column;
            axpy(1.0, block, &mut self.values[start..start + width]);
        }
    }

    /// Adds rows that depend on the velocities of the cell.
    fn add_drag(&mut self, row: usize, block: &[f64]) {
        for (i, block) in block.chunks_exact(self.places.len()).enumerate() {
            for (place, value) in self.places.iter().zip(block) {
                for (c, a) in place {
                    self.values[(row + i) * self.columns + c] += a * value;
                }
            }
        }
    }

    /// Subtracts the velocity rows of a force.
    fn add_force(&mut self, column: usize, width: usize, block: &[f64]) {
        for (place, block) in self.places.iter().zip(block.chunks_exact(width)) {
            for (r, a) in place {
                let start = r * self.columns + column;
                axpy(-a, block, &mut self.values[start..start + width]);
            }
        }
    }
}
