//! The derivative of one step's equations [7.11] at a state: what Newton's method solves with.
//!
//! ```text
//! R_v = K v + G Π − F(p),   R_Π = Gᵀ v,   R_p = Pe ∂_t p + Pe [a_upw − ω − a δ](p;v) + (1/B) L_h(p) − inputs
//! ```
//! The molecular field `L_h = B M⁻¹ Λ(p)` is eliminated cell by cell, so that
//! `F′ = F_p + F_L M⁻¹ Λ′` couples a cell's velocities to the polarity of its neighbours. With the velocity eliminated, too
//! (the Stokes problem is linear and factorised), the polarity alone remains: `R_p′ = J_pp + D S⁻¹ F′`.

use super::incompressible::Incompressible;
use super::momentum::MomentumError;
use super::parameters::ElasticForce;
use super::state::State;
use crate::form::power::{self, Power};
use crate::form::upwind::Carrier;
use crate::form::words::Vector;
use crate::form::{Bilinear, Density, FacePoint, elastic, mass, polarity, upwind};
use crate::solve::blocks::VectorBlocks;
use crate::solve::rows::Rows;
use crate::space::Field;

/// How the force depends on the polarity at a state, `F_p`, and on the molecular field over B, `F_L`.
#[derive(Debug, Clone)]
pub struct ForceTangent {
    /// `2n_v × 2n_p` per cell; the energy-consistent force also sees the cell's neighbours.
    pub by_polarity: Rows,
    /// Only with elasticity.
    pub by_field: Option<Rows>,
}

/// The derivative of the equations of one step.
#[derive(Debug)]
pub struct Tangent<'m> {
    pub model: &'m Incompressible,
    state: &'m State,
    t: f64,
    /// `J_pp`
    pub operator: VectorBlocks,
    /// `Λ′`, the derivative of `(1/B)(L_h|q)`.
    pub molecular: VectorBlocks,
    pub force: ForceTangent,
    /// `D`: the derivative of `R_p` along v, `2n_p × 2n_v` per cell.
    pub drag: Rows,
}

impl<'m> Tangent<'m> {
    /// Linearises at `state` and time `t`; `before` is the flow whose directions the energy-consistent force keeps, and
    /// `w = α₀/Δt` the weight of the new polarity in the time derivative (0 for the stationary equations).
    pub fn new(model: &'m Incompressible, state: &'m State, before: &'m Field, w: f64, t: f64) -> Self {
        let carrier = model.carrier(&state.v, before);
        let (loops, p) = (model.tissue(), &state.p);
        let molecular = model.polarity.molecular_tangent(loops, p);
        let operator = model.polarity.tangent(loops, w, carrier, &molecular);
        let l = model.molecular(p, t);
        let force = ForceTangent::new(model, state, carrier, l.as_ref(), model.parameters.elastic_force, t);
        let data = |s: &FacePoint| model.polarity.data(s, t);
        let (pe, a) = (model.parameters.peclet, model.parameters.alignment);
        let velocity = &*model.momentum.velocity;
        let form = pe * upwind::advection_by_flow(p, carrier, model.polarity.dirichlet, data)
            - pe * polarity::turning_by_flow(velocity, p, a, Density::One);
        let size = (p.space.cell_dof_count(), velocity.cell_dof_count());
        let mut drag = Rows::zero(model.polarity.neighbours(), size, false);
        loops.add_own_rows(&form, (velocity, &p.space), &mut drag.own);
        Self { model, state, t, operator, molecular, force, drag }
    }

    /// `F′` with the elastic force that only couples a cell with itself.
    pub fn local_force(&self) -> ForceTangent {
        let l = self.model.molecular(&self.state.p, self.t);
        ForceTangent::new(
            self.model,
            self.state,
            Carrier::from(&self.state.v),
            l.as_ref(),
            ElasticForce::Stress,
            self.t,
        )
    }

    /// `F′ φ`, a functional on the velocity space.
    pub fn force_of(&self, phi: &[f64]) -> Vec<f64> {
        let mut out = self.times_force(&self.force.by_polarity, phi);
        if let Some(rows) = &self.force.by_field {
            let mut well = vec![0.0; phi.len()];
            self.molecular.times(phi, &mut well);
            let lambda = self.model.polarity.project(&well);
            crate::solve::axpy(1.0, &self.times_force(rows, &lambda), &mut out);
        }
        out
    }

    /// Velocity and pressure that follow from the change φ of the polarity: `S⁻¹ F′ φ`.
    ///
    /// # Errors
    /// As [`super::momentum::Momentum::solve`].
    pub fn flow_of(&self, phi: &[f64]) -> Result<(Vec<f64>, Vec<f64>), MomentumError> {
        self.model.change_of_flow(&self.force_of(phi))
    }

    /// `y = (J_pp + D S⁻¹ F′) φ`: the derivative of the polarity's equation with the flow eliminated.
    ///
    /// # Errors
    /// As [`super::momentum::Momentum::solve`].
    pub fn times(&self, phi: &[f64], y: &mut [f64]) -> Result<(), MomentumError> {
        let (v, _) = self.flow_of(phi)?;
        self.operator.times(phi, y);
        crate::solve::axpy(1.0, &self.drag_of(&v), y);
        Ok(())
    }

    /// `D w`, a functional on the polarity space.
    pub fn drag_of(&self, w: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.model.polarity.space.dof_count()];
        self.drag.times_add(&self.model.momentum.velocity.by_cell(w), &mut out);
        out
    }

    /// Rows of a force times a function of the polarity space, gathered on the velocity space.
    fn times_force(&self, rows: &Rows, x: &[f64]) -> Vec<f64> {
        let mut local = vec![0.0; rows.size.0 * rows.neighbours.len()];
        rows.times_add(x, &mut local);
        self.model.momentum.velocity.assembled(&local)
    }
}

impl ForceTangent {
    /// Derivative of the force [7.11a] at `state` with the elastic part of `kind`; `l` is `L_h/B`.
    fn new(
        model: &Incompressible,
        state: &State,
        carrier: Carrier,
        l: Option<&Field>,
        kind: ElasticForce,
        t: f64,
    ) -> Self {
        let (m, p) = (&model.parameters, &state.p);
        let (velocity, space) = (&*model.momentum.velocity, &*p.space);
        let mut form = Bilinear::zero();
        if m.traction != 0.0 {
            form = form + m.traction * mass::vector_load_by(velocity, space);
        }
        if m.active_stress != 0.0 {
            form = form + 2.0 * polarity::force_by_field(velocity, p, 0.0, m.active_stress, Density::One);
        }
        let Some(l) = l else {
            return Self { by_polarity: rows(model, &form, kind), by_field: None };
        };
        let b = m.elasticity;
        form = form - polarity::force_by_polarity(velocity, l, b, b * m.alignment);
        let pushed = -polarity::force_by_field(velocity, p, b, b * m.alignment, Density::One);
        match kind {
            ElasticForce::Stress => {
                form = form + m.coherence.powi(2) * b * elastic::ericksen_tangent(velocity, p, Density::One);
                Self { by_polarity: rows(model, &form, kind), by_field: Some(rows(model, &pushed, kind)) }
            }
            ElasticForce::Energy => {
                let data = move |s: &FacePoint| model.polarity.data(s, t);
                let power = Power { p, l, carrier, inflow: model.polarity.dirichlet, data };
                let [open, dirichlet] = model.natural_faces;
                let shift = power::natural_traction_tangent(velocity, p, m.coherence, open, dirichlet);
                form = form + b * power.by_polarity() - b * shift;
                let pushed = pushed + b * power.by_field();
                Self { by_polarity: rows(model, &form, kind), by_field: Some(rows(model, &pushed, kind)) }
            }
        }
    }
}

/// The rows of a force: those of the energy-consistent one see the neighbours of their cell.
fn rows(model: &Incompressible, form: &Bilinear<Vector, Vector>, kind: ElasticForce) -> Rows {
    let (trial, test) = (&*model.polarity.space, &*model.momentum.velocity);
    let size = (test.cell_dof_count(), trial.cell_dof_count());
    let mut out = Rows::zero(model.polarity.neighbours(), size, kind == ElasticForce::Energy);
    match kind {
        ElasticForce::Stress => model.tissue().add_cell_blocks(form, trial, test, &mut out.own),
        ElasticForce::Energy => model.tissue().add_rows(form, (trial, test), &mut out.own, &mut out.off),
    }
    out
}
