//! Gauss–Lobatto points on `[0, 1]`: the ends and the zeros of the derivative of the Legendre polynomial of degree `q`.

/// The `q + 1` points, ascending, `1 ≤ q ≤ 5`; a rule on them is exact up to degree `2q − 1`.
///
/// # Panics
/// For a degree that no space has.
pub fn points(q: usize) -> Vec<f64> {
    let inner: &[f64] = match q {
        1 => &[],
        2 => &[0.0],
        3 => &[0.2],
        4 => &[0.0, 3.0 / 7.0],
        5 => &[(7.0 - 2.0 * 7_f64.sqrt()) / 21.0, (7.0 + 2.0 * 7_f64.sqrt()) / 21.0],
        _ => panic!("no Lobatto points of degree {q}"),
    };
    let right: Vec<f64> = inner.iter().copied().chain([1.0]).map(f64::sqrt).collect();
    let left = right.iter().rev().filter(|x| **x > 0.0).map(|x| 0.5 - 0.5 * x);
    left.chain(right.iter().map(|x| 0.5 + 0.5 * x)).collect()
}

/// Weights `ℓ_j(s)` with which a polynomial of degree `q` at `s` follows from its values at [`points`].
pub fn weights(q: usize, s: f64) -> Vec<f64> {
    let points = points(q);
    let factor = |j: usize, m: usize| (s - points[m]) / (points[j] - points[m]);
    (0..=q).map(|j| (0..=q).filter(|&m| m != j).map(|m| factor(j, m)).product()).collect()
}

#[cfg(test)]
mod tests {
    use super::{points, weights};

    #[test]
    fn interpolates_and_integrates_powers() {
        for q in 1..=5 {
            for n in 0..=q {
                let value: f64 = points(q).iter().zip(weights(q, 0.37)).map(|(x, w)| w * x.powi(n as i32)).sum();
                assert!((value - 0.37_f64.powi(n as i32)).abs() < 1e-14, "degree {q}, power {n}: {value}");
            }
            // the polynomial that vanishes at the points is orthogonal to degree q − 2
            let rule = crate::element::quadrature::interval(2 * q);
            for n in 0..q as i32 - 1 {
                let at = |s: f64| points(q).iter().map(|x| s - x).product::<f64>() * s.powi(n);
                let sum: f64 = rule.points.iter().zip(&rule.weights).map(|(s, w)| w * at(*s)).sum();
                assert!(sum.abs() < 1e-16, "degree {q}, power {n}: {sum:e}");
            }
        }
    }
}
