//! How gaps change with what of the bodies is free.

use super::Partner;
use super::gap::{Touch, along};
use super::mover::Freedom;
use super::pairs::Pair;
use super::step::Step;
use crate::shape::{Pose, Twist, perpendicular, turned};

impl Step<'_> {
    /// The bodies of a touch, with `∂D/∂(x, y, θ)` of each.
    pub(super) fn gradients(
        Pair { body, partner }: Pair,
        touch: &Touch,
        pose: &dyn Fn(usize) -> Pose,
    ) -> impl Iterator<Item = (usize, [f64; 3])> {
        let first = (body, touch.gradient_first(pose(body).position));
        let second = match partner {
            Partner::Body(other) => Some((other, touch.gradient_second(pose(other).position))),
            Partner::Wall(_) => None,
        };
        std::iter::once(first).chain(second)
    }

    /// The rate of what has these gradients, by the bodies whose motion is given.
    pub(super) fn given_of(&self, gradients: impl Iterator<Item = (usize, [f64; 3])>) -> f64 {
        let rate = |(body, gradient): (usize, [f64; 3])| match self.movers[body].freedom {
            Freedom::Given { .. } => along(gradient, &self.movers[body].whole(&Twist::ZERO, self.dt)),
            Freedom::Free { .. } | Freedom::Pinned { .. } => 0.0,
        };
        gradients.map(rate).sum()
    }

    /// `G` of a touch with respect to what is free, with the bodies where `pose` puts them.
    pub(super) fn entries(&self, pair: Pair, touch: &Touch, pose: &dyn Fn(usize) -> Pose) -> Vec<(usize, f64)> {
        let normal = |(body, [x, y, spin]): (usize, [f64; 3])| {
            // the normals of what is round go through its centre
            (body, [x, y, if self.movers[body].shape.is_round() { 0.0 } else { spin }])
        };
        self.entries_of(Self::gradients(pair, touch, pose).map(normal), pose)
    }

    /// Gradients with respect to what is free, with the bodies where `pose` puts them.
    pub(super) fn entries_of(
        &self,
        gradients: impl Iterator<Item = (usize, [f64; 3])>,
        pose: &dyn Fn(usize) -> Pose,
    ) -> Vec<(usize, f64)> {
        let mut entries = Vec::new();
        for (body, [x, y, spin]) in gradients {
            let (mover, first) = (&self.movers[body], self.unknowns[body]);
            let mut push = |k: usize, b: f64| {
                if b != 0.0 {
                    entries.push((k, b));
                }
            };
            match mover.freedom {
                Freedom::Free { .. } => {
                    push(first, x);
                    push(first + 1, y);
                    if self.turns(body) {
                        push(first + 2, spin);
                    }
                }
                Freedom::Pinned { pivot, .. } => {
                    let arm = perpendicular(-turned(pivot, pose(body).angle));
                    push(first, x * arm.x + y * arm.y + spin);
                }
                Freedom::Given { .. } => {}
            }
        }
        entries
    }
}
