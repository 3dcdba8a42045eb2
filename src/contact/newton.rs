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
use crate::solve::gram::{Gram, Rows};

/// σ in units of the inverse response of a row.
pub(super) const PENALTY: f64 = 1e6;

/// Penalties above this leave too few digits for refinement.
const MOST_PENALTY: f64 = 1e11;
const OUTER: usize = 60;
const INNER: usize = 100;
/// Whole steps before the search along the line.
const WHOLE: usize = 20;
const POLISH: usize = 20;
/// With a tolerance above this the first multipliers that keep it will do; below it forces are refined once more.
const LOOSE: f64 = 1e-9;

/// The inner problem and its factors. Unknowns have the order of the elimination. A row with a bound `b > −∞` is
/// shifted by it: the target takes `M⁻¹Bᵀb`, and the rest of the multiplier is at least 0.
struct Workspace<'a> {
    problem: &'a Problem,
    gram: Gram,
    metric: Vec<f64>,
    target: Vec<f64>,
    one_sided: Vec<bool>,
    sigma: Vec<f64>,
    /// Rows of the last factors.
    factored: Vec<bool>,
    /// What keeps a loose tolerance already.
    good_enough: Option<Projection>,
    iterations: usize,
    factorisations: usize,
}

pub(super) fn solve(problem: &Problem, warm: &[f64], penalty: f64) -> Result<Projection, Unsolved> {
    let failed = |iterations| Unsolved { row: 0, excess: f64::INFINITY, iterations };
    if problem.tolerance > LOOSE {
        let velocity = problem.answer(warm);
        if problem.worst(&velocity, warm).1 <= 1.0 {
            return Ok(Projection { velocity, multipliers: warm.to_vec(), ..Projection::default() });
        }
    }
    let mut work = Workspace::new(problem, penalty);
    let mut mu: Vec<f64> = problem.rows.iter().zip(warm).map(|(row, mu)| mu - finite(row.bound)).collect();
    let mut u = work.gram.ordered(&problem.answer(warm));
    let mut worst = (0, f64::INFINITY);
    let mut scale = penalty;
    // the rows of a pile at rest are those of the step before
    if work.excess(&u, &mu) <= 1.0
        && let Some(done) = work.polish(&mut u, &mut mu)
    {
        return Ok(done);
    }
    // those of a pile that moves are nearly
    let mut likely = Some(work.active(&mu)).filter(|active| active.contains(&true));
    for _ in 0..OUTER {
        work.minimise(&mut u, &mu, likely.take()).ok_or(failed(work.iterations))?;
        if let Some(done) = work.good_enough.take() {
            return Ok(done);
        }
        for (c, mu) in mu.iter_mut().enumerate() {
            let next = *mu - work.sigma[c] * work.value(c, &u);
            *mu = if work.one_sided[c] { next.max(0.0) } else { next };
        }
        if let Some(done) = work.polish(&mut u, &mut mu) {
            return Ok(done);
        }
        let now = work.worst(&u, &mu);
        if now.1 >= 0.03 * worst.1 && scale < MOST_PENALTY.max(10.0 * penalty) {
            scale *= 30.0;
            work.sigma.iter_mut().for_each(|s| *s *= 30.0);
            work.factored.clear();
        }
        worst = now;
    }
    Err(Unsolved { row: worst.0, excess: worst.1, iterations: work.iterations })
}

fn finite(bound: f64) -> f64 {
    if bound == f64::NEG_INFINITY { 0.0 } else { bound }
}

impl<'a> Workspace<'a> {
    fn new(problem: &'a Problem, penalty: f64) -> Self {
        let gram = Gram::new(problem.metric.len(), Rows::new(problem.rows.iter().map(|row| &row.entries[..])));
        let metric = gram.ordered(&problem.metric);
        let mut target = gram.ordered(&problem.target);
        let mut sigma = Vec::with_capacity(problem.rows.len());
        for (c, row) in problem.rows.iter().enumerate() {
            let bound = finite(row.bound);
            let mut response = 0.0;
            for (k, b) in gram.rows().entries(c) {
                if bound != 0.0 {
                    target[k] += b * bound / metric[k];
                }
                response += b * b / metric[k];
            }
            sigma.push(if response > 0.0 { penalty / response } else { 0.0 });
        }
        let one_sided = problem.rows.iter().map(|row| row.bound > f64::NEG_INFINITY).collect();
        let (factored, good_enough, iterations, factorisations) = (Vec::new(), None, 0, 0);
        Self { problem, gram, metric, target, one_sided, sigma, factored, good_enough, iterations, factorisations }
    }

    /// `w` of a row.
    fn value(&self, c: usize, u: &[f64]) -> f64 {
        self.problem.rows[c].offset + self.gram.rows().times(c, u)
    }

    /// Rows with a multiplier, and equations.
    fn active(&self, mu: &[f64]) -> Vec<bool> {
        mu.iter().zip(&self.one_sided).map(|(mu, one_sided)| !one_sided || *mu > 0.0).collect()
    }

    /// Factors of `M + Σ σ bbᵀ` over the active rows; kept as long as these do not change.
    fn factorise(&mut self, active: &[bool]) -> Option<()> {
        if self.factored == active {
            return Some(());
        }
        let weights: Vec<f64> = self.sigma.iter().zip(active).map(|(s, on)| if *on { *s } else { 0.0 }).collect();
        self.factorisations += 1;
        self.factored.clear();
        self.gram.factorise(&self.metric, &weights)?;
        self.factored.extend_from_slice(active);
        Some(())
    }

    fn solve(&mut self, x: &mut [f64]) {
        self.iterations += 1;
        self.gram.solve_in_place(x);
    }

    /// `M (u* − u) + Σ b ahead` over the active rows.
    fn imbalance(&self, u: &[f64], ahead: &[f64], active: &[bool]) -> Vec<f64> {
        let mut out: Vec<f64> = (0..u.len()).map(|k| self.metric[k] * (self.target[k] - u[k])).collect();
        for c in (0..ahead.len()).filter(|c| active[*c]) {
            self.gram.rows().add(c, ahead[c], &mut out);
        }
        out
    }

    /// Newton's method on the inner problem, until a whole step changes no activity. It begins with the rows that are
    /// `likely` active.
    fn minimise(&mut self, u: &mut [f64], mu: &[f64], mut likely: Option<Vec<bool>>) -> Option<()> {
        let (mut tried, mut whole) = (0, false);
        loop {
            let ahead: Vec<f64> = (0..mu.len()).map(|c| mu[c] - self.sigma[c] * self.value(c, u)).collect();
            let active = likely.take().unwrap_or_else(|| self.active(&ahead));
            // a whole step on the rows that are active at its end was exact
            if whole && self.factored == active || tried >= INNER {
                return Some(());
            }
            if tried > 0 && self.problem.tolerance > LOOSE {
                self.good_enough = self.clipped(&ahead);
                if self.good_enough.is_some() {
                    return Some(());
                }
            }
            self.factorise(&active)?;
            let mut step = self.imbalance(u, &ahead, &active);
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

    /// The velocities that multipliers give which have been cut off at their bounds, where they keep all rules.
    fn clipped(&self, ahead: &[f64]) -> Option<Projection> {
        let mu: Vec<f64> =
            ahead.iter().zip(&self.one_sided).map(|(a, one)| if *one { a.max(0.0) } else { *a }).collect();
        let multipliers = self.with_bounds(&mu);
        let velocity = self.problem.answer(&multipliers);
        let (iterations, factorisations) = (self.iterations, self.factorisations);
        let is_good = self.problem.worst(&velocity, &multipliers).1 <= 1.0;
        is_good.then_some(Projection { velocity, multipliers, iterations, factorisations })
    }

    fn with_bounds(&self, mu: &[f64]) -> Vec<f64> {
        self.problem.rows.iter().zip(mu).map(|(row, mu)| mu + finite(row.bound)).collect()
    }

    /// Whether a step is rounding.
    fn is_negligible(&self, step: &[f64], u: &[f64]) -> bool {
        let energy = |v: &[f64]| v.iter().zip(&self.metric).map(|(v, m)| m * v * v).sum::<f64>();
        energy(step) <= 1e-26 * (energy(u) + energy(&self.target))
    }

    /// Where the inner function is least along `step`: its derivative is piecewise linear and ascending.
    fn search(&self, u: &[f64], step: &[f64], ahead: &[f64]) -> f64 {
        let metric = &self.metric;
        let mut slope: f64 = (0..u.len()).map(|k| metric[k] * step[k] * (u[k] - self.target[k])).sum();
        let mut curvature: f64 = (0..u.len()).map(|k| metric[k] * step[k] * step[k]).sum();
        let mut breaks = Vec::new();
        for (c, &ahead) in ahead.iter().enumerate() {
            let change = self.gram.rows().times(c, step);
            let falls = self.sigma[c] * change;
            // the term is −change·max(0, ahead − t·falls)
            let on = !self.one_sided[c] || ahead > 0.0 || ahead == 0.0 && falls < 0.0;
            if on {
                slope -= change * ahead;
                curvature += change * falls;
            }
            let at = ahead / falls;
            if self.one_sided[c] && at > 0.0 && at.is_finite() {
                let sign = if on { -1.0 } else { 1.0 };
                breaks.push((at, c, -sign * change * ahead, sign * change * falls));
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
        let active = self.active(mu);
        let mut last = f64::INFINITY;
        for _ in 0..POLISH {
            let excess = self.excess(u, mu);
            if excess <= 1.0 {
                if self.problem.tolerance > LOOSE {
                    return Some(self.finish(u, mu));
                }
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

    /// The row that breaks its rule most, as [`Problem::worst`].
    fn worst(&self, u: &[f64], mu: &[f64]) -> (usize, f64) {
        let mut worst = (0, 0.0);
        for (c, mu) in mu.iter().enumerate() {
            let w = self.value(c, u);
            let miss = if *mu > 0.0 || !self.one_sided[c] { w.abs() } else { -w };
            let excess = miss / self.problem.rows[c].slack;
            if excess > worst.1 || excess.is_nan() {
                worst = (c, excess);
            }
        }
        worst
    }

    /// By how many of its slacks, or of the tolerance of the balance, the worst rule is broken.
    fn excess(&self, u: &[f64], mu: &[f64]) -> f64 {
        let worst = self.worst(u, mu).1;
        // NaN is no less than a number
        if worst.is_nan() { worst } else { worst.max(self.unbalanced(u, mu) / self.problem.tolerance) }
    }

    /// The relative residual of the balance, as [`Problem::imbalance`].
    fn unbalanced(&self, u: &[f64], mu: &[f64]) -> f64 {
        let target = &self.target;
        let fastest = u.iter().chain(target).fold(0.0, |most: f64, u| most.max(u.abs()));
        let mut residual: Vec<f64> = (0..u.len()).map(|k| self.metric[k] * (u[k] - target[k])).collect();
        let mut size: Vec<f64> = self.metric.iter().map(|m| m * fastest).collect();
        for (c, mu) in mu.iter().enumerate().filter(|(_, mu)| **mu != 0.0) {
            for (k, b) in self.gram.rows().entries(c) {
                residual[k] -= b * mu;
                size[k] += (b * mu).abs();
            }
        }
        residual.iter().zip(&size).map(|(r, s)| if *r == 0.0 { 0.0 } else { r.abs() / s }).fold(0.0, f64::max)
    }

    fn refine(&mut self, u: &mut [f64], mu: &mut [f64], active: &[bool]) {
        let gaps: Vec<f64> = (0..mu.len()).map(|c| self.value(c, u)).collect();
        let ahead: Vec<f64> = (0..mu.len()).map(|c| mu[c] - self.sigma[c] * gaps[c]).collect();
        let mut step = self.imbalance(u, &ahead, active);
        self.solve(&mut step);
        for c in (0..mu.len()).filter(|c| active[*c]) {
            mu[c] -= self.sigma[c] * (gaps[c] + self.gram.rows().times(c, &step));
            if self.one_sided[c] {
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
        let multipliers = self.with_bounds(mu);
        let exact = self.problem.answer(&multipliers);
        let is_good = self.problem.worst(&exact, &multipliers).1 <= 1.0;
        let velocity = if is_good { exact } else { self.gram.restored(u) };
        Projection { velocity, multipliers, iterations: self.iterations, factorisations: self.factorisations }
    }
}
