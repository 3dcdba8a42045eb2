//! A-BDF(θ): blends of the implicit and the explicit BDF on arbitrary time levels, with nonnegative coefficients where
//! the times allow it.

use super::bdf::derivative_weights_at;

/// Highest order: from 4 on, no θ makes all coefficients nonnegative even on equal steps.
pub const MAX_ORDER: usize = 3;
/// `θ*`: on equal steps all coefficients of the orders 1, 2 and 3 are positive.
pub const THETA: f64 = -0.35;
/// What the stiffness is multiplied by before a formula counts as stable.
pub const STABILITY_MARGIN: f64 = 1.2;

/// `y^n = Σ_{i≥1} α̃_i y^{n−i} + Δt (β̃_0 f^n + β̃_1 f^{n−1})`   [8.23]
///
/// with `α̃_i = −(α_i/α_0 − θ α^e_i/α^e_0)/(1−θ)`, `β̃_0 = 1/(α_0 (1−θ))`, `β̃_1 = −θ/(α^e_0 (1−θ))` and
/// `Δt = t_n − t_{n−1}`, where `α_i/Δt` and `α^e_i/Δt` are the weights of the derivative, at `t_n` and at `t_{n−1}`, of
/// the Lagrange interpolant through `t_n, …, t_{n−b}`: the formula has order b on any times and for any θ. θ = 0 is the
/// implicit BDF.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula {
    /// b
    pub order: usize,
    /// θ < 1
    pub theta: f64,
    /// `α̃_1, …, α̃_b`; their sum is 1.
    pub alpha: Vec<f64>,
    /// `β̃_0, β̃_1`
    pub beta: [f64; 2],
}

impl Formula {
    /// The formula on `times`: `t_n, …, t_{n−b}`, newest first, for `θ < 1`.
    pub fn new(times: &[f64], theta: f64) -> Self {
        let dt = times[0] - times[1];
        let (implicit, explicit) = (derivative_weights_at(times, 0), derivative_weights_at(times, 1));
        let share = 1.0 / (1.0 - theta);
        let blend = |(a, e): (&f64, &f64)| -(a / implicit[0] - theta * (e / explicit[0])) * share;
        Self {
            order: times.len() - 1,
            theta,
            alpha: implicit[1..].iter().zip(&explicit[1..]).map(blend).collect(),
            beta: [share / (dt * implicit[0]), -theta * share / (dt * explicit[0])],
        }
    }

    /// The interval of θ in which all coefficients on these times are nonnegative, if there is one. Its lower end can
    /// be `−∞`.
    ///
    /// `(1−θ) α̃_i = −α_i/α_0 + θ α^e_i/α^e_0` is linear in θ, and `β̃_1 ≥ 0` is `θ ≤ 0` because `α^e_0 > 0`. For order
    /// 1 it is `(−∞, 0]`; for order 2 it always exists, its upper end is the trapezoidal rule.
    pub fn admissible(times: &[f64]) -> Option<(f64, f64)> {
        let (implicit, explicit) = (derivative_weights_at(times, 0), derivative_weights_at(times, 1));
        let (mut low, mut high) = (f64::NEG_INFINITY, 0.0_f64);
        for (a, e) in implicit[1..].iter().zip(&explicit[1..]) {
            let (constant, slope) = (-a / implicit[0], e / explicit[0]);
            if slope > 0.0 {
                low = low.max(-constant / slope);
            } else if slope < 0.0 {
                high = high.min(-constant / slope);
            } else if constant < 0.0 {
                return None;
            }
        }
        (low <= high).then_some((low, high))
    }

    /// The most negative `z = λΔt` for which the formula is known to be stable on `y' = λy`; `−∞` where none is too
    /// negative.
    ///
    /// For `z → −∞` a root of the recursion tends to `−β̃_1/β̃_0`, so a formula with `β̃_1 ≤ β̃_0` has no bound.
    /// Otherwise, with nonnegative coefficients, `|y^n| ≤ max_i |y^{n−i}|` holds on any sequence of steps as long as
    /// `|z| (β̃_1 − β̃_0) ≤ 1 + α̃_1 − Σ_{i≥2} α̃_i`. On equal steps the recursion is unstable beyond the z at which −1
    /// is a root: for orders 1 and 2 that is the same bound, −80 for order 2 at θ*; for order 3 it is −4.43 while this
    /// gives −4.40. With negative coefficients (θ = 0 on the orders above 1) the bound is a heuristic.
    pub fn stable_until(&self) -> f64 {
        let explicit_share = self.beta[1] - self.beta[0];
        if explicit_share <= 0.0 {
            return f64::NEG_INFINITY;
        }
        let older: f64 = self.alpha[1..].iter().sum();
        -(1.0 + self.alpha[0] - older).max(0.0) / explicit_share
    }

    /// `α̃_1/β̃_1`, the largest `Δt |a_ii|` for which a nonnegative formula keeps `y' = Ay` nonnegative when the
    /// off-diagonal entries of A are; `∞` when nothing is explicit.
    ///
    /// `(I − Δt β̃_0 A) y^n = (α̃_1 I + Δt β̃_1 A) y^{n−1} + …`: the left matrix has a nonnegative inverse, the right
    /// one is nonnegative up to this step.
    pub fn positive_until(&self) -> f64 {
        if self.beta[1] > 0.0 { self.alpha[0] / self.beta[1] } else { f64::INFINITY }
    }

    /// Whether all coefficients are nonnegative.
    pub fn is_positive(&self) -> bool {
        self.alpha.iter().chain(&self.beta).all(|&c| c >= 0.0)
    }

    /// The formula for the step to `times[0]` from `times[1..]`, newest first, of order at most `order` and at most the
    /// number of past times; `stiffness` is the largest `−λΔt` that the step has to bear.
    ///
    /// The highest order whose coefficients can be nonnegative, at θ* or the admissible θ nearest to it; order 1 always
    /// is. When that is not stable for the stiffness, or with `implicit_only`, it is θ = 0: the implicit BDF, whose
    /// coefficients are not all nonnegative above order 1.
    pub fn choose(times: &[f64], order: usize, stiffness: f64, implicit_only: bool) -> Self {
        let highest = order.min(times.len() - 1);
        if implicit_only {
            return Self::new(&times[..=highest], 0.0);
        }
        let positive = (1..=highest).rev().find_map(|order| Self::nearest(&times[..=order]));
        let formula = positive.expect("order 1 is nonnegative for every θ ≤ 0");
        if formula.stable_until() <= -STABILITY_MARGIN * stiffness {
            return formula;
        }
        Self::new(&times[..=formula.order], 0.0)
    }

    /// The formula at θ* or at the admissible θ nearest to it.
    fn nearest(times: &[f64]) -> Option<Self> {
        let (low, high) = Self::admissible(times)?;
        // at the very end a coefficient is zero up to rounding; if it is α̃_1, no explicit part keeps anything positive
        let inset = 0.1 * (high - low).min(0.1);
        let theta = if (low..=high).contains(&THETA) { THETA } else { THETA.clamp(low + inset, high - inset) };
        Some(Self::new(times, theta)).filter(Self::is_positive)
    }
}
