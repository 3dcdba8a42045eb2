//! Recognises a flow that repeats itself: the distance to an earlier state returns to nearly zero, again and again.

use crate::model::State;
use crate::model::fields::VELOCITY;
use crate::solve::{dot, root};
use crate::time::Sheet;

/// A flow that repeats itself.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Oscillation {
    /// Time after which the flow is the same again.
    pub period: f64,
    /// Half of the largest root mean square distance between what is carried (the polarity, and a density) and that at
    /// the cycle's start.
    pub amplitude: f64,
    /// The same of the velocity.
    pub amplitude_velocity: f64,
    /// How much the last two cycles differ: the larger of the relative differences of period and amplitude.
    pub spread: f64,
}

/// What is carried, and the velocity, at the start of a cycle.
#[derive(Debug)]
struct Reference {
    t: f64,
    y: Vec<f64>,
    v: Vec<f64>,
}

/// Watches a march.
#[derive(Debug)]
pub struct Watch {
    reference: Option<Reference>,
    /// Times and distances of what is carried since, the last three.
    last: Vec<(f64, f64)>,
    /// Largest distances of that and of the velocity since.
    largest: [f64; 2],
    steps: usize,
    /// Steps after which a reference that does not recur is given up.
    patience: usize,
    cycles: Vec<Oscillation>,
}

/// A state recurs when its distance falls below this share of the largest.
const RECURRENCE: f64 = 0.15;

/// Two cycles in a row that differ by less are the same.
const SAME: f64 = 0.02;

/// Cycles that must agree.
const CYCLES: usize = 3;

/// Distances below this are no oscillation.
const REST: f64 = 1e-6;

impl Default for Watch {
    fn default() -> Self {
        Self { reference: None, last: Vec::new(), largest: [0.0; 2], steps: 0, patience: 60, cycles: Vec::new() }
    }
}

impl Watch {
    /// Takes in the state at time `t`; an oscillation when the last cycles agree.
    pub fn see(&mut self, model: &dyn Sheet, state: &State, t: f64) -> Option<Oscillation> {
        let scale = model.area().sqrt();
        let Some(reference) = &self.reference else {
            self.restart(state, t);
            return None;
        };
        let minus = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
        let dy = minus(&state.carried(), &reference.y);
        let distance = root(dot(&dy, &model.mass_times(&dy))) / scale;
        let dv = model.velocity_mass().quadratic(&minus(&state[VELOCITY].values, &reference.v));
        let begin = reference.t;
        self.largest[1] = self.largest[1].max(root(dv) / scale);
        self.distance(begin, t, distance)
            .and_then(|cycle| {
                self.restart(state, t);
                self.agree(cycle)
            })
            .or_else(|| {
                if self.steps > self.patience {
                    // the reference may have been a transient
                    self.patience = self.patience * 3 / 2;
                    self.cycles.clear();
                    self.restart(state, t);
                }
                None
            })
    }

    fn restart(&mut self, state: &State, t: f64) {
        self.reference = Some(Reference { t, y: state.carried(), v: state[VELOCITY].values.clone() });
        (self.last, self.largest, self.steps) = (vec![(t, 0.0)], [0.0; 2], 0);
    }

    /// Books a distance; a cycle when the one before was a small minimum.
    fn distance(&mut self, begin: f64, t: f64, distance: f64) -> Option<Oscillation> {
        self.steps += 1;
        self.largest[0] = self.largest[0].max(distance);
        self.last.push((t, distance));
        if self.last.len() > 3 {
            self.last.remove(0);
        }
        let [(ta, a), (tb, b), (tc, c)] = self.last[..] else { return None };
        let minimum = b <= a && b < c && b < RECURRENCE * self.largest[0] && self.largest[0] > REST;
        if !minimum || self.steps < 5 {
            return None;
        }
        // the squared distance is a parabola about its minimum
        let (fa, fb, fc) = (a * a, b * b, c * c);
        let (left, right) = (tb - ta, tc - tb);
        let curvature = (fc - fb) / right - (fb - fa) / left;
        let slope = ((fc - fb) / right * left + (fb - fa) / left * right) / (left + right);
        let vertex = tb - 0.5 * slope * (left + right) / curvature;
        Some(Oscillation {
            period: vertex.clamp(ta, tc) - begin,
            amplitude: 0.5 * self.largest[0],
            amplitude_velocity: 0.5 * self.largest[1],
            spread: 1.0,
        })
    }

    /// The newest cycle, if it agrees with those before it.
    fn agree(&mut self, mut cycle: Oscillation) -> Option<Oscillation> {
        self.cycles.push(cycle);
        let recent = &self.cycles[self.cycles.len().saturating_sub(CYCLES)..];
        let apart = |a: f64, b: f64| (a - b).abs() / a.abs().max(b.abs());
        let differ = |pair: &[Oscillation]| {
            apart(pair[0].period, pair[1].period).max(apart(pair[0].amplitude, pair[1].amplitude))
        };
        cycle.spread = recent.windows(2).map(differ).fold(0.0, f64::max);
        (recent.len() == CYCLES && cycle.spread < SAME).then_some(cycle)
    }
}

#[cfg(test)]
mod tests {
    use super::Watch;

    /// Feeds distances of a planar motion `(r cos ωt, r sin ωt)` with radius `r(t)`.
    fn watch(radius: impl Fn(f64) -> f64, step: f64) -> Option<(f64, f64)> {
        let mut watch = Watch::default();
        let place = |t: f64| (radius(t) * t.cos(), radius(t) * t.sin());
        let (mut begin, mut from) = (0.0, place(0.0));
        watch.last = vec![(0.0, 0.0)];
        for n in 1..2000 {
            let t = n as f64 * step;
            let (x, y) = place(t);
            if let Some(cycle) = watch.distance(begin, t, (x - from.0).hypot(y - from.1)) {
                if let Some(found) = watch.agree(cycle) {
                    return Some((found.period, found.amplitude));
                }
                (begin, from) = (t, (x, y));
                (watch.last, watch.largest, watch.steps) = (vec![(t, 0.0)], [0.0; 2], 0);
            }
        }
        None
    }

    #[test]
    fn a_circle_has_its_period_and_radius() {
        let (period, amplitude) = watch(|_| 1.0, 0.17).expect("a circle repeats itself");
        assert!((period - std::f64::consts::TAU).abs() < 0.01, "{period}");
        assert!((amplitude - 1.0).abs() < 0.01, "{amplitude}");
    }

    #[test]
    fn a_spiral_is_no_oscillation() {
        assert_eq!(watch(|t| (-0.05 * t).exp(), 0.17), None);
    }
}
