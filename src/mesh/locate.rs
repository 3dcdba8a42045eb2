//! Which cell contains a point: a tree of bounding boxes, then the inverse of the cell map.
//!
//! A tree rather than buckets: boundary layers and graded meshes put most cells into few buckets, whereas the depth of
//! the tree is `log₂(cells)` for any mesh.

use super::geometry::straight_nodes;
use super::{CellMap, Mesh, Point};

/// Distance from a cell, relative to its longest edge, within which a point still counts as inside.
const TOLERANCE: f64 = 1e-9;
/// Cells per leaf.
const LEAF: usize = 4;
/// Lebesgue constants of the equispaced triangle of degree 2 and 3 (5/3 and 2.27) are below this.
const LEBESGUE: f64 = 2.3;
const MAX_STEPS: usize = 30;

/// An axis-parallel box.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: Point,
    high: Point,
}

impl Bounds {
    fn join(self, other: Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    fn contains(&self, x: Point, margin: f64) -> bool {
        let (a, b) = (x - self.low, self.high - x);
        a.x >= -margin && a.y >= -margin && b.x >= -margin && b.y >= -margin
    }

    fn meets(&self, other: &Self) -> bool {
        let (a, b) = (other.high - self.low, self.high - other.low);
        a.x >= 0.0 && a.y >= 0.0 && b.x >= 0.0 && b.y >= 0.0
    }

    /// Longer side.
    fn reach(&self) -> f64 {
        (self.high - self.low).max()
    }

    /// Bounds of a cell, curved sides included: `|x(ξ) − flat(ξ)| ≤ Λ max_i |X_i − flat_i|`.
    fn of_cell(mesh: &Mesh, cell: usize) -> Self {
        let corners = mesh.corners(cell);
        let [a, b, c] = corners;
        let bulge = mesh.curved[cell].as_deref().map_or(0.0, |nodes| {
            let flat = straight_nodes(nodes.degree, corners).positions;
            let moved = nodes.positions.iter().zip(&flat).map(|(p, q)| (p - q).norm());
            LEBESGUE * moved.fold(0.0, f64::max)
        });
        let margin = Point::repeat(bulge);
        let (low, high) = (a.inf(&b).inf(&c) - margin, a.sup(&b).sup(&c) + margin);
        Self { low, high }
    }
}

/// A node of the tree: the cells `order[first..last]`, and its second child (the first child follows the node).
#[derive(Debug, Clone)]
struct Branch {
    bounds: Bounds,
    /// Longest side of the bounds of a cell below.
    reach: f64,
    first: usize,
    last: usize,
    second: Option<usize>,
}

/// Finds the cells of the mesh it was built from.
#[derive(Debug, Clone)]
pub struct Locator {
    bounds: Vec<Bounds>,
    order: Vec<usize>,
    branches: Vec<Branch>,
}

impl Locator {
    /// Prepares the search, in O(n log² n).
    pub fn new(mesh: &Mesh) -> Self {
        let bounds: Vec<Bounds> = (0..mesh.cells.len()).map(|cell| Bounds::of_cell(mesh, cell)).collect();
        let mut locator = Self { order: (0..bounds.len()).collect(), bounds, branches: Vec::new() };
        locator.grow(0, locator.order.len());
        locator
    }

    fn grow(&mut self, first: usize, last: usize) -> usize {
        let cells = &mut self.order[first..last];
        let all = cells.iter().map(|&c| self.bounds[c]);
        let reach = all.clone().map(|b| b.reach()).fold(0.0, f64::max);
        let bounds = all.reduce(Bounds::join).expect("a mesh has cells");
        let index = self.branches.len();
        self.branches.push(Branch { bounds, reach, first, last, second: None });
        if cells.len() > LEAF {
            let axis = usize::from(bounds.high.y - bounds.low.y > bounds.high.x - bounds.low.x);
            let centre = |c: &usize| self.bounds[*c].low[axis] + self.bounds[*c].high[axis];
            cells.sort_unstable_by(|a, b| centre(a).total_cmp(&centre(b)).then(a.cmp(b)));
            let middle = first + cells.len() / 2;
            self.grow(first, middle);
            let second = self.grow(middle, last);
            self.branches[index].second = Some(second);
        }
        index
    }

    /// The cell that contains `x` and the reference point `ξ` that it maps to `x`; `None` outside of the mesh.
    ///
    /// A point within 1e-9 of the longest edge of a cell belongs to it, so points on shared faces and on the boundary
    /// are found; a point of the exact circle may lie beyond a bent cell by more than that ([`Self::locate_near`]). Of
    /// several cells it is the one with the lowest index.
    pub fn locate(&self, mesh: &Mesh, x: Point) -> Option<(usize, Point)> {
        let mut best: Option<(usize, Point)> = None;
        self.visit(x, TOLERANCE, |cell| {
            if best.is_none_or(|(found, _)| cell < found)
                && let Some(xi) = invert(mesh, cell, x)
                && barycentric(xi).into_iter().zip(tolerances(mesh, cell)).all(|(b, tolerance)| b >= -tolerance)
            {
                best = Some((cell, xi));
            }
        });
        best
    }

    /// Like [`Self::locate`], and if no cell contains `x`, the cell that `x` misses by least, provided that no
    /// barycentric coordinate of `ξ` is below `-slack`. `ξ` then lies outside of the reference triangle by that much.
    pub fn locate_near(&self, mesh: &Mesh, x: Point, slack: f64) -> Option<(usize, Point)> {
        self.locate(mesh, x).or_else(|| {
            let mut best: Option<(f64, usize, Point)> = None;
            self.visit(x, slack, |cell| {
                let Some(xi) = invert(mesh, cell, x) else { return };
                let least = barycentric(xi).into_iter().fold(f64::INFINITY, f64::min);
                let better = best.is_none_or(|(b, c, _)| least > b || (least == b && cell < c));
                if least >= -slack && better {
                    best = Some((least, cell, xi));
                }
            });
            best.map(|(_, cell, xi)| (cell, xi))
        })
    }

    /// Calls `each` for the cells whose bounds meet the box from `low` to `high`, in no order that matters.
    pub fn visit_box(&self, low: Point, high: Point, mut each: impl FnMut(usize)) {
        let asked = Bounds { low, high };
        let mut open = vec![0];
        while let Some(index) = open.pop() {
            let branch = &self.branches[index];
            if !branch.bounds.meets(&asked) {
                continue;
            }
            match branch.second {
                Some(second) => open.extend([second, index + 1]),
                None => {
                    let cells = self.order[branch.first..branch.last].iter().copied();
                    cells.filter(|&c| self.bounds[c].meets(&asked)).for_each(&mut each);
                }
            }
        }
    }

    /// Calls `each` for the cells whose bounds, widened for `slack`, contain `x`.
    ///
    /// The points with barycentric coordinates above `-s` form the cell scaled by `1 + 3s` about its centroid, which
    /// leaves the bounds by at most `2s` of their side.
    fn visit(&self, x: Point, slack: f64, mut each: impl FnMut(usize)) {
        let widen = |reach: f64| 2.0 * slack * reach;
        let mut open = vec![0];
        while let Some(index) = open.pop() {
            let branch = &self.branches[index];
            if !branch.bounds.contains(x, widen(branch.reach)) {
                continue;
            }
            match branch.second {
                Some(second) => open.extend([second, index + 1]),
                None => {
                    let cells = self.order[branch.first..branch.last].iter().copied();
                    cells.filter(|&c| self.bounds[c].contains(x, widen(self.bounds[c].reach()))).for_each(&mut each);
                }
            }
        }
    }
}

fn barycentric(xi: Point) -> [f64; 3] {
    [1.0 - xi.x - xi.y, xi.x, xi.y]
}

/// The tolerance of each barycentric coordinate: [`TOLERANCE`] times the longest edge over the height on that face.
fn tolerances(mesh: &Mesh, cell: usize) -> [f64; 3] {
    let [a, b, c] = mesh.corners(cell);
    let edges = [(c - b).norm(), (a - c).norm(), (b - a).norm()];
    let longest = edges[0].max(edges[1]).max(edges[2]);
    let twice_area = (b - a).perp(&(c - a));
    edges.map(|edge| TOLERANCE * longest * edge / twice_area)
}

/// The reference point that the cell maps to `x`; `None` if Newton's method finds none near the cell.
pub(crate) fn invert(mesh: &Mesh, cell: usize, x: Point) -> Option<Point> {
    let straight = straight_inverse(mesh, cell, x)?;
    match mesh.map(cell) {
        CellMap::Affine { .. } => Some(straight),
        map @ CellMap::Isoparametric(_) => newton(map, x, straight),
    }
}

/// The inverse of the affine map of the corners.
pub(crate) fn straight_inverse(mesh: &Mesh, cell: usize, x: Point) -> Option<Point> {
    let [a, b, c] = mesh.corners(cell);
    let (u, v, w) = (b - a, c - a, x - a);
    let twice_area = u.perp(&v);
    let xi = Point::new(w.perp(&v), u.perp(&w)) / twice_area;
    (xi.x.is_finite() && xi.y.is_finite()).then_some(xi)
}

/// Solves `x(ξ) = x` from `xi` on; a step is halved as long as it does not bring `x(ξ)` nearer.
fn newton(map: CellMap, x: Point, mut xi: Point) -> Option<Point> {
    let (mut at, mut jacobian) = map.at(xi);
    for _ in 0..MAX_STEPS {
        let step = jacobian.try_inverse()? * (x - at);
        if step.norm() <= 4.0 * f64::EPSILON {
            return Some(xi);
        }
        let mut scale = 1.0;
        loop {
            let next = xi + step * scale;
            let (there, slopes) = map.at(next);
            if (x - there).norm() < (x - at).norm() {
                (xi, at, jacobian) = (next, there, slopes);
                break;
            }
            scale *= 0.5;
            if scale < 1e-3 {
                // Either rounding stops the iteration at the solution, or x is no image of a point near the cell.
                return (step.norm() < 1e-10).then_some(xi);
            }
        }
    }
    None
}
