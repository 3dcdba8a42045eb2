//! Backward differentiation formulas on arbitrary time levels.

/// Highest order; from 7 on, BDF is not zero-stable.
pub const MAX_ORDER: usize = 6;

/// Weights `d_i` with `ẏ(t_0) ≈ Σ_i d_i y(t_i)`: the derivative at `times[0]` of the Lagrange interpolant through all
/// `times` (newest first).
///
/// On equal steps `d_i = α_i/Δt` with the usual coefficients α; on unequal steps these keep the order, constant ones
/// lose it.
pub fn derivative_weights(times: &[f64]) -> Vec<f64> {
    derivative_weights_at(times, 0)
}

/// Weights `d_i` with `ẏ(t_at) ≈ Σ_i d_i y(t_i)`: the derivative at `times[at]` of the same interpolant.
pub fn derivative_weights_at(times: &[f64], at: usize) -> Vec<f64> {
    let here = times[at];
    let others = |skip: usize| (0..times.len()).filter(move |&m| m != at && m != skip);
    let weight = |j: usize| -> f64 {
        if j == at {
            return others(at).map(|m| 1.0 / (here - times[m])).sum();
        }
        let ratio: f64 = others(j).map(|m| (here - times[m]) / (times[j] - times[m])).product();
        ratio / (times[j] - here)
    };
    (0..times.len()).map(weight).collect()
}
