//! Smoothing: edges relax to their wanted lengths, points are added and taken away where these do not fit, and at last
//! the smallest angles are opened.

use super::front::triangulate;
use super::outline::Border;
use super::size::Size;
use crate::mesh::Point;

/// Triangulations with smoothing between them; in the first `COUNTED` the number of points may change.
const ROUNDS: usize = 24;
const COUNTED: usize = 16;

/// An edge longer or shorter than these multiples of the wanted length gains or loses a point.
const LONG: f64 = 1.5;
const SHORT: f64 = 0.72;

/// Angles below this are opened as far as their neighbours allow, in at most so many triangulations.
const SHARP: f64 = 35.0;
const OPENINGS: usize = 12;

/// Points and their triangulation; the first `fixed` points lie on the border and stay.
struct Net<'s> {
    points: Vec<Point>,
    fixed: usize,
    cells: Vec<[usize; 3]>,
    /// For every point, the two other corners (counterclockwise) of each of its cells.
    fans: Vec<Vec<[usize; 2]>>,
    size: &'s Size,
}

/// Moves the inner points (after those of the border) to a smooth mesh that follows the size function.
pub(super) fn relax(points: Vec<Point>, border: &Border, size: &Size) -> Vec<Point> {
    let mut net = Net { points, fixed: border.points.len(), cells: Vec::new(), fans: Vec::new(), size };
    for round in 0..ROUNDS {
        net.connect(border);
        if round < COUNTED && round % 2 == 0 && net.recount() {
            net.connect(border);
        }
        for _ in 0..3 {
            net.smooth();
        }
    }
    for _ in 0..OPENINGS {
        net.connect(border);
        if !net.open_angles() {
            break;
        }
    }
    net.points
}

impl Net<'_> {
    fn connect(&mut self, border: &Border) {
        self.cells = triangulate(&self.points, &border.edges);
        self.fans = vec![Vec::with_capacity(7); self.points.len()];
        for &[a, b, c] in &self.cells {
            self.fans[a].push([b, c]);
            self.fans[b].push([c, a]);
            self.fans[c].push([a, b]);
        }
    }

    /// One sweep: every free point goes to the minimum of a majorant of `Σ (|x_i − x_j|/h_ij − 1)²` over its edges.
    fn smooth(&mut self) {
        for v in self.fixed..self.points.len() {
            let x = self.points[v];
            let (mut sum, mut weights) = (Point::zeros(), 0.0);
            for &[j, _] in &self.fans[v] {
                let other = self.points[j];
                let h = self.size.between(x, other);
                let away = x - other;
                let weight = 1.0 / (h * h);
                sum += (other + away * (h / away.norm())) * weight;
                weights += weight;
            }
            let step = sum / weights - x;
            // A cell that would be turned over or flattened stops the point.
            if let Some(s) = [1.0, 0.5, 0.25].into_iter().find(|s| self.smallest_angle(v, x + step * *s) > 0.1) {
                self.points[v] = x + step * s;
            }
        }
    }

    /// The smallest angle (radians, negative if turned over) of the cells at `v`, were it at `x`.
    fn smallest_angle(&self, v: usize, x: Point) -> f64 {
        let angles = self.fans[v].iter().map(|&[j, k]| smallest_angle([x, self.points[j], self.points[k]]));
        angles.fold(f64::INFINITY, f64::min)
    }

    /// Adds points on long edges and at points of many cells, removes them at short edges and at points of few cells;
    /// at most one change in a neighbourhood. Tells whether anything changed.
    fn recount(&mut self) -> bool {
        let mut touched = vec![false; self.points.len()];
        let mut removed = vec![false; self.points.len()];
        let mut added = Vec::new();
        for v in self.fixed..self.points.len() {
            let fan = &self.fans[v];
            if touched[v] || fan.iter().any(|&[j, _]| touched[j]) {
                continue;
            }
            let ratio = |j: usize| {
                let (x, y) = (self.points[v], self.points[j]);
                (x - y).norm() / self.size.between(x, y)
            };
            let mut long = (0.0, v);
            let mut short = f64::INFINITY;
            for &[j, _] in fan {
                let r = ratio(j);
                long = if r > long.0 { (r, j) } else { long };
                short = short.min(r);
            }
            let crowded = fan.len() < 5 || short < SHORT;
            if crowded {
                removed[v] = true;
            } else if long.0 > LONG || fan.len() > 7 {
                added.push((self.points[v] + self.points[long.1]) * 0.5);
            } else {
                continue;
            }
            touched[v] = true;
            for &[j, _] in fan {
                touched[j] = true;
            }
        }
        added.extend(self.chords());
        let changed = !added.is_empty() || removed.contains(&true);
        let mut number = 0..;
        self.points.retain(|_| !removed[number.next().expect("an endless range")]);
        self.points.extend(added);
        changed
    }

    /// Midpoints of long inner edges between two border points, which no free point sees.
    fn chords(&self) -> Vec<Point> {
        let mut found = Vec::new();
        for a in 0..self.fixed {
            for &[b, _] in &self.fans[a] {
                let inner = b > a && b < self.fixed && self.fans[a].iter().any(|&[_, c]| c == b);
                let (x, y) = (self.points[a], self.points[b]);
                if inner && (x - y).norm() > LONG * self.size.between(x, y) {
                    found.push((x + y) * 0.5);
                }
            }
        }
        found
    }

    /// Moves the free corners of sharp cells to where the smallest angle about them is largest. Tells whether any
    /// moved.
    fn open_angles(&mut self) -> bool {
        let sharp = SHARP.to_radians();
        let mut moved = false;
        for index in 0..self.cells.len() {
            let corners = self.cells[index];
            if smallest_angle(corners.map(|v| self.points[v])) >= sharp {
                continue;
            }
            for v in corners {
                if v >= self.fixed {
                    moved |= self.open_about(v);
                }
            }
        }
        moved
    }

    /// Pattern search for the best place of one point.
    fn open_about(&mut self, v: usize) -> bool {
        let start = self.smallest_angle(v, self.points[v]);
        let mut best = (start, self.points[v]);
        let mut step = 0.1 * self.size.at(best.1);
        for _ in 0..6 {
            let around = (0..8).map(|k| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
                best.1 + Point::new(cos, sin) * step
            });
            let trial = around.map(|x| (self.smallest_angle(v, x), x)).fold(best, |a, b| if b.0 > a.0 { b } else { a });
            if trial.0 > best.0 {
                best = trial;
            } else {
                step *= 0.5;
            }
        }
        self.points[v] = best.1;
        best.0 > start + 1e-3
    }
}

/// The smallest angle of a triangle in radians; negative if it runs clockwise.
fn smallest_angle(corners: [Point; 3]) -> f64 {
    let angle = |k: usize| {
        let (u, v) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
        u.perp(&v).atan2(u.dot(&v))
    };
    angle(0).min(angle(1)).min(angle(2))
}
