//! Rigid bodies on cells that they cut, by Nitsche's method: the flow is that of the fluid alone, and every body adds
//! its motion as an unknown (Hansbo & Hansbo 2002; Burman & Hansbo 2012, 2014; Massing, Larson, Logg & Rognes 2014;
//! Guzmán & Olshanskii 2018).
//!
//! With `u_i = V_i + ω_i (x−x_i)^⊥`, `w_i` likewise of the test, n out of the fluid and q the degree of v,
//!
//! ```text
//! 2(D(v)|D(w))_{Ω∖B} + C_F(v|w)_{Ω∖B} − (Π|div w)_{Ω∖B} − (ξ|div v)_{Ω∖B}
//!   − Σ_i ∫_∂B_i (2D(v)n − Πn)·(w−w_i) − Σ_i ∫_∂B_i (2D(w)n − ξn)·(v−u_i) + Σ_i ∫_∂B_i (γ_N/h)(v−u_i)·(w−w_i)
//!   + γ_v Σ_S g_S(v,w) − γ_Π Σ_S h_S² g_S(Π,ξ) + Σ_i c_i ∫_B_i u_i·w_i
//!   = (f|w)_{Ω∖B} + Σ_i (F_i·W_i + τ_i ζ_i),      γ_N = 25 q²,  γ_v = γ_Π = 0.1
//! ```
//! Functions live on the cells with fluid; S are the faces between two of them one of which at least is cut, and g_S is
//! the ghost penalty of [`form::ghost`](crate::form::ghost) with whole polynomials. The motion of a body that is fixed
//! or held is given, and so exact; a pinned one has its spin alone, and one that stands in a wall moves as the wall
//! lets it, which carries it. A part of the fluid that no condition fixes the pressure of has zero mean of it, unless a
//! body that may move feels it.

mod assembly;
mod domain;
mod elements;
mod soft;
mod state;
mod structure;
mod twists;
mod walls;

use std::sync::Arc;

use super::border::{REFINED, REFINEMENTS};
use super::{FlowWithBodies, Ground};
use crate::body::Body;
use crate::body::guide::Rule;
use crate::cut::Cover;
use crate::form::{Integrator, nitsche};
use crate::mesh::Point;
use crate::model::momentum::{MomentumError, Stiffness};
use crate::shape::{Pose, Twist, Wrench, rigid_motion};
use crate::solve::multifrontal::Multifrontal;
use crate::solve::{DIRECT_TOLERANCE, SolveError, axpy, dot};
use assembly::{Prepared, prepare};
use domain::Domain;
use elements::{Blocks, Elements};
pub(in crate::model) use state::Moved;
use structure::Skeleton;
use twists::Twists;

/// `γ_N = 25 q²`
pub fn gamma(degree: usize) -> f64 {
    25.0 * (degree * degree) as f64
}

/// Bodies at their places.
#[derive(Debug, Clone)]
pub struct Placement {
    /// How they lie on the mesh.
    pub cover: Arc<Cover>,
    /// What they are.
    pub bodies: Arc<[Body]>,
    /// One for each body.
    pub poses: Vec<Pose>,
}

/// The system of a flow and its bodies, factorised for one placement of them.
pub struct Nitsche {
    loops: Integrator,
    bodies: Arc<[Body]>,
    domain: Domain,
    twists: Twists,
    blocks: Blocks,
    friction: Vec<[f64; 3]>,
    /// By unknown: whether some cell with fluid has it.
    used: Vec<bool>,
    /// Faces whose conditions fix the pressure.
    open: Vec<usize>,
    skeleton: Skeleton,
    /// Of `S A S`.
    factors: Multifrontal,
    /// Powers of two S.
    scales: Vec<f64>,
    positions: Vec<Point>,
    /// Share of the operations of a whole factorisation in the last one.
    pub share: f64,
}

impl std::fmt::Debug for Nitsche {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Nitsche").field("factors", &self.factors).finish_non_exhaustive()
    }
}

/// What is integrated over: the loops, and the forms of the velocity.
#[derive(Debug, Clone, Copy)]
pub(in crate::model) struct Forms<'m> {
    pub loops: &'m Integrator,
    pub velocity: &'m Stiffness,
}

impl Nitsche {
    /// `open` are the faces whose conditions fix the pressure, `whole` the blocks of whole cells: of the velocity, of
    /// `b(w,ξ)`, and `∫ ξ`.
    pub(in crate::model) fn new(
        ground: Ground,
        forms: Forms,
        whole: [Vec<f64>; 3],
        open: Vec<usize>,
        placement: Placement,
    ) -> Result<Self, MomentumError> {
        let Placement { cover, bodies, poses } = placement;
        let friction = bodies.iter().map(|body| {
            let (area, moment) = (body.shape.area(), body.shape.second_moment());
            [area, area, moment].map(|share| body.friction * share)
        });
        let blocks = Blocks { whole: Arc::new(whole), ..Blocks::default() };
        let skeleton = Skeleton::new(ground);
        let friction: Vec<[f64; 3]> = friction.collect();
        let prepared = prepare(ground, forms, cover, &bodies, (&poses, &open), blocks)?;
        let Prepared { domain, twists, blocks, used } = prepared;
        let elements =
            Elements { ground, domain: &domain, twists: &twists, blocks: &blocks, friction: &friction, used: &used };
        let scales = elements.scales();
        let factors = Multifrontal::keeping(skeleton.symbolic(&elements)?, |e, out| elements.fill(e, &scales, out))?;
        let positions = ground.velocity.node_positions();
        Ok(Self {
            loops: forms.loops.clone(),
            bodies,
            domain,
            twists,
            blocks,
            friction,
            used,
            open,
            skeleton,
            factors,
            scales,
            positions,
            share: 1.0,
        })
    }

    /// Moves the bodies: integrates and eliminates anew what changed.
    pub(in crate::model) fn move_to(
        &mut self,
        ground: Ground,
        forms: Forms,
        poses: &[Pose],
    ) -> Result<(), MomentumError> {
        let (cover, _) = self.domain.cover.moved(poses);
        let new = prepare(ground, forms, Arc::new(cover), &self.bodies, (poses, &self.open), self.blocks.clone())?;
        let Prepared { domain, twists, blocks, used } = &new;
        let elements = Elements { ground, domain, twists, blocks, used, friction: &self.friction };
        let scales = elements.scales();
        let changed = elements.changed(&scales, &self.elements(ground), &self.scales);
        let symbolic = self.skeleton.symbolic(&elements)?;
        self.share = self.factors.restructure(symbolic, |e, out| elements.fill(e, &scales, out), &changed)?;
        let Prepared { domain, twists, blocks, used } = new;
        (self.domain, self.twists, self.blocks, self.used, self.scales) = (domain, twists, blocks, used, scales);
        Ok(())
    }

    fn elements<'s>(&'s self, ground: Ground<'s>) -> Elements<'s> {
        Elements {
            ground,
            domain: &self.domain,
            twists: &self.twists,
            blocks: &self.blocks,
            friction: &self.friction,
            used: &self.used,
        }
    }

    /// How the bodies lie on the mesh.
    pub fn cover(&self) -> &Arc<Cover> {
        &self.domain.cover
    }

    /// The rules of a change of the flow: what is given stays.
    pub fn rules_of_change(&self) -> Vec<Rule> {
        self.twists.rules_of_change(&self.domain.poses)
    }

    /// Solves with the force `f` on the fluid, prescribed nodal values, loads on the bodies and rules of their motions.
    pub(in crate::model) fn solve(
        &self,
        ground: Ground,
        (f, prescribed): (&[f64], &[f64]),
        loads: &[Wrench],
        rules: &[Rule],
    ) -> Result<FlowWithBodies, MomentumError> {
        let elements = self.elements(ground);
        let [first, _, count] = elements.firsts();
        let given = self.twists.given(rules, prescribed)?;
        self.domain.check_flux(&self.loops, (ground.velocity, prescribed), (&given, &self.twists))?;
        let mut right = vec![0.0; count];
        right[..ground.frames.free].copy_from_slice(&ground.frames.restrict(f));
        right.iter_mut().zip(&self.used).filter(|(_, used)| !**used).for_each(|(value, _)| *value = 0.0);
        for (body, load) in loads.iter().enumerate() {
            for (k, value) in [load.force.x, load.force.y, load.torque].into_iter().enumerate() {
                self.twists.of(body, k).for_each(|(unknown, a)| right[first + unknown] += a * value);
            }
        }
        elements.subtract_given(prescribed, &given, &mut right);
        let x = self.refined(&elements, &right)?;
        let motions: Vec<[f64; 3]> = (0..given.len())
            .map(|body| {
                let unknown = |k: usize| self.twists.of(body, k).map(|(u, a)| a * x[first + u]).sum::<f64>();
                std::array::from_fn(|k| given[body][k] + unknown(k))
            })
            .collect();
        let v = self.velocity(ground, &x, prescribed, &motions);
        let free = ground.frames.free;
        let pi = x[free..free + ground.pressure.dof_count()].to_vec();
        let wrenches = self.wrenches(ground, (&v, &pi), &motions);
        let holding = self.holding(&motions, loads, &wrenches);
        let twist = |[x, y, spin]: &[f64; 3]| Twist { velocity: Point::new(*x, *y), spin: *spin };
        Ok(FlowWithBodies { v, pi, twists: motions.iter().map(twist).collect(), holding, wrenches })
    }

    /// Solves, with steps of iterative refinement while rounding left more than [`REFINED`].
    fn refined(&self, elements: &Elements, right: &[f64]) -> Result<Vec<f64>, SolveError> {
        if let Some(index) = right.iter().position(|v| !v.is_finite()) {
            return Err(SolveError::NotFiniteInput { system: "Stokes".into(), index });
        }
        // in the units in which the diagonal entries are near 1, so that forces and volumes weigh alike in any unit
        let norm = |r: &[f64]| crate::solve::root(r.iter().zip(&self.scales).map(|(r, s)| (r * s).powi(2)).sum());
        let scale = norm(right);
        let mut x = self.inverse(right);
        let mut rest = right.to_vec();
        elements.subtract_product(&x, &mut rest);
        for _ in 0..REFINEMENTS {
            if norm(&rest) <= REFINED * scale {
                break;
            }
            axpy(1.0, &self.inverse(&rest), &mut x);
            rest.copy_from_slice(right);
            elements.subtract_product(&x, &mut rest);
        }
        if x.iter().any(|v| !v.is_finite()) {
            return Err(SolveError::NotFinite { system: "Stokes".into(), hint: HINT.into() });
        }
        let residual = norm(&rest) / scale.max(f64::MIN_POSITIVE);
        if residual > DIRECT_TOLERANCE {
            return Err(SolveError::Inaccurate { system: "Stokes".into(), residual, hint: HINT.into() });
        }
        Ok(x)
    }

    fn inverse(&self, b: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = b.iter().zip(&self.scales).map(|(b, s)| b * s).collect();
        self.factors.solve_in_place(&mut x);
        x.iter_mut().zip(&self.scales).for_each(|(x, s)| *x *= s);
        x
    }

    /// The velocity, which is that of the bodies at nodes without fluid.
    fn velocity(&self, ground: Ground, x: &[f64], prescribed: &[f64], motions: &[[f64; 3]]) -> Vec<f64> {
        let space = ground.velocity;
        let mut v = ground.frames.expand(&x[..ground.frames.free], prescribed);
        let mut wet = vec![false; space.node_count];
        let active = |cell: &usize| self.domain.active[*cell];
        let cells = 0..space.mesh.cells.len();
        cells.clone().filter(active).for_each(|cell| {
            space.cell_nodes(cell).iter().for_each(|&node| wet[node as usize] = true);
        });
        for cell in cells.filter(|cell| !active(cell)) {
            let Some(&body) = self.domain.cover.bodies_of_cell(cell).first() else { continue };
            for node in space.cell_nodes(cell).iter().map(|&node| node as usize).filter(|&node| !wet[node]) {
                let at = |k: usize| rigid_motion(k, self.domain.poses[body].position, self.positions[node]);
                let u: Point = (0..3).map(|k| at(k) * motions[body][k]).sum();
                v[2 * node..2 * node + 2].copy_from_slice(&[u.x, u.y]);
            }
        }
        v
    }

    /// Forces and torques of the fluid on the bodies, `−∫ [(2D(v)n − Πn)·w_i − (γ_N/h)(v−u_i)·w_i]`: of full order only
    /// with the last term.
    fn wrenches(&self, ground: Ground, (v, pi): (&[f64], &[f64]), motions: &[[f64; 3]]) -> Vec<Wrench> {
        let (velocity, pressure) = (ground.velocity, ground.pressure);
        let mut sums = vec![[0.0; 3]; motions.len()];
        for (&cell, cut) in &self.blocks.cut {
            let mut local: Vec<f64> =
                (0..velocity.cell_dof_count()).map(|k| v[velocity.dof(cell, k / velocity.n, k % velocity.n)]).collect();
            local.extend((0..pressure.n).map(|k| pi[pressure.dof(cell, 0, k)]));
            let first = local.len();
            cut.bodies.iter().for_each(|&body| local.extend(motions[body]));
            let rows = cut.matrix.chunks_exact(local.len()).skip(first);
            for (k, row) in rows.enumerate() {
                sums[cut.bodies[k / 3]][k % 3] -= dot(row, &local);
            }
        }
        sums.into_iter().map(|[x, y, torque]| Wrench { force: Point::new(x, y), torque }).collect()
    }

    /// Adds what the boundaries of the bodies and the ghost penalty add to the balance of the fluid, test by test.
    pub(in crate::model) fn add_residual(&self, ground: Ground, flow: &FlowWithBodies, out: &mut [f64]) {
        let (velocity, pressure) = (ground.velocity, ground.pressure);
        let dofs = |cell: usize| -> Vec<usize> {
            (0..velocity.cell_dof_count()).map(|k| velocity.dof(cell, k / velocity.n, k % velocity.n)).collect()
        };
        for (&cell, cut) in &self.blocks.cut {
            let rows = dofs(cell);
            let mut local: Vec<f64> = rows.iter().map(|&dof| flow.v[dof]).collect();
            local.extend((0..pressure.n).map(|k| flow.pi[pressure.dof(cell, 0, k)]));
            let first = local.len();
            for &body in &cut.bodies {
                let (centre, Twist { velocity: v, spin }) = (self.domain.poses[body].position, flow.twists[body]);
                local.truncate(first);
                local.extend([v.x, v.y, spin]);
                let (at, gamma) = ((cell, body), gamma(velocity.degree));
                let surface = &self.domain.surface;
                let block = nitsche::block(&self.loops, (velocity, pressure), surface, at, centre, gamma);
                let products = block.chunks_exact(local.len()).map(|row| dot(row, &local));
                rows.iter().zip(products).for_each(|(&dof, value)| out[dof] += value);
            }
        }
        for &face in &self.domain.ghosts {
            let sides = &velocity.mesh.faces[face];
            let plus = sides.plus.expect("an interior face").cell;
            let (minus, plus) = (dofs(sides.minus.cell), dofs(plus));
            for c in [0, velocity.n] {
                let own = c..c + velocity.n;
                let rows: Vec<usize> = minus[own.clone()].iter().chain(&plus[own]).copied().collect();
                let local: Vec<f64> = rows.iter().map(|&dof| flow.v[dof]).collect();
                let products = self.blocks.ghosts[&face].velocity.chunks_exact(local.len());
                rows.iter().zip(products).for_each(|(&dof, row)| out[dof] += dot(row, &local));
            }
        }
    }

    /// What bodies with a given motion or a pin need besides the fluid's force and their loads.
    fn holding(&self, motions: &[[f64; 3]], loads: &[Wrench], wrenches: &[Wrench]) -> Vec<Wrench> {
        let held = |body: usize| {
            if !self.twists.is_held(body) {
                return Wrench::ZERO;
            }
            let ([x, y, spin], [c, _, turning]) = (motions[body], self.friction[body]);
            Wrench {
                force: c * Point::new(x, y) - loads[body].force - wrenches[body].force,
                torque: turning * spin - loads[body].torque - wrenches[body].torque,
            }
        };
        (0..motions.len()).map(held).collect()
    }
}

const HINT: &str = "check that the boundary conditions or a friction hold the flow";
