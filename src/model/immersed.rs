//! Rigid bodies in the momentum balance: the penalty `Σ_K (2/ε_K) ∫_{K∩B} D(v):D(w)` of [`crate::body::penalty`] and the bodies' own friction on top of a
//! generalised Stokes problem [L1.13].
//!
//! With the [`Kernel`] of the penalty as unknowns c in exchange for the nodal unknowns of its hosts, and constraints on twists with multipliers λ,
//!
//! ```text
//! A    KQ     −ℓᵀ     x     f
//! QᵀK  QᵀKQ   −QᵀLᵀ   c  =  Qᵀf        v = v_D + lift + x + Qc
//! ℓ    LQ      0      λ     target
//! ```
//! K is the matrix without the penalty where the kernel is rigid, and A with all of it and without the hosts. A is sparse and factorised along an elimination tree of the mesh, so that a move
//! changes few fronts; the rest is eliminated block by block. λ are the forces and torques that hold the bodies.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::frames::Frames;
use super::lagged::{Layout, Structure, add_velocity_block};
use crate::body::kernel::{Kernel, Sparse};
use crate::body::penalty::{BodyError, Immersion, Means, Wrench};
use crate::body::{Pose, Twist};
use crate::form::Integrator;
use crate::mesh::Point;
use crate::model::momentum::MomentumError;
use crate::solve::blocks::{self, Neighbours};
use crate::solve::multifrontal::Multifrontal;
use crate::solve::symbolic::Element;
use crate::solve::{DIRECT_TOLERANCE, SolveError, axpy, dot, norm};
use crate::space::Space;

/// Singular values of the constraints below this, relative to the largest one, are those of constraints that the boundary or other bodies impose.
const RANK: f64 = 1e-7;
/// Largest contradiction of constraints, relative to the velocities, that counts as rounding.
const MISFIT: f64 = 1e-7;

/// What the balance needs to know of the bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Rigidity {
    /// ε, relative to the surrounding viscosity.
    pub epsilon: f64,
    /// Friction of every body with the substrate, per area.
    pub friction: Vec<f64>,
}

/// What is prescribed of a body's motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// Nothing.
    Free,
    /// Velocity and spin.
    Held(Twist),
    /// It turns about this point (in space).
    Pinned(Point),
}

/// A flow that carries bodies.
#[derive(Debug, Clone)]
pub struct Carried {
    pub v: Vec<f64>,
    pub pi: Vec<f64>,
    /// Velocity and spin of every body.
    pub twists: Vec<Twist>,
    /// The forces and torques about the centre that hold the bodies to their rules; zero of a free body.
    pub holding: Vec<Wrench>,
}

/// The two spaces of the balance and the unknowns of its velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ground<'m> {
    pub velocity: &'m Space,
    pub pressure: &'m Space,
    pub frames: &'m Frames,
}

/// The system of flow and bodies, factorised for one placement of the bodies.
pub struct Immersed {
    pub immersion: Immersion,
    pub rigidity: Rigidity,
    kernel: Kernel,
    /// Friction of the fluid, which is no friction of the bodies.
    friction: f64,
    closed: bool,
    neighbours: Neighbours,
    /// Of `S A S`.
    factors: Multifrontal,
    /// Powers of two S that bring all diagonal entries near 1, whatever ε; those of pressures bring their pivots there.
    scales: Vec<f64>,
    /// Blocks of the balance without bodies, of `b(w,ξ)`, and `∫ ξ` in a closed domain, cell after cell.
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
        means: Option<Vec<f64>>,
        friction: f64,
        immersion: Immersion,
        rigidity: Rigidity,
    ) -> Result<Self, MomentumError> {
        assert_eq!(rigidity.friction.len(), immersion.parts.len(), "a friction for every body");
        let mesh = &ground.velocity.mesh;
        let kernel = Kernel::new(&immersion, ground.frames, None)?;
        let mut around = vec![Vec::new(); ground.velocity.node_count];
        for cell in 0..mesh.cells.len() {
            ground.velocity.cell_nodes(cell).iter().for_each(|&node| around[node as usize].push(cell as u32));
        }
        let (neighbours, closed) = (blocks::neighbours(mesh), means.is_some());
        let layout = ground.layout(closed, &neighbours);
        let structure = Structure::new("Stokes", &layout)?;
        let (stiffness, divergence) = blocks;
        let means = means.unwrap_or_default();
        let source = Source { layout, immersion: &immersion, rigidity: &rigidity, friction, hosts: &kernel.hosts };
        let source = Filled { source, stiffness: &stiffness, divergence: &divergence, means: &means };
        let scales = source.scales();
        let factors = Multifrontal::keeping(structure.symbolic.clone(), |e, out| source.fill_scaled(e, &scales, out))?;
        let mut this = Self {
            immersion,
            rigidity,
            kernel,
            friction,
            closed,
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

    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Moves the bodies: integrates and eliminates anew what changed.
    pub(super) fn move_to(
        &mut self,
        ground: Ground,
        loops: &Integrator,
        poses: &[Pose],
        keep: bool,
    ) -> Result<(), MomentumError> {
        let (immersion, changed) = self.immersion.moved(loops, poses)?;
        let kernel = Kernel::new(&immersion, ground.frames, keep.then_some(&self.kernel))?;
        let mut cells: BTreeSet<usize> = changed.into_iter().collect();
        let (old, new): (BTreeSet<_>, BTreeSet<_>) =
            (self.kernel.hosts.iter().copied().collect(), kernel.hosts.iter().copied().collect());
        let mut renewed: BTreeSet<usize> = old.symmetric_difference(&new).copied().collect();
        (self.immersion, self.kernel) = (immersion, kernel);
        let scales = self.filled(ground).scales();
        renewed.extend((0..scales.len()).filter(|&k| scales[k] != self.scales[k]));
        self.scales = scales;
        let mesh = &ground.velocity.mesh;
        let mut element = Element::default();
        if !renewed.is_empty() {
            let layout = ground.layout(self.closed, &self.neighbours);
            for cell in 0..mesh.cells.len() {
                layout.unknowns(cell, &mut element);
                if element.rows.iter().any(|&u| renewed.contains(&(u as usize))) {
                    cells.insert(cell);
                }
            }
        }
        // the pressures of a cell are in the element of their mean too
        let means = if self.closed { mesh.cells.len() } else { 0 };
        let cells: Vec<usize> =
            cells.iter().copied().chain(cells.iter().filter(|_| means > 0).map(|c| c + means)).collect();
        let layout = ground.layout(self.closed, &self.neighbours);
        let (immersion, rigidity) = (&self.immersion, &self.rigidity);
        let source = Source { layout, immersion, rigidity, friction: self.friction, hosts: &self.kernel.hosts };
        let filled = Filled { source, stiffness: &self.stiffness, divergence: &self.divergence, means: &self.means };
        let scales = &self.scales;
        self.share = self.factors.refactor_changed(|e, out| filled.fill_scaled(e, scales, out), &cells)?;
        self.couple(ground);
        Ok(())
    }

    fn filled<'s>(&'s self, ground: Ground<'s>) -> Filled<'s> {
        let layout = ground.layout(self.closed, &self.neighbours);
        let source = Source {
            layout,
            immersion: &self.immersion,
            rigidity: &self.rigidity,
            friction: self.friction,
            hosts: &self.kernel.hosts,
        };
        Filled { source, stiffness: &self.stiffness, divergence: &self.divergence, means: &self.means }
    }

    /// Makes the factors anew as a whole.
    pub(super) fn refactor(&mut self, ground: Ground) -> Result<(), MomentumError> {
        let layout = ground.layout(self.closed, &self.neighbours);
        let (immersion, rigidity) = (&self.immersion, &self.rigidity);
        let source = Source { layout, immersion, rigidity, friction: self.friction, hosts: &self.kernel.hosts };
        let filled = Filled { source, stiffness: &self.stiffness, divergence: &self.divergence, means: &self.means };
        let (scales, symbolic) = (&self.scales, self.factors.symbolic().clone());
        self.factors = Multifrontal::keeping(symbolic, |e, out| filled.fill_scaled(e, scales, out))?;
        self.share = 1.0;
        self.couple(ground);
        Ok(())
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
            self.kernel.hosts.iter().for_each(|&host| column[host] = 0.0);
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
    ) -> Result<Carried, MomentumError> {
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
        self.kernel.hosts.iter().for_each(|&host| right[host] = 0.0);
        let system = Bordering::new(self, &constraints)?;
        let (x, y) = system.solve(&filled, &right, &border)?;
        let mut total = lifted;
        axpy(1.0, &x[..free], &mut total);
        for (field, c) in self.kernel.fields.iter().zip(&y) {
            field.iter().for_each(|(unknown, value)| total[*unknown] += c * value);
        }
        let v = frames.expand(&total, prescribed);
        let pi = x[free..free + ground.pressure.dof_count()].to_vec();
        let twists = self.immersion.means.iter().map(|means| means.twist(&v)).collect();
        let holding = constraints.holding(&y[self.kernel.fields.len()..]);
        Ok(Carried { v, pi, twists, holding })
    }

    /// Adds to the blocks of the balance, cell after cell, the bodies' own friction in place of the fluid's and a penalty of at most `1/SOFT`.
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

    /// What the bodies add to `K v`: their own friction in place of the fluid's, and the penalty of the difference to the nearest rigid motion.
    pub(super) fn add_residual(&self, v: &[f64], out: &mut [f64]) {
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
                    out[dof] += surplus * dot(&part.mass[k * m..(k + 1) * m], &local);
                    if let Some(viscosity) = &part.viscosity {
                        let strength = part.strength(self.rigidity.epsilon);
                        out[dof] += strength * dot(&viscosity[k * m..(k + 1) * m], &bent);
                    }
                }
            }
        }
    }
}

impl<'m> Ground<'m> {
    fn layout(self, closed: bool, neighbours: &'m Neighbours) -> Layout<'m> {
        let (velocity, pressure, frames) = (self.velocity, Some(self.pressure), self.frames);
        Layout { velocity, pressure, carried: [None, None], frames, closed, neighbours }
    }
}

/// Where the bodies' part of an element comes from.
struct Source<'s> {
    layout: Layout<'s>,
    immersion: &'s Immersion,
    rigidity: &'s Rigidity,
    friction: f64,
    hosts: &'s [usize],
}

/// All that elements are made of.
struct Filled<'s> {
    source: Source<'s>,
    stiffness: &'s [f64],
    divergence: &'s [f64],
    means: &'s [f64],
}

impl Filled<'_> {
    /// Element `e` of `S A S`.
    fn fill_scaled(&self, e: usize, scales: &[f64], out: &mut Element) {
        self.fill(e, out);
        let width = out.columns.len();
        for (&row, values) in out.rows.iter().zip(out.values.chunks_exact_mut(width)) {
            let s = scales[row as usize];
            values.iter_mut().zip(&out.columns).for_each(|(a, &column)| *a *= s * scales[column as usize]);
        }
    }

    /// Powers of four near `1/√A_vv` and near the root of the inverse of `Σ_v b(v,p)²/A_vv`.
    fn scales(&self) -> Vec<f64> {
        let layout = &self.source.layout;
        let (space, pressure) = (layout.velocity, layout.pressure.expect("an incompressible flow has a pressure"));
        let (nv, np, free) = (space.cell_dof_count(), pressure.n, layout.frames.free);
        let cells = 0..space.mesh.cells.len();
        let unknowns = |cell: usize, k: usize| layout.frames.of(space.dof(cell, k / space.n, k % space.n));
        let mut size = vec![0.0; layout.first()];
        for cell in cells.clone() {
            for k in 0..nv {
                let a = self.stiffness[(cell * nv + k) * nv + k];
                unknowns(cell, k).for_each(|(unknown, b)| size[unknown] += a * b * b);
            }
        }
        for parts in &self.source.immersion.parts {
            for (&cell, part) in parts {
                let Some(viscosity) = &part.viscosity else { continue };
                for k in 0..nv {
                    let a = viscosity[k * nv + k] * part.strength(self.source.rigidity.epsilon);
                    unknowns(cell, k).for_each(|(unknown, b)| size[unknown] += a * b * b);
                }
            }
        }
        for cell in cells {
            for i in 0..nv {
                for (unknown, a) in unknowns(cell, i) {
                    let Some(share) = Some(a * a / size[unknown]).filter(|s| s.is_finite()) else { continue };
                    for j in 0..np {
                        let b = self.divergence[(cell * nv + i) * np + j];
                        size[free + pressure.dof(cell, 0, j)] += share * b * b;
                    }
                }
            }
        }
        let scale = |size: &f64| if *size > 0.0 { 4f64.powf(-(0.25 * size.log2()).round()) } else { 1.0 };
        size.iter().map(scale).collect()
    }

    /// Element `e` of A: with the penalty, hosts apart.
    fn fill(&self, e: usize, out: &mut Element) {
        let cells = self.source.layout.velocity.mesh.cells.len();
        if e >= cells {
            return self.fill_mean(e - cells, out);
        }
        self.fill_cell(e, out, true);
        let n = out.rows.len();
        for k in 0..n {
            if self.source.hosts.binary_search(&(out.rows[k] as usize)).is_ok() {
                for l in 0..n {
                    out.values[k * n + l] = 0.0;
                    out.values[l * n + k] = 0.0;
                }
                out.values[k * n + k] = 1.0;
            }
        }
    }

    fn fill_cell(&self, cell: usize, out: &mut Element, penalty: bool) {
        let layout = &self.source.layout;
        let pressure = layout.pressure.expect("an incompressible flow has a pressure");
        let (nv, np) = (layout.velocity.cell_dof_count(), pressure.n);
        let maps = layout.unknowns(cell, out);
        let columns = out.columns.len();
        let nf = columns - np;
        out.values.clear();
        out.values.resize(out.rows.len() * columns, 0.0);
        let mut block = self.stiffness[cell * nv * nv..(cell + 1) * nv * nv].to_vec();
        for (parts, friction) in self.source.immersion.parts.iter().zip(&self.source.rigidity.friction) {
            let Some(part) = parts.get(&cell) else { continue };
            if *friction != self.source.friction {
                axpy(friction - self.source.friction, &part.mass, &mut block);
            }
            if let Some(viscosity) = part.viscosity.as_ref().filter(|_| penalty || !part.rigid) {
                axpy(part.strength(self.source.rigidity.epsilon), viscosity, &mut block);
            }
        }
        let values = &mut out.values;
        add_velocity_block(&block, &maps, columns, values);
        for (i, row) in maps.iter().enumerate() {
            for j in 0..np {
                let g = self.divergence[cell * nv * np + i * np + j];
                for (r, a) in row {
                    values[r * columns + nf + j] += a * g;
                    values[(nf + j) * columns + r] += a * g;
                }
            }
        }
    }

    /// `λ ∫ ξ` and its transposed.
    fn fill_mean(&self, cell: usize, out: &mut Element) {
        self.source.layout.mean_unknowns(cell, out);
        let np = out.rows.len() - 1;
        out.values.clear();
        out.values.resize((np + 1) * (np + 1), 0.0);
        for (j, mean) in self.means[cell * np..(cell + 1) * np].iter().enumerate() {
            out.values[j * (np + 1) + np] = *mean;
            out.values[np * (np + 1) + j] = *mean;
        }
    }

    /// `K q` for a field that lives on some cells.
    fn times_field(&self, cells: &[usize], field: &Sparse, size: usize) -> Vec<f64> {
        let mut dense = vec![0.0; size];
        field.iter().for_each(|&(unknown, value)| dense[unknown] = value);
        let mut out = vec![0.0; size];
        let mut element = Element::default();
        for &cell in cells {
            self.fill_cell(cell, &mut element, false);
            add_product(&element, 1.0, &dense, &mut out);
        }
        out
    }

    /// `r ← r − A x`, in the order of the elements.
    fn subtract_product(&self, x: &[f64], r: &mut [f64]) {
        let cells = self.source.layout.velocity.mesh.cells.len();
        let mut element = Element::default();
        for e in 0..if self.means.is_empty() { cells } else { 2 * cells } {
            self.fill(e, &mut element);
            add_product(&element, -1.0, x, r);
        }
    }

    /// `r ← r − (K v, b(v,·))` for nodal values v, on whose rigid parts the penalty vanishes.
    fn subtract_start(&self, v: &[f64], r: &mut [f64]) {
        let layout = &self.source.layout;
        let pressure = layout.pressure.expect("an incompressible flow has a pressure");
        let (space, np) = (layout.velocity, pressure.n);
        let nv = space.cell_dof_count();
        for cell in 0..space.mesh.cells.len() {
            let dofs: Vec<usize> = (0..nv).map(|k| space.dof(cell, k / space.n, k % space.n)).collect();
            let local: Vec<f64> = dofs.iter().map(|&dof| v[dof]).collect();
            if local.iter().all(|v| *v == 0.0) {
                continue;
            }
            let mut block = self.stiffness[cell * nv * nv..(cell + 1) * nv * nv].to_vec();
            for (parts, friction) in self.source.immersion.parts.iter().zip(&self.source.rigidity.friction) {
                if let Some(part) = parts.get(&cell) {
                    axpy(friction - self.source.friction, &part.mass, &mut block);
                    if let Some(viscosity) = part.viscosity.as_ref().filter(|_| !part.rigid) {
                        axpy(part.strength(self.source.rigidity.epsilon), viscosity, &mut block);
                    }
                }
            }
            for (k, &dof) in dofs.iter().enumerate() {
                let value = dot(&block[k * nv..(k + 1) * nv], &local);
                layout.frames.of(dof).for_each(|(unknown, a)| r[unknown] -= a * value);
            }
            for j in 0..np {
                let value: f64 = (0..nv).map(|i| self.divergence[cell * nv * np + i * np + j] * local[i]).sum();
                r[layout.frames.free + pressure.dof(cell, 0, j)] -= value;
            }
        }
    }
}

fn add_product(element: &Element, scale: f64, x: &[f64], out: &mut [f64]) {
    for (row, values) in element.rows.iter().zip(element.values.chunks_exact(element.columns.len())) {
        let sum: f64 = element.columns.iter().zip(values).map(|(&column, a)| a * x[column as usize]).sum();
        out[*row as usize] += scale * sum;
    }
}

fn sparse_dot(a: &Sparse, b: &[f64]) -> f64 {
    a.iter().map(|(k, value)| value * b[*k]).sum()
}

/// Independent constraints on the twists of bodies.
struct Constraints {
    /// `ℓ` by free unknown.
    rows: Vec<Vec<f64>>,
    /// `LQ`.
    on_kernel: DMatrix<f64>,
    targets: Vec<f64>,
    /// What a multiplier does to which body.
    works: Vec<Vec<(usize, Vector3<f64>)>>,
    bodies: usize,
}

impl Constraints {
    fn new(immersed: &Immersed, frames: &Frames, rules: &[Rule], start: &[f64]) -> Result<Self, BodyError> {
        let immersion = &immersed.immersion;
        let single = single_constraints(immersion, rules);
        let fields = &immersed.kernel.fields;
        let by_unknown: Vec<Vec<f64>> =
            single.iter().map(|c| functional(&immersion.means[c.body], c.weights, frames)).collect();
        let on_kernel = DMatrix::from_fn(single.len(), fields.len(), |i, j| sparse_dot(&fields[j], &by_unknown[i]));
        let mut rest = DVector::zeros(single.len());
        let mut fastest = 0.0_f64;
        for (i, c) in single.iter().enumerate() {
            let now = immersion.means[c.body].twist(start);
            let now = c.weights.dot(&Vector3::new(now.velocity.x, now.velocity.y, now.spin));
            rest[i] = c.target - now;
            fastest = fastest.max(c.target.abs()).max(now.abs());
        }
        let bodies = rules.len();
        if single.is_empty() {
            return Ok(Self { rows: Vec::new(), on_kernel, targets: Vec::new(), works: Vec::new(), bodies });
        }
        // constraints that the boundary or other bodies impose already need no multiplier, but must agree
        let padded = DMatrix::from_fn(single.len(), single.len().max(fields.len()), |i, j| {
            if j < fields.len() { on_kernel[(i, j)] } else { 0.0 }
        });
        let svd = padded.svd(true, false);
        let u = svd.u.expect("it was asked for");
        let largest = svd.singular_values.max();
        let soft = (0..single.len()).filter(|&i| !immersed.kernel.has_patch(single[i].body));
        let kept: Vec<usize> = (0..single.len()).filter(|&k| svd.singular_values[k] > RANK * largest).collect();
        if kept.len() + soft.count() == single.len() {
            let works = single.iter().map(|c| vec![(c.body, c.weights)]).collect();
            return Ok(Self { rows: by_unknown, on_kernel, targets: rest.as_slice().to_vec(), works, bodies });
        }
        let u = u.select_columns(&kept);
        // what nothing makes rigid takes any motion
        let unit = |i: usize| DVector::from_fn(single.len(), |k, _| f64::from(u8::from(k == i)));
        let soft = (0..single.len()).filter(|&i| !immersed.kernel.has_patch(single[i].body));
        let columns: Vec<DVector<f64>> = u.column_iter().map(|c| c.into_owned()).chain(soft.map(unit)).collect();
        let u = DMatrix::from_fn(single.len(), columns.len(), |i, k| columns[k][i]);
        let misfit = &rest - &u * (u.transpose() * &rest);
        if misfit.amax() > MISFIT * fastest {
            let body = single[misfit.iamax()].body;
            return Err(BodyError::Contradiction { body: immersion.names[body].clone(), misfit: misfit.amax() });
        }
        let combine = |k: usize| {
            let mut row = vec![0.0; frames.free];
            by_unknown.iter().enumerate().for_each(|(i, single)| axpy(u[(i, k)], single, &mut row));
            row
        };
        let works = (0..u.ncols())
            .map(|k| single.iter().enumerate().map(|(i, c)| (c.body, c.weights * u[(i, k)])).collect())
            .collect();
        let rows = (0..u.ncols()).map(combine).collect();
        let targets = (u.transpose() * rest).as_slice().to_vec();
        Ok(Self { rows, on_kernel: u.transpose() * on_kernel, targets, works, bodies })
    }

    /// The force and torque on every body.
    fn holding(&self, multipliers: &[f64]) -> Vec<Wrench> {
        let mut sums = vec![Vector3::zeros(); self.bodies];
        for (works, lambda) in self.works.iter().zip(multipliers) {
            works.iter().for_each(|(body, work)| sums[*body] += work * *lambda);
        }
        sums.into_iter().map(|s: Vector3<f64>| Wrench { force: Point::new(s.x, s.y), torque: s.z }).collect()
    }
}

/// `weights · twist = target`
struct Single {
    body: usize,
    weights: Vector3<f64>,
    target: f64,
}

fn single_constraints(immersion: &Immersion, rules: &[Rule]) -> Vec<Single> {
    let mut all = Vec::new();
    for (body, rule) in rules.iter().enumerate() {
        match rule {
            Rule::Free => {}
            Rule::Held(twist) => {
                let targets = [twist.velocity.x, twist.velocity.y, twist.spin];
                let unit = Matrix3::identity();
                all.extend((0..3).map(|k| Single { body, weights: unit.column(k).into(), target: targets[k] }));
            }
            Rule::Pinned(point) => {
                let y = point - immersion.poses[body].position;
                all.push(Single { body, weights: Vector3::new(1.0, 0.0, -y.y), target: 0.0 });
                all.push(Single { body, weights: Vector3::new(0.0, 1.0, y.x), target: 0.0 });
            }
        }
    }
    all
}

/// `weights · twist` by free unknown.
fn functional(means: &Means, weights: Vector3<f64>, frames: &Frames) -> Vec<f64> {
    let mut out = vec![0.0; frames.free];
    for (dof, row) in &means.rows {
        let value = row.dot(&weights);
        frames.of(*dof).for_each(|(unknown, a)| out[unknown] += a * value);
    }
    out
}

/// The whole system for some constraints.
struct Bordering<'s> {
    immersed: &'s Immersed,
    columns: Vec<Vec<f64>>,
    reach: Vec<Vec<f64>>,
    corner: DMatrix<f64>,
    inverse: DMatrix<f64>,
}

impl<'s> Bordering<'s> {
    fn new(immersed: &'s Immersed, constraints: &Constraints) -> Result<Self, SolveError> {
        let (d, m) = (immersed.columns.len(), constraints.rows.len());
        let (mut columns, mut reach) = (immersed.columns.clone(), immersed.reach.clone());
        let size = immersed.factors.symbolic().unknowns();
        for row in &constraints.rows {
            let mut column = vec![0.0; size];
            column.iter_mut().zip(row).for_each(|(c, r)| *c = -r);
            immersed.kernel.hosts.iter().for_each(|&host| column[host] = 0.0);
            reach.push(immersed.inverse(&column));
            columns.push(column);
        }
        let corner = DMatrix::from_fn(d + m, d + m, |i, j| match (i < d, j < d) {
            (true, true) => immersed.corner[(i, j)],
            (true, false) => -constraints.on_kernel[(j - d, i)],
            (false, true) => -constraints.on_kernel[(i - d, j)],
            (false, false) => 0.0,
        });
        let schur = DMatrix::from_fn(d + m, d + m, |i, j| corner[(i, j)] - dot(&columns[i], &reach[j]));
        if d + m == 0 {
            return Ok(Self { immersed, columns, reach, corner, inverse: schur });
        }
        let inverse = schur.try_inverse().filter(|s| s.iter().all(|v| v.is_finite())).ok_or_else(singular)?;
        Ok(Self { immersed, columns, reach, corner, inverse })
    }

    /// Solves, with a step of iterative refinement where rounding left more than a tenth of the tolerance. Constraints count with the sign of `−ℓ`.
    fn solve(&self, filled: &Filled, f: &[f64], g: &[f64]) -> Result<(Vec<f64>, Vec<f64>), SolveError> {
        if let Some(index) = f.iter().chain(g).position(|v| !v.is_finite()) {
            return Err(SolveError::NotFiniteInput { system: "Stokes".into(), index });
        }
        let d = self.immersed.columns.len();
        let g: Vec<f64> = g.iter().enumerate().map(|(i, v)| if i < d { *v } else { -v }).collect();
        let (mut x, mut y) = self.eliminate(f, &g);
        let scale = norm(f) + norm(&g);
        let (mut rf, mut rg) = self.residual(filled, (f, &g), (&x, &y));
        if norm(&rf) + norm(&rg) > 0.1 * DIRECT_TOLERANCE * scale {
            let (dx, dy) = self.eliminate(&rf, &rg);
            axpy(1.0, &dx, &mut x);
            axpy(1.0, &dy, &mut y);
            (rf, rg) = self.residual(filled, (f, &g), (&x, &y));
        }
        if x.iter().chain(&y).any(|v| !v.is_finite()) {
            return Err(SolveError::NotFinite { system: "Stokes".into(), hint: HINT.into() });
        }
        let relative = (norm(&rf) + norm(&rg)) / scale.max(f64::MIN_POSITIVE);
        if relative > DIRECT_TOLERANCE {
            return Err(SolveError::Inaccurate { system: "Stokes".into(), residual: relative, hint: HINT.into() });
        }
        Ok((x, y))
    }

    fn eliminate(&self, f: &[f64], g: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut x = self.immersed.inverse(f);
        let rest = DVector::from_fn(g.len(), |i, _| g[i] - dot(&self.columns[i], &x));
        let y = &self.inverse * rest;
        self.reach.iter().zip(y.iter()).for_each(|(column, &yj)| axpy(-yj, column, &mut x));
        (x, y.as_slice().to_vec())
    }

    fn residual(&self, filled: &Filled, (f, g): (&[f64], &[f64]), (x, y): (&[f64], &[f64])) -> (Vec<f64>, Vec<f64>) {
        let mut rf = f.to_vec();
        filled.subtract_product(x, &mut rf);
        self.columns.iter().zip(y).for_each(|(column, &yj)| axpy(-yj, column, &mut rf));
        let corner = &self.corner * DVector::from_column_slice(y);
        let rg = (0..g.len()).map(|i| g[i] - dot(&self.columns[i], x) - corner[i]).collect();
        (rf, rg)
    }
}

const HINT: &str =
    "check that the boundary conditions or a friction hold the flow and that `rigid.epsilon` is not extreme";

fn singular() -> SolveError {
    SolveError::Factorise {
        system: "Stokes".into(),
        reason: "the balance of the bodies' forces is singular: nothing determines a rigid motion".into(),
        hint: HINT.into(),
    }
}
