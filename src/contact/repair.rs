//! Poses without overlap where straight steps end with some: the gap of shapes that turn is not convex.
//!
//! ```text
//! δ = argmin ½|δ|²_M   over   D(x + Δt W + δ) ≥ η        (= η for bonds that hold)
//! ```
//! by linear rows about the last poses, until no gap is missed. With inertia δ enters no velocity: a step that pushed
//! bodies out of each other by their velocities would give them energy. What it changes of the angular momentum,
//! `Σ μ n×(V_j − V_i)`, the centres of each pair give back along their contact, `t = n^⊥`, which takes energy away.

use super::gap::Touch;
use super::mobility::Failed;
use super::mover::Freedom;
use super::outcome::holds;
use super::pairs::Pair;
use super::projection::{Problem, Projection, Row};
use super::solver::partner_name;
use super::step::{Near, Step};
use super::{ContactError, Partner};
use crate::mesh::Point;
use crate::shape::{Pose, Twist, perpendicular};

/// Linear rows about new poses before a smaller step is asked for.
const ROUNDS: usize = 60;

/// Where bodies end without overlap.
#[derive(Debug, Clone, Default)]
pub(super) struct Repaired {
    /// Their poses.
    pub poses: Vec<Pose>,
    /// Touches that pushed, and their multipliers.
    pub pushes: Vec<Push>,
    pub iterations: usize,
    pub factorisations: usize,
    pub rounds: usize,
}

/// What a touch did to the poses, `δ = M⁻¹ Σ μ G`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Push {
    pub pair: Pair,
    pub touch: Touch,
    /// μ
    pub multiplier: f64,
}

/// What one round looks at.
struct Round {
    touches: Vec<(Pair, Touch)>,
    rows: Vec<Row>,
    /// The pair that is missed most, and by how much, if any is.
    worst: Option<(Pair, f64)>,
}

impl Step<'_> {
    /// The least displacement from the ends of straight steps after which no gap is missed.
    pub(super) fn repair(&mut self, pairs: &[Pair], twists: &[Twist]) -> Result<Repaired, ContactError> {
        let ends: Vec<Pose> =
            self.movers.iter().zip(twists).map(|(mover, twist)| mover.after(twist, self.dt)).collect();
        let mut out = Repaired { poses: ends.clone(), ..Repaired::default() };
        let mut delta = vec![0.0; self.metric.len()];
        // rows that follow their gaps have none to repair
        if !self.misses_a_tangent(pairs, &ends) {
            return Ok(out);
        }
        loop {
            let Round { touches, rows, worst } = self.round(pairs, &out.poses, &delta);
            let Some((pair, miss)) = worst else { return Ok(out) };
            if out.rounds == ROUNDS {
                return Err(self.overlapped(pair, miss));
            }
            let known = |(pair, touch): &(Pair, Touch)| {
                let same = |push: &&Push| push.pair == *pair && push.touch.slot == touch.slot;
                out.pushes.iter().find(same).map_or(0.0, |push| push.multiplier)
            };
            let warm: Vec<f64> = touches.iter().map(known).collect();
            let tolerance = self.solver.settings.tolerance;
            let problem = Problem { metric: self.metric.clone(), target: vec![0.0; delta.len()], rows, tolerance };
            let method = self.solver.settings.method;
            let solved = match &mut self.flow {
                None => problem.solve(method, &warm).map_err(Failed::Rows),
                Some(flow) => flow.displace(&problem, method, &warm),
            };
            let solved = solved.map_err(|failed| match failed {
                Failed::Rows(unsolved) => self.overlapped(touches[unsolved.row].0, miss),
                Failed::Flow(reason) => ContactError::Flow { reason },
            })?;
            let Projection { velocity, multipliers, iterations, factorisations } = solved;
            delta = velocity;
            out.poses = self.displaced(&ends, &delta);
            let pushes = touches.into_iter().zip(multipliers).filter(|(_, multiplier)| *multiplier != 0.0);
            out.pushes = pushes.map(|((pair, touch), multiplier)| Push { pair, touch, multiplier }).collect();
            out.rounds += 1;
            out.iterations += iterations;
            out.factorisations += factorisations;
        }
    }

    /// Whether a gap is missed whose row is a tangent.
    fn misses_a_tangent(&self, pairs: &[Pair], poses: &[Pose]) -> bool {
        let mut found: Vec<Touch> = Vec::new();
        pairs.iter().filter(|pair| self.is_tangent(**pair)).any(|&pair| {
            found.clear();
            let reach = self.solver.settings.margin + self.pair_reach(pair);
            self.solver.touches(self.movers, pair, |k| poses[k], reach, &mut found);
            found.iter().any(|touch| self.miss(pair, touch) > 4.0 * self.slack(pair) || touch.gap.is_nan())
        })
    }

    /// By how much a touch misses its gap: also by being too wide where a bond holds it.
    fn miss(&self, pair: Pair, touch: &Touch) -> f64 {
        let value = touch.gap - self.solver.settings.margin;
        let held = self.near_of(pair, touch).is_some_and(|(near, mu)| holds(self.solver.settings.law, near, mu));
        if held { value.abs() } else { -value }
    }

    fn overlapped(&self, pair: Pair, miss: f64) -> ContactError {
        let (first, second) = (self.movers[pair.body].name.to_owned(), partner_name(self.movers, pair.partner));
        ContactError::Unrepaired { first, second, miss, dt: self.dt }
    }

    /// The rows `D(x) − η + G(x)·(δ' − δ)` of all touches at the poses of a displacement δ.
    fn round(&self, pairs: &[Pair], poses: &[Pose], delta: &[f64]) -> Round {
        let margin = self.solver.settings.margin;
        let mut round = Round { touches: Vec::new(), rows: Vec::new(), worst: None };
        let mut found: Vec<Touch> = Vec::new();
        for &pair in pairs {
            found.clear();
            let reach = margin + self.pair_reach(pair);
            self.solver.touches(self.movers, pair, |k| poses[k], reach, &mut found);
            let slack = self.slack(pair);
            for touch in found.iter().filter(|touch| touch.gap <= reach || touch.gap.is_nan()) {
                let value = touch.gap - margin;
                let held =
                    self.near_of(pair, touch).is_some_and(|(near, mu)| holds(self.solver.settings.law, near, mu));
                let miss = if held { value.abs() } else { -value };
                if (miss > 4.0 * slack || miss.is_nan()) && round.worst.is_none_or(|(_, most)| miss > most) {
                    round.worst = Some((pair, miss));
                }
                let entries = self.entries(pair, touch, &|k| poses[k]);
                let mut row = Row { entries, slack, ..Row::default() };
                row.offset = value - row.times(delta);
                row.bound = if held { f64::NEG_INFINITY } else { 0.0 };
                round.rows.push(row);
                round.touches.push((pair, *touch));
            }
        }
        round
    }

    /// The touch of the projection that is of the same place, and its multiplier.
    pub(super) fn near_of(&self, pair: Pair, touch: &Touch) -> Option<(&Near, f64)> {
        let first = self.near.partition_point(|near| near.pair < pair);
        let of_pair = self.near.iter().enumerate().skip(first).take_while(|(_, near)| near.pair == pair);
        let (place, near) = of_pair.into_iter().find(|(_, near)| near.touch.slot == touch.slot)?;
        Some((near, self.solution.multipliers[place]))
    }

    /// Poses after a displacement of what is free.
    fn displaced(&self, ends: &[Pose], delta: &[f64]) -> Vec<Pose> {
        let twists = self.twists_of(delta, |_, _| 0.0);
        let moved = |((mover, end), twist): ((&super::Mover, &Pose), Twist)| match mover.freedom {
            Freedom::Free { .. } => Pose { position: end.position + twist.velocity, angle: end.angle + twist.spin },
            Freedom::Pinned { pivot, .. } => {
                let angle = end.angle + twist.spin;
                Pose { position: end.to_space(pivot) - crate::shape::turned(pivot, angle), angle }
            }
            Freedom::Given { .. } => *end,
        };
        self.movers.iter().zip(ends).zip(twists).map(moved).collect()
    }

    /// Gives back what the repair changed of the angular momentum of pairs that nothing holds, where that takes energy
    /// away.
    pub(super) fn keep_angular_momentum(&self, repaired: &Repaired, twists: &mut [Twist]) {
        let mass = |k: usize| match self.movers[k].freedom {
            Freedom::Free { mass, .. } => Some(mass),
            Freedom::Pinned { .. } | Freedom::Given { .. } => None,
        };
        let mut impulses = vec![Point::zeros(); twists.len()];
        for Push { pair, touch, multiplier } in &repaired.pushes {
            let Partner::Body(other) = pair.partner else { continue };
            if mass(pair.body).is_none() || mass(other).is_none() {
                continue;
            }
            let arm = (repaired.poses[other].position - repaired.poses[pair.body].position).dot(&touch.normal);
            let sliding = touch.normal.perp(&(twists[other].velocity - twists[pair.body].velocity));
            if arm > 0.0 {
                let impulse = -multiplier * sliding / arm * perpendicular(touch.normal);
                impulses[pair.body] -= impulse;
                impulses[other] += impulse;
            }
        }
        let gains = impulses.iter().enumerate().filter_map(|(k, impulse)| {
            let mass = mass(k)?;
            Some(impulse.dot(&twists[k].velocity) + 0.5 * impulse.norm_squared() / mass)
        });
        if gains.sum::<f64>() <= 0.0 {
            for (k, impulse) in impulses.iter().enumerate() {
                if let Some(mass) = mass(k) {
                    twists[k].velocity += impulse / mass;
                }
            }
        }
    }
}
