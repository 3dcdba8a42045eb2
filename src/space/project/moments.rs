//! The moments `(f|φ)` of a function on one cell, and the member of the space that has them.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::breaks::{Piece, WHOLE, at, quarters, twice_area};
use crate::element::quadrature::{self, MAX_TRIANGLE_DEGREE};
use crate::element::{MAX_DEGREE, basis, tables};
use crate::mesh::{CellMap, Mesh, Point};

/// Most basis functions of a cell.
const MOST_FUNCTIONS: usize = basis::node_count(MAX_DEGREE);
/// A rule is compared with one of a degree lower by this.
const LOWER: usize = 4;
/// Least degree of the rules, for functions that are no polynomials.
const LEAST_DEGREE: usize = 12;
/// Two rules agree within this share of the largest value.
const CONVERGED: f64 = 1e-10;
/// Pieces that a cell may get besides those that it was cut into, until its rules agree.
const MOST_DIVISIONS: usize = 1024;

/// What all cells have in common: the factors of `(φ_i|φ_j)` on the reference cell.
pub(super) struct Masses {
    degree: usize,
    reference: Factors,
}

type Factors = Cholesky<f64, Dyn>;

impl Masses {
    /// For elements of degree `degree`.
    pub(super) fn new(degree: usize) -> Self {
        let rule = quadrature::triangle(2 * degree);
        Self { degree, reference: factors(degree, rule.points.iter().copied().zip(rule.weights.iter().copied())) }
    }
}

/// The factors of `Σ_q w_q φ_i(x_q) φ_j(x_q)`.
fn factors(degree: usize, points: impl Iterator<Item = (Point, f64)>) -> Factors {
    let n = basis::node_count(degree);
    let mut mass = DMatrix::zeros(n, n);
    for (xi, weight) in points {
        let phi = DVector::from_iterator(n, basis::values(degree, xi));
        mass.ger(weight, &phi, &phi, 1.0);
    }
    mass.cholesky().expect("the determinants of a checked mesh are positive")
}

/// `(f − f_0|φ_i)` by component, and the constants `f_0` that were taken off: a constant function is then exact to the
/// bit, and rounding is that of the differences. Sizes are those of the reference cell where the map is affine.
pub(super) struct Moments<const C: usize> {
    offset: [f64; C],
    loads: [[f64; MOST_FUNCTIONS]; C],
    /// Largest `|f|`, times the determinant.
    size: f64,
}

impl<const C: usize> Moments<C> {
    pub(super) fn none(offset: [f64; C]) -> Self {
        Self { offset, loads: [[0.0; MOST_FUNCTIONS]; C], size: 0.0 }
    }

    pub(super) fn offset(&self) -> [f64; C] {
        self.offset
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.loads.iter_mut().flatten().zip(other.loads.iter().flatten()).for_each(|(sum, load)| *sum += load);
    }

    fn is_near(&self, other: &Self, slack: f64) -> bool {
        self.loads.iter().flatten().zip(other.loads.iter().flatten()).all(|(a, b)| (a - b).abs() <= slack)
    }
}

/// One cell that is projected on.
pub(super) struct Cell<'c> {
    pub(super) map: CellMap<'c>,
    masses: &'c Masses,
}

impl<'c> Cell<'c> {
    pub(super) fn new(mesh: &'c Mesh, cell: usize, masses: &'c Masses) -> Self {
        Self { map: mesh.map(cell), masses }
    }

    /// What the geometry adds to the degree of an integrand.
    fn curvature(&self) -> usize {
        match self.map {
            CellMap::Affine { .. } => 0,
            CellMap::Isoparametric(nodes) => 2 * nodes.degree,
        }
    }

    /// The moments of `f(ξ, x)` over one piece of the cell, by a rule of degree `degree` besides that of the geometry.
    pub(super) fn moments<const C: usize, E>(
        &self,
        piece: &Piece,
        degree: usize,
        offset: [f64; C],
        f: &impl Fn(Point, Point) -> Result<[f64; C], E>,
    ) -> Result<Moments<C>, E> {
        let degree = (degree + self.curvature()).min(MAX_TRIANGLE_DEGREE);
        let rule = quadrature::triangle(degree);
        let whole = (*piece == WHOLE).then(|| tables::cell(degree).degree(self.masses.degree));
        let share = twice_area(piece);
        let mut sum = Moments::none(offset);
        let mut phi = [0.0; MOST_FUNCTIONS];
        let n = basis::node_count(self.masses.degree);
        for (q, (xi, weight)) in rule.points.iter().zip(&rule.weights).enumerate() {
            let xi = at(piece, *xi);
            let (x, det) = self.place(xi);
            match whole {
                Some(table) => phi[..n].copy_from_slice(&table.values(q)[..n]),
                None => phi.iter_mut().zip(basis::values(self.masses.degree, xi)).for_each(|(to, value)| *to = value),
            }
            let values = f(xi, x)?;
            for c in 0..C {
                let value = (values[c] - offset[c]) * det;
                sum.size = sum.size.max((values[c] * det).abs());
                sum.loads[c][..n].iter_mut().zip(&phi).for_each(|(load, phi)| *load += weight * share * value * phi);
            }
        }
        Ok(sum)
    }

    /// Position, and the determinant where it is not the same everywhere.
    fn place(&self, xi: Point) -> (Point, f64) {
        match self.map {
            CellMap::Affine { origin, jacobian } => (origin + jacobian * xi, 1.0),
            map @ CellMap::Isoparametric(_) => {
                let (x, jacobian) = map.at(xi);
                (x, jacobian.determinant())
            }
        }
    }

    /// The moments of `f(ξ, x)` over the pieces of the cell; pieces are divided until two rules agree on each, as long
    /// as there are not too many.
    pub(super) fn converged<const C: usize, E>(
        &self,
        pieces: Vec<Piece>,
        f: &impl Fn(Point, Point) -> Result<[f64; C], E>,
    ) -> Result<Moments<C>, E> {
        let degree = (2 * self.masses.degree + LOWER).max(LEAST_DEGREE);
        let middle = at(&WHOLE, quadrature::triangle(1).points[0]);
        let mut total = Moments::none(f(middle, self.place(middle).0)?);
        let (mut open, mut divisions) = (pieces, 0);
        while !open.is_empty() {
            let by_rule = |degree| -> Result<Vec<Moments<C>>, E> {
                open.iter().map(|piece| self.moments(piece, degree, total.offset, f)).collect()
            };
            let (fine, coarse) = (by_rule(degree)?, by_rule(degree - LOWER)?);
            total.size = fine.iter().chain(&coarse).fold(total.size, |most, moments| most.max(moments.size));
            let slack = CONVERGED * total.size;
            let mut next = Vec::new();
            for ((piece, fine), coarse) in open.iter().zip(&fine).zip(&coarse) {
                if fine.is_near(coarse, slack) || divisions >= MOST_DIVISIONS {
                    total.add(fine);
                } else {
                    next.extend(quarters(*piece));
                    divisions += 4;
                }
            }
            open = next;
        }
        Ok(total)
    }

    /// The coefficients with these moments, component by component.
    pub(super) fn solve<const C: usize, E>(&self, moments: &Moments<C>) -> Result<[Vec<f64>; C], E> {
        let (degree, n) = (self.masses.degree, basis::node_count(self.masses.degree));
        let own = match self.map {
            CellMap::Affine { .. } => None,
            map @ CellMap::Isoparametric(_) => {
                let rule = quadrature::triangle(2 * degree + self.curvature());
                let weighted = |(xi, w): (&Point, &f64)| (*xi, w * map.at(*xi).1.determinant());
                Some(factors(degree, rule.points.iter().zip(&rule.weights).map(weighted)))
            }
        };
        let factors = own.as_ref().unwrap_or(&self.masses.reference);
        Ok(std::array::from_fn(|c| {
            let change = factors.solve(&DVector::from_column_slice(&moments.loads[c][..n]));
            change.iter().map(|change| moments.offset[c] + change).collect()
        }))
    }
}
