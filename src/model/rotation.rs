//! What a rigid rotation costs where slip walls leave it free.

use std::sync::Arc;

use super::boundary::Conditions;
use super::momentum::{SlipTreatment, tagged};
use crate::form::{Faces, Integrator, mass, stokes};
use crate::mesh::{Curve, Mesh, Point};
use crate::solve::dot;
use crate::solve::sparse::{Factored, Matrix};
use crate::space::Space;

/// Circles whose centres differ by less than this share of their radius have one centre.
const CONCENTRIC: f64 = 1e-9;

/// The common centre of circles that are the whole boundary, all of them with slip: the tissue can rotate about it as
/// a rigid body.
pub fn free_centre(mesh: &Mesh, conditions: &[Conditions]) -> Option<Point> {
    let mut found: Option<Point> = None;
    for face in mesh.faces.iter().filter(|face| face.plus.is_none()) {
        let slips = conditions[face.tag?].velocity.slips_freely();
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
    let (turned, count) = (rotation_of(mesh, velocity, centre), velocity.dof_count());
    let quadratic = |triplets: &[(usize, usize, f64)]| Matrix::from_triplets(count, count, triplets).quadratic(&turned);
    let viscous = quadratic(&loops.triplets(&stokes::viscosity(velocity), velocity, velocity));
    viscous / quadratic(&loops.triplets(&mass::vector_mass(velocity), velocity, velocity))
}

/// The interpolant of `(x − centre)^⊥`.
fn rotation_of(mesh: &Mesh, velocity: &Space, centre: Point) -> Vec<f64> {
    let positions = velocity.node_positions();
    let mut turned = vec![0.0; velocity.dof_count()];
    for (cell, i) in (0..mesh.cells.len()).flat_map(|cell| (0..velocity.n).map(move |i| (cell, i))) {
        let x = positions[velocity.node(cell, i)] - centre;
        turned[velocity.dof(cell, 0, i)] = -x.y;
        turned[velocity.dof(cell, 1, i)] = x.x;
    }
    turned
}

/// How fast a force that friction alone would balance at the speed 1 turns velocities whose slip is imposed by penalty.
/// Nothing asks them to be free of divergence, so those of the flow turn no faster. `None` where it cannot be told.
fn turning_by_penalty(
    mesh: &Arc<Mesh>,
    velocity: &Space,
    centre: Point,
    friction: f64,
    (slip, epsilon): (Faces, f64),
) -> Option<f64> {
    let loops = Integrator::new(mesh);
    let (turned, count) = (rotation_of(mesh, velocity, centre), velocity.dof_count());
    let matrix = |form| Matrix::from_triplets(count, count, &loops.triplets(&form, velocity, velocity));
    let held = stokes::viscosity(velocity) + stokes::slip_penalty(velocity, slip, epsilon * mesh.area().sqrt());
    let held = matrix(held + friction * mass::vector_mass(velocity));
    let weighed = matrix(mass::vector_mass(velocity)).times(&turned);
    let force: Vec<f64> = weighed.iter().map(|v| friction * v).collect();
    let v = Factored::new("rotation", held).ok()?.solve(&force).ok()?;
    Some(dot(&weighed, &v) / dot(&weighed, &turned))
}

/// What to say about a rotation that costs more than a thousandth of the friction.
pub fn remark(
    mesh: &Arc<Mesh>,
    velocity: &Space,
    conditions: &[Conditions],
    friction: f64,
    slip: SlipTreatment,
) -> Option<String> {
    let centre = free_centre(mesh, conditions)?;
    let drag = drag(mesh, velocity, centre);
    let degree = velocity.degree;
    let hint = format!("take `mesh.curved` = {}, or `space.k` larger", degree.min(3));
    if let (SlipTreatment::Penalty { epsilon }, true) = (slip, drag > 0.0) {
        let faces = tagged(conditions, |c| c.slips_freely());
        let share = turning_by_penalty(mesh, velocity, centre, friction, (faces, epsilon))?;
        return (share < 0.999).then(|| {
            format!(
                "the tissue can rotate as a whole about ({:.3}, {:.3}), and velocities of degree {degree} do not turn \
                 rigidly along walls of cells of a higher degree, to which `space.penalty` = {epsilon:.0e} holds them: what \
                 should turn with the speed 1 turns with {share:.1e} at most; hint: {hint}",
                centre.x, centre.y
            )
        });
    }
    (drag > 1e-3 * friction).then(|| {
        let share = friction / (friction + drag);
        format!(
            "the tissue can rotate as a whole about ({:.3}, {:.3}), and velocities of degree {degree} do not turn \
             rigidly in cells of a higher degree: that costs as much as a friction of {drag:.1e} beside {friction:.1e}, \
             and what should turn with the speed 1 turns with {share:.3}; hint: {hint}",
            centre.x, centre.y
        )
    })
}
