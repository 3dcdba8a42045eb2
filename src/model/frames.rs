//! Velocity conditions at nodes: every node has an orthonormal frame whose directions are free or prescribed.
//!
//! Walls prescribe the direction of the exact normal, `no-tangential` the tangent, Dirichlet both. The unknowns of a
//! node are its components along the free directions, so that `v = T û + v_D` and the reduced matrix `Tᵀ K T` stays
//! symmetric.
//!
//! On curved walls `w·n` is not zero between the nodes, and the consistency error is `∫ (n·σ·n)(w·n)`. To lowest order
//! `w·n` on an edge is a polynomial of degree q+1 that vanishes where the condition is imposed. At Gauss–Lobatto points
//! its integral is zero; at evenly spaced ones it is not from `q = 3` on, and the pressure would be of order one near
//! the wall. So for `q ≥ 3` the unknowns inside a curved edge are components at its Lobatto points, from which the
//! nodes take their values by interpolation along the edge.

mod corners;

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{Matrix2, Matrix2x3, Matrix3};

use self::corners::Piece;
use super::boundary::{Conditions, Held};
use super::closed::part_of_nodes;
use crate::element::{basis, lobatto, quadrature};
use crate::expression::ExpressionError;
use crate::mesh::{CellMap, Curve, Face, Mesh, Point};
use crate::solve::sparse::Matrix;
use crate::space::Space;

/// Normals that differ by less than this angle (radians) at a node are averaged; beyond, the node is a corner.
const CORNER: f64 = 0.6;

/// Where the conditions of slip walls hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WallPoints {
    /// At the nodes: every node has a frame of its own.
    Nodes,
    /// At the nodes, but from degree 3 on at the Lobatto points of curved edges.
    Lobatto,
    /// Nowhere: a form [10.3] takes care of `v·n = 0`.
    Penalty,
}

/// What is prescribed of a node.
enum Constraint {
    /// Zero along a direction.
    Along(Point),
    /// Zero.
    Rest,
    /// The velocity that follows from the faces there, at least one of them Dirichlet.
    Value(Vec<Piece>),
}

/// Frames and numbering of the velocity unknowns.
#[derive(Debug)]
pub struct Frames {
    /// Number of free unknowns.
    pub free: usize,
    /// `(free unknown, coefficient)` of all velocity dofs, one after the other.
    entries: Vec<(usize, f64)>,
    /// Where the entries of every dof begin, and where the last one's end.
    starts: Vec<usize>,
    /// Per node, the unknowns that are its own.
    owned: Vec<Range<usize>>,
    /// Nodes with a Dirichlet value: node, position, the faces there.
    values: Vec<(usize, Point, Vec<Piece>)>,
    /// Nodes inside curved edges, and what they take of the values at both ends: node, end, weight.
    inside: Vec<(usize, usize, f64)>,
}

/// Components of a node along its free directions: unknown, direction.
type Nodal = Vec<(usize, Point)>;

impl Frames {
    /// Reads the conditions of every boundary tag.
    pub fn new(space: &Space, conditions: &[Conditions], walls: WallPoints) -> Self {
        let (constraints, bent) = collect(space, conditions, walls);
        let (mut nodal, mut owned, mut values, mut free) = (Vec::new(), Vec::new(), Vec::new(), 0);
        for (node, position) in space.node_positions().into_iter().enumerate() {
            let directions = match constraints.get(&node) {
                None => vec![Point::x(), Point::y()],
                Some(Constraint::Value(pieces)) => {
                    values.push((node, position, pieces.clone()));
                    Vec::new()
                }
                Some(Constraint::Rest) => Vec::new(),
                Some(Constraint::Along(n)) => vec![Point::new(-n.y, n.x)],
            };
            owned.push(free..free + directions.len());
            nodal.push((free..).zip(directions).collect::<Nodal>());
            free = owned[node].end;
        }
        let (nodal, inside) = spread(nodal, &bent, space.degree);
        let (mut entries, mut starts) = (Vec::new(), vec![0]);
        for node in &nodal {
            for c in 0..2 {
                entries.extend(node.iter().map(|(unknown, d)| (*unknown, d[c])).filter(|(_, a)| *a != 0.0));
                starts.push(entries.len());
            }
        }
        Self { free, entries, starts, owned, values, inside }
    }

    /// The unknowns that belong to `node` alone: its own components, or those at its Lobatto point.
    pub fn owned(&self, node: usize) -> Range<usize> {
        self.owned[node].clone()
    }

    /// The free unknowns that a velocity dof is made of, with their coefficients.
    pub fn of(&self, dof: usize) -> impl Iterator<Item = (usize, f64)> {
        self.entries[self.starts[dof]..self.starts[dof + 1]].iter().copied()
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
        let mut out = vec![0.0; self.starts.len() - 1];
        for (node, x, pieces) in &self.values {
            let v = corners::velocity(pieces, conditions, *x, t)?;
            out[2 * node..2 * node + 2].copy_from_slice(&[v.x, v.y]);
        }
        for &(node, end, weight) in &self.inside {
            for c in 0..2 {
                out[2 * node + c] += weight * out[2 * end + c];
            }
        }
        Ok(out)
    }

    /// The first connected part whose rigid motions, translations and the rotation, or a combination of them (the
    /// rotation about the centre of a disc), the conditions at the [`WallPoints::Nodes`] do not all hold: as messages
    /// name it, empty where the mesh is connected.
    pub fn free_part(&self, space: &Space) -> Option<String> {
        let parts = space.mesh.parts();
        let part_of = part_of_nodes(&space.mesh, space, &parts);
        let positions = space.node_positions();
        (0..parts.count).find_map(|part| {
            let nodes: Vec<usize> = (0..positions.len()).filter(|&node| part_of[node] == part).collect();
            let centre = nodes.iter().map(|&node| positions[node]).sum::<Point>() / nodes.len() as f64;
            let place = if parts.count == 1 {
                String::new()
            } else {
                format!(" of the part of the mesh around ({:.4}, {:.4})", centre.x, centre.y)
            };
            (!self.hold_rigid_motions(&nodes, &positions, centre)).then_some(place)
        })
    }

    /// Whether the conditions at some nodes leave no rigid motion of them free.
    fn hold_rigid_motions(&self, nodes: &[usize], positions: &[Point], centre: Point) -> bool {
        let size = nodes.iter().map(|&node| (positions[node] - centre).norm()).fold(0.0, f64::max);
        // G = Σ over nodes of Rᵀ(1 − T Tᵀ)R, R the three motions at the node: zero along a motion that meets no
        // constraint
        let mut gram = Matrix3::zeros();
        for &node in nodes {
            let y = (positions[node] - centre) / size;
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

/// Replaces the unknowns inside curved edges by those at the Lobatto points; also returns what these nodes take of the
/// values at the ends.
fn spread(mut nodal: Vec<Nodal>, bent: &[Vec<usize>], degree: usize) -> (Vec<Nodal>, Vec<(usize, usize, f64)>) {
    let mut inside = Vec::new();
    for edge in bent {
        let rows: Vec<Nodal> = (1..degree)
            .map(|k| {
                let weights = lobatto::weights(degree, k as f64 / degree as f64);
                inside.extend([0, degree].map(|end| (edge[k], edge[end], weights[end])));
                let parts = edge.iter().zip(&weights);
                parts.flat_map(|(&node, &w)| nodal[node].iter().map(move |(unknown, d)| (*unknown, d * w))).collect()
            })
            .collect();
        for (row, &node) in rows.into_iter().zip(&edge[1..]) {
            nodal[node] = row;
        }
    }
    (nodal, inside)
}

/// What the boundary faces ask of each node, and the nodes of the curved edges whose inner unknowns lie at Lobatto
/// points.
fn collect(
    space: &Space,
    conditions: &[Conditions],
    walls: WallPoints,
) -> (BTreeMap<usize, Constraint>, Vec<Vec<usize>>) {
    let mut pieces: BTreeMap<usize, Vec<Piece>> = BTreeMap::new();
    let mut bent = Vec::new();
    for face in space.mesh.faces.iter() {
        let Some(tag) = face.tag else { continue };
        let curved = face.curve.is_some() || matches!(space.mesh.map(face.minus.cell), CellMap::Isoparametric(_));
        let locals = basis::face_nodes(space.degree, face.minus.face);
        let slips = match conditions[tag].velocity.holds() {
            Held::Normal => walls != WallPoints::Penalty,
            Held::Tangent => true,
            Held::Both | Held::Nothing => false,
        };
        let at_lobatto = slips && curved && space.degree > 2 && walls == WallPoints::Lobatto;
        if at_lobatto {
            bent.push(locals.iter().map(|&local| space.node(face.minus.cell, local)).collect());
        }
        let even = |k: usize| k as f64 / space.degree as f64;
        let points = if at_lobatto { lobatto::points(space.degree) } else { (0..=space.degree).map(even).collect() };
        let [a, b] = space.mesh.face_vertices(face).map(|v| space.mesh.vertices[v]);
        for (local, s) in locals.into_iter().zip(points) {
            let normal = match conditions[tag].velocity.holds() {
                Held::Both => mean_normal(space, face, local),
                Held::Normal | Held::Tangent | Held::Nothing => node_normal(&space.mesh, face, s),
            };
            let piece = Piece { tag, normal, length: (b - a).norm() };
            pieces.entry(space.node(face.minus.cell, local)).or_default().push(piece);
        }
    }
    let all = pieces.into_iter().filter_map(|(node, pieces)| Some((node, constraint(pieces, conditions, walls)?)));
    (all.collect(), bent)
}

/// What the faces at a node ask of it.
fn constraint(pieces: Vec<Piece>, conditions: &[Conditions], walls: WallPoints) -> Option<Constraint> {
    let of = |piece: &Piece| conditions[piece.tag].velocity.holds();
    if pieces.iter().any(|piece| of(piece) == Held::Both) {
        return Some(Constraint::Value(pieces));
    }
    let (mut across, mut along) = (Vec::new(), Vec::new());
    for piece in &pieces {
        match of(piece) {
            Held::Normal if walls != WallPoints::Penalty => across.push(piece.normal * piece.length),
            Held::Tangent => along.push(Point::new(-piece.normal.y, piece.normal.x) * piece.length),
            Held::Normal | Held::Nothing | Held::Both => {}
        }
    }
    let all: Vec<Point> = across.iter().chain(&along).copied().collect();
    match (all.is_empty(), single(&all)) {
        (true, _) => None,
        (false, None) => Some(Constraint::Rest),
        // no wall may leak: its normal goes before the tangent of another face
        (false, Some(mean)) => Some(Constraint::Along(single(&across).unwrap_or(mean))),
    }
}

/// Unit normal at the share `s` of the way along a boundary face: of the exact curve where there is one, else of the
/// face.
fn node_normal(mesh: &Mesh, face: &Face, s: f64) -> Point {
    let map = mesh.map(face.minus.cell);
    let (x, jacobian) = map.at(basis::face_point(face.minus.face, s));
    let tangent = jacobian * basis::face_tangent(face.minus.face);
    let normal = Point::new(tangent.y, -tangent.x).normalize();
    match face.curve.map(|c| mesh.curves[c]) {
        Some(curve @ Curve::Circle { .. }) => curve.normal(x, normal),
        None => normal,
    }
}

/// `∫ φ n ds` of the shape function of a node on a face as it is meshed, as a unit vector.
fn mean_normal(space: &Space, face: &Face, local: usize) -> Point {
    let map = space.mesh.map(face.minus.cell);
    let scaled = |s: f64| {
        let tangent = map.at(basis::face_point(face.minus.face, s)).1 * basis::face_tangent(face.minus.face);
        Point::new(tangent.y, -tangent.x)
    };
    let CellMap::Isoparametric(nodes) = &map else { return scaled(0.5).normalize() };
    let rule = quadrature::interval(space.degree + nodes.degree);
    let shape = |s: f64| basis::values(space.degree, basis::face_point(face.minus.face, s)).nth(local).unwrap_or(0.0);
    let sum: Point = rule.points.iter().zip(&rule.weights).map(|(&s, w)| scaled(s) * (w * shape(s))).sum();
    sum.normalize()
}

/// The one direction that is prescribed, or `None` at a corner, where two independent ones fix the node, and without
/// any. The mean of directions is weighed by the lengths of their faces: what leaves through one enters through the
/// other.
fn single(directions: &[Point]) -> Option<Point> {
    let first = directions.first()?.normalize();
    let mut sum = Point::zeros();
    for d in directions {
        if first.perp(&d.normalize()).abs() > CORNER.sin() {
            return None;
        }
        sum += if first.dot(d) < 0.0 { -d } else { *d };
    }
    let mean = sum.normalize();
    // clean axis-aligned directions, so that mirrored scenes give mirrored bits
    Some(mean.map(|c| if c.abs() < 1e-14 { 0.0 } else { c }))
}
