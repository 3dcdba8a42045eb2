//! The numbers of the fronts: panels of L with the inverses of its diagonal, and what is left for the parents.

use super::Gram;
use super::structure::Front;

impl Gram {
    /// Factorises with these weights, or as much of it as has changed since the last time. `None` where the matrix is
    /// not positive definite to rounding; then nothing is kept.
    pub fn factorise(&mut self, metric: &[f64], weights: &[f64]) -> Option<()> {
        // numbers that have just been made are zero
        let is_new = self.numbers.is_empty();
        let mut stale = self.stale(metric, weights);
        for k in 0..self.structure.fronts.len() {
            if stale[k] {
                let front = &self.structure.fronts[k];
                if !is_new {
                    self.numbers[front.panel().start..front.rest().end].fill(0.0);
                }
                if let Some(above) = stale.get_mut(front.parent as usize) {
                    *above = true;
                }
            }
        }
        for k in 0..self.structure.fronts.len() {
            if stale[k] {
                self.take(k, metric, weights);
                let front = self.structure.fronts[k];
                let (panel, rest) =
                    self.numbers[front.panel().start..front.rest().end].split_at_mut(front.panel().len());
                if eliminate(&front, panel, rest, &mut self.work).is_none() {
                    self.weights.clear();
                    return None;
                }
            }
            if stale.get(self.structure.fronts[k].parent as usize).is_some_and(|above| *above) {
                self.hand_on(k);
            }
        }
        super::super::sparse::count(1, 0);
        self.weights.clear();
        self.weights.extend_from_slice(weights);
        Some(())
    }

    /// The fronts of rows whose weights have changed; all of them where there are no factors.
    fn stale(&mut self, metric: &[f64], weights: &[f64]) -> Vec<bool> {
        let structure = &self.structure;
        if self.weights.len() == weights.len() && !self.numbers.is_empty() && self.metric == metric {
            let mut stale = vec![false; structure.fronts.len()];
            for ((old, new), front) in self.weights.iter().zip(weights).zip(&structure.front_of_row) {
                if old != new {
                    stale[*front as usize] = true;
                }
            }
            return stale;
        }
        if self.numbers.is_empty() {
            self.numbers = vec![0.0; structure.numbers];
        }
        let most = structure.fronts.iter().map(Front::stride).max().unwrap_or(0);
        self.work.resize(most, 0.0);
        self.metric.clear();
        self.metric.extend_from_slice(metric);
        vec![true; structure.fronts.len()]
    }

    /// Adds the metric and the rows of a front.
    fn take(&mut self, k: usize, metric: &[f64], weights: &[f64]) {
        let front = &self.structure.fronts[k];
        let stride = front.stride();
        let panel = &mut self.numbers[front.panel()];
        for (j, m) in metric[front.start..front.start + front.pivots].iter().enumerate() {
            panel[j * stride + j] += m;
        }
        let numbers = &mut self.numbers[front.panel().start..front.rest().end];
        for &c in &self.structure.rows[front.rows.0 as usize..front.rows.1 as usize] {
            let weight = weights[c as usize];
            if weight == 0.0 {
                continue;
            }
            let range = self.rows.range(c as usize);
            let (local, values) = (&self.structure.local[range.clone()], &self.rows.values[range]);
            for (i, (&a, &b)) in local.iter().zip(values).enumerate() {
                let factor = weight * b;
                for (&other, &value) in local[..=i].iter().zip(values) {
                    let (row, column) = (a.max(other) as usize, a.min(other) as usize);
                    numbers[place(front, row, column)] += factor * value;
                }
            }
        }
    }

    /// Adds what is left of a front to its parent.
    fn hand_on(&mut self, k: usize) {
        let front = &self.structure.fronts[k];
        let above = &self.structure.fronts[front.parent as usize];
        let into = &self.structure.into_parent[front.edges()];
        let (own, parents) = self.numbers.split_at_mut(above.numbers);
        let rest = &own[front.rest()];
        for (c, &column) in into.iter().enumerate() {
            let from = &rest[c * front.rest_stride() + c..c * front.rest_stride() + front.boundary];
            let column = column as usize;
            // the rows of a column follow each other from here on
            let base = place(above, column, column) - column;
            let target = &mut parents[base..];
            for (value, &row) in from.iter().zip(&into[c..]) {
                target[row as usize] += value;
            }
        }
    }

    /// `x ← A⁻¹ x`, in the order of the elimination.
    pub fn solve_in_place(&mut self, x: &mut [f64]) {
        super::super::sparse::count(0, 1);
        for front in &self.structure.fronts {
            let stride = front.stride();
            let panel = &self.numbers[front.panel()];
            let work = &mut self.work[..stride];
            work[front.pivots..].fill(0.0);
            work[..front.pivots].copy_from_slice(&x[front.start..front.start + front.pivots]);
            for j in 0..front.pivots {
                let column = &panel[j * stride..(j + 1) * stride];
                work[j] *= column[j];
                let factor = work[j];
                for (w, l) in work[j + 1..].iter_mut().zip(&column[j + 1..]) {
                    *w -= factor * l;
                }
            }
            x[front.start..front.start + front.pivots].copy_from_slice(&work[..front.pivots]);
            for (&place, w) in self.structure.boundaries[front.edges()].iter().zip(&work[front.pivots..]) {
                x[place as usize] += w;
            }
        }
        for front in self.structure.fronts.iter().rev() {
            let stride = front.stride();
            let panel = &self.numbers[front.panel()];
            let work = &mut self.work[..stride];
            for (&place, w) in self.structure.boundaries[front.edges()].iter().zip(&mut work[front.pivots..]) {
                *w = x[place as usize];
            }
            work[front.pivots + front.boundary..].fill(0.0);
            work[..front.pivots].copy_from_slice(&x[front.start..front.start + front.pivots]);
            for j in (0..front.pivots).rev() {
                let column = &panel[j * stride..(j + 1) * stride];
                work[j] = (work[j] - product(&column[j + 1..], &work[j + 1..])) * column[j];
            }
            x[front.start..front.start + front.pivots].copy_from_slice(&work[..front.pivots]);
        }
    }
}

/// Where the number of a row and a column of a front is, `row ≥ column`.
fn place(front: &Front, row: usize, column: usize) -> usize {
    if column < front.pivots {
        column * front.stride() + row
    } else {
        let column = column - front.pivots;
        front.pivots * front.stride() + column * front.rest_stride() + row - front.pivots
    }
}

/// Eliminates the pivots of a front. `None` where one of them is not positive.
fn eliminate(front: &Front, panel: &mut [f64], rest: &mut [f64], factors: &mut [f64]) -> Option<()> {
    let (stride, size) = (front.stride(), front.pivots + front.boundary);
    for k in 0..front.pivots {
        let (done, column) = panel.split_at_mut(k * stride);
        let column = &mut column[k..stride];
        gather(done, stride, k, factors);
        let length = (size - k).next_multiple_of(4);
        subtract(&done[k.min(done.len())..], stride, &factors[..k], &mut column[..length]);
        let pivot = column[0];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        let inverse = 1.0 / pivot.sqrt();
        column[1..size - k].iter_mut().for_each(|l| *l *= inverse);
        column[0] = inverse;
    }
    for c in 0..front.boundary {
        let row = front.pivots + c;
        gather(panel, stride, row, factors);
        let length = (front.boundary - c).next_multiple_of(4);
        let at = c * front.rest_stride() + c;
        subtract(&panel[row..], stride, &factors[..front.pivots], &mut rest[at..at + length]);
    }
    Some(())
}

/// A row of a panel.
fn gather(panel: &[f64], stride: usize, row: usize, out: &mut [f64]) {
    for (value, column) in out.iter_mut().zip(panel.chunks_exact(stride)) {
        *value = column[row];
    }
}

/// `y −= A x` for a column-major A with columns `stride` apart and a multiple of four rows.
fn subtract(a: &[f64], stride: usize, x: &[f64], y: &mut [f64]) {
    let rows = y.len();
    let mut j = 0;
    while j + 4 <= x.len() {
        let column = |i: usize| a[(j + i) * stride..(j + i) * stride + rows].chunks_exact(4);
        let (xa, xb, xc, xd) = (x[j], x[j + 1], x[j + 2], x[j + 3]);
        let columns = column(0).zip(column(1)).zip(column(2).zip(column(3)));
        for (y, ((a, b), (c, d))) in y.chunks_exact_mut(4).zip(columns) {
            for i in 0..4 {
                y[i] -= (a[i] * xa + b[i] * xb) + (c[i] * xc + d[i] * xd);
            }
        }
        j += 4;
    }
    for (j, &factor) in x.iter().enumerate().skip(j) {
        let column = a[j * stride..j * stride + rows].chunks_exact(4);
        for (y, a) in y.chunks_exact_mut(4).zip(column) {
            for i in 0..4 {
                y[i] -= factor * a[i];
            }
        }
    }
}

/// A product of vectors, summed in four lanes.
fn product(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (a, b) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for i in 0..4 {
            lanes[i] += a[i] * b[i];
        }
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + tail
}
