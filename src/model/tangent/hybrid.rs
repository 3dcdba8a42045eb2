//! The derivative of one step's equations in hybrid form.
//!
//! ```text
//! R_v = K v + G Π − F(p, Λ),   R_Π = Gᵀ v,   R_p = S_p (p, p̂) + …,   R_p̂ = S_p̂ (p, p̂)
//! ```
//! All of it is by cells: a cell knows its velocities, its polarity and the traces on its faces. Its polarity is
//! eliminated, see [`crate::model::condensed`].

use rayon::prelude::*;

use super::ForceTangent;
use crate::form::Integrator;
use crate::form::side::HybridSize;
use crate::form::words::Vector;
use crate::model::State;
use crate::model::fields::{POLARITY, VELOCITY};
use crate::model::incompressible::{Force, Incompressible, PASSES, Settling};
use crate::model::momentum::MomentumError;
use crate::model::polarity::Hybrid;
use crate::model::terms::{self, At, MOLECULAR, Sum};
use crate::solve::axpy;
use crate::solve::rows::{add_combined, add_product};
use crate::space::Traces;

/// The derivative of the equations of one step.
#[derive(Debug)]
pub struct HybridTangent<'m> {
    /// Whose derivative this is.
    pub model: &'m Incompressible,
    hybrid: &'m Hybrid,
    /// What acts on both components of polarity and traces alike, one component, cell by cell.
    alike: Vec<f64>,
    /// What mixes the components of the polarity, `2n × 2n` per cell.
    mixed: Vec<f64>,
    /// That of `(1/B)(L_h|q)`, whose part for both components alike is constant.
    well: Vec<f64>,
    /// How the force on the flow depends on the polarity.
    force: ForceTangent,
    /// How the equations of polarity and traces depend on the velocity, cell by cell.
    drag: Vec<f64>,
    drag_size: HybridSize,
}

/// The derivative on one cell, with rows and columns of the polarity (p), and of velocity and traces (c); row-major.
#[derive(Debug, Default)]
pub struct CellTangent {
    /// `∂R_p/∂p`
    pub own: Vec<f64>,
    /// `∂R_p/∂(v, p̂)`
    pub by_others: Vec<f64>,
    /// `∂(R_v, R_p̂)/∂p`
    pub of_others: Vec<f64>,
    /// `∂(R_v, R_p̂)/∂(v, p̂)` without the matrix of the flow.
    pub others: Vec<f64>,
    /// `F_L M⁻¹`
    pushed: Vec<f64>,
}

impl CellTangent {
    fn restart(&mut self, [m, nv, nt]: [usize; 3]) {
        let c = nv + nt;
        let parts = [&mut self.own, &mut self.by_others, &mut self.of_others, &mut self.others, &mut self.pushed];
        for (part, size) in parts.into_iter().zip([m * m, m * c, c * m, c * c, nv * m]) {
            part.clear();
            part.resize(size, 0.0);
        }
    }
}

impl<'m> HybridTangent<'m> {
    /// Linearises at `state` and time `t`, `w = α₀/Δt` the weight of the new polarity in the time derivative.
    ///
    /// # Panics
    /// A model that is not in hybrid form.
    pub fn new(model: &'m Incompressible, state: &State, w: f64, t: f64) -> Self {
        let hybrid = model.polarity.hybrid().expect("a model in hybrid form");
        let (loops, p, v) = (model.tissue(), &state[POLARITY], &state[VELOCITY]);
        let (space, velocity, skeleton) = (&*model.polarity.space, &*model.momentum.velocity, &*hybrid.skeleton);
        let traces = model.traces(p, v, t).expect("values on faces");
        let (given, l) =
            (model.given(t), model.projected(&model.polarity.molecular_functional(loops, p, Some(&traces), t)));
        let l = (model.parameters.elasticity != 0.0).then_some(l);
        let at = At::new(&model.parameters, p, &given)
            .with_flow(velocity, v.into())
            .with_field(l.as_ref())
            .with_traces(Some(&traces));
        let polarity = Sum::of(&[terms::POLARITY]);
        let mut alike = hybrid.with_constant(loops, &polarity.by_components(&at), space);
        hybrid.add_cells(model.polarity.inertia(), model.parameters.peclet * w, &mut alike);
        let well = loops.cell_blocks(&Sum::of(&[MOLECULAR]).varying().by_polarity(&at), space, space);
        let mut mixed = well.clone();
        loops.add_own_rows(&polarity.by_polarity(&at), (space, space), &mut mixed);
        let drag_size = Integrator::hybrid_size::<Vector, Vector>(velocity, space, skeleton, false);
        let mut drag = vec![0.0; space.mesh.cells.len() * drag_size.rows() * drag_size.columns()];
        loops.add_hybrid(&polarity.by_velocity(&at), (velocity, space), (skeleton, false), &mut drag);
        Self { model, hybrid, alike, mixed, well, force: ForceTangent::new(model, &at), drag, drag_size }
    }

    /// Unknowns of the polarity on a cell, of its velocity, and of the traces on its faces.
    pub fn sizes(&self) -> [usize; 3] {
        let n = self.hybrid.size.own.0;
        [2 * n, self.drag_size.own.1, 6 * self.hybrid.skeleton.modes()]
    }

    /// The derivative on a cell.
    pub fn of_cell(&self, cell: usize, out: &mut CellTangent) {
        out.restart(self.sizes());
        self.add_alike(cell, out);
        let [m, nv, nt] = self.sizes();
        let c = nv + nt;
        let mixed = &self.mixed[cell * m * m..(cell + 1) * m * m];
        out.own.iter_mut().zip(mixed).for_each(|(a, b)| *a += b);
        let size = self.drag_size.rows() * nv;
        let drag = &self.drag[cell * size..(cell + 1) * size];
        let rows = out.by_others.chunks_exact_mut(c).chain(out.others[nv * c..].chunks_exact_mut(c));
        rows.zip(drag.chunks_exact(nv)).for_each(|(row, drag)| row[..nv].copy_from_slice(drag));
        self.add_force(cell, out);
    }

    /// What acts on both components alike.
    fn add_alike(&self, cell: usize, out: &mut CellTangent) {
        let [m, nv, nt] = self.sizes();
        let (n, c, modes, columns) = (m / 2, nv + nt, nt / 6, self.hybrid.size.columns());
        let alike = &self.alike[cell * columns * columns..(cell + 1) * columns * columns];
        for (i, row) in alike.chunks_exact(columns).enumerate() {
            for component in 0..2 {
                let (own, others) = match i.checked_sub(n) {
                    None => {
                        let i = component * n + i;
                        (&mut out.own[i * m..(i + 1) * m], &mut out.by_others[i * c..(i + 1) * c])
                    }
                    Some(k) => {
                        let i = nv + (2 * (k / modes) + component) * modes + k % modes;
                        (&mut out.of_others[i * m..(i + 1) * m], &mut out.others[i * c..(i + 1) * c])
                    }
                };
                own[component * n..(component + 1) * n].copy_from_slice(&row[..n]);
                for (local, seen) in row[n..].chunks_exact(modes).enumerate() {
                    others[nv + (2 * local + component) * modes..][..modes].copy_from_slice(seen);
                }
            }
        }
    }

    /// `−F′ = −(F_p + F_L M⁻¹ Λ′)` by polarity and traces.
    fn add_force(&self, cell: usize, out: &mut CellTangent) {
        let [m, nv, nt] = self.sizes();
        let (n, c, modes, columns) = (m / 2, nv + nt, nt / 6, self.hybrid.size.columns());
        let CellTangent { of_others, others, pushed, .. } = out;
        of_others.iter_mut().zip(self.force.by_polarity.own_of(cell)).for_each(|(a, b)| *a -= b);
        let Some(by_field) = &self.force.by_field else { return };
        let inverse = self.model.polarity.projection_block(cell);
        for (field, pushed) in by_field.own_of(cell).chunks_exact(n).zip(pushed.chunks_exact_mut(n)) {
            add_combined(1.0, field, inverse, pushed);
        }
        let well = &self.well[cell * m * m..(cell + 1) * m * m];
        let constant = &self.hybrid.constant[cell * columns * columns..][..n * columns];
        let mut seen = vec![0.0; columns];
        for (i, pushed) in pushed.chunks_exact(m).enumerate() {
            let row = &mut of_others[i * m..(i + 1) * m];
            add_combined(-1.0, pushed, well, row);
            for component in 0..2 {
                seen.fill(0.0);
                add_combined(-1.0, &pushed[component * n..(component + 1) * n], constant, &mut seen);
                axpy(1.0, &seen[..n], &mut row[component * n..(component + 1) * n]);
                for (local, seen) in seen[n..].chunks_exact(modes).enumerate() {
                    axpy(1.0, seen, &mut others[i * c + nv + (2 * local + component) * modes..][..modes]);
                }
            }
        }
    }

    /// `y = R_p′ φ` with flow and traces eliminated. The flow depends on the traces and these, a little, on the flow: a
    /// few passes settle both.
    ///
    /// # Errors
    /// As [`crate::model::momentum::Momentum::solve`].
    pub fn times(&self, phi: &[f64], y: &mut [f64]) -> Result<(), MomentumError> {
        let [m, nv, _] = self.sizes();
        let mut v = vec![0.0; self.model.momentum.velocity.dof_count()];
        let mut traces = self.traces_of(phi, &v);
        let mut settling = Settling::new();
        for _ in 0..PASSES {
            let (next, _) = self.model.change_of_flow(&self.force_of(phi, &traces))?;
            let settled = settling.is_over(&v, &next);
            v = next;
            traces = self.traces_of(phi, &v);
            if settled || self.force.by_field.is_none() {
                break;
            }
        }
        let by_cell = self.model.momentum.velocity.by_cell(&v);
        self.hybrid.times_own(&self.alike, phi, &traces, y);
        y.par_chunks_mut(m).enumerate().for_each(|(cell, y)| {
            add_product(&self.mixed[cell * m * m..(cell + 1) * m * m], &phi[cell * m..(cell + 1) * m], y);
            let drag = &self.drag[cell * self.drag_size.rows() * nv..][..m * nv];
            add_product(drag, &by_cell[cell * nv..(cell + 1) * nv], y);
        });
        Ok(())
    }

    /// The change of the traces with those of polarity and flow.
    fn traces_of(&self, phi: &[f64], v: &[f64]) -> Traces {
        let by_cell = self.model.momentum.velocity.by_cell(v);
        let nv = self.drag_size.own.1;
        self.hybrid.traces_by(&self.alike, phi, |cell, local, rows| {
            let (size, face) = (self.drag_size.rows() * nv, self.drag_size.face.0);
            let first = cell * size + (self.drag_size.own.0 + local * face) * nv;
            add_product(&self.drag[first..first + face * nv], &by_cell[cell * nv..(cell + 1) * nv], rows);
        })
    }

    /// `F′` times the changes of polarity and traces.
    fn force_of(&self, phi: &[f64], traces: &Traces) -> Force {
        let velocity = &self.model.momentum.velocity;
        let m = self.sizes()[0];
        let mut local = vec![0.0; self.force.by_polarity.size.0 * velocity.mesh.cells.len()];
        self.force.by_polarity.times_add(phi, &mut local);
        if let Some(by_field) = &self.force.by_field {
            let mut change = self.hybrid.times(phi, traces);
            change.par_chunks_mut(m).enumerate().for_each(|(cell, out)| {
                add_product(&self.well[cell * m * m..(cell + 1) * m * m], &phi[cell * m..(cell + 1) * m], out);
            });
            by_field.times_add(&self.model.polarity.project(&change), &mut local);
        }
        Force { flow: velocity.assembled(&local), bodies: Vec::new() }
    }
}
