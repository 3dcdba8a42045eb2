//! The derivative of one step's equations [7.11] at a state: what Newton's method solves with.
//!
//! ```text
//! R_v = K v + G Π − F(p),   R_Π = Gᵀ v,   R_p = Pe ∂_t p + Pe [a_upw − ω − a δ](p;v) + (1/B) L_h(p) − inputs
//! ```
//! The molecular field `L_h = B M⁻¹ Λ(p)` is eliminated cell by cell, so that
//! `F′ = F_p + F_L M⁻¹ Λ′` couples a cell's velocities to the polarity of its neighbours. With the velocity eliminated,
//! too (the Stokes problem is linear and factorised), the polarity alone remains: `R_p′ = J_pp + D S⁻¹ F′`.

mod hybrid;

pub use self::hybrid::{CellTangent, HybridTangent};
use super::fields::State;
use super::incompressible::{Force, Incompressible};
use super::momentum::MomentumError;
use super::parameters::{ElasticForce, Parameters};
use super::terms::{self, At, MOLECULAR, MOMENTUM, Sum};
use crate::form::Bilinear;
use crate::form::traction::{self, Pull};
use crate::form::upwind::Carrier;
use crate::form::words::Vector;
use crate::model::fields::{POLARITY, VELOCITY};
use crate::shape::Wrench;
use crate::solve::blocks::VectorBlocks;
use crate::solve::rows::Rows;
use crate::space::Field;

/// How the force depends on the polarity at a state, `F_p`, and on the molecular field over B, `F_L`.
#[derive(Debug, Clone)]
pub struct ForceTangent {
    /// `2n_v × 2n_p` per cell; forces with integrals over faces also see the cell's neighbours.
    pub by_polarity: Rows,
    /// Only with elasticity.
    pub by_field: Option<Rows>,
    /// How the tractions on bodies depend on both, where those are there by Nitsche's method.
    pub tractions: [Vec<Pull>; 2],
}

/// The derivative of the equations of one step.
#[derive(Debug)]
pub struct Tangent<'m> {
    /// Whose derivative this is.
    pub model: &'m Incompressible,
    state: &'m State,
    t: f64,
    /// `J_pp`
    pub operator: VectorBlocks,
    /// `Λ′`, the derivative of `(1/B)(L_h|q)`.
    pub molecular: VectorBlocks,
    /// How the force on the flow depends on the polarity.
    pub force: ForceTangent,
    /// `D`: the derivative of `R_p` along v, `2n_p × 2n_v` per cell.
    pub drag: Rows,
}

impl<'m> Tangent<'m> {
    /// Linearises at `state` and time `t`; `before` is the flow whose directions the energy-consistent force keeps, and
    /// `w = α₀/Δt` the weight of the new polarity in the time derivative (0 for the stationary equations).
    pub fn new(model: &'m Incompressible, state: &'m State, before: &'m Field, w: f64, t: f64) -> Self {
        let (loops, p, velocity) = (model.tissue(), &state[POLARITY], &*model.momentum.velocity);
        let (given, l) = (model.given(t), model.molecular(p, &state[VELOCITY], t));
        let carrier = model.carrier(&state[VELOCITY], before);
        let at = At::new(&model.parameters, p, &given).with_flow(velocity, carrier).with_field(l.as_ref());
        let molecular = model.polarity.molecular_tangent(loops, p);
        let operator = model.polarity.tangent(loops, w, &at, &molecular);
        let force = ForceTangent::new(model, &at);
        let mut drag =
            Rows::zero(model.polarity.neighbours(), (p.space.cell_dof_count(), velocity.cell_dof_count()), false);
        let form = Sum::of(&[terms::POLARITY, MOLECULAR]).by_velocity(&at);
        loops.add_own_rows(&form, (velocity, &p.space), &mut drag.own);
        Self { model, state, t, operator, molecular, force, drag }
    }

    /// `F′` with the elastic force that only couples a cell with itself.
    pub fn local_force(&self) -> ForceTangent {
        let (model, p) = (self.model, &self.state[POLARITY]);
        let parameters = Parameters { elastic_force: ElasticForce::Stress, ..model.parameters };
        let (given, l) = (model.given(self.t), model.molecular(p, &self.state[VELOCITY], self.t));
        let carrier = Carrier::from(&self.state[VELOCITY]);
        let at = At::new(&parameters, p, &given).with_flow(&model.momentum.velocity, carrier).with_field(l.as_ref());
        ForceTangent::new(model, &at)
    }

    /// `F′ φ`, a functional on the velocity space, and what bodies feel of it.
    pub fn force_of(&self, phi: &[f64]) -> Force {
        let outline = self.model.momentum.outline();
        let bodies = vec![Wrench::ZERO; outline.map_or(0, |outline| outline.poses.len())];
        let mut force = Force { flow: self.times_force(&self.force.by_polarity, phi), bodies };
        self.add_tractions(&self.force.tractions[0], phi, &mut force);
        if let Some(rows) = &self.force.by_field {
            let mut well = vec![0.0; phi.len()];
            self.molecular.times(phi, &mut well);
            let lambda = self.model.polarity.project(&well);
            crate::solve::axpy(1.0, &self.times_force(rows, &lambda), &mut force.flow);
            self.add_tractions(&self.force.tractions[1], &lambda, &mut force);
        }
        force
    }

    fn add_tractions(&self, pulls: &[Pull], x: &[f64], force: &mut Force) {
        let m = self.model.polarity.space.cell_dof_count();
        for Pull { cell, body, rows } in pulls {
            let local = &x[cell * m..(cell + 1) * m];
            let values: Vec<f64> = rows.chunks_exact(m).map(|row| crate::solve::dot(row, local)).collect();
            force.add(&self.model.momentum.velocity, (*cell, *body), &values);
        }
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
    /// Derivative of the force [7.11a] at a state.
    fn new(model: &Incompressible, at: &At) -> Self {
        let (sum, spaces) = (Sum::of(&[MOMENTUM]), (&*model.polarity.space, &*model.momentum.velocity));
        let rows = |form: &Bilinear<Vector, Vector>| model.tissue().rows(form, spaces, model.polarity.neighbours());
        let outline = model.momentum.outline();
        let pulls = |form: &Bilinear<Vector, Vector>| {
            // the force is minus the form, and its tractions stand on the other side
            outline.map_or_else(Vec::new, |outline| traction::of_derivative(&model.loops, form, spaces, outline))
        };
        let of_polarity = sum.by_polarity(at);
        let of_field = (model.parameters.elasticity != 0.0).then(|| sum.by_field(at));
        let tractions = [pulls(&of_polarity), of_field.as_ref().map_or_else(Vec::new, pulls)];
        Self { by_polarity: rows(&-of_polarity), by_field: of_field.map(|form| rows(&-form)), tractions }
    }
}
