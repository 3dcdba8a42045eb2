//! The structured square.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::MeshScene;
use crate::mesh::{BoundaryEdge, Mesh, MeshError, Point};

/// `2 n²` cells on `[x₀, x₁]²`, every square cut along the same diagonal; inner vertices moved by up to
/// `distortion·(x₁ − x₀)/n` in each direction.
///
/// # Errors
/// What [`Mesh::build`] finds.
pub(super) fn build(scene: &MeshScene) -> Result<Mesh, MeshError> {
    let n = scene.n.unwrap_or(1);
    let [x0, x1] = scene.length.unwrap_or([0.0, 1.0]);
    let reach = scene.distortion.unwrap_or(0.0) * (x1 - x0) / n as f64;
    let mut random = ChaCha8Rng::seed_from_u64(scene.seed.unwrap_or(0));
    let line = |i: usize| if i == n { x1 } else { x0 + (x1 - x0) * (i as f64 / n as f64) };
    let at = |i: usize, j: usize| j * (n + 1) + i;
    let mut vertices = Vec::with_capacity((n + 1) * (n + 1));
    for j in 0..=n {
        for i in 0..=n {
            let mut x = Point::new(line(i), line(j));
            if reach > 0.0 && (1..n).contains(&i) && (1..n).contains(&j) {
                x += Point::new(random.random_range(-1.0..1.0), random.random_range(-1.0..1.0)) * reach;
            }
            vertices.push(x);
        }
    }
    let mut cells = Vec::with_capacity(2 * n * n);
    for j in 0..n {
        for i in 0..n {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            cells.extend([[a, b, c], [a, c, d]]);
        }
    }
    let edge = |a: usize, b: usize, tag: usize| BoundaryEdge { vertices: [a, b], tag, curve: None };
    let sides = |k: usize| {
        [
            edge(at(0, k), at(0, k + 1), 0),
            edge(at(n, k), at(n, k + 1), 1),
            edge(at(k, 0), at(k + 1, 0), 2),
            edge(at(k, n), at(k + 1, n), 3),
        ]
    };
    let boundary: Vec<_> = (0..n).flat_map(sides).collect();
    let tags = super::Shape::Square.tags(false).iter().map(|tag| (*tag).to_owned()).collect();
    Mesh::build(vertices, cells, &boundary, tags, Vec::new())
}
