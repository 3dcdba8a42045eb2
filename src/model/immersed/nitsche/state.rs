//! Bodies in a flow that is known: how it moves them, what is left of the balance, and what they take.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector};

use super::elements::Elements;
use super::{Nitsche, gamma};
use crate::body::guide::Rule;
use crate::form::nitsche;
use crate::form::traction::Outline;
use crate::mesh::Point;
use crate::model::immersed::Ground;
use crate::model::immersed::penalty::BodyError;
use crate::shape::{Twist, Wrench};
use crate::solve::dot;
use crate::space::Space;

/// A flow, and how the bodies move in it.
#[derive(Debug, Clone, Copy)]
pub(in crate::model) struct Moved<'f> {
    /// Coefficients of the velocity.
    pub v: &'f [f64],
    /// Coefficients of the pressure.
    pub pi: &'f [f64],
    /// One for each body.
    pub twists: &'f [Twist],
}

impl Moved<'_> {
    fn motions(&self) -> Vec<[f64; 3]> {
        self.twists.iter().map(|twist| [twist.velocity.x, twist.velocity.y, twist.spin]).collect()
    }
}

impl Nitsche {
    /// The boundaries of the bodies where they are.
    pub fn outline(&self) -> Outline<'_> {
        Outline { surface: &self.domain.surface, poses: &self.domain.poses }
    }

    /// The twists with which forces and torques on every body are in balance: those of the flow that was solved for
    /// under the same loads and rules, with the same velocities of walls.
    ///
    /// # Errors
    /// As [`Nitsche::solve`].
    pub(in crate::model) fn twists_in(
        &self,
        ground: Ground,
        (v, pi): (&[f64], &[f64]),
        prescribed: &[f64],
        loads: &[Wrench],
        rules: &[Rule],
    ) -> Result<Vec<Twist>, BodyError> {
        let given = self.twists.given(rules, prescribed)?;
        let [corners, pulls] = self.balances(ground, (v, pi));
        let twist = |body: usize| {
            let unknowns = (0..3).flat_map(|k| self.twists.of(body, k)).map(|(unknown, _)| unknown);
            let (first, end) = unknowns.fold((usize::MAX, 0), |(first, end), u| (first.min(u), end.max(u + 1)));
            let mut motion = given[body];
            if end > 0 {
                let mut basis = DMatrix::<f64>::zeros(3, end - first);
                (0..3).for_each(|k| self.twists.of(body, k).for_each(|(u, a)| basis[(k, u - first)] = a));
                let load = [loads[body].force.x, loads[body].force.y, loads[body].torque];
                let right = DVector::from_fn(3, |k, _| load[k] - pulls[body][k]);
                let corner = DMatrix::from_row_slice(3, 3, &corners[body]);
                let system = basis.tr_mul(&(corner * &basis));
                let solved = system.lu().solve(&basis.tr_mul(&right)).expect("a body in a fluid resists any motion");
                (&basis * solved).iter().zip(&mut motion).for_each(|(value, motion)| *motion += value);
            }
            Twist { velocity: Point::new(motion[0], motion[1]), spin: motion[2] }
        };
        Ok((0..given.len()).map(twist).collect())
    }

    /// Of the rows of every body: their product with its own motion, 3 × 3, and with the flow.
    fn balances(&self, ground: Ground, (v, pi): (&[f64], &[f64])) -> [Vec<Vec<f64>>; 2] {
        let count = self.domain.poses.len();
        let (mut corners, mut pulls) = (vec![vec![0.0; 9]; count], vec![vec![0.0; 3]; count]);
        for (corner, friction) in corners.iter_mut().zip(&self.friction) {
            (0..3).for_each(|k| corner[4 * k] = friction[k]);
        }
        for (&cell, cut) in &self.blocks.cut {
            let local = flow_in(ground, cell, (v, pi));
            let first = local.len();
            let size = first + 3 * cut.bodies.len();
            for (place, &body) in cut.bodies.iter().enumerate() {
                for k in 0..3 {
                    let row = &cut.matrix[(first + 3 * place + k) * size..][..size];
                    pulls[body][k] += dot(&row[..first], &local);
                    let own = &row[first + 3 * place..][..3];
                    own.iter().enumerate().for_each(|(j, value)| corners[body][3 * k + j] += value);
                }
            }
        }
        [corners, pulls]
    }

    /// What is left of the balance of momentum and of `div v = 0` under the force `f`, as functionals on the free
    /// unknowns; without what multipliers of the pressure's means take.
    pub(in crate::model) fn residual(&self, ground: Ground, f: &[f64], flow: Moved) -> [Vec<f64>; 2] {
        let elements = self.elements(ground);
        let (free, [_, _, count]) = (ground.frames.free, elements.firsts());
        let mut r = vec![0.0; count];
        r[..free].copy_from_slice(&ground.frames.restrict(f));
        r.iter_mut().zip(&self.used).filter(|(_, used)| !**used).for_each(|(value, _)| *value = 0.0);
        elements.subtract_state((flow.v, Some(flow.pi)), &flow.motions(), &mut r);
        let mut volume = r[free..free + ground.pressure.dof_count()].to_vec();
        self.take_off_means(&elements, &mut volume);
        r.truncate(free);
        [r, volume]
    }

    fn take_off_means(&self, elements: &Elements, volume: &mut [f64]) {
        let (parts, ground) = (&self.domain.parts, elements.ground);
        let count = parts.means.len();
        if count == 0 {
            return;
        }
        let (mut means, mut constants) = (vec![vec![0.0; volume.len()]; count], vec![vec![0.0; volume.len()]; count]);
        for cell in 0..self.domain.active.len() {
            let Some(part) = parts.of_cell(cell) else { continue };
            let np = ground.pressure.n;
            let own =
                self.blocks.cut.get(&cell).map_or(&self.blocks.whole[2][cell * np..(cell + 1) * np], |c| &c.means);
            for (k, weights) in parts.means.iter().enumerate() {
                for (i, value) in own.iter().enumerate() {
                    let dof = ground.pressure.dof(cell, 0, i);
                    means[k][dof] += weights[part] * value;
                    constants[k][dof] = weights[part];
                }
            }
        }
        let system = DMatrix::from_fn(count, count, |i, j| dot(&constants[i], &means[j]));
        let right = DVector::from_fn(count, |i, _| dot(&constants[i], volume));
        let Some(multipliers) = system.lu().solve(&right) else { return };
        for (mean, multiplier) in means.iter().zip(multipliers.iter()) {
            crate::solve::axpy(-multiplier, mean, volume);
        }
    }

    /// Adds to a functional on the velocity space what the boundaries of the bodies and the ghost penalties have in the
    /// balance, beside the forms over the fluid.
    pub(in crate::model) fn add_boundaries(&self, ground: Ground, flow: Moved, out: &mut [f64]) {
        let velocity = ground.velocity;
        self.each_boundary(ground, flow, |(cell, _), local, block| {
            for (k, row) in block.chunks_exact(local.len()).take(velocity.cell_dof_count()).enumerate() {
                out[velocity.dof(cell, k / velocity.n, k % velocity.n)] += dot(row, local);
            }
        });
        for &face in &self.domain.ghosts {
            let (matrix, face) = (&self.blocks.ghosts[&face].velocity, &velocity.mesh.faces[face]);
            let sides = [face.minus.cell, face.plus.expect("an interior face").cell];
            for c in 0..2 {
                let dofs: Vec<usize> =
                    sides.iter().flat_map(|&cell| (0..velocity.n).map(move |i| velocity.dof(cell, c, i))).collect();
                let local: Vec<f64> = dofs.iter().map(|&dof| flow.v[dof]).collect();
                let rows = dofs.iter().zip(matrix.chunks_exact(local.len()));
                rows.for_each(|(&dof, row)| out[dof] += dot(row, &local));
            }
        }
    }

    /// `∫_∂B_i [(γ_N/h)(v−u_i)·v − 2D(v)n·(2v−u_i) + Πn·u_i]` of every body, and `γ_v g_S(v,v) + γ_Π h_S² g_S(Π,Π)` of
    /// the ghost faces at its cells, shared with others that cut these: what a flow that was solved for loses to it.
    pub(in crate::model) fn powers(&self, ground: Ground, flow: Moved) -> Vec<f64> {
        let (nv, np) = (ground.velocity.cell_dof_count(), ground.pressure.n);
        let mut powers = vec![0.0; self.domain.poses.len()];
        self.each_boundary(ground, flow, |(_, body), local, block| {
            let tested = |k: usize| if k < nv { local[k] } else { -local[k] };
            let rows = block.chunks_exact(local.len()).take(nv + np).enumerate();
            powers[body] += rows.map(|(k, row)| tested(k) * dot(row, local)).sum::<f64>();
        });
        for &face in &self.domain.ghosts {
            let (blocks, face) = (&self.blocks.ghosts[&face], &ground.velocity.mesh.faces[face]);
            let sides = [face.minus.cell, face.plus.expect("an interior face").cell];
            let square = |matrix: &[f64], space: &Space, values: &[f64], c: usize| {
                let of = |&cell: &usize| (0..space.n).map(move |i| space.dof(cell, c, i));
                let local: Vec<f64> = sides.iter().flat_map(of).map(|dof| values[dof]).collect();
                matrix.chunks_exact(local.len()).zip(&local).map(|(row, value)| value * dot(row, &local)).sum::<f64>()
            };
            let of_velocity = (0..2).map(|c| square(&blocks.velocity, ground.velocity, flow.v, c));
            let lost = of_velocity.sum::<f64>() - square(&blocks.pressure, ground.pressure, flow.pi, 0);
            let here: BTreeSet<usize> =
                sides.iter().flat_map(|&cell| self.domain.surface.bodies_of_cell(cell)).collect();
            here.iter().for_each(|&body| powers[body] += lost / here.len() as f64);
        }
        powers
    }

    /// Calls `visit` with every boundary in a cell: the cell and the body, its velocities, pressures and the motion of the body, and
    /// the block of Nitsche's method.
    fn each_boundary(&self, ground: Ground, flow: Moved, mut visit: impl FnMut((usize, usize), &[f64], &[f64])) {
        let (spaces, surface) = ((ground.velocity, ground.pressure), &self.domain.surface);
        let (gamma, motions) = (gamma(ground.velocity.degree), flow.motions());
        for cell in surface.cells() {
            for body in surface.bodies_of_cell(cell) {
                let centre = self.domain.poses[body].position;
                let block = nitsche::block(&self.loops, spaces, surface, (cell, body), centre, gamma);
                let mut local = flow_in(ground, cell, (flow.v, flow.pi));
                local.extend(motions[body]);
                visit((cell, body), &local, &block);
            }
        }
    }
}

/// The velocities of a cell, then its pressures.
fn flow_in(ground: Ground, cell: usize, (v, pi): (&[f64], &[f64])) -> Vec<f64> {
    let (velocity, pressure) = (ground.velocity, ground.pressure);
    let of_velocity = (0..velocity.cell_dof_count()).map(|k| v[velocity.dof(cell, k / velocity.n, k % velocity.n)]);
    of_velocity.chain((0..pressure.n).map(|k| pi[pressure.dof(cell, 0, k)])).collect()
}
