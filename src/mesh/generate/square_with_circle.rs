//! The square with a circle in it that edges follow: a disc of blocks inside, a ring of blocks outside.

use std::collections::HashMap;

use super::keys::{Meaning, keyed};
use super::rules::{Check, MOST_CELLS, bad};
use super::square::SIDES;
use super::{Domain, Named, Scale};
use crate::mesh::{BoundaryEdge, Mesh, MeshError, Point};

/// Share of the radius at which the corners of the block in the middle of the disc lie.
const MIDDLE: f64 = 0.55;

keyed! {
    /// The square, edges follow a circle in it: `4n` of them, about `14n²` cells.
    SquareWithCircle {
        /// Cells per side, and on a quarter of the circle.
        n: usize => Meaning::Count;
        /// Extent along both axes, `[x₀, x₁]`.
        length: [f64; 2] = [0.0, 1.0] => Meaning::Interval;
        /// Radius of the circle.
        radius: f64 => Meaning::Length;
        /// Centre of the circle.
        centre: [f64; 2] = [0.5 * (length[0] + length[1]); 2], "the square's middle" => Meaning::Place;
    }
}

impl Named for SquareWithCircle {
    const NAME: &'static str = "square-with-circle";
}

impl Domain for SquareWithCircle {
    fn tags(&self) -> &'static [&'static str] {
        &SIDES
    }

    fn check(&self) -> Check {
        if self.expected() > MOST_CELLS {
            return Err(bad("n", self.n, "14 n² must not exceed 5 million cells", "choose a smaller n"));
        }
        let ([x0, x1], [cx, cy], radius) = (self.length, self.centre, self.radius);
        let gap = [cx - x0, x1 - cx, cy - x0, x1 - cy].into_iter().fold(f64::INFINITY, f64::min) - radius;
        if gap < 0.01 * (x1 - x0) {
            let rule = format!("the circle must keep a hundredth of the side from the sides (gap {gap:.4})");
            return Err(bad("radius", format!("{radius:?}"), rule, "shrink or move the circle"));
        }
        if radius < 0.01 * (x1 - x0) {
            let rule = "it must be at least a hundredth of the side, or the cells about the circle are too thin";
            return Err(bad("radius", format!("{radius:?}"), rule, "enlarge the circle"));
        }
        Ok(())
    }

    fn build(&self) -> Result<Mesh, MeshError> {
        build(self)
    }

    fn expected(&self) -> f64 {
        14.0 * (self.n as f64).powi(2)
    }

    fn quickly_built(&self) -> f64 {
        2e5
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        [self.length; 2]
    }

    fn scale(&self) -> Scale {
        Scale::None
    }
}

/// `4n` edges on the circle, `n` on every side, in all about `14 n²` cells; every quadrilateral is cut along its
/// shorter diagonal.
///
/// # Errors
/// What [`Mesh::build`] finds.
fn build(square: &SquareWithCircle) -> Result<Mesh, MeshError> {
    let (n, [x0, x1], radius, [cx, cy]) = (square.n, square.length, square.radius, square.centre);
    let centre = Point::new(cx, cy);
    let corners = [Point::new(x0, x0), Point::new(x1, x0), Point::new(x1, x1), Point::new(x0, x1)];
    let mut draft = Draft { side: x1 - x0, vertices: Vec::new(), cells: Vec::new(), known: HashMap::new() };
    // on a quarter of the rings: the middle block's side, the circle, the square's side
    let part = |i: usize| i as f64 / n as f64;
    let lines = |quarter: usize, i: usize| {
        let (a, b) = (corners[quarter], corners[(quarter + 1) % 4]);
        let direction = |k: usize| std::f64::consts::TAU * ((k as f64 - 1.5) / 4.0);
        let angle = direction(quarter) + 0.25 * std::f64::consts::TAU * part(i);
        let rim = centre + radius * Point::new(angle.cos(), angle.sin());
        let corner = |k: usize| {
            let angle = direction(k);
            centre + MIDDLE * radius * Point::new(angle.cos(), angle.sin())
        };
        let core = corner(quarter) + (corner(quarter + 1) - corner(quarter)) * part(i);
        [core, rim, a + (b - a) * part(i)]
    };
    let inner = n.div_ceil(2);
    let steps = growth(n, 0.5 * std::f64::consts::PI * radius / n as f64, 0.5 * (x1 - x0) - radius);
    for quarter in 0..4 {
        let row = |i: usize| -> Vec<Point> {
            let [core, rim, side] = lines(quarter, i);
            let inside = (0..inner).map(|j| core + (rim - core) * (j as f64 / inner as f64));
            let outside = steps.iter().map(|s| rim + (side - rim) * *s);
            inside.chain(outside).collect()
        };
        let rows: Vec<Vec<Point>> = (0..=n).map(row).collect();
        draft.grid(&rows);
    }
    let [south, north] = [0, 2].map(|quarter| (0..=n).map(|i| lines(quarter, i)[0]).collect::<Vec<_>>());
    let across = |i: usize| -> Vec<Point> {
        // the sides of the middle block, bottom to top
        (0..=n).map(|j| south[i] + (north[n - i] - south[i]) * part(j)).collect()
    };
    draft.grid(&(0..=n).map(across).collect::<Vec<_>>());
    draft.finish([x0, x1])
}

/// `0, …, 1` in `n` steps whose first is about as long as `first` on the length `whole`.
fn growth(n: usize, first: f64, whole: f64) -> Vec<f64> {
    let sum = |q: f64| (0..n).map(|k| q.powi(k as i32)).sum::<f64>();
    let (mut low, mut high) = (1.0, 10.0);
    for _ in 0..100 {
        let q = 0.5 * (low + high);
        if sum(q) * first < whole { low = q } else { high = q }
    }
    let total = sum(low);
    let end = |i: usize| if i == n { 1.0 } else { (0..i).map(|k| low.powi(k as i32)).sum::<f64>() / total };
    (0..=n).map(end).collect()
}

/// Vertices are the same where they coincide to rounding.
struct Draft {
    /// Side of the square.
    side: f64,
    vertices: Vec<Point>,
    cells: Vec<[usize; 3]>,
    known: HashMap<(i64, i64), usize>,
}

impl Draft {
    fn vertex(&mut self, x: Point) -> usize {
        let grid = |v: f64| (v / self.side * 1e10).round() as i64;
        let (i, j) = (grid(x.x), grid(x.y));
        let near = (-1..=1).flat_map(|a| (-1..=1).map(move |b| (i + a, j + b)));
        if let Some(&vertex) = near.filter_map(|key| self.known.get(&key)).next() {
            return vertex;
        }
        self.vertices.push(x);
        self.known.insert((i, j), self.vertices.len() - 1);
        self.vertices.len() - 1
    }

    /// The cells of a block of points, row by row.
    fn grid(&mut self, rows: &[Vec<Point>]) {
        let numbers: Vec<Vec<usize>> = rows.iter().map(|row| row.iter().map(|x| self.vertex(*x)).collect()).collect();
        for pair in numbers.windows(2) {
            for j in 1..pair[0].len() {
                let [a, b, c, d] = [pair[0][j - 1], pair[1][j - 1], pair[1][j], pair[0][j]];
                let length = |p: usize, q: usize| (self.vertices[p] - self.vertices[q]).norm();
                if length(a, c) <= length(b, d) * (1.0 + 1e-9) {
                    self.cells.extend([[a, b, c], [a, c, d]]);
                } else {
                    self.cells.extend([[a, b, d], [b, c, d]]);
                }
            }
        }
    }

    fn finish(self, [x0, x1]: [f64; 2]) -> Result<Mesh, MeshError> {
        let mut count: HashMap<(usize, usize), usize> = HashMap::new();
        let edges = |cell: &[usize; 3]| [0, 1, 2].map(|k| (cell[k], cell[(k + 1) % 3]));
        for (a, b) in self.cells.iter().flat_map(edges) {
            *count.entry((a.min(b), a.max(b))).or_default() += 1;
        }
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9 * (x1 - x0);
        let tag = |x: Point, y: Point| {
            [near(x.x, x0) && near(y.x, x0), near(x.x, x1) && near(y.x, x1), near(x.y, x0) && near(y.y, x0)]
                .iter()
                .position(|side| *side)
                .unwrap_or(3)
        };
        let boundary: Vec<BoundaryEdge> = self
            .cells
            .iter()
            .flat_map(edges)
            .filter(|&(a, b)| count[&(a.min(b), a.max(b))] == 1)
            .map(|(a, b)| {
                let tag = tag(self.vertices[a], self.vertices[b]);
                BoundaryEdge { vertices: [a, b], tag, curve: None }
            })
            .collect();
        let tags = SIDES.iter().map(|tag| (*tag).to_owned()).collect();
        Mesh::build(self.vertices, self.cells, &boundary, tags, Vec::new())
    }
}
