//! Bodies that stand in walls: what is prescribed of the fluid there, a body that covers it does as well.
//!
//! Where the boundary of a body meets a wall, the fluid has the velocity of both. Any difference would take an
//! unbounded power, so that a body on a wall at rest rests, and one on a wall that slides goes along. What would change
//! the volume of a closed part of the fluid is left to the fluid, which keeps it: a plug goes with what comes in.

use nalgebra::{DMatrix, DVector, Dyn, SVD, Vector3};

use super::domain::{CLOSED, Domain};
use crate::body::{Body, Hold};
use crate::element::basis;
use crate::mesh::Point;
use crate::model::immersed::Ground;
use crate::model::immersed::kernel::prescribed_directions;
use crate::model::immersed::penalty::BodyError;
use crate::shape::rigid_motion;

/// Singular values below this, relative to the largest one, are zero.
const RANK: f64 = 1e-9;
/// A unit motion that differs by less from others is one of them.
const SAME: f64 = 1e-6;
/// Largest misfit of prescribed velocities, relative to the largest one, that counts as rounding.
const MISFIT: f64 = 1e-7;

/// What walls prescribe of the motion of a body.
#[derive(Debug, Clone)]
pub(super) struct Wall {
    body: String,
    /// Nodes of the wall in the body, and directions in which their velocity is prescribed; `None` for a pin.
    nodes: Vec<Option<(usize, Point)>>,
    /// `d·w_k` of the motions `w_k` there, rotations in units of the distance `reach`; padded to three rows.
    matrix: DMatrix<f64>,
    svd: SVD<f64, Dyn, Dyn>,
    reach: f64,
    /// Orthonormal motions, in the same units, that walls leave to the fluid.
    left: Vec<Vector3<f64>>,
}

/// The walls that every body stands in.
pub(super) fn walls(ground: Ground, domain: &Domain, bodies: &[Body], positions: &[Point]) -> Vec<Option<Wall>> {
    let nodes = nodes_in_bodies(ground, domain, bodies.len(), positions);
    let wall = |((body, nodes), index): ((&Body, Vec<usize>), usize)| {
        let pose = domain.poses[index];
        let pin = match &body.hold {
            Hold::Pinned(point) => Some(pose.to_space(*point)),
            Hold::Free | Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => None,
        };
        let directions = |node: usize| prescribed_directions(ground.frames, node).unwrap_or_default();
        let along = |node| directions(node).into_iter().map(move |d| (Some((node, d)), positions[node], d));
        let mut rows: Vec<_> = nodes.into_iter().flat_map(along).collect();
        if rows.is_empty() {
            return None;
        }
        rows.extend(pin.into_iter().flat_map(|x| [Point::x(), Point::y()].map(|d| (None, x, d))));
        let reach = rows.iter().map(|(_, x, _)| (x - pose.position).norm()).fold(f64::MIN_POSITIVE, f64::max);
        let motion = |k: usize, x: Point| rigid_motion(k, pose.position, x) / if k == 2 { reach } else { 1.0 };
        let mut matrix = DMatrix::zeros(rows.len().max(3), 3);
        for (i, (_, x, d)) in rows.iter().enumerate() {
            (0..3).for_each(|k| matrix[(i, k)] = motion(k, *x).dot(d));
        }
        let nodes = rows.into_iter().map(|(node, ..)| node).collect();
        let svd = matrix.clone().svd(true, true);
        let volumes = if pin.is_some() { Vec::new() } else { domain.closed_passages(index) };
        let left = left_motions(&svd, volumes.into_iter().map(|[x, y, spin]| Vector3::new(x, y, spin / reach)));
        Some(Wall { body: body.name.clone(), nodes, svd, matrix, reach, left })
    };
    bodies.iter().zip(nodes).zip(0..).map(wall).collect()
}

/// An orthonormal basis of the motions that nothing prescribes, and of those that change volumes.
fn left_motions(prescribed: &SVD<f64, Dyn, Dyn>, volumes: impl Iterator<Item = Vector3<f64>>) -> Vec<Vector3<f64>> {
    let right = prescribed.v_t.as_ref().expect("it was asked for");
    let bound = RANK * prescribed.singular_values.max();
    let free = (0..3).filter(|&k| prescribed.singular_values[k] <= bound);
    let free = free.map(|k| Vector3::new(right[(k, 0)], right[(k, 1)], right[(k, 2)]));
    let mut basis: Vec<Vector3<f64>> = Vec::new();
    for motion in free.chain(volumes.filter_map(|volume| volume.try_normalize(0.0))) {
        let apart = |motion: Vector3<f64>| basis.iter().fold(motion, |rest, known| rest - known * known.dot(&rest));
        // twice is enough (Kahan)
        let rest = apart(apart(motion));
        if rest.norm() > SAME {
            basis.push(rest.normalize());
        }
    }
    basis
}

/// Nodes of the boundary that lie deep in a body, by body; one that touches a wall is free to leave it.
fn nodes_in_bodies(ground: Ground, domain: &Domain, bodies: usize, positions: &[Point]) -> Vec<Vec<usize>> {
    let (space, mut found) = (ground.velocity, vec![Vec::new(); bodies]);
    for face in space.mesh.faces.iter().filter(|face| face.plus.is_none()) {
        let cell = face.minus.cell;
        let depth = CLOSED * (2.0 * space.mesh.cell_area(cell)).sqrt();
        for body in domain.cover.bodies_of_cell(cell) {
            let placed = domain.cover.body(body);
            let nodes = basis::face_nodes(space.degree, face.minus.face).into_iter().map(|i| space.node(cell, i));
            found[body].extend(nodes.filter(|&node| placed.signed_distance(positions[node]).0 < -depth));
        }
    }
    for nodes in &mut found {
        nodes.sort_unstable();
        nodes.dedup();
    }
    found
}

impl Wall {
    /// Independent motions that they leave to the fluid.
    pub fn free_motions(&self) -> Vec<[f64; 3]> {
        self.left.iter().map(|motion| self.unscaled(*motion)).collect()
    }

    /// What the velocities that are prescribed make of the motion, less what is left to the fluid.
    ///
    /// # Errors
    /// Velocities that no rigid motion has.
    pub fn motion(&self, prescribed: &[f64]) -> Result<[f64; 3], BodyError> {
        let targets = self.targets(prescribed);
        let largest = targets.amax();
        if largest == 0.0 {
            return Ok([0.0; 3]);
        }
        let motion = self.svd.solve(&targets, RANK * self.svd.singular_values.max()).expect("both factors are there");
        let misfit = (&self.matrix * &motion - targets).amax() / largest;
        if misfit > MISFIT {
            return Err(BodyError::Wall { body: self.body.clone(), misfit });
        }
        let motion = Vector3::new(motion[0], motion[1], motion[2]);
        Ok(self.unscaled(self.left.iter().fold(motion, |rest, left| rest - left * left.dot(&motion))))
    }

    /// Whether a body may move so.
    ///
    /// # Errors
    /// A motion with other velocities than those that are prescribed.
    pub fn check(&self, [x, y, spin]: [f64; 3], prescribed: &[f64]) -> Result<(), BodyError> {
        let targets = self.targets(prescribed);
        let velocities = &self.matrix * DVector::from_vec(vec![x, y, spin * self.reach]);
        let misfit = (&velocities - &targets).amax();
        if misfit > MISFIT * velocities.amax().max(targets.amax()) {
            return Err(BodyError::Contradiction { body: self.body.clone(), misfit });
        }
        Ok(())
    }

    fn targets(&self, prescribed: &[f64]) -> DVector<f64> {
        let value = |(node, d): (usize, Point)| d.dot(&Point::new(prescribed[2 * node], prescribed[2 * node + 1]));
        let mut targets = DVector::zeros(self.matrix.nrows());
        self.nodes.iter().zip(targets.iter_mut()).for_each(|(node, target)| *target = node.map_or(0.0, value));
        targets
    }

    fn unscaled(&self, motion: Vector3<f64>) -> [f64; 3] {
        [motion.x, motion.y, motion.z / self.reach]
    }
}
