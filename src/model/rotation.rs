//! What a rigid rotation costs where slip walls leave it free.

use std::sync::Arc;

use super::boundary::{Conditions, VelocityCondition};
use crate::form::{Density, Integrator, mass, stokes};
use crate::mesh::{Curve, Mesh, Point};
use crate::solve::sparse::Matrix;
use crate::space::Space;

/// Circles whose centres differ by less than this share of their radius have one centre.
const CONCENTRIC: f64 = 1e-9;

/// The common centre of circles that are the whole boundary, all of them with slip: the tissue can rotate about it as
/// a rigid body.
pub fn free_centre(mesh: &Mesh, conditions: &[Conditions]) -> Option<Point> {
    let mut found: Option<Point> = None;
    for face in mesh.faces.iter().filter(|face| face.plus.is_none()) {
        let slips = matches!(conditions[face.tag?].velocity, VelocityCondition::Slip);
        let Curve::Circle { centre, radius } = mesh.curves[face.curve?];
        if !slips || found.is_some_and(|other| (other - centre).norm() > CONCENTRIC * radius) {
            return None;
        }
        found.get_or_insert(centre);
    }
    found
}

/// `2‖D(I x^⊥)‖²/‖I x^⊥‖²` of the interpolated rotation about `centre`: the friction that it costs in cells of higher
/// degree than the velocities, in which a linear field is none of theirs. Zero, without a look, where all cells have
/// that degree at most.
pub fn drag(mesh: &Arc<Mesh>, velocity: &Space, centre: Point) -> f64 {
    if mesh.curved.iter().flatten().all(|nodes| nodes.degree <= velocity.degree) {
        return 0.0;
    }
    let loops = Integrator::new(mesh);
    let positions = velocity.node_positions();
    let count = velocity.dof_count();
    let mut turned = vec![0.0; count];
    for (cell, i) in (0..mesh.cells.len()).flat_map(|cell| (0..velocity.n).map(move |i| (cell, i))) {
        let x = positions[velocity.node(cell, i)] - centre;
        turned[velocity.dof(cell, 0, i)] = -x.y;
        turned[velocity.dof(cell, 1, i)] = x.x;
    }
    let quadratic = |triplets: &[(usize, usize, f64)]| Matrix::from_triplets(count, count, triplets).quadratic(&turned);
    let viscous = quadratic(&loops.triplets(&stokes::viscosity(velocity, Density::One), velocity, velocity));
    viscous / quadratic(&loops.triplets(&mass::vector_mass(velocity), velocity, velocity))
}

/// What to say about a rotation that costs more than a thousandth of the friction.
pub fn remark(mesh: &Arc<Mesh>, velocity: &Space, conditions: &[Conditions], friction: f64) -> Option<String> {
    let centre = free_centre(mesh, conditions)?;
    let drag = drag(mesh, velocity, centre);
    (drag > 1e-3 * friction).then(|| {
        let (share, degree) = (friction / (friction + drag), velocity.degree);
        format!(
            "the tissue can rotate as a whole about ({:.3}, {:.3}), and velocities of degree {degree} do not turn \
             rigidly in cells of a higher degree: that costs as much as a friction of {drag:.1e} beside {friction:.1e}, \
             and what should turn with the speed 1 turns with {share:.3}; hint: take `mesh.curved` = {}, or `space.k` larger",
            centre.x,
            centre.y,
            degree.min(3)
        )
    })
}
