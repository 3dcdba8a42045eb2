//! Backward differentiation formulas on arbitrary time levels.

/// Highest order; from 7 on, BDF is not zero-stable.
pub const MAX_ORDER: usize = 6;

/// Weights `d_i` with `ẏ(t_0) ≈ Σ_i d_i y(t_i)`: the derivative at `times[0]` of the Lagrange interpolant through all
/// `times` (newest first).
///
/// On equal steps `d_i = α_i/Δt` with the usual coefficients α; on unequal steps these keep the order, constant ones lose
/// it.
pub fn derivative_weights(times: &[f64]) -> Vec<f64> {
    let now = times[0];
    let others = |skip: usize| (1..times.len()).filter(move |&m| m != skip);
    let mut weights = vec![others(0).map(|m| 1.0 / (now - times[m])).sum()];
    for j in 1..times.len() {
        let ratio: f64 = others(j).map(|m| (now - times[m]) / (times[j] - times[m])).product();
        weights.push(ratio / (times[j] - now));
    }
    weights
}
