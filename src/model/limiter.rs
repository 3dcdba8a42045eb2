//! Keeps a density nonnegative without changing its means, by the scaling of Zhang and Shu (2010).

use std::collections::HashSet;
use std::sync::Arc;

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::element::quadrature::{self, MAX_INTERVAL_DEGREE, MAX_TRIANGLE_DEGREE};
use crate::element::{MAX_DEGREE, basis};
use crate::form::{Integrator, mass};
use crate::mesh::Point;
use crate::space::{Continuity, Field, Space};

/// What is left of the mean at the minimum of a limited cell: above the rounding of an evaluation, far below any error.
const FLOOR: f64 = 1e-13;

/// A mean that is negative by less than this share of the largest is zero to rounding.
const SLACK: f64 = 1e-14;

/// `ρ̃ = ⟨ρ⟩ + ϑ(ρ − ⟨ρ⟩)` in each cell, `ϑ = min(1, ⟨ρ⟩/(⟨ρ⟩ − min ρ))`   [8.25], [8.26]
///
/// ⟨ρ⟩ is the mean over the cell as it is meshed. The minimum is taken over every point at which a density is
/// evaluated: the lattice nodes of all degrees, the points of all triangle rules, and those of all interval rules on
/// the three faces.
#[derive(Debug, Clone)]
pub struct Limiter {
    space: Arc<Space>,
    /// `∫_K φ_i / |K|`, cell after cell.
    weights: Vec<f64>,
    /// Number of points.
    count: usize,
    /// Basis function after basis function, its values at all points.
    values: Vec<f64>,
    /// `max Σ_i |φ_i|` over the points.
    lebesgue: f64,
}

/// A field after [`Limiter::limit`].
#[derive(Debug, Clone)]
pub struct Limited {
    /// `ρ̃`: nonnegative at every point at which a density is evaluated.
    pub rho: Field,
    /// Number of cells that were limited.
    pub cells: usize,
    /// ϑ of each cell; exactly 1 where nothing was changed.
    pub theta: Vec<f64>,
    /// The point of the minimum in each cell; 0 where ϑ = 1.
    pub lowest: Vec<u32>,
}

/// A mean from which no nonnegative density can be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the mean density of cell {cell} at ({x:.4}, {y:.4}) is {mean:.3e}, which is not a finite number ≥ 0; hint: take a \
     smaller `time.step` or a finer mesh there"
)]
pub struct NegativeMean {
    /// Its number.
    pub cell: usize,
    /// Mean of the corners of the cell.
    pub x: f64,
    /// Second coordinate.
    pub y: f64,
    /// The mean density.
    pub mean: f64,
}

impl Limiter {
    /// Tabulates the basis and the means of the scalar discontinuous `space`.
    ///
    /// # Panics
    /// When the space is continuous or has two components.
    pub fn new(loops: &Integrator, space: &Arc<Space>) -> Self {
        assert!(space.continuity == Continuity::Discontinuous && space.components == 1, "a density is limited");
        let mut weights = loops.vector(&mass::scalar_load(space, 0, |_| 1.0), space);
        weights.par_chunks_mut(space.n).for_each(|weights| {
            let area: f64 = weights.iter().sum();
            weights.iter_mut().for_each(|w| *w /= area);
        });
        let points = points(space.degree);
        let count = points.len();
        let mut values = vec![0.0; space.n * count];
        let mut lebesgue = 0.0_f64;
        for (p, &at) in points.iter().enumerate() {
            let mut sum = 0.0;
            for (i, phi) in basis::values(space.degree, at).enumerate() {
                values[i * count + p] = phi;
                sum += phi.abs();
            }
            lebesgue = lebesgue.max(sum);
        }
        Self { space: space.clone(), weights, count, values, lebesgue }
    }

    /// The space of the densities.
    pub fn space(&self) -> &Arc<Space> {
        &self.space
    }

    /// The projection of a density that is not negative, limited: a mean below zero is that of rounding, or of points
    /// beyond the boundary of the mesh that the density comes from, and becomes 0.
    pub fn limit_start(&self, u: &Field) -> Field {
        self.limit_to(u, &self.means(u)).rho
    }

    /// ⟨u⟩ of every cell.
    ///
    /// # Panics
    /// For a field of another space.
    pub fn means(&self, u: &Field) -> Vec<f64> {
        assert_eq!(u.values.len(), self.weights.len(), "the field is of another space");
        let n = self.space.n;
        u.values.par_chunks(n).zip(self.weights.par_chunks(n)).map(|(u, w)| product(w, u)).collect()
    }

    /// The smallest value over every point at which a density is evaluated.
    pub fn smallest(&self, u: &Field) -> f64 {
        let of_cell = |room: &mut Vec<f64>, cell: &[f64]| self.minimum(cell, room).1;
        let lows: Vec<f64> = u.values.par_chunks(self.space.n).map_init(|| vec![0.0; self.count], of_cell).collect();
        lows.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Limits `u`; cells in which it is large enough keep their bits. A cell with mean 0 becomes 0, and so does one
    /// whose mean is negative by no more than rounding against the largest.
    ///
    /// # Errors
    /// The first cell whose mean is negative or not finite.
    pub fn limit(&self, u: &Field) -> Result<Limited, NegativeMean> {
        let means = self.means(u);
        let rounding = SLACK * means.iter().fold(0.0_f64, |most, mean| most.max(*mean));
        match means.iter().position(|mean| !(mean.is_finite() && *mean >= -rounding)) {
            Some(cell) => Err(self.negative(cell, means[cell])),
            None => Ok(self.limit_to(u, &means)),
        }
    }

    /// As [`Limiter::limit`] for an iterate on the way to a density: cells with a negative mean become 0, too.
    ///
    /// # Errors
    /// The first cell whose mean is not finite.
    pub fn limit_on_the_way(&self, u: &Field) -> Result<Limited, NegativeMean> {
        let means = self.means(u);
        match means.iter().position(|mean| !mean.is_finite()) {
            Some(cell) => Err(self.negative(cell, means[cell])),
            None => Ok(self.limit_to(u, &means)),
        }
    }

    fn negative(&self, cell: usize, mean: f64) -> NegativeMean {
        let centre = self.space.mesh.centroid(cell);
        NegativeMean { cell, x: centre.x, y: centre.y, mean }
    }

    fn limit_to(&self, u: &Field, means: &[f64]) -> Limited {
        let mut rho = u.clone();
        let (theta, lowest): (Vec<f64>, Vec<u32>) = rho
            .values
            .par_chunks_mut(self.space.n)
            .zip(means)
            .map_init(|| vec![0.0; self.count], |room, (cell, &mean)| self.limit_cell(cell, mean, room))
            .unzip();
        let cells = theta.iter().filter(|&&t| t < 1.0).count();
        Limited { rho, cells, theta, lowest }
    }

    /// Limits the coefficients of one cell; ϑ and the point of the minimum.
    fn limit_cell(&self, cell: &mut [f64], mean: f64, room: &mut [f64]) -> (f64, u32) {
        const UNTOUCHED: (f64, u32) = (1.0, 0);
        if mean < 0.0 {
            cell.fill(0.0);
            return (0.0, 0);
        }
        let floor = FLOOR * mean;
        let spread = cell.iter().map(|u| (u - mean).abs()).fold(0.0, f64::max);
        // Σ_i φ_i = 1, so ρ ≥ ⟨ρ⟩ − Σ_i |φ_i| max |u_i − ⟨ρ⟩|: most cells need no more than this
        if mean - self.lebesgue * spread > 2.0 * floor {
            return UNTOUCHED;
        }
        let (lowest, low) = self.minimum(cell, room);
        // nothing above rounding fits below a mean without all its digits
        if mean < f64::MIN_POSITIVE && cell.iter().any(|&u| u != 0.0) {
            cell.fill(0.0);
            return (0.0, lowest);
        }
        let theta = (mean - floor) / (mean - low);
        if low >= floor || theta >= 1.0 {
            return UNTOUCHED;
        }
        cell.iter_mut().for_each(|u| *u = mean + theta * (*u - mean));
        (theta, lowest)
    }

    /// The first point with the least value, and that value.
    fn minimum(&self, cell: &[f64], room: &mut [f64]) -> (u32, f64) {
        room.fill(0.0);
        for (u, column) in cell.iter().zip(self.values.chunks_exact(self.count)) {
            crate::solve::axpy(*u, column, room);
        }
        let lower = |a: (u32, f64), b: (u32, f64)| if b.1 < a.1 { b } else { a };
        (0..).zip(room.iter().copied()).fold((0, f64::INFINITY), lower)
    }

    /// `∂ρ̃_i/∂ρ_j` of the coefficients on `cell`, where `limited` is what became of `u`; the identity where ϑ = 1.
    ///
    /// With `w_j = ∂⟨ρ⟩/∂ρ_j`, the point `x*` of the minimum and `ϑ = c ⟨ρ⟩/(⟨ρ⟩ − ρ(x*))`, c < 1 for what the limiter
    /// leaves at the minimum:
    ///
    /// `∂ρ̃_i/∂ρ_j = w_j + ϑ (δ_ij − w_j) + (ρ_i − ⟨ρ⟩) ∂ϑ/∂ρ_j`,
    /// `∂ϑ/∂ρ_j = [c w_j − ϑ (w_j − φ_j(x*))]/(⟨ρ⟩ − ρ(x*))`
    pub fn derivative(&self, limited: &Limited, u: &Field, cell: usize) -> DMatrix<f64> {
        let n = self.space.n;
        let theta = limited.theta[cell];
        let weights = &self.weights[cell * n..(cell + 1) * n];
        let u = &u.values[cell * n..(cell + 1) * n];
        let lowest = limited.lowest[cell] as usize;
        let phi: Vec<f64> = (0..n).map(|j| self.values[j * self.count + lowest]).collect();
        let mean = product(weights, u);
        let depth = mean - product(&phi, u);
        if mean < 0.0 {
            return DMatrix::zeros(n, n);
        }
        if theta == 1.0 || depth <= 0.0 {
            return DMatrix::identity(n, n);
        }
        DMatrix::from_fn(n, n, |i, j| {
            let own = f64::from(u8::from(i == j));
            let slope = (1.0 - FLOOR) * weights[j] - theta * (weights[j] - phi[j]);
            weights[j] + theta * (own - weights[j]) + (u[i] - mean) / depth * slope
        })
    }
}

/// `Σ_i a_i b_i`, in order.
fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The points of the minimum for fields of a degree, each once.
fn points(degree: usize) -> Vec<Point> {
    // a field of degree 1 is linear on the reference triangle, also where that is mapped to a curved cell, and every
    // point lies between the vertices
    if degree == 1 {
        return basis::nodes(1);
    }
    let lattices = (1..=MAX_DEGREE).flat_map(basis::nodes);
    let inside = (1..=MAX_TRIANGLE_DEGREE).flat_map(|d| quadrature::triangle(d).points.iter().copied());
    let shares = (1..=MAX_INTERVAL_DEGREE).step_by(2).flat_map(|d| quadrature::interval(d).points.iter().copied());
    let along = shares.flat_map(|s| [s, 1.0 - s]).flat_map(|s| (0..3).map(move |f| basis::face_point(f, s)));
    let mut seen = HashSet::new();
    let is_new = |x: &Point| seen.insert([x.x, x.y].map(|c| (c * 1e12).round() as i64));
    lattices.chain(inside).chain(along).filter(is_new).collect()
}
