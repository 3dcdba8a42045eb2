//! Connected parts of the mesh whose pressure nothing fixes: there it has mean zero.

use super::boundary::Conditions;
use crate::mesh::{Face, Mesh, Parts, Point};
use crate::space::Space;

/// Of a cell or dof in a part whose pressure is fixed.
const OPEN: u32 = u32::MAX;

/// The closed parts of a domain: on none of their faces does a condition prescribe a normal stress, so their
/// pressures are determined up to a constant each. They are numbered in the order of their first cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ClosedParts {
    of_cell: Vec<u32>,
    of_dof: Vec<u32>,
    cells: Vec<u32>,
    last: Vec<usize>,
    /// A place in each part, for messages; empty where the domain is connected.
    places: Vec<Point>,
}

impl ClosedParts {
    /// No part is closed, or there is no such pressure.
    pub const NONE: &'static Self =
        &Self { of_cell: Vec::new(), of_dof: Vec::new(), cells: Vec::new(), last: Vec::new(), places: Vec::new() };

    /// The closed parts under conditions by boundary tag, for a continuous pressure.
    pub fn new(pressure: &Space, conditions: &[Conditions]) -> Self {
        Self::without(pressure, |face| face.tag.is_some_and(|tag| conditions[tag].velocity.fixes_pressure()))
    }

    /// The parts that have no face of a kind, for any scalar space.
    pub fn without(space: &Space, is_open: impl Fn(&Face) -> bool) -> Self {
        let mesh = &space.mesh;
        let parts = mesh.parts();
        let mut open = vec![false; parts.count];
        for face in mesh.faces.iter() {
            if face.plus.is_none() && is_open(face) {
                open[parts.of_cell[face.minus.cell]] = true;
            }
        }
        let mut number = vec![OPEN; parts.count];
        let mut count = 0;
        for (number, _) in number.iter_mut().zip(&open).filter(|(_, open)| !**open) {
            *number = count;
            count += 1;
        }
        Self::numbered(space, &parts, &number, count as usize)
    }

    fn numbered(space: &Space, parts: &Parts, number: &[u32], count: usize) -> Self {
        let of_cell: Vec<u32> = parts.of_cell.iter().map(|&part| number[part]).collect();
        let mut of_dof = vec![OPEN; space.dof_count()];
        for (cell, &part) in of_cell.iter().enumerate() {
            (0..space.n).for_each(|i| of_dof[space.dof(cell, 0, i)] = part);
        }
        let cells: Vec<u32> = (0..of_cell.len() as u32).filter(|&cell| of_cell[cell as usize] != OPEN).collect();
        let last = (0..count as u32).map(|part| of_dof.iter().rposition(|&p| p == part).expect("a part has a dof"));
        let first = |part| parts.of_cell.iter().position(|&p| number[p] == part).expect("a part has a cell");
        let places = match parts.count {
            1 => Vec::new(),
            _ => (0..count as u32).map(|part| space.mesh.centroid(first(part))).collect(),
        };
        let last = last.collect();
        Self { of_cell, of_dof, cells, last, places }
    }

    pub fn count(&self) -> usize {
        self.last.len()
    }

    /// Cells of closed parts, ascending.
    pub fn cells(&self) -> &[u32] {
        &self.cells
    }

    /// The closed part of a cell.
    pub fn of_cell(&self, cell: usize) -> Option<usize> {
        self.of_cell.get(cell).filter(|&&part| part != OPEN).map(|&part| part as usize)
    }

    /// The last pressure dof of each part.
    pub fn last(&self) -> &[usize] {
        &self.last
    }

    /// Sums over the pressure dofs of each part.
    pub fn sums(&self, values: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.count()];
        for (value, &part) in values.iter().zip(&self.of_dof) {
            if part != OPEN {
                sums[part as usize] += value;
            }
        }
        sums
    }

    /// Takes `shifts[part] · weight` off the values of each part, which has a weight for every dof.
    pub fn shift(&self, values: &mut [f64], shifts: &[f64], weight: impl Fn(usize) -> f64) {
        for (dof, (value, &part)) in values.iter_mut().zip(&self.of_dof).enumerate() {
            if part != OPEN {
                *value -= shifts[part as usize] * weight(dof);
            }
        }
    }

    /// Takes the mean `Σ w x / Σ w` off the values of each part.
    pub fn take_off_means(&self, values: &mut [f64], weights: &[f64]) {
        let weighted: Vec<f64> = values.iter().zip(weights).map(|(x, w)| w * x).collect();
        let means = self.sums(&weighted).into_iter().zip(self.sums(weights)).map(|(sum, weight)| sum / weight);
        self.shift(values, &means.collect::<Vec<_>>(), |_| 1.0);
    }

    /// Says which part is meant, where there are several.
    pub fn shown(&self, part: usize) -> String {
        self.places.get(part).map_or(String::new(), |x| format!(" of the part of the mesh at ({:.4}, {:.4})", x.x, x.y))
    }
}

/// The connected part of every node of a continuous space.
pub(crate) fn part_of_nodes(mesh: &Mesh, space: &Space, parts: &Parts) -> Vec<usize> {
    let mut of_node = vec![0; space.node_count];
    for cell in 0..mesh.cells.len() {
        space.cell_nodes(cell).iter().for_each(|&node| of_node[node as usize] = parts.of_cell[cell]);
    }
    of_node
}
