//! The structured square.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::keys::{Meaning, keyed};
use super::rules::{Check, MOST_CELLS, bad};
use super::{Domain, Named, Scale};
use crate::mesh::{BoundaryEdge, Mesh, MeshError, Point};
use crate::schema::Range;

keyed! {
    /// Square `[x₀, x₁]²`, `2n²` equal cells.
    Square {
        /// Cells per side.
        n: usize => Meaning::Count;
        /// Inner vertices move at random by up to this share of the cell size.
        distortion: f64 = 0.0 => DISTORTION;
        /// Seed of the distortion.
        seed: u64 = 0 => Meaning::Free;
        /// Extent along both axes, `[x₀, x₁]`.
        length: [f64; 2] = [0.0, 1.0] => Meaning::Interval;
    }
}

const DISTORTION: Meaning = Meaning::Within {
    range: Range::within(0.0, 0.3),
    rule: "it must lie in 0 to 0.3",
    hint: "beyond 0.3 cells could turn over",
};

/// Sides of a square.
pub(super) const SIDES: [&str; 4] = ["left", "right", "bottom", "top"];

impl Named for Square {
    const NAME: &'static str = "square";
}

impl Domain for Square {
    fn tags(&self) -> &'static [&'static str] {
        &SIDES
    }

    fn check(&self) -> Check {
        if self.expected() > MOST_CELLS {
            return Err(bad("n", self.n, "2 n² must not exceed 5 million cells", "choose a smaller n"));
        }
        Ok(())
    }

    fn build(&self) -> Result<Mesh, MeshError> {
        build(self)
    }

    fn expected(&self) -> f64 {
        2.0 * (self.n as f64).powi(2)
    }

    fn quickly_built(&self) -> f64 {
        2e5
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        [self.length; 2]
    }

    fn scale(&self) -> Scale {
        Scale::Count
    }
}

/// `2 n²` cells on `[x₀, x₁]²`, every square cut along the same diagonal; inner vertices moved by up to
/// `distortion·(x₁ − x₀)/n` in each direction.
///
/// # Errors
/// What [`Mesh::build`] finds.
fn build(square: &Square) -> Result<Mesh, MeshError> {
    let (n, [x0, x1]) = (square.n, square.length);
    let reach = square.distortion * (x1 - x0) / n as f64;
    let mut random = ChaCha8Rng::seed_from_u64(square.seed);
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
    let tags = SIDES.iter().map(|tag| (*tag).to_owned()).collect();
    Mesh::build(vertices, cells, &boundary, tags, Vec::new())
}
