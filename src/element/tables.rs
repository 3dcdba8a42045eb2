//! Values and reference gradients of every Lagrange basis at the points of a quadrature rule, computed once per rule.

use std::sync::OnceLock;

use nalgebra::Vector2;

use super::quadrature::{self, MAX_INTERVAL_DEGREE, MAX_TRIANGLE_DEGREE};
use super::{MAX_DEGREE, basis};

/// Longest padded row: 21 functions of degree 5, rounded up to whole vector registers.
pub const MAX_STRIDE: usize = 24;

/// Rows of `n` functions are padded with zeros to this length, so that loops over them have no remainder.
pub const fn stride(n: usize) -> usize {
    n.next_multiple_of(4)
}

/// One basis at a list of points; row `q` holds the `n` basis functions at point `q`, padded with zeros.
#[derive(Debug, Clone)]
pub struct Table {
    /// Number of basis functions.
    pub n: usize,
    stride: usize,
    values: Vec<f64>,
    slopes: [Vec<f64>; 2],
}

impl Table {
    fn new(degree: usize, points: &[Vector2<f64>]) -> Self {
        let n = basis::node_count(degree);
        let stride = stride(n);
        let mut table = Self { n, stride, values: Vec::new(), slopes: [Vec::new(), Vec::new()] };
        for &x in points {
            let (values, slopes) = basis::evaluate(degree, x);
            let padding = || std::iter::repeat_n(0.0, stride - n);
            table.values.extend(values.into_iter().chain(padding()));
            for (c, to) in table.slopes.iter_mut().enumerate() {
                to.extend(slopes.iter().map(|d| d[c]).chain(padding()));
            }
        }
        table
    }

    /// Values of the basis at point `q`, padded.
    pub fn values(&self, q: usize) -> &[f64] {
        &self.values[q * self.stride..(q + 1) * self.stride]
    }

    /// Reference derivatives along axis `c` of the basis at point `q`, padded.
    pub fn slopes(&self, q: usize, c: usize) -> &[f64] {
        &self.slopes[c][q * self.stride..(q + 1) * self.stride]
    }
}

/// The bases of degree 0 to [`MAX_DEGREE`] at one set of points of the reference triangle.
#[derive(Debug, Clone)]
pub struct Tables {
    /// Where the values are, in the reference triangle.
    pub points: Vec<Vector2<f64>>,
    by_degree: [OnceLock<Table>; MAX_DEGREE + 1],
}

impl Tables {
    /// The bases at `points`; each is tabulated when it is first asked for.
    pub fn new(points: Vec<Vector2<f64>>) -> Self {
        Self { points, by_degree: [const { OnceLock::new() }; MAX_DEGREE + 1] }
    }

    /// The basis of degree `q`.
    pub fn degree(&self, q: usize) -> &Table {
        self.by_degree[q].get_or_init(|| Table::new(q, &self.points))
    }
}

/// The bases at the points of [`quadrature::triangle`].
pub fn cell(degree: usize) -> &'static Tables {
    static TABLES: [OnceLock<Tables>; MAX_TRIANGLE_DEGREE + 1] = [const { OnceLock::new() }; MAX_TRIANGLE_DEGREE + 1];
    TABLES[degree].get_or_init(|| Tables::new(quadrature::triangle(degree).points.clone()))
}

/// The bases at the points of [`quadrature::interval`] on local face `face`; `reversed` runs from vertex `f+2` to
/// `f+1`, as the plus side of a face sees the points of the minus side.
pub fn face(degree: usize, face: usize, reversed: bool) -> &'static Tables {
    static TABLES: [OnceLock<[[Tables; 2]; 3]>; MAX_INTERVAL_DEGREE + 1] =
        [const { OnceLock::new() }; MAX_INTERVAL_DEGREE + 1];
    let all = TABLES[degree].get_or_init(|| {
        let corners = [Vector2::new(0.0, 0.0), Vector2::new(1.0, 0.0), Vector2::new(0.0, 1.0)];
        let rule = quadrature::interval(degree);
        let along = |a: Vector2<f64>, b: Vector2<f64>| {
            Tables::new(rule.points.iter().map(|&s| a * (1.0 - s) + b * s).collect())
        };
        std::array::from_fn(|f| {
            let (a, b) = (corners[(f + 1) % 3], corners[(f + 2) % 3]);
            [along(a, b), along(b, a)]
        })
    });
    &all[face][usize::from(reversed)]
}
