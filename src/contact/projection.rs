//! The projection of velocities on those that create no overlap (Maury 2006): a convex quadratic programme.
//!
//! ```text
//! u = argmin ½ Σ m_k (u_k − u*_k)²   over   w = c + B u ≥ 0   (w = 0 for rows that hold)                [L A]
//! M (u − u*) = Bᵀμ,   μ ≥ 0,   μ w = 0
//! ```
//! u is unique; μ need not be: there may be more rows than unknowns.

use super::newton;

/// Steps of Uzawa's method before it gives up, and of its accelerated form where Newton's method has.
const MOST: usize = 1_000_000;
const FALLBACK: usize = 20_000;

/// One row `w = c + B u`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// Unknowns and coefficients; no unknown twice.
    pub entries: Vec<(usize, f64)>,
    /// `c`
    pub offset: f64,
    /// Least value of the multiplier: 0 for `w ≥ 0`, −∞ for `w = 0`, and in between for a bond that holds so much and
    /// no more.
    pub bound: f64,
    /// What `w` may miss.
    pub slack: f64,
}

impl Row {
    /// `B u`
    pub fn times(&self, u: &[f64]) -> f64 {
        self.entries.iter().map(|&(k, b)| b * u[k]).sum()
    }

    /// `c + B u`
    pub fn value(&self, u: &[f64]) -> f64 {
        self.offset + self.times(u)
    }
}

/// What is projected.
#[derive(Debug, Clone, Default)]
pub struct Problem {
    /// `m > 0`: masses, or resistances.
    pub metric: Vec<f64>,
    /// `u*`
    pub target: Vec<f64>,
    /// The constraints `w = B u + c ≥ 0`.
    pub rows: Vec<Row>,
    /// Relative residual that the balance `M (u − u*) = Bᵀμ` may keep.
    pub tolerance: f64,
}

/// How it is projected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Augmented Lagrangian with a semismooth Newton method; where that fails twice, the accelerated one.
    #[default]
    Newton,
    /// Uzawa's method, the reference.
    Uzawa,
    /// Uzawa's method with Nesterov's acceleration and restarts.
    Accelerated,
}

/// The projection.
#[derive(Debug, Clone, Default)]
pub struct Projection {
    /// `u`
    pub velocity: Vec<f64>,
    /// `μ`, with the bounds.
    pub multipliers: Vec<f64>,
    /// Linear solves of the Newton method, or steps of Uzawa's.
    pub iterations: usize,
    /// Factorisations.
    pub factorisations: usize,
}

/// Why there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Unsolved {
    /// The row that is missed most.
    pub row: usize,
    /// By how much, in its slacks.
    pub excess: f64,
    /// Iterations that were made.
    pub iterations: usize,
}

impl Problem {
    /// `Σ B²/m` of every row: what a multiplier of one does to the row itself.
    pub fn responses(&self) -> Vec<f64> {
        let response = |row: &Row| row.entries.iter().map(|&(k, b)| b * b / self.metric[k]).sum();
        self.rows.iter().map(response).collect()
    }

    /// `u* + M⁻¹ Bᵀ μ`
    pub fn answer(&self, multipliers: &[f64]) -> Vec<f64> {
        let mut u = self.target.clone();
        for (row, mu) in self.rows.iter().zip(multipliers) {
            if *mu != 0.0 {
                for &(k, b) in &row.entries {
                    u[k] += b * mu / self.metric[k];
                }
            }
        }
        u
    }

    /// The row that breaks its rule most, with by how many of its slacks: `w ≥ 0` where `μ` is at its bound, `w = 0`
    /// elsewhere.
    pub fn worst(&self, u: &[f64], multipliers: &[f64]) -> (usize, f64) {
        let mut worst = (0, 0.0);
        for (index, (row, mu)) in self.rows.iter().zip(multipliers).enumerate() {
            let w = row.value(u);
            let miss = if *mu > row.bound { w.abs() } else { -w };
            let excess = miss / row.slack;
            if excess > worst.1 || excess.is_nan() {
                worst = (index, excess);
            }
        }
        worst
    }

    /// `max |M (u − u*) − Bᵀμ|` relative to the sums of the terms, of which none counts as less than a momentum of the
    /// fastest unknown.
    pub fn imbalance(&self, u: &[f64], multipliers: &[f64]) -> f64 {
        let fastest = u.iter().chain(&self.target).fold(0.0, |most: f64, u| most.max(u.abs()));
        let mut residual: Vec<f64> = (0..u.len()).map(|k| self.metric[k] * (u[k] - self.target[k])).collect();
        let mut size: Vec<f64> = self.metric.iter().map(|m| m * fastest).collect();
        for (row, mu) in self.rows.iter().zip(multipliers) {
            for &(k, b) in &row.entries {
                residual[k] -= b * mu;
                size[k] += (b * mu).abs();
            }
        }
        residual.iter().zip(&size).map(|(r, s)| if *r == 0.0 { 0.0 } else { r.abs() / s }).fold(0.0, f64::max)
    }

    /// Projects; `warm` are multipliers to start from.
    ///
    /// # Errors
    /// When the rows contradict each other, or the method does not reach the tolerance.
    pub fn solve(&self, method: Method, warm: &[f64]) -> Result<Projection, Unsolved> {
        let warm: Vec<f64> = self.rows.iter().zip(warm).map(|(row, mu)| mu.max(row.bound)).collect();
        // what is at rest stays so, to the bit, where rounding takes the gaps of bodies that touch below 0
        let rests = self.target.iter().all(|u| *u == 0.0);
        let least = |row: &Row| if rests { -row.slack } else { 0.0 };
        if self.rows.iter().all(|row| row.bound >= 0.0 && row.value(&self.target) >= least(row)) {
            let multipliers = vec![0.0; self.rows.len()];
            return Ok(Projection { velocity: self.target.clone(), multipliers, ..Projection::default() });
        }
        match method {
            Method::Newton => self.newton(&warm),
            Method::Uzawa => self.uzawa(&warm, false, MOST),
            Method::Accelerated => self.uzawa(&warm, true, MOST),
        }
    }

    /// Newton's method; a warm start may mislead: then once more from nothing, with another penalty; where a heavy body
    /// presses light ones, with one that the heavy one feels; and at last without factors.
    fn newton(&self, warm: &[f64]) -> Result<Projection, Unsolved> {
        let mut spent = 0;
        let mut or_spend = |tried: Result<Projection, Unsolved>| match tried {
            Ok(found) => Ok(Projection { iterations: found.iterations + spent, ..found }),
            Err(unsolved) => {
                spent += unsolved.iterations;
                Err(Unsolved { iterations: spent, ..unsolved })
            }
        };
        or_spend(newton::solve(self, warm, newton::PENALTY))
            .or_else(|_| or_spend(newton::solve(self, &self.cold(), 1e2 * newton::PENALTY)))
            .or_else(|_| or_spend(newton::solve(self, &self.cold(), 1e7 * newton::PENALTY)))
            .or_else(|_| or_spend(self.uzawa(&self.cold(), true, FALLBACK)))
    }

    fn cold(&self) -> Vec<f64> {
        vec![0.0; self.rows.len()]
    }

    /// A bound of the largest eigenvalue of `B M⁻¹ Bᵀ`, by the sums of its rows (Gershgorin).
    fn largest(&self) -> f64 {
        let mut column = vec![0.0; self.metric.len()];
        for row in &self.rows {
            for &(k, b) in &row.entries {
                column[k] += b.abs();
            }
        }
        let sum = |row: &Row| row.entries.iter().map(|&(k, b)| b.abs() * column[k] / self.metric[k]).sum();
        self.rows.iter().map(sum).fold(0.0, f64::max)
    }

    /// `u ← u* + M⁻¹Bᵀμ, μ ← max(bound, μ − ρ w)` with `ρ‖B M⁻¹ Bᵀ‖ ≤ 1.9`; accelerated with ρ of 1 and momentum.
    fn uzawa(&self, warm: &[f64], accelerated: bool, most: usize) -> Result<Projection, Unsolved> {
        let rho = if accelerated { 1.0 } else { 1.9 } / self.largest();
        let (mut mu, mut ahead) = (warm.to_vec(), warm.to_vec());
        let mut momentum: f64 = 1.0;
        for iterations in 1..=most {
            let u = self.answer(&ahead);
            let mut turned = 0.0;
            let next_momentum = if accelerated { 0.5 * (1.0 + (1.0 + 4.0 * momentum * momentum).sqrt()) } else { 1.0 };
            let push = if accelerated { (momentum - 1.0) / next_momentum } else { 0.0 };
            for (c, row) in self.rows.iter().enumerate() {
                let w = row.value(&u);
                let next = (ahead[c] - rho * w).max(row.bound);
                turned += w * (next - mu[c]);
                ahead[c] = next + push * (next - mu[c]);
                mu[c] = next;
            }
            momentum = if turned > 0.0 { 1.0 } else { next_momentum };
            if turned > 0.0 {
                ahead.copy_from_slice(&mu);
            }
            // looking costs as much as an iteration
            if iterations % 10 == 0 {
                let velocity = self.answer(&mu);
                if self.worst(&velocity, &mu).1 <= 1.0 {
                    return Ok(Projection { velocity, multipliers: mu, iterations, factorisations: 0 });
                }
            }
        }
        let (row, excess) = self.worst(&self.answer(&mu), &mu);
        Err(Unsolved { row, excess, iterations: most })
    }
}
