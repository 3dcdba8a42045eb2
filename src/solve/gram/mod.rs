//! Cholesky factors of `M + Σ σ bbᵀ`, M diagonal, with few entries in every row b, for many weights `σ ≥ 0`.
//!
//! Unknowns that rows always have together, as those of a body, are eliminated together, in an order of least degree
//! (Amestoy, Davis and Duff 1996), by dense fronts (Duff and Reid 1983). Every front keeps what it hands on, so that
//! new weights of a few rows cost the fronts above these rows alone, and give the same bits as all fronts anew.

mod fronts;
mod structure;

use structure::Structure;

/// Sparse rows `B`, one after the other.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    starts: Vec<u32>,
    unknowns: Vec<u32>,
    values: Vec<f64>,
}

impl Rows {
    /// Rows from their entries, an unknown and its coefficient; no unknown twice in a row.
    pub fn new<'a>(rows: impl Iterator<Item = &'a [(usize, f64)]>) -> Self {
        let mut out = Self { starts: vec![0], ..Self::default() };
        for row in rows {
            out.unknowns.extend(row.iter().map(|&(k, _)| k as u32));
            out.values.extend(row.iter().map(|&(_, b)| b));
            out.starts.push(out.unknowns.len() as u32);
        }
        out
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn range(&self, row: usize) -> std::ops::Range<usize> {
        self.starts[row] as usize..self.starts[row + 1] as usize
    }

    /// Unknowns and coefficients of a row.
    pub fn entries(&self, row: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.range(row);
        self.unknowns[range.clone()].iter().zip(&self.values[range]).map(|(&k, &b)| (k as usize, b))
    }

    /// `b · x`
    pub fn times(&self, row: usize, x: &[f64]) -> f64 {
        self.entries(row).map(|(k, b)| b * x[k]).sum()
    }

    /// `x += factor b`
    pub fn add(&self, row: usize, factor: f64, x: &mut [f64]) {
        for (k, b) in self.entries(row) {
            x[k] += factor * b;
        }
    }
}

/// Factors of `M + Σ σ bbᵀ` for the rows of one structure. Unknowns have the order of the elimination in all of it.
#[derive(Debug)]
pub struct Gram {
    rows: Rows,
    structure: Structure,
    /// Panels of the factors and what the fronts hand on.
    numbers: Vec<f64>,
    /// Of the factors that are there.
    weights: Vec<f64>,
    metric: Vec<f64>,
    /// Of one front.
    work: Vec<f64>,
}

impl Gram {
    /// The structure of a matrix of so many unknowns.
    pub fn new(unknowns: usize, mut rows: Rows) -> Self {
        let structure = Structure::new(unknowns, &rows);
        for unknown in &mut rows.unknowns {
            *unknown = structure.place[*unknown as usize];
        }
        Self { rows, structure, numbers: Vec::new(), weights: Vec::new(), metric: Vec::new(), work: Vec::new() }
    }

    /// The rows, with their unknowns in the order of the elimination.
    pub fn rows(&self) -> &Rows {
        &self.rows
    }

    /// Values of unknowns, brought into the order of the elimination.
    pub fn ordered(&self, x: &[f64]) -> Vec<f64> {
        self.structure.order.iter().map(|&k| x[k as usize]).collect()
    }

    /// And back.
    pub fn restored(&self, x: &[f64]) -> Vec<f64> {
        self.structure.place.iter().map(|&k| x[k as usize]).collect()
    }
}
