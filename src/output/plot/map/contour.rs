//! Contour lines by marching triangles.

use std::collections::HashMap;

use rayon::prelude::*;

use super::{Scalar, Window};
use crate::mesh::Point;
use crate::output::plot::axis;

/// Evenly spaced levels between the values, about `count` of them, and their spacing: 1, 2 or 5 times a power of ten.
///
/// They lie half a spacing beside the multiples of the spacing: a stream function is constant along walls, often a
/// round number, and a level there would follow its rounding errors.
pub fn nice_levels([low, high]: [f64; 2], count: usize) -> (Vec<f64>, f64) {
    let step = (high - low) / count.max(1) as f64;
    if !(step.is_finite() && step > 1e-12 * low.abs().max(high.abs())) {
        return (Vec::new(), 0.0);
    }
    let step = axis::nice_above(step);
    let (first, last) = ((low / step - 0.5).ceil(), (high / step - 0.5).floor());
    let levels = (0..=2 * count).map(|k| first + k as f64).take_while(|k| *k <= last).map(|k| (k + 0.5) * step);
    (levels.collect(), step)
}

/// Lines along which a scalar has the given levels, by level and then in the order in which the grid meets them.
///
/// The window is divided into `cells[0] × cells[1]` rectangles of two triangles each, in which the scalar is taken as
/// linear; lines end where one of its values is missing. A closed line ends at its first point.
pub fn contours(of: Scalar, window: &Window, cells: [usize; 2], levels: &[f64]) -> Vec<Vec<Point>> {
    let grid = Grid::sample(of, window, cells);
    levels.iter().flat_map(|&level| grid.contour(level)).collect()
}

/// About `count` contour lines' levels of [`nice_levels`], and their spacing; 0 where there are none.
pub(super) fn evenly_spaced(of: Scalar, window: &Window, cells: [usize; 2], count: usize) -> (Vec<Vec<Point>>, f64) {
    let grid = Grid::sample(of, window, cells);
    let extent = grid.values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |e, v| [e[0].min(*v), e[1].max(*v)]);
    let (levels, step) = nice_levels(extent, count);
    (levels.iter().flat_map(|&level| grid.contour(level)).collect(), step)
}

/// Values at the corners of the rectangles, row by row from below; NaN where there is none.
struct Grid<'w> {
    window: &'w Window,
    cells: [usize; 2],
    values: Vec<f64>,
}

/// An edge of a triangle: the numbers of its ends, the lower one first.
type Edge = (usize, usize);

impl<'w> Grid<'w> {
    fn sample(of: Scalar, window: &'w Window, cells: [usize; 2]) -> Self {
        let [nx, ny] = cells.map(|n| n.max(1));
        let row = |j: usize| {
            let up = j as f64 / ny as f64;
            let value =
                move |i: usize| of(window.at(i as f64 / nx as f64, up)).filter(|v| v.is_finite()).unwrap_or(f64::NAN);
            (0..=nx).map(value).collect::<Vec<f64>>()
        };
        let values = (0..=ny).into_par_iter().map(row).collect::<Vec<_>>().concat();
        Self { window, cells: [nx, ny], values }
    }

    fn contour(&self, level: f64) -> Vec<Vec<Point>> {
        let [nx, ny] = self.cells;
        let mut segments: Vec<[Edge; 2]> = Vec::new();
        for (j, i) in (0..ny).flat_map(|j| (0..nx).map(move |i| (j, i))) {
            let (a, b) = (j * (nx + 1) + i, (j + 1) * (nx + 1) + i);
            for triangle in [[a, a + 1, b + 1], [a, b, b + 1]] {
                segments.extend(self.segment(triangle, level));
            }
        }
        let lines = join(&segments);
        lines.into_iter().map(|line| line.into_iter().map(|edge| self.crossing(edge, level)).collect()).collect()
    }

    /// The two edges on which the level is crossed: a corner exactly on the level counts as above it.
    fn segment(&self, [a, b, c]: [usize; 3], level: f64) -> Option<[Edge; 2]> {
        let value = |node: usize| self.values[node];
        if [a, b, c].iter().any(|&node| value(node).is_nan()) {
            return None;
        }
        let crossed = |&(from, to): &Edge| (value(from) >= level) != (value(to) >= level);
        let mut edges = [(a, b), (b, c), (a, c)].into_iter().map(|(m, n)| (m.min(n), m.max(n))).filter(crossed);
        Some([edges.next()?, edges.next()?])
    }

    fn crossing(&self, (from, to): Edge, level: f64) -> Point {
        let share = (level - self.values[from]) / (self.values[to] - self.values[from]);
        let [nx, ny] = self.cells;
        let place =
            |node: usize| self.window.at((node % (nx + 1)) as f64 / nx as f64, (node / (nx + 1)) as f64 / ny as f64);
        place(from) * (1.0 - share) + place(to) * share
    }
}

/// Joins segments that share an edge: open lines first, then closed ones.
fn join(segments: &[[Edge; 2]]) -> Vec<Vec<Edge>> {
    let mut at: HashMap<Edge, [Option<usize>; 2]> = HashMap::with_capacity(segments.len() + 1);
    for (k, segment) in segments.iter().enumerate() {
        for edge in segment {
            let both = at.entry(*edge).or_default();
            both[usize::from(both[0].is_some())] = Some(k);
        }
    }
    let mut used = vec![false; segments.len()];
    let mut lines = Vec::new();
    let is_end = |edge: &Edge| at[edge][1].is_none();
    let begins = |k: usize| match segments[k] {
        [a, _] if is_end(&a) => Some(a),
        [_, b] if is_end(&b) => Some(b),
        _ => None,
    };
    let open = (0..segments.len()).filter_map(|k| begins(k).map(|edge| (k, edge)));
    let closed = segments.iter().enumerate().map(|(k, segment)| (k, segment[0]));
    for (first, start) in open.chain(closed) {
        let mut line = vec![start];
        let (mut next, mut edge) = (Some(first), start);
        while let Some(k) = next.filter(|&k| !used[k]) {
            used[k] = true;
            edge = if segments[k][0] == edge { segments[k][1] } else { segments[k][0] };
            line.push(edge);
            next = at[&edge].into_iter().flatten().find(|&other| !used[other]);
        }
        if line.len() > 1 {
            lines.push(line);
        }
    }
    lines
}
