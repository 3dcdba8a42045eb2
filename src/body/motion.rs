//! Where bodies go (algorithm 1.1 of Lefebvre's thesis).

use super::leaving::Remaining;
use crate::mesh::Point;
use crate::scheme::bdf::derivative_weights;
use crate::shape::{Pose, Twist};

/// Poses in time, and what the next step needs to know of the past.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Motion {
    /// Where the bodies are.
    pub poses: Vec<Pose>,
    /// 1: `x ← x + Δt V`. 2: the BDF of order 2 on any steps, with V extrapolated:
    /// `Σ_i d_i x_i = V* = V_n + (Δt/Δt_{n−1})(V_n − V_{n−1})`.
    pub order: usize,
    /// The last step: its size, the twists at its beginning, and those by which the bodies moved.
    last: Option<(f64, Vec<Twist>, Vec<Twist>)>,
}

impl Motion {
    /// Bodies that have not moved yet.
    ///
    /// # Panics
    /// For an order other than 1 and 2.
    pub fn new(poses: Vec<Pose>, order: usize) -> Self {
        assert!((1..=2).contains(&order), "motions have order 1 or 2");
        Self { poses, order, last: None }
    }

    /// That of the bodies that are left.
    #[must_use]
    pub fn of(&self, remaining: &Remaining) -> Self {
        let last = self.last.as_ref().map(|(dt, now, by)| (*dt, remaining.of(now), remaining.of(by)));
        Self { poses: remaining.of(&self.poses), order: self.order, last }
    }

    /// The twists W with which a step ends at `x + Δt W`, for bodies that have the twists `now`. They are what contact
    /// corrects. The first step of all is of first order.
    pub fn predicted(&self, dt: f64, now: &[Twist]) -> Vec<Twist> {
        match &self.last {
            Some((before, twists, moved)) if self.order == 2 && dt > 0.0 => {
                let [d0, d1, d2] = weights(dt, *before);
                debug_assert!((d0 + d1 + d2).abs() < 1e-10 * d0);
                let ratio = dt / before;
                let parts = now.iter().zip(twists).zip(moved);
                // d_0 (x + Δt W) + d_1 x + d_2 (x − Δt' W') = V* with d_0 + d_1 + d_2 = 0
                parts
                    .map(|((v, old), w)| combine([(1.0 + ratio, v), (-ratio, old), (d2 * before, w)], d0 * dt))
                    .collect()
            }
            Some(_) | None => now.to_vec(),
        }
    }

    /// How the predicted twists follow from a change of those that the bodies have: `∂W/∂V`.
    pub fn slope(&self, dt: f64) -> f64 {
        match &self.last {
            Some((before, ..)) if self.order == 2 && dt > 0.0 => (1.0 + dt / before) / (weights(dt, *before)[0] * dt),
            Some(_) | None => 1.0,
        }
    }

    /// Moves by `by` (predicted, corrected or given) from a time at which the bodies had the twists `now`.
    pub fn advance(&mut self, dt: f64, now: &[Twist], by: &[Twist]) {
        for (pose, w) in self.poses.iter_mut().zip(by) {
            pose.position += dt * w.velocity;
            pose.angle += dt * w.spin;
        }
        if dt > 0.0 {
            self.last = Some((dt, now.to_vec(), by.to_vec()));
        }
    }
}

/// Weights of the derivative at the end of a step `dt` that follows a step `before`, newest first.
fn weights(dt: f64, before: f64) -> [f64; 3] {
    let weights = derivative_weights(&[0.0, -dt, -dt - before]);
    [weights[0], weights[1], weights[2]]
}

/// `(Σ aᵢ tᵢ) / divisor`
fn combine(terms: [(f64, &Twist); 3], divisor: f64) -> Twist {
    let velocity = terms.iter().map(|(a, t)| *a * t.velocity).sum::<Point>() / divisor;
    Twist { velocity, spin: terms.iter().map(|(a, t)| a * t.spin).sum::<f64>() / divisor }
}
