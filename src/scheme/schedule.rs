//! When outputs, checkpoints and measures happen.

use serde::{Deserialize, Serialize};

/// A rule for repeating something; the last state always counts as well.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Schedule {
    /// At every multiple of a time; steps are trimmed to land on it.
    Time(f64),
    /// Every so many accepted steps.
    Steps(usize),
    /// Only at the end.
    End,
}

/// Two times closer than this fraction of a step, or of the interval between outputs, are the same.
const SAME: f64 = 1e-9;

impl Schedule {
    /// The next time after `t` on which a step must land.
    pub fn next_time(&self, t: f64) -> Option<f64> {
        match *self {
            Schedule::Time(every) => {
                let count = (t / every + SAME).floor() + 1.0;
                Some(plain(count * every, 0.0))
            }
            Schedule::Steps(_) | Schedule::End => None,
        }
    }

    /// How often it is due in a run of so many steps to `end`, the start included.
    pub fn count(&self, steps: f64, end: f64) -> f64 {
        match *self {
            Schedule::Time(every) => (end / every + SAME).floor() + 1.0,
            Schedule::Steps(every) => (steps / every as f64).floor() + 1.0,
            Schedule::End => 1.0,
        }
    }

    /// Whether it is due after the step that went from `before` to `t`, the `step`-th.
    pub fn is_due(&self, before: f64, t: f64, step: usize) -> bool {
        match *self {
            Schedule::Time(_) => self.next_time(before).is_some_and(|next| t >= next - SAME * (t - before)),
            Schedule::Steps(every) => step.is_multiple_of(every),
            Schedule::End => false,
        }
    }
}

/// The step to take from `t` towards `landing`: `step` itself while far away, then as many equal parts as are
/// needed, so that
/// no sliver of a step is left.
pub fn trim(t: f64, step: f64, landing: f64) -> f64 {
    let rest = landing - t;
    let parts = (rest / step - SAME).ceil();
    if parts <= 2.0 { rest / parts.max(1.0) } else { step }
}

/// The decimal number with the fewest digits among those that a number could be without its rounding errors: `value`
/// itself if none
/// lies within a few units in the last place of `value`, or of `scale` where it is the difference of numbers as
/// large as that.
///
/// Sums of steps drift from the multiples that they stand for: 0.1 + 0.1 + 0.1 is 0.30000000000000004. The times of
/// equal steps of
/// a decimal length are these multiples.
pub fn plain(value: f64, scale: f64) -> f64 {
    const LAST_PLACES: f64 = 4.0;
    let slack = LAST_PLACES * f64::EPSILON * value.abs().max(scale.abs());
    let rounded = |digits: usize| format!("{value:.digits$e}").parse::<f64>().expect("a number that was printed");
    (0..15).map(rounded).find(|near| (near - value).abs() <= slack).unwrap_or(value)
}
