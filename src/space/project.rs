//! Fields from functions of position: the L² projection cell by cell for discontinuous spaces, nodal interpolants for
//! continuous ones.

mod breaks;
mod moments;
mod transfer;

use std::convert::Infallible;
use std::sync::Arc;

use rayon::prelude::*;

use super::{Continuity, Field, Space};
use crate::mesh::Point;

pub use breaks::{Break, Level};
use moments::{Cell, Masses};
pub use transfer::{NotCovered, transfer};

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

/// The L² projection of `f` on a discontinuous space of `C` components: in every cell `(u|φ)_K = (f|φ)_K` for all φ, so
/// that the means of the cells are those of `f`.
///
/// All points of the quadrature lie inside of cells: on a face at which `f` jumps each cell sees its own side. A cell
/// that a line of `breaks` crosses is cut along it; where the quadrature is not yet converged, cells are divided.
///
/// # Errors
/// The error of `f` in the first cell that has one.
///
/// # Panics
/// When the space is continuous or has another number of components.
pub fn project<const C: usize, E: Send>(
    space: &Arc<Space>,
    breaks: &[Break],
    f: impl Fn(Point) -> Result<[f64; C], E> + Sync,
) -> Result<Field, E> {
    let masses = Masses::new(space.degree);
    cell_by_cell(space, |index| {
        let cell = Cell::new(&space.mesh, index, &masses);
        let pieces = breaks::cut(cell.map, breaks);
        cell.solve(&cell.converged(pieces, &|_, x| f(x))?)
    })
}

/// As [`project`] for a scalar function that is smooth but for the lines of `breaks`.
pub fn project_scalar(space: &Arc<Space>, breaks: &[Break], f: impl Fn(Point) -> f64 + Sync) -> Field {
    let Ok(field) = project(space, breaks, |x| Ok::<_, Infallible>([f(x)]));
    field
}

/// As [`project`] for a vector function that is smooth but for the lines of `breaks`.
pub fn project_vector(space: &Arc<Space>, breaks: &[Break], f: impl Fn(Point) -> Point + Sync) -> Field {
    let Ok(field) = project(space, breaks, |x| {
        let value = f(x);
        Ok::<_, Infallible>([value.x, value.y])
    });
    field
}

/// A discontinuous field from its coefficients in every cell, component by component.
fn cell_by_cell<const C: usize, E: Send>(
    space: &Arc<Space>,
    of_cell: impl Fn(usize) -> Result<[Vec<f64>; C], E> + Sync,
) -> Result<Field, E> {
    assert!(space.continuity == Continuity::Discontinuous, "continuous spaces are interpolated in");
    assert_eq!(space.components, C);
    let cells: Vec<Result<[Vec<f64>; C], E>> = (0..space.mesh.cells.len()).into_par_iter().map(&of_cell).collect();
    let mut values = Vec::with_capacity(space.dof_count());
    for cell in cells {
        cell?.iter().for_each(|component| values.extend_from_slice(component));
    }
    Ok(Field::new(space, values))
}
