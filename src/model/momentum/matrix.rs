//! The forms of velocity and pressure, and their blocks.

use crate::form::words::Vector;
use crate::form::{Bilinear, Density, Integrator, mass, stokes};
use crate::model::terms::FlowTerms;
use crate::model::walls::Walls;
use crate::space::Space;

/// What the flow's matrix depends on besides spaces and conditions.
#[derive(Debug, Clone)]
pub struct Stiffness {
    /// Those that are linear in the flow.
    pub terms: FlowTerms,
    pub walls: Walls,
}

impl Stiffness {
    /// The listed terms that are linear in the flow, `2(D(v)|D(w)) + C_F(v|w)` of a plain sheet, and the forms of walls
    /// [7.11a], [10.3]
    pub fn form(&self, velocity: &Space) -> Bilinear<'_, Vector, Vector> {
        self.terms.matrix(velocity, Density::One) + self.walls.form(velocity)
    }

    /// Dense blocks of [`Stiffness::form`] and of `b(w,ξ)`, cell after cell, rows w.
    pub fn blocks(&self, loops: &Integrator, (velocity, pressure): (&Space, &Space)) -> (Vec<f64>, Vec<f64>) {
        let mut stiffness = vec![0.0; loops.mesh.cells.len() * velocity.cell_dof_count().pow(2)];
        loops.add_own_rows(&self.form(velocity), (velocity, velocity), &mut stiffness);
        (stiffness, loops.cell_blocks(&stokes::divergence(velocity, pressure), pressure, velocity))
    }

    /// The same of some cells alone, in their order.
    pub fn blocks_of(
        &self,
        loops: &Integrator,
        (velocity, pressure): (&Space, &Space),
        cells: &[usize],
    ) -> Vec<(Vec<f64>, Vec<f64>)> {
        let stiffness = loops.own_rows_of(&self.form(velocity), (velocity, velocity), cells);
        let divergence = loops.blocks_of(&stokes::divergence(velocity, pressure), (pressure, velocity), cells);
        stiffness.into_iter().zip(divergence).collect()
    }
}

/// `∫_K ξ` of every pressure function on every cell K.
pub(super) fn cell_means(loops: &Integrator, pressure: &Space) -> Vec<f64> {
    let blocks = loops.cell_blocks(&mass::mass(pressure), pressure, pressure);
    blocks.chunks_exact(pressure.n).map(|row| row.iter().sum()).collect()
}
