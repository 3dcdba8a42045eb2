//! Fields from functions of position.

use std::sync::Arc;

use super::{Field, Space};
use crate::mesh::Point;

/// Nodal interpolant of a scalar function.
pub fn interpolate_scalar(space: &Arc<Space>, f: impl Fn(Point) -> f64) -> Field {
    Field::new(space, space.node_positions().into_iter().map(f).collect())
}

/// Nodal interpolant of a vector function.
pub fn interpolate_vector(space: &Arc<Space>, f: impl Fn(Point) -> Point) -> Field {
    let positions = space.node_positions();
    let mut field = Field::zero(space);
    for cell in 0..space.mesh.cells.len() {
        for i in 0..space.n {
            let value = f(positions[space.node(cell, i)]);
            field.values[space.dof(cell, 0, i)] = value.x;
            field.values[space.dof(cell, 1, i)] = value.y;
        }
    }
    field
}
