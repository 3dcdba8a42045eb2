//! Lagrange bases of degree 1 to 5 on equispaced nodes.
//!
//! Nodes are numbered as VTK's Lagrange triangle numbers them: the three vertices, then the inner nodes of the edges
//! 0→1, 1→2, 2→0 in that direction, then the inner nodes, which form a triangle of degree `q − 3` numbered the same
//! way.

use std::sync::OnceLock;

use nalgebra::Vector2;

use super::MAX_DEGREE;

/// Number of nodes of the Lagrange triangle of degree `q`: `(q+1)(q+2)/2`.
pub const fn node_count(q: usize) -> usize {
    (q + 1) * (q + 2) / 2
}

/// Barycentric indices `(i, j, k)`, `i + j + k = q`, of every node; the node lies at `(j/q, k/q)`.
pub fn node_indices(q: usize) -> Vec<[usize; 3]> {
    let mut all = Vec::with_capacity(node_count(q));
    let mut shell = 0;
    let mut size = q as isize;
    while size >= 0 {
        let n = size as usize;
        let at = |j: usize, k: usize| [n - j - k + shell, j + shell, k + shell];
        if n == 0 {
            all.push(at(0, 0));
        } else {
            all.extend([at(0, 0), at(n, 0), at(0, n)]);
            all.extend((1..n).map(|s| at(s, 0)));
            all.extend((1..n).map(|s| at(n - s, s)));
            all.extend((1..n).map(|s| at(0, n - s)));
        }
        shell += 1;
        size -= 3;
    }
    all
}

/// Reference coordinates of the nodes, in the order of [`node_indices`].
pub fn nodes(q: usize) -> Vec<Vector2<f64>> {
    let step = 1.0 / q.max(1) as f64;
    node_indices(q).into_iter().map(|[_, j, k]| Vector2::new(j as f64 * step, k as f64 * step)).collect()
}

/// Local numbers of the nodes on local face `f` (opposite vertex `f`), from vertex `f+1` to vertex `f+2`, ends
/// included.
pub fn face_nodes(q: usize, f: usize) -> Vec<usize> {
    let (a, b) = ((f + 1) % 3, (f + 2) % 3);
    let first = 3 + a * (q - 1);
    std::iter::once(a).chain(first..first + q - 1).chain(std::iter::once(b)).collect()
}

/// The point at the share `s` of the way along local face `f`, from vertex `f+1` to vertex `f+2`.
pub fn face_point(f: usize, s: f64) -> Vector2<f64> {
    let corners = [Vector2::new(0.0, 0.0), Vector2::new(1.0, 0.0), Vector2::new(0.0, 1.0)];
    let (a, b) = (corners[(f + 1) % 3], corners[(f + 2) % 3]);
    a * (1.0 - s) + b * s
}

/// Direction of local face `f` on the reference triangle, from vertex `f+1` to vertex `f+2`.
pub fn face_tangent(f: usize) -> Vector2<f64> {
    [Vector2::new(-1.0, 1.0), Vector2::new(0.0, -1.0), Vector2::new(1.0, 0.0)][f]
}

/// Value and derivative of `P_i(s) = Π_{m<i} (s − m)/(m + 1)`.
fn factor(i: usize, s: f64) -> (f64, f64) {
    (0..i).fold((1.0, 0.0), |(value, slope), m| {
        let scale = 1.0 / (m + 1) as f64;
        let root = (s - m as f64) * scale;
        (value * root, slope * root + value * scale)
    })
}

/// The indices of [`node_indices`], computed once.
fn cached_indices(q: usize) -> &'static [[usize; 3]] {
    static INDICES: [OnceLock<Vec<[usize; 3]>>; MAX_DEGREE + 1] = [const { OnceLock::new() }; MAX_DEGREE + 1];
    INDICES[q].get_or_init(|| node_indices(q))
}

/// Values and reference gradients of all basis functions of degree `q` at the reference point `at`.
///
/// With barycentric coordinates λ, `φ_ijk = P_i(qλ₀) P_j(qλ₁) P_k(qλ₂)`.
pub fn evaluate(q: usize, at: Vector2<f64>) -> (Vec<f64>, Vec<Vector2<f64>>) {
    let scale = q as f64;
    let bary = [1.0 - at.x - at.y, at.x, at.y];
    cached_indices(q)
        .iter()
        .map(|index| {
            let [(a, da), (b, db), (c, dc)] = std::array::from_fn(|v| factor(index[v], scale * bary[v]));
            let along = [da * b * c * scale, a * db * c * scale, a * b * dc * scale];
            (a * b * c, Vector2::new(along[1] - along[0], along[2] - along[0]))
        })
        .unzip()
}

/// Values alone, in the order of the nodes.
pub fn values(q: usize, at: Vector2<f64>) -> impl Iterator<Item = f64> {
    let scale = q as f64;
    let bary = [1.0 - at.x - at.y, at.x, at.y];
    cached_indices(q).iter().map(move |index| (0..3).map(|v| factor(index[v], scale * bary[v]).0).product())
}
