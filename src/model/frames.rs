//! Velocity conditions at nodes: every node has an orthonormal frame whose directions are free or prescribed.
//!
//! Slip prescribes the direction of the exact normal, `no-tangential` the tangent, Dirichlet both. The unknowns of a node
//! are its components along the free directions, so that `v = T û + v_D` and the reduced matrix `Tᵀ K T` stays symmetric.

use std::collections::BTreeMap;

use nalgebra::{Matrix2, Matrix2x3, Matrix3};

use super::boundary::{Conditions, VelocityCondition};
use super::expression::{Expression, ExpressionError};
use crate::element::basis;
use crate::mesh::{Curve, Face, Mesh, Point};
use crate::solve::sparse::Matrix;
use crate::space::Space;

/// Normals that differ by less than this angle (radians) at a node are averaged; beyond, the node is a corner.
const CORNER: f64 = 0.6;

/// Prescribed value of a node: zero along `direction`, or both components.
enum Constraint {
    Directions(Vec<Point>),
    Value(usize),
}

/// Frames and numbering of the velocity unknowns.
#[derive(Debug)]
pub struct Frames {
    /// Number of free unknowns.
    pub free: usize,
    /// Per velocity dof: up to two `(free unknown, coefficient)`.
    entries: Vec<[Option<(usize, f64)>; 2]>,
    /// Nodes with a Dirichlet value: node, position, tag.
    values: Vec<(usize, Point, usize)>,
}

impl Frames {
    /// Reads the conditions of every boundary tag; `penalty` leaves slip to the form [10.3].
    pub fn new(space: &Space, conditions: &[Conditions], penalty: bool) -> Self {
        let constraints = collect(space, conditions, penalty);
        let positions = space.node_positions();
        let mut frames = Self { free: 0, entries: vec![[None, None]; space.dof_count()], values: Vec::new() };
        for (node, &position) in positions.iter().enumerate() {
            match constraints.get(&node) {
                None => {
                    frames.release(node, Point::x());
                    frames.release(node, Point::y());
                }
                Some(Constraint::Value(tag)) => frames.values.push((node, position, *tag)),
                Some(Constraint::Directions(directions)) => {
                    if let Some(fixed) = single(directions) {
                        frames.release(node, Point::new(-fixed.y, fixed.x));
                    }
                }
            }
        }
        frames
    }

    /// Gives `node` an unknown along `direction`.
    fn release(&mut self, node: usize, direction: Point) {
        for c in 0..2 {
            let slots = &mut self.entries[2 * node + c];
            let slot = usize::from(slots[0].is_some());
            if direction[c] != 0.0 {
                slots[slot] = Some((self.free, direction[c]));
            }
        }
        self.free += 1;
    }

    /// The free unknowns that a velocity dof is made of, with their coefficients.
    pub fn of(&self, dof: usize) -> impl Iterator<Item = (usize, f64)> {
        self.entries[dof].iter().flatten().copied()
    }

    /// `Tᵀ K T` as triplets.
    pub fn reduce(&self, k: &Matrix) -> Vec<(usize, usize, f64)> {
        let mut out = Vec::with_capacity(k.entries());
        for (i, j, value) in k.triplets() {
            for (row, a) in self.of(i) {
                out.extend(self.of(j).map(|(column, b)| (row, column, a * value * b)));
            }
        }
        out
    }

    /// `Tᵀ G` for a matrix with velocity rows, as triplets.
    pub fn reduce_rows(&self, g: &Matrix) -> Vec<(usize, usize, f64)> {
        let mut out = Vec::with_capacity(g.entries());
        for (i, j, value) in g.triplets() {
            out.extend(self.of(i).map(|(row, a)| (row, j, a * value)));
        }
        out
    }

    /// `Tᵀ f`.
    pub fn restrict(&self, f: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.free];
        for (dof, value) in f.iter().enumerate() {
            for (row, a) in self.of(dof) {
                out[row] += a * value;
            }
        }
        out
    }

    /// `T û + v_D`.
    pub fn expand(&self, free: &[f64], prescribed: &[f64]) -> Vec<f64> {
        let mut out = prescribed.to_vec();
        for (dof, value) in out.iter_mut().enumerate() {
            for (column, a) in self.of(dof) {
                *value += a * free[column];
            }
        }
        out
    }

    /// `v_D` at time `t`, zero at free nodes.
    ///
    /// # Errors
    /// A Dirichlet formula that is not finite at a node.
    pub fn prescribed(&self, conditions: &[Conditions], t: f64) -> Result<Vec<f64>, ExpressionError> {
        let mut out = vec![0.0; self.entries.len()];
        for &(node, x, tag) in &self.values {
            if let VelocityCondition::Dirichlet(value) = &conditions[tag].velocity {
                out[2 * node] = value[0].try_eval(x, t)?;
                out[2 * node + 1] = value[1].try_eval(x, t)?;
            }
        }
        Ok(out)
    }

    /// Whether the conditions leave no rigid motion free: translations and the rotation, or a combination of them (the
    /// rotation about the centre of a disc).
    pub fn hold_rigid_motions(&self, space: &Space) -> bool {
        let positions = space.node_positions();
        let centre = positions.iter().sum::<Point>() / positions.len() as f64;
        let size = positions.iter().map(|x| (x - centre).norm()).fold(0.0, f64::max);
        // G = Σ over nodes of Rᵀ(1 − T Tᵀ)R, R the three motions at the node: zero along a motion that meets no constraint
        let mut gram = Matrix3::zeros();
        for (node, x) in positions.iter().enumerate() {
            let y = (x - centre) / size;
            let motions = Matrix2x3::new(1.0, 0.0, -y.y, 0.0, 1.0, y.x);
            let mut free = Matrix2::zeros();
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                for (row, a) in self.of(2 * node + i) {
                    free[(i, j)] +=
                        self.of(2 * node + j).filter(|(other, _)| *other == row).map(|(_, b)| a * b).sum::<f64>();
                }
            }
            gram += motions.transpose() * (Matrix2::identity() - free) * motions;
        }
        let values = gram.symmetric_eigenvalues();
        values.min() > 1e-10 * values.max()
    }
}

/// What the boundary faces ask of each node. A Dirichlet tag wins over others; of two Dirichlet tags, one with values that
/// are not all zero wins over a wall at rest, else the first.
fn collect(space: &Space, conditions: &[Conditions], penalty: bool) -> BTreeMap<usize, Constraint> {
    let mesh = &space.mesh;
    let mut all: BTreeMap<usize, Constraint> = BTreeMap::new();
    for face in mesh.faces.iter() {
        let Some(tag) = face.tag else { continue };
        for local in basis::face_nodes(space.degree, face.minus.face) {
            let node = space.node(face.minus.cell, local);
            match &conditions[tag].velocity {
                VelocityCondition::Traction(_) => {}
                VelocityCondition::Slip if penalty => {}
                VelocityCondition::Dirichlet(value) => {
                    let at_rest = value.iter().all(Expression::is_zero);
                    let taken = matches!(all.get(&node), Some(Constraint::Value(_)));
                    if !(taken && at_rest) {
                        all.entry(node)
                            .and_modify(|c| {
                                let keep = matches!(c, Constraint::Value(other) if !moves_less(conditions, *other));
                                if !keep {
                                    *c = Constraint::Value(tag);
                                }
                            })
                            .or_insert(Constraint::Value(tag));
                    }
                }
                condition @ (VelocityCondition::Slip | VelocityCondition::NoTangential) => {
                    let normal = node_normal(mesh, face, space.degree, local);
                    let along = match condition {
                        VelocityCondition::NoTangential => Point::new(-normal.y, normal.x),
                        VelocityCondition::Slip | VelocityCondition::Dirichlet(_) | VelocityCondition::Traction(_) => {
                            normal
                        }
                    };
                    match all.entry(node).or_insert_with(|| Constraint::Directions(Vec::new())) {
                        Constraint::Directions(directions) => directions.push(along),
                        Constraint::Value(_) => {}
                    }
                }
            }
        }
    }
    all
}

/// Whether the Dirichlet value of `tag` is zero.
fn moves_less(conditions: &[Conditions], tag: usize) -> bool {
    match &conditions[tag].velocity {
        VelocityCondition::Dirichlet(value) => value.iter().all(Expression::is_zero),
        VelocityCondition::Traction(_) | VelocityCondition::Slip | VelocityCondition::NoTangential => true,
    }
}

/// Unit normal at a node of a boundary face: of the exact curve where there is one, else of the face.
fn node_normal(mesh: &Mesh, face: &Face, degree: usize, local: usize) -> Point {
    let map = mesh.map(face.minus.cell);
    let (x, jacobian) = map.at(basis::nodes(degree)[local]);
    let tangent = jacobian * basis::face_tangent(face.minus.face);
    let normal = Point::new(tangent.y, -tangent.x).normalize();
    match face.curve.map(|c| mesh.curves[c]) {
        Some(curve @ Curve::Circle { .. }) => curve.normal(x, normal),
        None => normal,
    }
}

/// The one direction that is prescribed, or `None` at a corner, where two independent ones fix the node.
fn single(directions: &[Point]) -> Option<Point> {
    let first = directions[0];
    let mut sum = Point::zeros();
    for d in directions {
        if first.perp(d).abs() > CORNER.sin() {
            return None;
        }
        sum += if first.dot(d) < 0.0 { -d } else { *d };
    }
    let mean = sum.normalize();
    // clean axis-aligned directions, so that mirrored scenes give mirrored bits
    Some(mean.map(|c| if c.abs() < 1e-14 { 0.0 } else { c }))
}
