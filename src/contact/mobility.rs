//! The projection in the metric of the flow: contact acts on bodies through the fluid around them.
//!
//! ```text
//! W = U* + Y Gᵀλ,   λ ≥ 0,   D + Δt G·W ≥ η,   λ (D + Δt G·W − η) = 0
//! ```
//! Y is the mobility: the twists that wrenches on the bodies cause. It is symmetric and positive definite, and its
//! inverse is the metric of the projection. With the Cholesky factor `Y = LLᵀ` of the bodies that touch and
//! `u = u* + L z`, the projection is one in the usual metric, whose rows are `BL`. Bodies that nothing touches are moved
//! by the flow that contact causes.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::mover::{Freedom, Mover};
use super::projection::{Method, Problem, Projection, Row, Unsolved};
use crate::model::mobility::Mobility;
use crate::shape::{Twist, Wrench};

/// How a flow moves the bodies in it by forces on them.
pub trait UnitResponse: Sync + Debug {
    /// Twists of all bodies that a unit force along an axis (`k` 0 or 1) or a unit torque about the centre (2) on one of
    /// them causes, where nothing else acts and all that is prescribed stays.
    ///
    /// # Errors
    /// Why the flow cannot be solved for.
    fn column(&self, body: usize, k: usize) -> Result<Arc<[Twist]>, String>;
}

impl UnitResponse for Mobility<'_> {
    fn column(&self, body: usize, k: usize) -> Result<Arc<[Twist]>, String> {
        Mobility::column(self, body, k).map_err(|error| error.to_string())
    }
}

/// The flow as the metric of a projection.
#[derive(Debug, Clone, Copy)]
pub struct FlowMetric<'a> {
    /// Y
    pub mobility: &'a dyn UnitResponse,
    /// U*, the twists of the flow without contact: what contact pushes moves by a step of first order.
    pub unpushed: &'a [Twist],
    /// How the step W of a body that nothing pushes follows from a change of its twist U: 1 in motions of first order.
    pub factor: f64,
}

/// Why a projection in a flow has no answer.
#[derive(Debug)]
pub(super) enum Failed {
    Rows(Unsolved),
    Flow(String),
}

/// The twists that forces and torques on bodies cause: `Y F`.
///
/// # Errors
/// A flow that cannot be solved for.
pub fn response(mobility: &dyn UnitResponse, wrenches: &[Wrench]) -> Result<Vec<Twist>, String> {
    let mut sum = vec![Twist::ZERO; wrenches.len()];
    for (body, wrench) in wrenches.iter().enumerate() {
        for (k, force) in [wrench.force.x, wrench.force.y, wrench.torque].into_iter().enumerate() {
            if force != 0.0 {
                for (sum, twist) in sum.iter_mut().zip(mobility.column(body, k)?.iter()) {
                    sum.velocity += force * twist.velocity;
                    sum.spin += force * twist.spin;
                }
            }
        }
    }
    Ok(sum)
}

/// What a step knows of the flow around its bodies.
#[derive(Debug)]
pub(super) struct InFlow<'a> {
    metric: FlowMetric<'a>,
    /// U* of every unknown.
    unpushed: Vec<f64>,
    /// The body and the part of its wrench of every unknown.
    places: Vec<(usize, usize)>,
    /// Columns of Y by unknown.
    columns: BTreeMap<usize, Vec<f64>>,
    /// Bodies in islands with a contact that acts.
    pushed: Vec<bool>,
}

impl<'a> InFlow<'a> {
    pub(super) fn new(movers: &[Mover], metric: FlowMetric<'a>) -> Self {
        let mut places = Vec::new();
        for (body, mover) in movers.iter().enumerate() {
            match mover.freedom {
                Freedom::Free { .. } => places.extend((0..3).map(|k| (body, k))),
                Freedom::Pinned { .. } => places.push((body, 2)),
                Freedom::Given { .. } => {}
            }
        }
        let unpushed = places.iter().map(|&place| component(metric.unpushed, place)).collect();
        Self { metric, unpushed, places, columns: BTreeMap::new(), pushed: vec![false; movers.len()] }
    }

    /// Projects predicted velocities: `target` of bodies that nothing pushes, U* of the others.
    pub(super) fn project(&mut self, problem: &Problem, method: Method, warm: &[f64]) -> Result<Projection, Failed> {
        let (unpushed, factor) = (self.unpushed.clone(), self.metric.factor);
        self.solve((&unpushed, factor), problem, method, warm)
    }

    /// Projects a displacement.
    pub(super) fn displace(&mut self, problem: &Problem, method: Method, warm: &[f64]) -> Result<Projection, Failed> {
        let nothing = vec![0.0; problem.target.len()];
        self.solve((&nothing, 1.0), problem, method, warm)
    }

    fn solve(
        &mut self,
        (of_pushed, factor): (&[f64], f64),
        problem: &Problem,
        method: Method,
        warm: &[f64],
    ) -> Result<Projection, Failed> {
        let rests = problem.target.iter().all(|u| *u == 0.0);
        let mut now = Projection {
            velocity: problem.target.clone(),
            multipliers: vec![0.0; problem.rows.len()],
            ..Projection::default()
        };
        let mut solved = false;
        loop {
            let least = |row: &Row| if rests || solved { -row.slack } else { 0.0 };
            let acts = |row: &Row| row.bound < 0.0 || row.value(&now.velocity) < least(row);
            let has_grown = self.push_islands(&problem.rows, acts);
            if !has_grown && (solved || !self.pushed.contains(&true)) {
                return Ok(now);
            }
            let base: Vec<f64> = (self.places.iter().enumerate())
                .map(|(i, &(body, _))| if self.pushed[body] { of_pushed[i] } else { problem.target[i] })
                .collect();
            let found = self.solve_pushed((&base, factor), problem, method, warm)?;
            let (iterations, factorisations) =
                (now.iterations + found.iterations, now.factorisations + found.factorisations);
            now = Projection { iterations, factorisations, ..found };
            solved = true;
        }
    }

    /// Notes the bodies of islands that have a row which acts; whether there are new ones.
    fn push_islands(&mut self, rows: &[Row], acts: impl Fn(&Row) -> bool) -> bool {
        let bodies_of = |row: &Row| -> BTreeSet<usize> { row.entries.iter().map(|&(k, _)| self.places[k].0).collect() };
        let linked: Vec<BTreeSet<usize>> = rows.iter().map(bodies_of).collect();
        let mut pushed = self.pushed.clone();
        let touched = rows.iter().zip(&linked).filter(|(row, _)| acts(row));
        touched.flat_map(|(_, bodies)| bodies).for_each(|&body| pushed[body] = true);
        loop {
            let before = pushed.clone();
            for bodies in &linked {
                if bodies.iter().any(|&body| pushed[body]) {
                    bodies.iter().for_each(|&body| pushed[body] = true);
                }
            }
            if pushed == before {
                break;
            }
        }
        let has_grown = pushed != self.pushed;
        self.pushed = pushed;
        has_grown
    }

    /// Projects what is pushed, and moves the rest with the flow.
    fn solve_pushed(
        &mut self,
        (base, factor): (&[f64], f64),
        problem: &Problem,
        method: Method,
        warm: &[f64],
    ) -> Result<Projection, Failed> {
        let is_pushed = |row: &Row| row.entries.iter().any(|&(k, _)| self.pushed[self.places[k].0]);
        let chosen: Vec<usize> = (0..problem.rows.len()).filter(|&c| is_pushed(&problem.rows[c])).collect();
        let support: BTreeSet<usize> =
            chosen.iter().flat_map(|&c| problem.rows[c].entries.iter().map(|&(k, _)| k)).collect();
        let support: Vec<usize> = support.into_iter().collect();
        self.learn(&support).map_err(Failed::Flow)?;
        let size = support.len();
        let mobility = DMatrix::from_fn(size, size, |i, j| {
            0.5 * (self.columns[&support[j]][support[i]] + self.columns[&support[i]][support[j]])
        });
        let indefinite = || Failed::Flow("its mobility is not positive definite".to_owned());
        let lower = mobility.clone().cholesky().ok_or_else(indefinite)?.unpack();
        let place = |k: usize| support.binary_search(&k).expect("an unknown of the support");
        let transformed = |&c: &usize| {
            let row = &problem.rows[c];
            let along = |j: usize| row.entries.iter().map(|&(k, b)| b * lower[(place(k), j)]).sum::<f64>();
            let entries = (0..size).map(|j| (j, along(j))).filter(|(_, b)| *b != 0.0).collect();
            Row { entries, offset: row.offset + row.times(base), ..row.clone() }
        };
        let rows = chosen.iter().map(transformed).collect();
        let small = Problem { metric: vec![1.0; size], target: vec![0.0; size], rows, tolerance: problem.tolerance };
        let warm: Vec<f64> = chosen.iter().map(|&c| warm[c]).collect();
        let found = small
            .solve(method, &warm)
            .map_err(|unsolved| Failed::Rows(Unsolved { row: chosen[unsolved.row], ..unsolved }))?;
        let mut multipliers = vec![0.0; problem.rows.len()];
        let mut forces = vec![0.0; size];
        for (&c, &mu) in chosen.iter().zip(&found.multipliers) {
            multipliers[c] = mu;
            problem.rows[c].entries.iter().for_each(|&(k, b)| forces[place(k)] += b * mu);
        }
        let mut velocity = base.to_vec();
        for (i, (u, &(body, _))) in velocity.iter_mut().zip(&self.places).enumerate() {
            let own = support.binary_search(&i);
            let by = |j: usize| own.map_or_else(|_| self.columns[&support[j]][i], |i| mobility[(i, j)]);
            let change: f64 = forces.iter().enumerate().map(|(j, force)| by(j) * force).sum();
            *u += if self.pushed[body] { change } else { factor * change };
        }
        Ok(Projection { velocity, multipliers, ..found })
    }

    /// Solves for the columns of some unknowns.
    fn learn(&mut self, unknowns: &[usize]) -> Result<(), String> {
        let new: Vec<usize> = unknowns.iter().copied().filter(|k| !self.columns.contains_key(k)).collect();
        let column = |&unknown: &usize| {
            let (body, k) = self.places[unknown];
            let twists = self.metric.mobility.column(body, k)?;
            Ok((unknown, self.places.iter().map(|&place| component(&twists, place)).collect()))
        };
        let columns: Vec<(usize, Vec<f64>)> = new.par_iter().map(column).collect::<Result<_, String>>()?;
        self.columns.extend(columns);
        Ok(())
    }
}

/// A component of the twist of a body.
fn component(twists: &[Twist], (body, k): (usize, usize)) -> f64 {
    let Twist { velocity, spin } = twists[body];
    [velocity.x, velocity.y, spin][k]
}
