//! Islands of bodies that contact pushes in a step, and the energy that it gives them.

use super::mover::Freedom;
use super::pairs::Pair;
use super::projection::Projection;
use super::step::Step;
use super::{ContactError, Partner};
use crate::shape::Twist;

/// Energy that rounding may give, relative to what an island has; a tolerance that is larger may give as much as it.
const ROUNDING: f64 = 1e-12;

impl Step<'_> {
    /// Projects until the gaps at the end of the step are what the rows say. Where this would raise the kinetic energy
    /// of an island, or finds no end, its rows are the tangents at the beginning of the step, for which rest is
    /// admissible, and its poses are repaired.
    pub(super) fn rounds(&mut self, pairs: &[Pair]) -> Result<(), ContactError> {
        loop {
            let (islands, failure) = match self.follow_gaps(pairs) {
                Ok(()) if self.strike() => continue,
                Ok(()) => (self.raised(), None),
                Err((pair, error)) => (self.island_of(pair), Some(error)),
            };
            let new: Vec<usize> =
                islands.into_iter().filter(|k| !self.tangent[*k] || self.restitution[*k] > 0.0).collect();
            match failure {
                Some(error) if new.is_empty() => return Err(error),
                Some(error) => self.failure = Some(error),
                None if new.is_empty() => return Ok(()),
                None => {}
            }
            for k in new {
                if self.tangent[k] {
                    self.soften(k);
                }
                self.tangent[k] = true;
            }
            self.solution = Projection::default();
            for place in 0..self.near.len() {
                let near = &self.near[place];
                if self.is_tangent(near.pair) {
                    let offset = self.offset(near.pair, &near.touch, near.struck);
                    let near = &mut self.near[place];
                    (near.row.offset, near.followed) = (offset, false);
                }
            }
        }
    }

    /// Whether the row of a pair is the tangent at the beginning of the step.
    pub(super) fn is_tangent(&self, Pair { body, partner }: Pair) -> bool {
        self.tangent[body]
            || match partner {
                Partner::Body(other) => self.tangent[other],
                Partner::Wall(_) => false,
            }
    }

    /// Whether forces and contact move a body.
    fn is_moved(&self, body: usize) -> bool {
        match self.movers[body].freedom {
            Freedom::Free { .. } | Freedom::Pinned { .. } => true,
            Freedom::Given { .. } => false,
        }
    }

    /// The island of every body: the lowest number of a body in it. What is given does not connect.
    fn islands(&self, is_pushed: impl Fn(usize) -> bool) -> Vec<usize> {
        let mut parent: Vec<usize> = (0..self.movers.len()).collect();
        let root = |parent: &mut [usize], mut k: usize| {
            while parent[k] != k {
                parent[k] = parent[parent[k]];
                k = parent[k];
            }
            k
        };
        for (place, near) in self.near.iter().enumerate().filter(|(place, _)| is_pushed(*place)) {
            let Partner::Body(other) = self.near[place].pair.partner else { continue };
            if self.is_moved(near.pair.body) && self.is_moved(other) {
                let (a, b) = (root(&mut parent, near.pair.body), root(&mut parent, other));
                parent[a.max(b)] = a.min(b);
            }
        }
        (0..parent.len()).map(|k| root(&mut parent, k)).collect()
    }

    /// The bodies that can be reached from a pair over rows, which are all that a projection that failed can tell.
    fn island_of(&self, Pair { body, partner }: Pair) -> Vec<usize> {
        let islands = self.islands(|_| true);
        let of = match partner {
            Partner::Body(other) if !self.is_moved(body) => islands[other],
            Partner::Body(_) | Partner::Wall(_) => islands[body],
        };
        (0..islands.len()).filter(|k| islands[*k] == of).collect()
    }

    /// The bodies of islands whose kinetic energy contact raises, without a moving obstacle that works on them.
    fn raised(&self) -> Vec<usize> {
        // without inertia there is none
        if !self.metric_of.has_inertia() {
            return Vec::new();
        }
        let pushed = |place: usize| self.solution.multipliers[place] != 0.0;
        let islands = self.islands(pushed);
        let (mut gains, mut before) = (vec![[0.0; 2]; islands.len()], vec![0.0_f64; islands.len()]);
        for (k, island) in islands.iter().enumerate() {
            let end = self.unknowns.get(k + 1).copied().unwrap_or(self.metric.len());
            for i in self.unknowns[k]..end {
                gains[*island][0] += 0.5 * self.metric[i] * self.solution.velocity[i].powi(2);
                gains[*island][1] += 0.5 * self.metric[i] * self.target[i].powi(2);
            }
            before[*island] += 0.5 * self.energy_before(k);
        }
        for (_, near) in self.near.iter().enumerate().filter(|(place, _)| pushed(*place)) {
            let Partner::Body(other) = near.pair.partner else { continue };
            for (one, given) in [(near.pair.body, other), (other, near.pair.body)] {
                let works = !self.is_moved(given) && self.movers[given].whole(&Twist::ZERO, self.dt) != Twist::ZERO;
                if works && self.is_moved(one) {
                    gains[islands[one]][1] = f64::INFINITY;
                }
            }
        }
        let most = |island: usize| match self.solver.settings.restitution {
            0.0 => gains[island][1],
            // what bounces takes back the velocity from before the step
            _ => gains[island][1].max(before[island]),
        };
        let room = ROUNDING.max(self.solver.settings.tolerance);
        (0..islands.len()).filter(|k| gains[islands[*k]][0] > most(islands[*k]) * (1.0 + room)).collect()
    }
}
