//! Sparse matrices and their factorisation by faer.

use std::sync::atomic::{AtomicUsize, Ordering};

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::prelude::Solve;
use faer::sparse::linalg::solvers::Lu;
use faer::sparse::linalg::{amd, colamd, qr};
use faer::sparse::{SparseColMat, SymbolicSparseColMat, Triplet};
use faer::{MatMut, Par};

use super::{DIRECT_TOLERANCE, SolveError, axpy, norm};

/// A sparse matrix in compressed columns.
#[derive(Debug, Clone)]
pub struct Matrix {
    inner: SparseColMat<usize, f64>,
}

impl Matrix {
    /// Sums triplets `(row, column, value)` into a matrix.
    ///
    /// # Panics
    /// For an index out of range.
    pub fn from_triplets(rows: usize, columns: usize, triplets: &[(usize, usize, f64)]) -> Self {
        let entries: Vec<_> = triplets.iter().map(|&(i, j, v)| Triplet::new(i, j, v)).collect();
        let inner = SparseColMat::try_new_from_triplets(rows, columns, &entries)
            .expect("triplets lie inside the matrix and memory suffices");
        Self { inner }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.inner.nrows()
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.inner.ncols()
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.inner.compute_nnz()
    }

    /// `A x`.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.rows()];
        self.times_add(1.0, x, &mut y);
        y
    }

    /// `y += scale A x`.
    pub fn times_add(&self, scale: f64, x: &[f64], y: &mut [f64]) {
        for (j, &xj) in x.iter().enumerate() {
            if xj != 0.0 {
                let factor = scale * xj;
                for (&i, &a) in self.inner.row_idx_of_col_raw(j).iter().zip(self.inner.val_of_col(j)) {
                    y[i] += factor * a;
                }
            }
        }
    }

    /// `xᵀ A x`.
    pub fn quadratic(&self, x: &[f64]) -> f64 {
        super::dot(x, &self.times(x))
    }

    /// All entries as triplets.
    pub fn triplets(&self) -> Vec<(usize, usize, f64)> {
        let column = |j: usize| {
            let rows = self.inner.row_idx_of_col_raw(j).iter();
            rows.zip(self.inner.val_of_col(j)).map(move |(&i, &v)| (i, j, v))
        };
        (0..self.columns()).flat_map(column).collect()
    }
}

/// Entries of R in `A = QR` for a square matrix of symmetric structure, whose columns are given by their rows, in the
/// order of elimination that [`Factored`] takes. Whatever rows are exchanged, U of `P A = L U` has no entry where R has
/// none (George and Ng 1985), so that R tells how much memory the factors take.
///
/// # Panics
/// For columns that are not ascending or out of range.
pub fn factor_bound(columns: &[Vec<usize>]) -> usize {
    let n = columns.len();
    if n == 0 {
        return 0;
    }
    let starts: Vec<usize> = std::iter::once(0)
        .chain(columns.iter().scan(0, |end, column| {
            *end += column.len();
            Some(*end)
        }))
        .collect();
    let entries = starts[n];
    let matrix = SymbolicSparseColMat::new_checked(n, n, starts, None, columns.concat());
    let room = StackReq::any_of(&[
        colamd::order_scratch::<usize>(n, n, entries),
        qr::col_etree_scratch::<usize>(n, n),
        qr::postorder_scratch::<usize>(n),
        qr::column_counts_aat_scratch::<usize>(n, n),
    ]);
    let mut memory = MemBuffer::new(room);
    let stack = MemStack::new(&mut memory);
    let (mut forward, mut inverse) = (vec![0; n], vec![0; n]);
    colamd::order(&mut forward, &mut inverse, matrix.as_ref(), colamd::Control::default(), stack)
        .expect("indices of this size do not overflow");
    let order = PermRef::new_checked(&forward, &inverse, n);
    let (mut parents, mut post) = (vec![0; n], vec![0; n]);
    let tree = qr::col_etree(matrix.as_ref(), Some(order), &mut parents, stack);
    qr::postorder(&mut post, tree, stack);
    let (mut counts, mut first) = (vec![0; n], vec![0; n]);
    // the structure is symmetric: the matrix is its own transposed
    qr::column_counts_ata(&mut counts, &mut first, matrix.as_ref(), Some(order), tree, &post, stack);
    counts.iter().sum()
}

/// An order of elimination of little fill for a matrix of symmetric structure (Amestoy, Davis and Duff 1996). `links`
/// are its pairs of unknowns, the lower one first, ascending and each once.
///
/// # Panics
/// For links that are not ascending or out of range.
pub fn least_degree(unknowns: usize, links: &[(u32, u32)]) -> Vec<usize> {
    let mut starts = vec![0_usize; unknowns + 1];
    for &(low, _) in links {
        starts[low as usize + 1] += 1;
    }
    for k in 0..unknowns {
        starts[k + 1] += starts[k];
    }
    let rows = links.iter().map(|&(_, high)| high as usize).collect();
    let pattern = SymbolicSparseColMat::new_checked(unknowns, unknowns, starts, None, rows);
    let mut memory = MemBuffer::new(amd::order_scratch::<usize>(unknowns, links.len()));
    let (mut forward, mut inverse) = (vec![0; unknowns], vec![0; unknowns]);
    let control = amd::Control::default();
    amd::order(&mut forward, &mut inverse, pattern.as_ref(), control, MemStack::new(&mut memory))
        .expect("indices of this size do not overflow");
    forward
}

static FACTORISATIONS: AtomicUsize = AtomicUsize::new(0);
static SOLVES: AtomicUsize = AtomicUsize::new(0);

/// Books a factorisation that another file of this module made, or a solve with it.
pub(super) fn count(factorisations: usize, solves: usize) {
    FACTORISATIONS.fetch_add(factorisations, Ordering::Relaxed);
    SOLVES.fetch_add(solves, Ordering::Relaxed);
}

/// Factorisations and solves with factors since the program began.
pub fn counts() -> [usize; 2] {
    [FACTORISATIONS.load(Ordering::Relaxed), SOLVES.load(Ordering::Relaxed)]
}

/// A factorised square matrix that remembers the matrix, so that every solve can be checked.
pub struct Factored {
    name: String,
    matrix: Matrix,
    lu: Lu<usize, f64>,
}

impl std::fmt::Debug for Factored {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Factored").field("name", &self.name).field("unknowns", &self.matrix.rows()).finish()
    }
}

impl Factored {
    /// Factorises `matrix`; `name` is what errors call the system. One thread, so that the bits of the factors do not
    /// depend on the number of threads.
    ///
    /// # Errors
    /// When the factorisation fails; a matrix that is singular to rounding only shows in [`Factored::solve`].
    pub fn new(name: &str, matrix: Matrix) -> Result<Self, SolveError> {
        faer::set_global_parallelism(Par::Seq);
        FACTORISATIONS.fetch_add(1, Ordering::Relaxed);
        let lu = matrix.inner.sp_lu().map_err(|e| SolveError::Factorise {
            system: name.into(),
            reason: format!("{e:?}"),
            hint: "a boundary condition may be missing, or a parameter may be zero that must not be".into(),
        })?;
        Ok(Self { name: name.into(), matrix, lu })
    }

    /// What errors call the system.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Solves `A x = b`, with one step of iterative refinement when rounding has left more than a tenth of the
    /// tolerance.
    ///
    /// # Errors
    /// Input or solution not finite; relative residual above [`DIRECT_TOLERANCE`].
    pub fn solve(&self, b: &[f64]) -> Result<Vec<f64>, SolveError> {
        let system = || self.name.clone();
        if let Some(index) = b.iter().position(|v| !v.is_finite()) {
            return Err(SolveError::NotFiniteInput { system: system(), index });
        }
        SOLVES.fetch_add(1, Ordering::Relaxed);
        let mut x = b.to_vec();
        self.apply_inverse(&mut x);
        let scale = norm(b);
        let mut residual = self.residual(&x, b);
        if norm(&residual) > 0.1 * DIRECT_TOLERANCE * scale {
            self.apply_inverse(&mut residual);
            axpy(1.0, &residual, &mut x);
            residual = self.residual(&x, b);
        }
        let hint =
            || "check that the boundary conditions leave no motion free, and that no parameter is extreme".into();
        if x.iter().any(|v| !v.is_finite()) {
            return Err(SolveError::NotFinite { system: system(), hint: hint() });
        }
        let relative = norm(&residual) / scale.max(f64::MIN_POSITIVE);
        if relative > DIRECT_TOLERANCE && !self.is_rounding(&x, b, &residual) {
            return Err(SolveError::Inaccurate { system: system(), residual: relative, hint: hint() });
        }
        Ok(x)
    }

    fn apply_inverse(&self, x: &mut [f64]) {
        let n = x.len();
        self.lu.solve_in_place(MatMut::from_column_major_slice_mut(x, n, 1));
    }

    /// Whether a residual is no more than the rounding of `A x`, row by row, while `A x` does not cancel so much that
    /// the matrix must be taken for singular: a penalty of 1e-8 leaves large residuals in this way, and they are
    /// harmless.
    fn is_rounding(&self, x: &[f64], b: &[f64], residual: &[f64]) -> bool {
        let mut size: Vec<f64> = b.iter().map(|v| v.abs()).collect();
        for (j, xj) in x.iter().enumerate() {
            for (&i, a) in self.matrix.inner.row_idx_of_col_raw(j).iter().zip(self.matrix.inner.val_of_col(j)) {
                size[i] += (a * xj).abs();
            }
        }
        norm(&size) < 1e12 * norm(b) && residual.iter().zip(&size).all(|(r, s)| r.abs() <= 1e-12 * s)
    }

    fn residual(&self, x: &[f64], b: &[f64]) -> Vec<f64> {
        let mut r = b.to_vec();
        self.matrix.times_add(-1.0, x, &mut r);
        r
    }
}
