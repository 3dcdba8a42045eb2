//! The fast projection: an augmented Lagrangian whose inner problems are solved by a semismooth Newton method.
//!
//! ```text
//! u ← argmin ½|u − u*|²_M + Σ max(0, μ − σ w)²/(2σ),   μ ← max(0, μ − σ w)
//! ```
//! The inner function is strictly convex and piecewise quadratic, so that Newton's method with an exact search along
//! the line ends after finitely many steps, whatever the rows: redundant ones, and more of them than unknowns, do no
//! harm. Whole steps change many rows at once where the search along the line adds them one by one; so they are tried
//! first, and the search is what is left when they go in circles. The matrix `M + Σ σ bbᵀ` over the active rows is
//! sparse and positive definite. At last the active rows alone are solved by refinement, which takes away what a finite
//! σ and the rounding of a large one leave.

use super::projection::{Problem, Projection, Unsolved};
use crate::solve::sparse::{Cholesky, Symmetric};

/// σ in units of the inverse response of a row.
pub(super) const PENALTY: f64 = 1e6;

/// Penalties above this leave too few digits for refinement.
const MOST_PENALTY: f64 = 1e11;
const OUTER: usize = 60;
const INNER: usize = 100;
/// Whole steps before the search along the line.
const WHOLE: usize = 20;
const POLISH: usize = 20;

/// A row with a bound `b > −∞` is shifted by it: the target takes `M⁻¹Bᵀb`, and the rest of the multiplier is at least
/// 0.
struct Shifted<'a> {
    problem: &'a Problem,
    target: Vec<f64>,
    one_sided: Vec<bool>,
}

struct Workspace<'a> {
    shifted: Shifted<'a>,
    symmetric: Symmetric,
    /// Places in the values of the products of the entries of each row.
    places: Vec<Vec<usize>>,
    diagonal: Vec<usize>,
    sigma: Vec<f64>,
    factors: Option<(Vec<bool>, Cholesky)>,
    iterations: usize,
    factorisations: usize,
}

pub(super) fn solve(problem: &Problem, warm: &[f64], penalty: f64) -> Result<Projection, Unsolved> {
    let failed = |iterations| Unsolved { row: 0, excess: f64::INFINITY, iterations };
    let mut work = Workspace::new(problem, penalty).ok_or(failed(0))?;
    let mut mu: Vec<f64> = problem.rows.iter().zip(warm).map(|(row, mu)| mu - finite(row.bound)).collect();
    let mut u = problem.answer(warm);
    let mut worst = (0, f64::INFINITY);
    let mut scale = penalty;
    // the rows of a pile at rest are those of the step before
    if work.excess(&u, &mu) <= 1.0
        && let Some(done) = work.polish(&mut u, &mut mu)
    {
        return Ok(done);
    }
    for _ in 0..OUTER {
        work.minimise(&mut u, &mu).ok_or(failed(work.iterations))?;
        for (c, row) in problem.rows.iter().enumerate() {
            let next = mu[c] - work.sigma[c] * row.value(&u);
            mu[c] = if work.shifted.one_sided[c] { next.max(0.0) } else { next };
        }
        if let Some(done) = work.polish(&mut u, &mut mu) {
            return Ok(done);
        }
        let now = problem.worst(&u, &work.with_bounds(&mu));
        if now.1 >= 0.03 * worst.1 && scale < MOST_PENALTY.max(10.0 * penalty) {
            scale *= 30.0;
            work.sigma.iter_mut().for_each(|s| *s *= 30.0);
            work.factors = None;
        }
        worst = now;
    }
    Err(Unsolved { row: worst.0, excess: worst.1, iterations: work.iterations })
}

fn finite(bound: f64) -> f64 {
    if bound == f64::NEG_INFINITY { 0.0 } else { bound }
}

impl<'a> Workspace<'a> {
    fn new(problem: &'a Problem, penalty: f64) -> Option<Self> {
        let n = problem.metric.len();
        let mut target = problem.target.clone();
        for row in &problem.rows {
            let bound = finite(row.bound);
            if bound != 0.0 {
                for &(k, b) in &row.entries {
                    target[k] += b * bound / problem.metric[k];
                }
            }
        }
        let mut all: Vec<(usize, usize)> = (0..n).map(|k| (k, k)).collect();
        for row in &problem.rows {
            for (i, &(k, _)) in row.entries.iter().enumerate() {
                all.extend(row.entries[..=i].iter().map(|&(l, _)| (k.max(l), k.min(l))));
            }
        }
        let symmetric = Symmetric::new(n, all).ok()?;
        let places = problem.rows.iter().map(|row| {
            let pairs = row.entries.iter().enumerate();
            pairs
                .flat_map(|(i, &(k, _))| row.entries[..=i].iter().map(move |&(l, _)| (k.max(l), k.min(l))))
                .map(|(k, l)| symmetric.place(k, l))
                .collect()
        });
        let places = places.collect();
        let responses = problem.responses();
        let sigma = responses.iter().map(|a| if *a > 0.0 { penalty / a } else { 0.0 }).collect();
        let one_sided = problem.rows.iter().map(|row| row.bound > f64::NEG_INFINITY).collect();
        let diagonal = (0..n).map(|k| symmetric.place(k, k)).collect();
        let shifted = Shifted { problem, target, one_sided };
        let (factors, iterations, factorisations) = (None, 0, 0);
        Some(Self { shifted, symmetric, places, diagonal, sigma, factors, iterations, factorisations })
    }

    fn rows(&self) -> &'a [super::projection::Row] {
        &self.shifted.problem.rows
    }

    fn with_bounds(&self, mu: &[f64]) -> Vec<f64> {
        self.rows().iter().zip(mu).map(|(row, mu)| mu + finite(row.bound)).collect()
    }

    /// Factors of `M + Σ σ bbᵀ` over the active rows; kept as long as these do not change.
    fn factorise(&mut self, active: &[bool]) -> Option<()> {
        if self.factors.as_ref().is_some_and(|(of, _)| of == active) {
            return Some(());
        }
        let mut values = vec![0.0; self.symmetric.entries()];
        for (place, m) in self.diagonal.iter().zip(&self.shifted.problem.metric) {
            values[*place] = *m;
        }
        for (c, row) in self.rows().iter().enumerate().filter(|(c, _)| active[*c]) {
            let mut place = self.places[c].iter();
            for (i, &(_, b)) in row.entries.iter().enumerate() {
                for &(_, other) in &row.entries[..=i] {
                    values[*place.next().expect("one place per product")] += self.sigma[c] * b * other;
                }
            }
        }
        self.factorisations += 1;
        self.factors = Some((active.to_vec(), self.symmetric.factorise(&values).ok()?));
        Some(())
    }

    fn solve(&mut self, x: &mut [f64]) {
        self.iterations += 1;
        self.factors.as_ref().expect("factorised before").1.solve_in_place(x);
    }

    /// Newton's method on the inner problem, until a whole step changes no activity.
    fn minimise(&mut self, u: &mut [f64], mu: &[f64]) -> Option<()> {
        let rows = self.rows();
        let (mut tried, mut whole) = (0, false);
        loop {
            let ahead: Vec<f64> = (0..rows.len()).map(|c| mu[c] - self.sigma[c] * rows[c].value(u)).collect();
            let active: Vec<bool> = (0..rows.len()).map(|c| !self.shifted.one_sided[c] || ahead[c] > 0.0).collect();
            // a whole step on the rows that are active at its end was exact
            let settled = whole && self.factors.as_ref().is_some_and(|(of, _)| *of == active);
            if settled || tried >= INNER {
                return Some(());
            }
            self.factorise(&active)?;
            let mut step: Vec<f64> =
                (0..u.len()).map(|k| self.shifted.problem.metric[k] * (self.shifted.target[k] - u[k])).collect();
            for c in (0..rows.len()).filter(|c| active[*c]) {
                for &(k, b) in &rows[c].entries {
                    step[k] += b * ahead[c];
                }
            }
            self.solve(&mut step);
            if step.iter().any(|s| !s.is_finite()) {
                return None;
            }
            let length = if tried < WHOLE { 1.0 } else { self.search(u, &step, &ahead) };
            let negligible = self.is_negligible(&step, u);
            for (u, s) in u.iter_mut().zip(&step) {
                *u += length * s;
            }
            if negligible {
                return Some(());
            }
            tried += 1;
            whole = (length - 1.0).abs() < 1e-6;
        }
    }

    /// Whether a step is rounding.
    fn is_negligible(&self, step: &[f64], u: &[f64]) -> bool {
        let metric = &self.shifted.problem.metric;
        let energy = |v: &[f64]| v.iter().zip(metric).map(|(v, m)| m * v * v).sum::<f64>();
        energy(step) <= 1e-26 * (energy(u) + energy(&self.shifted.target))
    }

    /// Where the inner function is least along `step`: its derivative is piecewise linear and ascending.
    fn search(&self, u: &[f64], step: &[f64], ahead: &[f64]) -> f64 {
        let metric = &self.shifted.problem.metric;
        let mut slope: f64 = (0..u.len()).map(|k| metric[k] * step[k] * (u[k] - self.shifted.target[k])).sum();
        let mut curvature: f64 = (0..u.len()).map(|k| metric[k] * step[k] * step[k]).sum();
        let mut breaks = Vec::new();
        for (c, row) in self.rows().iter().enumerate() {
            let change = row.times(step);
            let falls = self.sigma[c] * change;
            // the term is −change·max(0, ahead − t·falls)
            let on = !self.shifted.one_sided[c] || ahead[c] > 0.0 || ahead[c] == 0.0 && falls < 0.0;
            if on {
                slope -= change * ahead[c];
                curvature += change * falls;
            }
            let at = ahead[c] / falls;
            if self.shifted.one_sided[c] && at > 0.0 && at.is_finite() {
                let sign = if on { -1.0 } else { 1.0 };
                breaks.push((at, c, -sign * change * ahead[c], sign * change * falls));
            }
        }
        breaks.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (at, _, slope_change, curvature_change) in breaks {
            if slope + at * curvature >= 0.0 {
                break;
            }
            slope += slope_change;
            curvature += curvature_change;
        }
        if curvature > 0.0 { (-slope / curvature).max(0.0) } else { 1.0 }
    }

    /// Solves the active rows as equations by refinement; the projection when it keeps all rules. What is gained stays
    /// when it does not.
    fn polish(&mut self, u: &mut Vec<f64>, mu: &mut Vec<f64>) -> Option<Projection> {
        let active: Vec<bool> = (0..mu.len()).map(|c| !self.shifted.one_sided[c] || mu[c] > 0.0).collect();
        let mut last = f64::INFINITY;
        for _ in 0..POLISH {
            let excess = self.excess(u, mu);
            if excess <= 1.0 {
                // a gap within its slack may leave forces along soft chains of contacts that are not
                let kept = (u.clone(), mu.clone());
                self.factorise(&active)?;
                self.refine(u, mu, &active);
                let gained = self.excess(u, mu) < excess;
                if !gained {
                    (*u, *mu) = kept;
                }
                return Some(self.finish(u, mu));
            }
            // so slow a gain means other rows, or a larger penalty
            if excess.is_nan() || excess > 0.1 * last {
                return None;
            }
            last = excess;
            self.factorise(&active)?;
            self.refine(u, mu, &active);
        }
        None
    }

    /// By how many of its slacks, or of the tolerance of the balance, the worst rule is broken.
    fn excess(&self, u: &[f64], mu: &[f64]) -> f64 {
        let (problem, bounded) = (self.shifted.problem, self.with_bounds(mu));
        let worst = problem.worst(u, &bounded).1;
        // NaN is no less than a number
        if worst.is_nan() { worst } else { worst.max(problem.imbalance(u, &bounded) / problem.tolerance) }
    }

    fn refine(&mut self, u: &mut [f64], mu: &mut [f64], active: &[bool]) {
        let (rows, problem) = (self.rows(), self.shifted.problem);
        let gaps: Vec<f64> = rows.iter().map(|row| row.value(u)).collect();
        let mut step: Vec<f64> = (0..u.len()).map(|k| problem.metric[k] * (self.shifted.target[k] - u[k])).collect();
        for c in (0..rows.len()).filter(|c| active[*c]) {
            for &(k, b) in &rows[c].entries {
                step[k] += b * (mu[c] - self.sigma[c] * gaps[c]);
            }
        }
        self.solve(&mut step);
        for c in (0..rows.len()).filter(|c| active[*c]) {
            mu[c] -= self.sigma[c] * (gaps[c] + rows[c].times(&step));
            if self.shifted.one_sided[c] {
                mu[c] = mu[c].max(0.0);
            }
        }
        for (u, s) in u.iter_mut().zip(&step) {
            *u += s;
        }
    }

    /// Takes the velocity that the multipliers give, which keeps momentum to rounding, where it keeps the rules as
    /// well.
    fn finish(&self, u: &[f64], mu: &[f64]) -> Projection {
        let (problem, multipliers) = (self.shifted.problem, self.with_bounds(mu));
        let exact = problem.answer(&multipliers);
        let velocity = if problem.worst(&exact, &multipliers).1 <= 1.0 { exact } else { u.to_vec() };
        Projection { velocity, multipliers, iterations: self.iterations, factorisations: self.factorisations }
    }
}
