//! All that the factors are made of, for one placement of the bodies.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::domain::Domain;
use super::elements::{Blocks, CutCell, GHOST, GhostFace, place_flow};
use super::twists::Twists;
use super::walls::walls;
use super::{Forms, gamma};
use crate::body::Body;
use crate::cut::{Class, Cover};
use crate::form::{ghost, mass, nitsche};
use crate::model::immersed::Ground;
use crate::model::immersed::penalty::BodyError;
use crate::model::momentum::MomentumError;
use crate::shape::Pose;
use crate::space::Space;

/// All but the factors.
pub(super) struct Prepared {
    pub domain: Domain,
    pub twists: Twists,
    pub blocks: Blocks,
    /// By unknown: whether some cell with fluid has it.
    pub used: Vec<bool>,
}

/// Blocks of a cell without its bodies: of the velocity, of `b(w,ξ)`, and `∫ ξ`.
type Flow = [Vec<f64>; 3];

/// Integrates over what the bodies leave of the cells that they cut; `blocks` has those of whole cells. `open` are the
/// faces whose conditions fix the pressure.
pub(super) fn prepare(
    ground: Ground,
    forms: Forms,
    cover: Arc<Cover>,
    bodies: &[Body],
    (poses, open): (&[Pose], &[usize]),
    mut blocks: Blocks,
) -> Result<Prepared, MomentumError> {
    let (velocity, pressure) = (ground.velocity, ground.pressure);
    let mut domain = Domain::new(cover, poses, (forms.loops, pressure), open);
    check_bodies(forms, &domain, bodies)?;
    let walls = walls(ground, &domain, bodies, &ground.velocity.node_positions());
    let twists = Twists::new(bodies, poses, walls);
    domain.settle_means(&twists);
    let flows = flows(ground, forms, &domain, &blocks);
    let with_bodies = |(cell, flow)| (cell, Arc::new(cut_cell(ground, forms, &domain, cell, flow)));
    blocks.cut = flows.into_iter().map(with_bodies).collect();
    for &face in &domain.ghosts {
        blocks.ghosts.entry(face).or_insert_with(|| Arc::new(ghost_face(ground, face)));
    }
    let first = ground.frames.free + pressure.dof_count();
    let mut used = vec![false; first];
    used.resize(first + twists.count(), true);
    for cell in (0..domain.active.len()).filter(|&cell| domain.active[cell]) {
        for k in 0..velocity.cell_dof_count() {
            let dof = velocity.dof(cell, k / velocity.n, k % velocity.n);
            ground.frames.of(dof).for_each(|(unknown, _)| used[unknown] = true);
        }
        (0..pressure.n).for_each(|k| used[ground.frames.free + pressure.dof(cell, 0, k)] = true);
    }
    Ok(Prepared { domain, twists, blocks, used })
}

/// Length along which a body touches fluid, relative to its size, that holds nothing but rounding.
const DRY: f64 = 1e-5;

/// Every body must touch fluid: one that touches it along less than a [`DRY`] of its size is gone.
fn check_bodies(forms: Forms, domain: &Domain, bodies: &[Body]) -> Result<(), BodyError> {
    let mut wet = vec![0.0; bodies.len()];
    for cell in domain.surface.cells() {
        for body in domain.surface.bodies_of_cell(cell) {
            forms.loops.each_outline_point(&domain.surface, (cell, body), 1, &mut |x| wet[body] += x.weight);
        }
    }
    let sizes = bodies.iter().map(|body| body.shape.circumradius());
    let Some(dry) = wet.iter().zip(sizes).position(|(wet, size)| *wet <= DRY * size) else { return Ok(()) };
    let body = bodies[dry].name.clone();
    let lies_outside = domain.active.contains(&true);
    Err(if lies_outside { BodyError::Outside { body, number: dry } } else { BodyError::Everything { body } })
}

/// The blocks of the active cells that bodies cut or touch.
fn flows(ground: Ground, forms: Forms, domain: &Domain, blocks: &Blocks) -> BTreeMap<usize, Flow> {
    let Ground { velocity, pressure, .. } = ground;
    let (nv, np) = (velocity.cell_dof_count(), pressure.n);
    let outside = forms.loops.outside(&domain.cover);
    let is_cut = |cell: &usize| domain.active[*cell] && matches!(domain.cover.cell(*cell), Class::Cut(_));
    let cut: Vec<usize> = domain.cover.touched().iter().copied().filter(is_cut).collect();
    let parts = forms.velocity.blocks_of(&outside, (velocity, pressure), &cut);
    let masses = outside.blocks_of(&mass::mass(pressure), (pressure, pressure), &cut);
    let mut flows = BTreeMap::new();
    for ((cell, (stiffness, divergence)), mass) in cut.into_iter().zip(parts).zip(masses) {
        let means = mass.chunks_exact(np).map(|row| row.iter().sum()).collect();
        flows.insert(cell, [stiffness, divergence, means]);
    }
    // whole cells along whose faces a boundary runs
    for cell in domain.surface.cells() {
        let of = |k: usize, size: usize| blocks.whole[k][cell * size..(cell + 1) * size].to_vec();
        flows.entry(cell).or_insert_with(|| [of(0, nv * nv), of(1, nv * np), of(2, np)]);
    }
    flows
}

/// Adds the boundaries of the bodies.
fn cut_cell(ground: Ground, forms: Forms, domain: &Domain, cell: usize, flow: Flow) -> CutCell {
    let Ground { velocity, pressure, .. } = ground;
    let [stiffness, divergence, means] = flow;
    let bodies = domain.surface.bodies_of_cell(cell);
    let (nv, np) = (velocity.cell_dof_count(), pressure.n);
    let first = nv + np;
    let size = first + 3 * bodies.len();
    let mut matrix = vec![0.0; size * size];
    place_flow(&stiffness, &divergence, (nv, np), size, &mut matrix);
    for (k, &body) in bodies.iter().enumerate() {
        let (centre, gamma) = (domain.poses[body].position, gamma(velocity.degree));
        let block = nitsche::block(forms.loops, (velocity, pressure), &domain.surface, (cell, body), centre, gamma);
        let place = |i: usize| if i < first { i } else { i + 3 * k };
        for (i, row) in block.chunks_exact(first + 3).enumerate() {
            row.iter().enumerate().for_each(|(j, value)| matrix[place(i) * size + place(j)] += value);
        }
    }
    CutCell { bodies, matrix, means }
}

fn ghost_face(ground: Ground, face: usize) -> GhostFace {
    let of = |space: &Space, weight: f64| -> Vec<f64> {
        let matrix = ghost::matrix(space, &space.mesh.faces[face]);
        matrix.iter().map(|value| weight * value).collect()
    };
    let h = ghost::width(&ground.velocity.mesh, &ground.velocity.mesh.faces[face]);
    GhostFace { velocity: of(ground.velocity, GHOST), pressure: of(ground.pressure, -GHOST * h * h) }
}
