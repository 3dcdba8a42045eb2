//! The forms of velocity and pressure, and their blocks.

use crate::form::words::Vector;
use crate::form::{Bilinear, Density, Faces, Integrator, mass, stokes};
use crate::model::parameters::Parameters;
use crate::model::terms::{MOMENTUM, Sum};
use crate::space::Space;

/// What the flow's matrix depends on besides spaces and conditions.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stiffness {
    /// Those of terms that are linear in the flow.
    pub parameters: Parameters,
    /// Faces with slip by penalty, and `ε_r √|Ω|`.
    pub penalty: Option<(Faces, f64)>,
}

impl Stiffness {
    /// The listed terms that are linear in the flow, `2(D(v)|D(w)) + C_F(v|w)` of a plain sheet, and
    /// `(1/ε_r) ∫ (v·n)(w·n)` on the faces with penalty   [7.11a], [10.3]
    pub fn form<'a>(&self, velocity: &Space) -> Bilinear<'a, Vector, Vector> {
        let form = Sum::of(&[MOMENTUM]).flow_matrix(&self.parameters, velocity, Density::One);
        match self.penalty {
            Some((faces, epsilon)) => form + stokes::slip_penalty(velocity, faces, epsilon),
            None => form,
        }
    }

    /// Dense blocks of [`Stiffness::form`] and of `b(w,ξ)`, cell after cell, rows w.
    pub fn blocks(&self, loops: &Integrator, (velocity, pressure): (&Space, &Space)) -> (Vec<f64>, Vec<f64>) {
        let mut stiffness = vec![0.0; loops.mesh.cells.len() * velocity.cell_dof_count().pow(2)];
        loops.add_own_rows(&self.form(velocity), (velocity, velocity), &mut stiffness);
        (stiffness, loops.cell_blocks(&stokes::divergence(velocity, pressure), pressure, velocity))
    }
}

/// `∫_K ξ` of every pressure function on every cell K.
pub(super) fn cell_means(loops: &Integrator, pressure: &Space) -> Vec<f64> {
    let blocks = loops.cell_blocks(&mass::mass(pressure), pressure, pressure);
    blocks.chunks_exact(pressure.n).map(|row| row.iter().sum()).collect()
}
