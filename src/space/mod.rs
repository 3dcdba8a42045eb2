//! Continuous and discontinuous Lagrange spaces on a mesh, and the fields that live in them.
//!
//! A space of `c` components numbers its dofs as `node·c + component` when it is continuous, and as
//! `(cell·c + component)·n + node` when it is discontinuous: all unknowns of one cell then form one block.

pub mod field;
pub mod project;
pub mod skeleton;

use std::collections::HashMap;
use std::sync::Arc;

use crate::element::{MAX_DEGREE, basis};
use crate::mesh::{Mesh, Point};

pub use field::Field;
pub use skeleton::{Skeleton, Traces};

/// Whether functions of a space are continuous across faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Continuity {
    /// Cells share the nodes on common faces and vertices.
    Continuous,
    /// Every cell has nodes of its own.
    Discontinuous,
}

/// A Lagrange space of degree 1 to 5 with one to three components.
#[derive(Debug, Clone)]
pub struct Space {
    /// What it stands on.
    pub mesh: Arc<Mesh>,
    /// Whether cells share nodes.
    pub continuity: Continuity,
    /// Polynomial degree on a cell.
    pub degree: usize,
    /// 1 of a scalar, 2 of a vector, 3 of a symmetric tensor.
    pub components: usize,
    /// Basis functions of one component on one cell.
    pub n: usize,
    /// Scalar nodes in total.
    pub node_count: usize,
    /// Global node of each local node, cell after cell; empty when discontinuous.
    nodes: Vec<u32>,
}

impl Space {
    /// The space of the given kind.
    ///
    /// # Panics
    /// For a degree outside 1 to [`MAX_DEGREE`] or components other than 1 to 3: the scene is checked before.
    pub fn new(mesh: &Arc<Mesh>, continuity: Continuity, degree: usize, components: usize) -> Self {
        assert!((1..=MAX_DEGREE).contains(&degree) && (1..=3).contains(&components));
        let n = basis::node_count(degree);
        let (nodes, node_count) = match continuity {
            Continuity::Continuous => number_nodes(mesh, degree),
            Continuity::Discontinuous => (Vec::new(), mesh.cells.len() * n),
        };
        Self { mesh: mesh.clone(), continuity, degree, components, n, node_count, nodes }
    }

    /// Number of unknowns.
    pub fn dof_count(&self) -> usize {
        self.node_count * self.components
    }

    /// Unknowns of one cell: `components · n`.
    pub fn cell_dof_count(&self) -> usize {
        self.components * self.n
    }

    /// Global node number of local node `i` of `cell`.
    pub fn node(&self, cell: usize, i: usize) -> usize {
        match self.continuity {
            Continuity::Continuous => self.nodes[cell * self.n + i] as usize,
            Continuity::Discontinuous => cell * self.n + i,
        }
    }

    /// Global nodes of `cell` in a continuous space; empty otherwise.
    pub fn cell_nodes(&self, cell: usize) -> &[u32] {
        match self.continuity {
            Continuity::Continuous => &self.nodes[cell * self.n..(cell + 1) * self.n],
            Continuity::Discontinuous => &[],
        }
    }

    /// Global dof of component `c` at local node `i` of `cell`.
    pub fn dof(&self, cell: usize, c: usize, i: usize) -> usize {
        match self.continuity {
            Continuity::Continuous => self.nodes[cell * self.n + i] as usize * self.components + c,
            Continuity::Discontinuous => (cell * self.components + c) * self.n + i,
        }
    }

    /// Coefficients of a member cell by cell, component by component on each.
    pub fn by_cell(&self, values: &[f64]) -> Vec<f64> {
        let m = self.cell_dof_count();
        let mut local = vec![0.0; self.mesh.cells.len() * m];
        for (cell, local) in local.chunks_exact_mut(m).enumerate() {
            for (k, value) in local.iter_mut().enumerate() {
                *value = values[self.dof(cell, k / self.n, k % self.n)];
            }
        }
        local
    }

    /// A functional from its parts cell by cell, added in the order of the cells.
    pub fn assembled(&self, local: &[f64]) -> Vec<f64> {
        let m = self.cell_dof_count();
        let mut global = vec![0.0; self.dof_count()];
        for (cell, local) in local.chunks_exact(m).enumerate() {
            for (k, value) in local.iter().enumerate() {
                global[self.dof(cell, k / self.n, k % self.n)] += value;
            }
        }
        global
    }

    /// Positions of all nodes, by node number.
    pub fn node_positions(&self) -> Vec<Point> {
        let mut positions = vec![Point::zeros(); self.node_count];
        let reference = basis::nodes(self.degree);
        for cell in 0..self.mesh.cells.len() {
            let map = self.mesh.map(cell);
            for (i, &xi) in reference.iter().enumerate() {
                positions[self.node(cell, i)] = map.at(xi).0;
            }
        }
        positions
    }
}

/// Numbers vertex nodes first, then those inside faces, then those inside cells.
fn number_nodes(mesh: &Mesh, degree: usize) -> (Vec<u32>, usize) {
    let n = basis::node_count(degree);
    let on_face = degree - 1;
    let inside = n - 3 - 3 * on_face;
    let mut used: HashMap<usize, usize> = HashMap::new();
    let mut vertex_node = |v: usize| {
        let next = used.len();
        *used.entry(v).or_insert(next)
    };
    let corners: Vec<[usize; 3]> = mesh.cells.iter().map(|cell| cell.map(&mut vertex_node)).collect();
    let first_face = used.len();
    let first_inside = first_face + mesh.faces.len() * on_face;
    let mut nodes = vec![0_u32; mesh.cells.len() * n];
    for (cell, own) in nodes.chunks_mut(n).enumerate() {
        for (slot, corner) in own.iter_mut().zip(corners[cell]) {
            *slot = corner as u32;
        }
        for local in 0..3 {
            let number = mesh.cell_faces[cell][local];
            let forward = mesh.faces[number].minus.cell == cell && mesh.faces[number].minus.face == local;
            for (k, &node) in basis::face_nodes(degree, local)[1..degree].iter().enumerate() {
                let along = if forward { k } else { on_face - 1 - k };
                own[node] = (first_face + number * on_face + along) as u32;
            }
        }
        for k in 0..inside {
            own[3 + 3 * on_face + k] = (first_inside + cell * inside + k) as u32;
        }
    }
    (nodes, first_inside + mesh.cells.len() * inside)
}
