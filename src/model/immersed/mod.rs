//! Rigid bodies in the momentum balance: the penalty `Σ_K (2/ε_K) ∫_{K∩B} D(v):D(w)` of `penalty` and the bodies'
//! own friction on top of a generalised Stokes problem [L1.13].
//!
//! With the `Kernel` of the penalty as unknowns c in exchange for as many nodal ones, the exchanged dofs, and
//! constraints on twists with multipliers λ,
//!
//! ```text
//! A    KQ     −ℓᵀ     x     f
//! QᵀK  QᵀKQ   −QᵀLᵀ   c  =  Qᵀf        v = v_D + lift + x + Qc
//! ℓ    LQ      0      λ     target
//! ```
//! K is the matrix without the penalty where the kernel is rigid, and A with all of it and without the exchanged dofs.
//! A is sparse and factorised along an elimination tree of the mesh, so that a move changes few fronts; the rest is
//! eliminated block by block. λ are the forces and torques that hold the bodies.

mod balance;
mod border;
mod constraints;
pub mod flow;
pub(crate) mod kernel;
pub mod leaving;
pub mod nitsche;
pub(crate) mod penalty;

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::DMatrix;
use rayon::prelude::*;

use balance::{Filled, Source, sparse_dot};
use border::Bordering;
use constraints::Constraints;

use super::closed::ClosedParts;
use super::frames::Frames;
use super::lagged::{Layout, Structure};
use crate::body::guide::Rule;
use crate::cut::Cover;
use crate::form::Integrator;
use crate::mesh::Point;
use crate::model::momentum::MomentumError;
use crate::shape::{Pose, Twist, Wrench, rigid_motion};
use crate::solve::blocks::{self, Neighbours};
use crate::solve::multifrontal::Multifrontal;
use crate::solve::symbolic::Element;
use crate::solve::{axpy, dot};
use crate::space::Space;
use kernel::{Kernel, Sparse};
use penalty::Immersion;

/// What the balance needs to know of the bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Rigidity {
    /// ε, relative to the surrounding viscosity.
    pub epsilon: f64,
    /// Friction of every body with the substrate, per area.
    pub friction: Vec<f64>,
}

/// How bodies are put into a flow.
#[derive(Debug, Clone)]
pub enum Embedding {
    /// As a fluid that is very viscous.
    Penalty(Immersion, Rigidity),
    /// As a boundary of the fluid.
    Nitsche(nitsche::Placement),
}

impl Embedding {
    /// How the bodies lie on the mesh.
    pub fn cover(&self) -> &Arc<Cover> {
        match self {
            Embedding::Penalty(immersion, _) => &immersion.cover,
            Embedding::Nitsche(placement) => &placement.cover,
        }
    }
}

/// A flow that carries bodies.
#[derive(Debug, Clone)]
pub struct FlowWithBodies {
    /// Coefficients of the velocity.
    pub v: Vec<f64>,
    /// Coefficients of the pressure.
    pub pi: Vec<f64>,
    /// Velocity and spin of every body.
    pub twists: Vec<Twist>,
    /// The forces and torques about the centre that hold the bodies to their rules; zero of a free body.
    pub holding: Vec<Wrench>,
    /// The forces and torques about the centre of the fluid on every body; by penalty also those that a force on the
    /// fluid exerts inside of it.
    pub wrenches: Vec<Wrench>,
}

/// The two spaces of the balance and the unknowns of its velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ground<'m> {
    pub velocity: &'m Space,
    pub pressure: &'m Space,
    pub frames: &'m Frames,
    pub closed: &'m ClosedParts,
}

/// The system of flow and bodies, factorised for one placement of the bodies.
pub struct Immersed {
    /// Where the bodies lie on the mesh.
    pub immersion: Immersion,
    /// How rigid they are.
    pub rigidity: Rigidity,
    kernel: Kernel,
    /// Friction of the fluid, which is no friction of the bodies.
    friction: f64,
    neighbours: Neighbours,
    /// Of `S A S`.
    factors: Multifrontal,
    /// Powers of two S that bring all diagonal entries near 1, whatever ε; those of pressures bring their pivots there.
    scales: Vec<f64>,
    /// Blocks of the balance without bodies, of `b(w,ξ)`, and `∫ ξ` where there are closed parts, cell after cell.
    stiffness: Vec<f64>,
    divergence: Vec<f64>,
    means: Vec<f64>,
    /// Cells around every velocity node.
    around: Vec<Vec<u32>>,
    /// `KQ` column by column, `A⁻¹ KQ`, and `QᵀKQ`.
    columns: Vec<Vec<f64>>,
    reach: Vec<Vec<f64>>,
    corner: DMatrix<f64>,
    /// Share of the operations of a whole factorisation in the last one.
    pub share: f64,
}

impl std::fmt::Debug for Immersed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Immersed")
            .field("rigidity", &self.rigidity)
            .field("factors", &self.factors)
            .finish_non_exhaustive()
    }
}

impl Immersed {
    pub(super) fn new(
        ground: Ground,
        blocks: (Vec<f64>, Vec<f64>),
        means: Vec<f64>,
        friction: f64,
        immersion: Immersion,
        rigidity: Rigidity,
    ) -> Result<Self, MomentumError> {
        assert_eq!(rigidity.friction.len(), immersion.parts.len(), "a friction for every body");
        let mesh = &ground.velocity.mesh;
        let kernel = Kernel::new(&immersion, ground.frames)?;
        let mut around = vec![Vec::new(); ground.velocity.node_count];
        for cell in 0..mesh.cells.len() {
            ground.velocity.cell_nodes(cell).iter().for_each(|&node| around[node as usize].push(cell as u32));
        }
        let neighbours = blocks::neighbours(mesh);
        let layout = ground.layout(&neighbours);
        let structure = Structure::new("Stokes", &layout)?;
        let (stiffness, divergence) = blocks;
        let source =
            Source { layout, immersion: &immersion, rigidity: &rigidity, friction, exchanged: &kernel.exchanged };
        let source = Filled { source, stiffness: &stiffness, divergence: &divergence, means: &means };
        let scales = source.scales();
        let factors = Multifrontal::keeping(structure.symbolic.clone(), |e, out| source.fill_scaled(e, &scales, out))?;
        let mut this = Self {
            immersion,
            rigidity,
            kernel,
            friction,
            neighbours,
            factors,
            scales,
            stiffness,
            divergence,
            means,
            around,
            columns: Vec::new(),
            reach: Vec::new(),
            corner: DMatrix::zeros(0, 0),
            share: 1.0,
        };
        this.couple(ground);
        Ok(this)
    }

    /// Moves the bodies: integrates and eliminates anew what changed.
    pub(super) fn move_to(&mut self, ground: Ground, loops: &Integrator, poses: &[Pose]) -> Result<(), MomentumError> {
        let (immersion, changed) = self.immersion.moved(loops, poses)?;
        let kernel = Kernel::new(&immersion, ground.frames)?;
        let mut cells: BTreeSet<usize> = changed.into_iter().collect();
        let (old, new): (BTreeSet<_>, BTreeSet<_>) =
            (self.kernel.exchanged.iter().copied().collect(), kernel.exchanged.iter().copied().collect());
        let mut renewed: BTreeSet<usize> = old.symmetric_difference(&new).copied().collect();
        (self.immersion, self.kernel) = (immersion, kernel);
        let scales = self.filled(ground).scales();
        renewed.extend((0..scales.len()).filter(|&k| scales[k] != self.scales[k]));
        self.scales = scales;
        let mesh = &ground.velocity.mesh;
        let mut element = Element::default();
        if !renewed.is_empty() {
            let layout = ground.layout(&self.neighbours);
            for cell in 0..mesh.cells.len() {
                layout.unknowns(cell, &mut element);
                if element.rows.iter().any(|&u| renewed.contains(&(u as usize))) {
                    cells.insert(cell);
                }
            }
        }
        // the pressures of a cell are in the element of their mean too
        let of_mean = |cell: &usize| ground.closed.cells().binary_search(&(*cell as u32)).ok();
        let means = cells.iter().filter_map(of_mean).map(|k| mesh.cells.len() + k);
        let cells: Vec<usize> = cells.iter().copied().chain(means).collect();
        let layout = ground.layout(&self.neighbours);
        let (immersion, rigidity) = (&self.immersion, &self.rigidity);
        let source = Source { layout, immersion, rigidity, friction: self.friction, exchanged: &self.kernel.exchanged };
        let filled = Filled { source, stiffness: &self.stiffness, divergence: &self.divergence, means: &self.means };
        let scales = &self.scales;
        self.share = self.factors.refactor_changed(|e, out| filled.fill_scaled(e, scales, out), &cells)?;
        self.couple(ground);
        Ok(())
    }

    fn filled<'s>(&'s self, ground: Ground<'s>) -> Filled<'s> {
        let layout = ground.layout(&self.neighbours);
        let source = Source {
            layout,
            immersion: &self.immersion,
            rigidity: &self.rigidity,
            friction: self.friction,
            exchanged: &self.kernel.exchanged,
        };
        Filled { source, stiffness: &self.stiffness, divergence: &self.divergence, means: &self.means }
    }

    /// The borders of the rigid motions.
    fn couple(&mut self, ground: Ground) {
        let filled = self.filled(ground);
        let near: Vec<Vec<usize>> = self.kernel.fields.iter().map(|field| self.cells_of(ground, field)).collect();
        let size = filled.source.layout.first();
        let mut columns: Vec<Vec<f64>> =
            self.kernel.fields.iter().zip(&near).map(|(field, cells)| filled.times_field(cells, field, size)).collect();
        let d = columns.len();
        let corner = DMatrix::from_fn(d, d, |i, j| sparse_dot(&self.kernel.fields[i], &columns[j]));
        // rounding must not tell rows from columns
        let corner = (&corner + corner.transpose()) * 0.5;
        for column in &mut columns {
            self.kernel.exchanged.iter().for_each(|&dof| column[dof] = 0.0);
        }
        let reach = columns.par_iter().map(|column| self.inverse(column)).collect();
        (self.columns, self.reach, self.corner) = (columns, reach, corner);
    }

    /// Cells with a node where a field differs from zero.
    fn cells_of(&self, ground: Ground, field: &Sparse) -> Vec<usize> {
        let nodes = (0..ground.velocity.node_count).filter(|&node| {
            let owned = ground.frames.owned(node);
            let at = field.partition_point(|(u, _)| *u < owned.start);
            field.get(at).is_some_and(|(u, _)| owned.contains(u))
        });
        let cells: BTreeSet<usize> = nodes.flat_map(|node| &self.around[node]).map(|&cell| cell as usize).collect();
        cells.into_iter().collect()
    }

    /// The norm of a residual in the units in which the diagonal entries of the matrix are near 1: that of the sum of
    /// its squares mixes forces with volumes, and so depends on the unit of length.
    fn scaled_norm(&self, r: &[f64]) -> f64 {
        crate::solve::root(r.iter().zip(&self.scales).map(|(r, s)| (r * s).powi(2)).sum())
    }

    fn inverse(&self, b: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = b.iter().zip(&self.scales).map(|(b, s)| b * s).collect();
        self.factors.solve_in_place(&mut x);
        x.iter_mut().zip(&self.scales).for_each(|(x, s)| *x *= s);
        x
    }

    /// Solves with the force `f`, prescribed nodal values, loads on the bodies and rules of their motions.
    pub(super) fn solve(
        &self,
        ground: Ground,
        (f, prescribed): (&[f64], &[f64]),
        loads: &[Wrench],
        rules: &[Rule],
    ) -> Result<FlowWithBodies, MomentumError> {
        let filled = self.filled(ground);
        let (frames, free) = (ground.frames, ground.frames.free);
        let size = filled.source.layout.first();
        let mut force = f.to_vec();
        self.immersion.means.iter().zip(loads).for_each(|(means, load)| means.add_load(*load, &mut force));
        let lift = self.kernel.lift(&self.immersion, frames, prescribed)?;
        let mut lifted = vec![0.0; free];
        lift.iter().for_each(|&(unknown, value)| lifted[unknown] = value);
        let start = frames.expand(&lifted, prescribed);
        let mut right = vec![0.0; size];
        right[..free].copy_from_slice(&frames.restrict(&force));
        filled.subtract_start(&start, &mut right);
        let constraints = Constraints::new(self, frames, rules, &start)?;
        let mut border: Vec<f64> = self.kernel.fields.iter().map(|field| sparse_dot(field, &right)).collect();
        border.extend(&constraints.targets);
        self.kernel.exchanged.iter().for_each(|&dof| right[dof] = 0.0);
        let system = Bordering::new(self, &constraints)?;
        let (x, y) = system.solve(&filled, &right, &border)?;
        let mut total = lifted;
        axpy(1.0, &x[..free], &mut total);
        for (field, c) in self.kernel.fields.iter().zip(&y) {
            field.iter().for_each(|(unknown, value)| total[*unknown] += c * value);
        }
        let v = frames.expand(&total, prescribed);
        let pi = x[free..free + ground.pressure.dof_count()].to_vec();
        let twists: Vec<Twist> = self.immersion.means.iter().map(|means| means.twist(&v)).collect();
        let holding = constraints.holding(&y[self.kernel.fields.len()..]);
        let wrenches = self.wrenches(&v, loads, &holding);
        Ok(FlowWithBodies { v, pi, twists, holding, wrenches })
    }

    /// What balances loads, holding forces and the bodies' friction.
    fn wrenches(&self, v: &[f64], loads: &[Wrench], holding: &[Wrench]) -> Vec<Wrench> {
        let space = &*self.immersion.velocity;
        let wrench = |body: usize| {
            let mut sums = [
                -loads[body].force.x - holding[body].force.x,
                -loads[body].force.y - holding[body].force.y,
                -loads[body].torque - holding[body].torque,
            ];
            let centre = self.immersion.poses[body].position;
            let c = self.rigidity.friction[body];
            for (&cell, part) in self.immersion.parts[body].iter().filter(|_| c != 0.0) {
                let m = space.cell_dof_count();
                let dof = |k: usize| (space.dof(cell, k / space.n, k % space.n), space.node(cell, k % space.n));
                let local: Vec<f64> = (0..m).map(|k| v[dof(k).0]).collect();
                for (k, row) in part.mass.chunks_exact(m).enumerate() {
                    let (drag, x) = (c * dot(row, &local), self.immersion.positions()[dof(k).1]);
                    let motion = |i: usize| rigid_motion(i, centre, x)[k / space.n];
                    sums.iter_mut().enumerate().for_each(|(i, sum)| *sum += drag * motion(i));
                }
            }
            Wrench { force: Point::new(sums[0], sums[1]), torque: sums[2] }
        };
        (0..loads.len()).map(wrench).collect()
    }

    /// Adds to the blocks of the balance, cell after cell, the bodies' own friction in place of the fluid's and a
    /// penalty of at most `1/SOFT`.
    pub(super) fn add_soft_blocks(&self, blocks: &mut [f64]) {
        const SOFT: f64 = 1e-4;
        let size = self.immersion.velocity.cell_dof_count().pow(2);
        for (parts, friction) in self.immersion.parts.iter().zip(&self.rigidity.friction) {
            for (&cell, part) in parts {
                let block = &mut blocks[cell * size..(cell + 1) * size];
                axpy(friction - self.friction, &part.mass, block);
                if let Some(viscosity) = &part.viscosity {
                    axpy(part.strength(self.rigidity.epsilon.max(SOFT)), viscosity, block);
                }
            }
        }
    }

    /// What the bodies add to `K v`: their own friction in place of the fluid's, and the penalty of the difference to
    /// the nearest rigid motion.
    pub(in crate::model) fn add_residual(&self, v: &[f64], out: &mut [f64]) {
        self.each_row(v, |_, dof, row| out[dof] += row);
    }

    /// The same tested with v, body by body.
    pub(in crate::model) fn powers(&self, v: &[f64]) -> Vec<f64> {
        let mut powers = vec![0.0; self.immersion.parts.len()];
        self.each_row(v, |body, dof, row| powers[body] += row * v[dof]);
        powers
    }

    /// Calls `visit` with the body, the velocity and its row of what a body adds to `K v` in a cell.
    fn each_row(&self, v: &[f64], mut visit: impl FnMut(usize, usize, f64)) {
        let space = &*self.immersion.velocity;
        for (body, parts) in self.immersion.parts.iter().enumerate() {
            let (twist, centre) = (self.immersion.means[body].twist(v), self.immersion.poses[body].position);
            let surplus = self.rigidity.friction[body] - self.friction;
            for (&cell, part) in parts {
                let m = space.cell_dof_count();
                let dofs: Vec<usize> = (0..m).map(|k| space.dof(cell, k / space.n, k % space.n)).collect();
                let local: Vec<f64> = dofs.iter().map(|&dof| v[dof]).collect();
                let bent: Vec<f64> = (0..m)
                    .map(|k| {
                        let x = self.immersion.positions()[space.node(cell, k % space.n)];
                        local[k] - twist.at(x, centre)[k / space.n]
                    })
                    .collect();
                for (k, &dof) in dofs.iter().enumerate() {
                    let mut row = surplus * dot(&part.mass[k * m..(k + 1) * m], &local);
                    if let Some(viscosity) = &part.viscosity {
                        let strength = part.strength(self.rigidity.epsilon);
                        row += strength * dot(&viscosity[k * m..(k + 1) * m], &bent);
                    }
                    visit(body, dof, row);
                }
            }
        }
    }
}

impl<'m> Ground<'m> {
    fn layout(self, neighbours: &'m Neighbours) -> Layout<'m> {
        let Ground { velocity, pressure, frames, closed } = self;
        let pressure = Some(pressure);
        Layout { velocity, pressure, carried: [None, None], traces: None, frames, closed, neighbours }
    }
}
