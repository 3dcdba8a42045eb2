//! The bodies in the coupled matrix of a tissue, whose factors only have to come near the inverse: as a fluid that is
//! very viscous, and hardly moves where the motion is given.

use super::Nitsche;
use crate::cut::Class;
use crate::form::{mass, stokes};
use crate::solve::axpy;
use crate::space::Space;

/// ε of the penalty.
const SOFT: f64 = 1e-4;

impl Nitsche {
    /// Adds to the blocks of the velocity, cell after cell, a penalty of at most `1/SOFT` over the bodies, and their
    /// own friction in place of the fluid's.
    pub(in crate::model) fn add_soft_blocks(&self, velocity: &Space, friction: f64, blocks: &mut [f64]) {
        let (cover, size) = (&self.domain.cover, velocity.cell_dof_count().pow(2));
        let (viscosity, mass) = (stokes::viscosity(velocity), mass::vector_mass(velocity));
        for (body, of_body) in self.bodies.iter().enumerate() {
            let has_body = |cell: &usize| cover.bodies_of_cell(*cell).contains(&body);
            let own: Vec<usize> = cover.touched().iter().copied().filter(has_body).collect();
            let inside = self.loops.inside(cover, Some(body));
            let stiff = inside.blocks_of(&viscosity, (velocity, velocity), &own);
            let masses = inside.blocks_of(&mass, (velocity, velocity), &own);
            let held = if self.twists.has_unknowns(body) { 0.0 } else { 1.0 / (SOFT * of_body.shape.area()) };
            for ((&cell, stiff), mass) in own.iter().zip(stiff).zip(masses) {
                let block = &mut blocks[cell * size..(cell + 1) * size];
                let share = match cover.cell(cell) {
                    Class::Inside(_) => 1.0,
                    Class::Outside | Class::Cut(_) => 1.0 - cover.share_outside(cell),
                };
                axpy(1.0 / (SOFT + 1.0 - share), &stiff, block);
                axpy(of_body.friction - friction + held, &mass, block);
            }
        }
    }
}
