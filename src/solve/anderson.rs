//! Anderson acceleration of a fixed point `x = G(x)` (Anderson 1965).

use nalgebra::{DMatrix, DVector};

use super::{axpy, dot};

/// The last iterates and residuals of one fixed-point solve; depth 0 is the plain iteration.
#[derive(Debug)]
pub struct Anderson {
    depth: usize,
    last: Option<(Vec<f64>, Vec<f64>)>,
    steps: Vec<Vec<f64>>,
    changes: Vec<Vec<f64>>,
}

impl Anderson {
    /// Acceleration over at most `depth` differences.
    pub fn new(depth: usize) -> Self {
        Self { depth, last: None, steps: Vec::new(), changes: Vec::new() }
    }

    /// The next iterate from `x` and `image = G(x)`:
    /// `x⁺ = G(x) − Σ γ_j (ΔG)_j` with γ minimising `‖f − ΔF γ‖`, `f = G(x) − x`.
    pub fn next(&mut self, x: &[f64], image: &[f64]) -> Vec<f64> {
        let f: Vec<f64> = image.iter().zip(x).map(|(g, x)| g - x).collect();
        let mut next = image.to_vec();
        if self.depth > 0 {
            if let Some((last_image, last_f)) = &self.last {
                self.steps.push(image.iter().zip(last_image).map(|(a, b)| a - b).collect());
                self.changes.push(f.iter().zip(last_f).map(|(a, b)| a - b).collect());
                if self.steps.len() > self.depth {
                    self.steps.remove(0);
                    self.changes.remove(0);
                }
                if let Some(gamma) = least_squares(&self.changes, &f) {
                    for (g, step) in gamma.iter().zip(&self.steps) {
                        axpy(-g, step, &mut next);
                    }
                }
            }
            self.last = Some((image.to_vec(), f));
        }
        next
    }
}

/// Minimises `‖f − Σ γ_j c_j‖` by the scaled normal equations, truncated at relative singular value 1e-12.
fn least_squares(columns: &[Vec<f64>], f: &[f64]) -> Option<DVector<f64>> {
    let scales: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt()).collect();
    if scales.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
        return None;
    }
    let m = columns.len();
    let gram = DMatrix::from_fn(m, m, |i, j| dot(&columns[i], &columns[j]) / (scales[i] * scales[j]));
    let right = DVector::from_fn(m, |i, _| dot(&columns[i], f) / scales[i]);
    let solution = gram.svd(true, true).solve(&right, 1e-12).ok()?;
    solution.iter().all(|v| v.is_finite()).then(|| DVector::from_fn(m, |i, _| solution[i] / scales[i]))
}
