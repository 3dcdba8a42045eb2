//! Restarted GMRES (Saad and Schultz 1986) with right preconditioning.

use super::{axpy, dot, norm};

/// How an iteration ended.
#[derive(Debug, Clone, Copy)]
pub struct Outcome {
    /// Products with the matrix.
    pub iterations: usize,
    /// Euclidean norm of the true residual `b − A x`.
    pub residual: f64,
    /// Whether the tolerance was reached.
    pub converged: bool,
}

/// Solves `A x = b` from the guess in `x` until `‖b − A x‖ ≤ target`, at most `limit` products with `A`.
///
/// `apply(v, out)` is `out = A v`; `precondition(v)` overwrites `v` by an approximation of `A⁻¹ v`.
pub fn gmres(
    apply: &dyn Fn(&[f64], &mut [f64]),
    precondition: &dyn Fn(&mut [f64]),
    b: &[f64],
    x: &mut [f64],
    target: f64,
    limit: usize,
) -> Outcome {
    const RESTART: usize = 40;
    let system = System { apply, precondition };
    let mut iterations = 0;
    let mut residual = b.to_vec();
    if x.iter().any(|x| *x != 0.0) {
        system.residual(b, x, &mut residual);
    }
    loop {
        let size = norm(&residual);
        let done = size <= target;
        if done || iterations >= limit || !size.is_finite() {
            return Outcome { iterations, residual: size, converged: done };
        }
        iterations += system.cycle(&residual, x, target, RESTART.min(limit - iterations));
        // near a singular matrix the recurrence may be far off
        system.residual(b, x, &mut residual);
    }
}

/// What is solved, and with which approximate inverse.
struct System<'s> {
    /// `out = A v`
    apply: &'s dyn Fn(&[f64], &mut [f64]),
    /// `v ← M⁻¹ v`
    precondition: &'s dyn Fn(&mut [f64]),
}

impl System<'_> {
    /// `r = b − A x`
    fn residual(&self, b: &[f64], x: &[f64], r: &mut [f64]) {
        (self.apply)(x, r);
        r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
    }

    /// One GMRES cycle from the residual of `x`: adds the correction to `x`, returns the number of products with `A`.
    fn cycle(&self, residual: &[f64], x: &mut [f64], target: f64, steps: usize) -> usize {
        let size = norm(residual);
        let mut basis = vec![residual.iter().map(|r| r / size).collect::<Vec<f64>>()];
        let mut reached: Vec<Vec<f64>> = Vec::new();
        let mut triangle: Vec<Vec<f64>> = Vec::new();
        let mut rotations: Vec<(f64, f64)> = Vec::new();
        let mut rest = vec![size];
        for k in 0..steps {
            let mut z = basis[k].clone();
            (self.precondition)(&mut z);
            let mut w = vec![0.0; z.len()];
            (self.apply)(&z, &mut w);
            reached.push(z);
            let mut column = Vec::with_capacity(k + 2);
            for v in &basis {
                let h = dot(&w, v);
                axpy(-h, v, &mut w);
                column.push(h);
            }
            let length = norm(&w);
            for (i, &(c, s)) in rotations.iter().enumerate() {
                let (a, b) = (column[i], column[i + 1]);
                column[i] = c * a + s * b;
                column[i + 1] = -s * a + c * b;
            }
            let r = column[k].hypot(length);
            if r == 0.0 || !r.is_finite() {
                reached.pop();
                break;
            }
            let (c, s) = (column[k] / r, length / r);
            column[k] = r;
            rotations.push((c, s));
            rest.push(-s * rest[k]);
            rest[k] *= c;
            triangle.push(column);
            if rest[k + 1].abs() <= target || length <= 1e-14 * r {
                break;
            }
            basis.push(w.iter().map(|v| v / length).collect());
        }
        let m = triangle.len();
        let mut y = vec![0.0; m];
        for i in (0..m).rev() {
            let known: f64 = (i + 1..m).map(|j| triangle[j][i] * y[j]).sum();
            y[i] = (rest[i] - known) / triangle[i][i];
        }
        for (z, y) in reached.iter().zip(&y) {
            axpy(*y, z, x);
        }
        m.max(1)
    }
}
