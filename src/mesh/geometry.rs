//! The map from the reference triangle to a cell: affine, or isoparametric of degree 2 or 3 on curved boundary cells.

use nalgebra::{DMatrix, DVector, Matrix2};

use super::{Mesh, MeshError, Point};
use crate::element::{basis, quadrature};

/// Isoparametric geometry of one cell: degree and node positions in the order of [`basis::node_indices`].
#[derive(Debug, Clone)]
pub struct Nodes {
    /// Polynomial degree of the map.
    pub degree: usize,
    /// In the order of [`basis::node_indices`].
    pub positions: Vec<Point>,
}

/// The map `x(ξ)` of one cell.
#[derive(Debug, Clone, Copy)]
pub enum CellMap<'m> {
    /// `x = origin + J ξ`.
    Affine {
        /// Image of the corner (0, 0).
        origin: Point,
        /// The edges from that corner, as columns.
        jacobian: Matrix2<f64>,
    },
    /// `x = Σ_i N_i(ξ) X_i`.
    Isoparametric(&'m Nodes),
}

impl CellMap<'_> {
    /// Position and Jacobian `J_ij = ∂x_i/∂ξ_j` at a reference point.
    pub fn at(&self, xi: Point) -> (Point, Matrix2<f64>) {
        match self {
            CellMap::Affine { origin, jacobian } => (origin + jacobian * xi, *jacobian),
            CellMap::Isoparametric(nodes) => {
                let (values, slopes) = basis::evaluate(nodes.degree, xi);
                let rows = [0, 1].map(|c| slopes.iter().map(|d| d[c]).collect::<Vec<f64>>());
                combine(&nodes.positions, &values, [&rows[0], &rows[1]])
            }
        }
    }
}

/// `Σ N_i X_i` and `Σ X_i ⊗ ∇N_i`.
pub fn combine(positions: &[Point], values: &[f64], slopes: [&[f64]; 2]) -> (Point, Matrix2<f64>) {
    let mut x = Point::zeros();
    let (mut along, mut across) = (Point::zeros(), Point::zeros());
    for (((p, value), dx), dy) in positions.iter().zip(values).zip(slopes[0]).zip(slopes[1]) {
        x += *p * *value;
        along += *p * *dx;
        across += *p * *dy;
    }
    (x, Matrix2::from_columns(&[along, across]))
}

impl Mesh {
    /// The map of `cell`.
    pub fn map(&self, cell: usize) -> CellMap<'_> {
        match &self.curved[cell] {
            Some(nodes) => CellMap::Isoparametric(nodes),
            None => {
                let [a, b, c] = self.corners(cell);
                CellMap::Affine { origin: a, jacobian: Matrix2::from_columns(&[b - a, c - a]) }
            }
        }
    }

    /// The middle of a face, of its chord where it is curved.
    pub fn midpoint(&self, face: usize) -> Point {
        let [a, b] = self.face_vertices(&self.faces[face]).map(|vertex| self.vertices[vertex]);
        (a + b) * 0.5
    }

    /// Area of one cell.
    pub fn cell_area(&self, cell: usize) -> f64 {
        match self.map(cell) {
            CellMap::Affine { jacobian, .. } => 0.5 * jacobian.determinant(),
            map @ CellMap::Isoparametric(nodes) => {
                let rule = quadrature::triangle(2 * nodes.degree);
                let at = |(xi, w): (&Point, &f64)| w * map.at(*xi).1.determinant();
                rule.points.iter().zip(&rule.weights).map(at).sum()
            }
        }
    }

    /// Bends the cells on curved boundary faces: isoparametric of degree `degree` (1 leaves them straight).
    ///
    /// Nodes of a curved face divide its arc evenly; those of straight faces stay; the inner node of degree 3 is moved
    /// by a quarter of the sum of the displacements of the face nodes, which reproduces quadratic displacements.
    ///
    /// # Errors
    /// A cell whose Jacobian is not positive at the nodes or quadrature points.
    ///
    /// # Panics
    /// For a degree other than 1, 2 or 3.
    pub fn bend(&mut self, degree: usize) -> Result<(), MeshError> {
        assert!((1..=3).contains(&degree), "geometry of degree {degree}");
        self.curved = vec![None; self.cells.len()];
        if degree == 1 {
            return Ok(());
        }
        let on_curves: Vec<_> = self.faces.iter().filter_map(|f| f.curve.map(|c| (f.minus, self.curves[c]))).collect();
        for (side, curve) in on_curves {
            let corners = self.corners(side.cell);
            let nodes = self.curved[side.cell].get_or_insert_with(|| Box::new(straight_nodes(degree, corners)));
            let local = basis::face_nodes(degree, side.face);
            let (a, b) = (corners[(side.face + 1) % 3], corners[(side.face + 2) % 3]);
            for (k, &node) in local.iter().enumerate().take(degree).skip(1) {
                nodes.positions[node] = curve.between(a, b, k as f64 / degree as f64);
            }
        }
        for (cell, nodes) in self.curved.iter_mut().enumerate() {
            if let Some(nodes) = nodes.as_deref_mut().filter(|n| n.degree == 3) {
                let corners = self.cells[cell].map(|v| self.vertices[v]);
                let flat = straight_nodes(3, corners).positions;
                let moved: Point = (3..9).map(|k| nodes.positions[k] - flat[k]).sum();
                nodes.positions[9] = flat[9] + moved * 0.25;
            }
        }
        self.check_curved()
    }

    /// Refuses curved cells whose Jacobian is not positive everywhere, by the bounds of its Bernstein coefficients.
    ///
    /// # Errors
    /// The first such cell.
    pub fn check_curved(&self) -> Result<(), MeshError> {
        let bounds = [2, 3].map(Bounds::of);
        for (cell, nodes) in self.curved.iter().enumerate() {
            let Some(nodes) = nodes.as_deref().filter(|nodes| nodes.degree > 1) else { continue };
            let [a, b, c] = self.corners(cell);
            let least = 1e-3 * (b - a).perp(&(c - a));
            let whole = [Point::zeros(), Point::new(1.0, 0.0), Point::new(0.0, 1.0)];
            if let Some((x, area)) = bounds[nodes.degree - 2].below(self.map(cell), whole, least, SPLITS) {
                let hint = "refine the mesh near the curved boundary, or use a lower `curved` degree";
                return Err(MeshError::Inverted { cell, x: x.x, y: x.y, area, hint });
            }
        }
        Ok(())
    }
}

/// How often a cell is cut into four until its Jacobian counts as not positive.
const SPLITS: usize = 5;

/// From the values of a polynomial at the nodes of a triangle to its Bernstein coefficients, between which it lies.
struct Bounds {
    nodes: Vec<Point>,
    transform: DMatrix<f64>,
}

impl Bounds {
    /// Of the Jacobian `det ∂x/∂ξ` of a map of degree k, a polynomial of degree 2(k − 1).
    fn of(k: usize) -> Self {
        let degree = 2 * (k - 1);
        let indices = basis::node_indices(degree);
        let factorial = |n: usize| (1..=n).product::<usize>() as f64;
        // B_m = d!/(i! j! k!) λ₁ⁱ λ₂ʲ λ₃ᵏ
        let value = |at: &[usize; 3], m: &[usize; 3]| {
            let power = |(i, n): (&usize, &usize)| (*i as f64 / degree as f64).powi(*n as i32) / factorial(*n);
            factorial(degree) * at.iter().zip(m).map(power).product::<f64>()
        };
        let n = indices.len();
        let matrix = DMatrix::from_fn(n, n, |i, j| value(&indices[i], &indices[j]));
        let transform = matrix.try_inverse().expect("Bernstein polynomials are a basis");
        Self { nodes: basis::nodes(degree), transform }
    }

    /// A place where the Jacobian is below `least`, if it is not certain that there is none.
    fn below(&self, map: CellMap, [a, b, c]: [Point; 3], least: f64, splits: usize) -> Option<(Point, f64)> {
        let at = |xi: &Point| map.at(a + (b - a) * xi.x + (c - a) * xi.y);
        let values: Vec<(Point, f64)> = self.nodes.iter().map(at).map(|(x, j)| (x, j.determinant())).collect();
        let lowest = *values.iter().min_by(|p, q| p.1.total_cmp(&q.1)).expect("a triangle has nodes");
        if lowest.1 <= least || values.iter().any(|(_, area)| area.is_nan()) {
            return Some(lowest);
        }
        let coefficients = &self.transform * DVector::from_iterator(values.len(), values.iter().map(|v| v.1));
        if coefficients.min() > least {
            return None;
        }
        if splits == 0 {
            return Some(lowest);
        }
        let [p, q, r] = [(b + c) * 0.5, (c + a) * 0.5, (a + b) * 0.5];
        [[a, r, q], [r, b, p], [q, p, c], [p, q, r]]
            .into_iter()
            .find_map(|part| self.below(map, part, least, splits - 1))
    }
}

/// Nodes of the straight triangle.
pub fn straight_nodes(degree: usize, [a, b, c]: [Point; 3]) -> Nodes {
    let place = |xi: Point| a + (b - a) * xi.x + (c - a) * xi.y;
    let mut positions: Vec<Point> = basis::nodes(degree).into_iter().map(place).collect();
    positions[..3].copy_from_slice(&[a, b, c]);
    Nodes { degree, positions }
}
