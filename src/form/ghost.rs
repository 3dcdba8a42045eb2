//! Ghost penalty: what holds the functions of a cell that keeps only a sliver of the domain.
//!
//! A cell K that a body cuts belongs to the discretisation by its part `K∖B` alone, and nothing in that part's
//! integrals bounds a polynomial on the rest of K. Across a face S of such a cell, with both polynomials continued to
//! the whole patch `ω_S = K− ∪ K+`,
//!
//! ```text
//! g_S(φ,χ) = h_S⁻² ∫_ω_S (φ− − φ+)(χ− − χ+),   h_S = (|K−| + |K+|)/|S|
//! ```
//! vanishes for what is one polynomial on the patch, so it costs no order. It is the direct variant of the penalty on
//! the jumps of all normal derivatives, `Σ_j h^{2j−1} ∫_S [∂_n^j φ][∂_n^j χ]` (Gürkan & Massing 2019; Preuß 2018): both
//! vanish for the same functions and scale alike, and this one needs no derivatives.

use nalgebra::{DMatrix, DVector};

use crate::element::{basis, quadrature};
use crate::mesh::{CellMap, Face, Mesh, Point};
use crate::space::{Field, Space};

/// The matrix of `g_S` for one component, unknowns of K− before those of K+.
///
/// # Panics
/// For a face on the boundary.
pub fn matrix(space: &Space, face: &Face) -> DMatrix<f64> {
    let (jumps, weights) = jumps(space, face);
    let mut weighed = jumps.clone();
    weighed.row_iter_mut().zip(weights.iter()).for_each(|(mut row, w)| row *= *w);
    jumps.tr_mul(&weighed)
}

/// `g_S(p,p)` of a field, both components together.
///
/// # Panics
/// For a face on the boundary.
pub fn energy(p: &Field, face: &Face) -> f64 {
    let (jumps, weights) = jumps(&p.space, face);
    let plus = face.plus.expect("an interior face");
    let of = |c: usize| {
        let both = p.coefficients(face.minus.cell, c).chain(p.coefficients(plus.cell, c));
        let jump = &jumps * DVector::from_iterator(jumps.ncols(), both);
        jump.iter().zip(weights.iter()).map(|(j, w)| w * j * j).sum::<f64>()
    };
    (0..p.space.components).map(of).sum()
}

/// `h_S = (|K−| + |K+|)/|S|`
///
/// # Panics
/// For a face on the boundary.
pub fn width(mesh: &Mesh, face: &Face) -> f64 {
    let [a, b] = mesh.face_vertices(face).map(|v| mesh.vertices[v]);
    let plus = face.plus.expect("an interior face").cell;
    [face.minus.cell, plus].map(|cell| mesh.cell_area(cell)).iter().sum::<f64>() / (b - a).norm()
}

/// Row by row `φ− − φ+` at the points of the patch, and their weights over `h_S²`.
fn jumps(space: &Space, face: &Face) -> (DMatrix<f64>, DVector<f64>) {
    let (mesh, q) = (&*space.mesh, space.degree);
    let sides = [face.minus.cell, face.plus.expect("an interior face").cell];
    let h = width(mesh, face);
    let (mut rows, mut weights) = (Vec::new(), Vec::new());
    for (side, &cell) in sides.iter().enumerate() {
        let map = mesh.map(cell);
        let bent = match map {
            CellMap::Affine { .. } => 0,
            CellMap::Isoparametric(nodes) => 2 * nodes.degree,
        };
        let rule = quadrature::triangle((2 * q + bent).min(quadrature::MAX_TRIANGLE_DEGREE));
        for (xi, w) in rule.points.iter().zip(&rule.weights) {
            let (x, jacobian) = map.at(*xi);
            let across = pull_back(mesh, sides[1 - side], x);
            let [inner, outer] = if side == 0 { [*xi, across] } else { [across, *xi] };
            rows.extend(basis::values(q, inner).chain(basis::values(q, outer).map(|v| -v)));
            weights.push(w * jacobian.determinant() / (h * h));
        }
    }
    (DMatrix::from_row_iterator(weights.len(), 2 * space.n, rows), DVector::from_vec(weights))
}

/// The reference point of `x`, which may lie outside the cell, whose map is continued.
fn pull_back(mesh: &Mesh, cell: usize, x: Point) -> Point {
    let map = mesh.map(cell);
    let [a, b, c] = mesh.corners(cell);
    let flat = nalgebra::Matrix2::from_columns(&[b - a, c - a]);
    let solve = |j: nalgebra::Matrix2<f64>, r: Point| j.try_inverse().map(|inverse| inverse * r);
    let mut xi = solve(flat, x - a).expect("cells have an area");
    let guess = xi;
    let CellMap::Isoparametric(_) = map else { return xi };
    for _ in 0..20 {
        let (at, jacobian) = map.at(xi);
        let Some(step) = solve(jacobian, x - at) else { break };
        xi += step;
        if step.norm() < 1e-14 * (1.0 + xi.norm()) {
            break;
        }
    }
    // a map that folds over outside of its cell has no inverse there: any continuation will do
    if xi.norm() < 10.0 { xi } else { guess }
}
