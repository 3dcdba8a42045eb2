//! The part of a curved cell that a body covers.
//!
//! The boundary of the part is a closed chain: runs along the edges of the cell inside the body, and from the end of
//! each run along the boundary of the body, counterclockwise, to where the next run begins. The inverse of the cell map
//! takes the pieces in space to the reference triangle, where they are smooth; a fan of cones over the chain is then
//! the region, with signs, wherever its apex lies.

use super::face;
use super::region::NOTHING;
use super::rule::{add_cone, gauss};
use crate::element::basis;
use crate::element::quadrature::Rule;
use crate::mesh::locate::invert;
use crate::mesh::{Mesh, Point};
use crate::shape::Placed;
use crate::shape::outline::Piece;

/// Intervals along an edge between samples of the distance, in which crossings are sought.
const SAMPLES: usize = 32;
/// Runs and gaps of runs that are shorter, as shares of an edge, are nothing.
const SHORT: f64 = 1e-12;

/// A side of the part.
#[derive(Debug, Clone, Copy)]
pub(super) enum Side {
    /// Along an edge of the reference triangle.
    Edge { from: Point, to: Point },
    /// Along the boundary of the body, in space.
    Body(Piece),
}

/// What of a curved cell a body covers.
pub(super) enum Covered {
    Nothing,
    All,
    Part(Vec<Side>),
}

/// The part of a curved cell inside a body.
pub(super) fn covered(mesh: &Mesh, cell: usize, placed: Placed) -> Covered {
    let runs = match runs(mesh, cell, placed) {
        Runs::All => return Covered::All,
        Runs::Some(runs) => runs,
    };
    let boundary = placed.boundary();
    let count = boundary.len() as f64;
    let mut sides = Vec::new();
    if runs.is_empty() {
        let centre = invert(mesh, cell, placed.pose.position);
        let inside = centre.is_some_and(|xi| xi.x >= 0.0 && xi.y >= 0.0 && xi.x + xi.y <= 1.0);
        sides.extend(boundary.iter().filter(|_| inside).map(|piece| Side::Body(*piece)));
    }
    let position = |(f, s): (usize, f64)| parameter(&boundary, mesh.map(cell).at(basis::face_point(f, s)).0);
    let starts: Vec<f64> = runs.iter().map(|run| position((run[0].0, run[0].1[0]))).collect();
    for run in &runs {
        let on_edge = |f: usize, s: f64| basis::face_point(f, s);
        sides.extend(run.iter().map(|&(f, [a, b])| Side::Edge { from: on_edge(f, a), to: on_edge(f, b) }));
        let &(f, [_, last]) = run.last().expect("a run has an interval");
        let from = position((f, last));
        let onwards = starts.iter().map(|start| (start - from).rem_euclid(count)).fold(count, f64::min);
        add_arcs(&mut sides, &boundary, from, onwards);
    }
    let area = |rule: &Rule<Point>| -> f64 {
        rule.points.iter().zip(&rule.weights).map(|(xi, w)| w * mesh.map(cell).at(*xi).1.determinant()).sum()
    };
    let share = area(&fan(mesh, cell, &sides, 4)) / mesh.cell_area(cell);
    match share {
        s if s <= NOTHING => Covered::Nothing,
        s if s >= 1.0 - NOTHING => Covered::All,
        _ => Covered::Part(sides),
    }
}

/// An interval of a local face, from vertex `f+1` to vertex `f+2`.
type Interval = (usize, [f64; 2]);

enum Runs {
    /// The whole boundary of the cell lies in the body, and so the cell, for the body is convex.
    All,
    /// Intervals inside the body that follow each other.
    Some(Vec<Vec<Interval>>),
}

fn runs(mesh: &Mesh, cell: usize, placed: Placed) -> Runs {
    let mut intervals: Vec<Interval> = Vec::new();
    for f in 0..3 {
        intervals.extend(along_face(mesh, cell, f, placed).into_iter().map(|span| (f, span)));
    }
    let follows = |a: &Interval, b: &Interval| {
        let gap = if a.0 == b.0 { b.1[0] - a.1[1] } else { 1.0 - a.1[1] + b.1[0] };
        (a.0 == b.0 || (a.0 + 1) % 3 == b.0) && (0.0..SHORT).contains(&gap)
    };
    let mut runs: Vec<Vec<Interval>> = Vec::new();
    for interval in intervals {
        match runs.last_mut().filter(|run| follows(&run[run.len() - 1], &interval)) {
            Some(run) => run.push(interval),
            None => runs.push(vec![interval]),
        }
    }
    if let (Some(first), Some(last)) = (runs.first(), runs.last())
        && follows(&last[last.len() - 1], &first[0])
    {
        if runs.len() == 1 {
            return Runs::All;
        }
        let mut last = runs.pop().expect("there are two");
        last.append(&mut runs[0]);
        runs[0] = last;
    }
    runs.retain(|run| run.iter().map(|(_, [a, b])| b - a).sum::<f64>() > SHORT);
    Runs::Some(runs)
}

/// The shares of local face `f` inside a body, from vertex `f+1` to vertex `f+2`.
pub(super) fn along_face(mesh: &Mesh, cell: usize, f: usize, placed: Placed) -> Vec<[f64; 2]> {
    let corners = mesh.corners(cell);
    let ends = [corners[(f + 1) % 3], corners[(f + 2) % 3]];
    if is_straight(mesh, cell, f) {
        return face::covered(placed.shape, ends.map(|x| placed.pose.to_body(x))).into_iter().collect();
    }
    let map = mesh.map(cell);
    crossed(|s| placed.signed_distance(map.at(basis::face_point(f, s)).0).0)
}

/// Whether the nodes of a local face divide its chord evenly.
pub(super) fn is_straight(mesh: &Mesh, cell: usize, f: usize) -> bool {
    let Some(nodes) = &mesh.curved[cell] else { return true };
    let on_face = basis::face_nodes(nodes.degree, f);
    let (a, b) = (nodes.positions[on_face[0]], nodes.positions[on_face[nodes.degree]]);
    let apart = |(k, &node): (usize, &usize)| {
        let s = k as f64 / nodes.degree as f64;
        (nodes.positions[node] - a * (1.0 - s) - b * s).norm()
    };
    on_face.iter().enumerate().map(apart).fold(0.0, f64::max) <= 1e-14 * (b - a).norm()
}

/// Where a function of `0 ≤ s ≤ 1` is negative: it is sampled, and a least value between two samples of one sign is
/// looked for.
fn crossed(level: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let mut samples: Vec<(f64, f64)> =
        (0..=SAMPLES).map(|k| k as f64 / SAMPLES as f64).map(|s| (s, level(s))).collect();
    let dips: Vec<(f64, f64)> = samples
        .windows(3)
        .filter(|w| {
            let one_sign = w.iter().all(|p| p.1 > 0.0) || w.iter().all(|p| p.1 <= 0.0);
            one_sign && w[1].1.abs() <= w[0].1.abs() && w[1].1.abs() <= w[2].1.abs()
        })
        .map(|w| lowest(&level, w[1].1.signum(), [w[0].0, w[2].0]))
        .collect();
    samples.extend(dips);
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut inside = Vec::new();
    let mut from = (samples[0].1 <= 0.0).then_some(0.0);
    for pair in samples.windows(2) {
        let entering = pair[1].1 <= 0.0;
        if (pair[0].1 <= 0.0) != entering {
            let root = bisected(&level, pair[0].0, pair[1].0, entering);
            match from.take() {
                Some(start) => inside.push([start, root]),
                None => from = Some(root),
            }
        }
    }
    inside.extend(from.map(|start| [start, 1.0]));
    inside.retain(|[a, b]| b - a > face::NOTHING);
    inside
}

/// Where `sign · level` is least, by golden sections.
fn lowest(level: &impl Fn(f64) -> f64, sign: f64, [mut a, mut b]: [f64; 2]) -> (f64, f64) {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    for _ in 0..45 {
        let (p, q) = (b - golden * (b - a), a + golden * (b - a));
        if sign * level(p) < sign * level(q) { b = q } else { a = p }
    }
    (0.5 * (a + b), level(0.5 * (a + b)))
}

fn bisected(level: &impl Fn(f64) -> f64, mut a: f64, mut b: f64, entering: bool) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (a + b);
        if (level(middle) <= 0.0) == entering { b = middle } else { a = middle }
    }
    0.5 * (a + b)
}

/// Where on a boundary a point lies: the number of the piece plus the share of its range.
pub(super) fn parameter(boundary: &[Piece], x: Point) -> f64 {
    let nearest = |piece: &Piece| {
        let (from, to) = piece.range();
        let t = match *piece {
            // a side without length has one parameter alone
            Piece::Segment { from, to } if from == to => 0.0,
            Piece::Segment { from, to } => (x - from).dot(&(to - from)) / (to - from).norm_squared(),
            Piece::Arc { centre, axes: [a, b], .. } => {
                let y = x - centre;
                let angle = (y.dot(&b) / b.norm_squared()).atan2(y.dot(&a) / a.norm_squared());
                from + (angle - from).rem_euclid(std::f64::consts::TAU)
            }
        };
        // beyond its end an arc is met either there or at its start
        let ends = [t.clamp(from, to), from];
        let apart = |t: f64| (piece.at(t) - x).norm();
        let t = if apart(ends[1]) < apart(ends[0]) { ends[1] } else { ends[0] };
        (apart(t), (t - from) / (to - from))
    };
    let all = boundary.iter().map(nearest).enumerate();
    let best = all.min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0)).expect("a boundary has pieces");
    best.0 as f64 + best.1.1
}

/// Adds the boundary of the body from a parameter on, for a length of parameter.
fn add_arcs(sides: &mut Vec<Side>, boundary: &[Piece], from: f64, onwards: f64) {
    let (mut at, end) = (from, from + onwards);
    while at < end {
        let whole = at.floor();
        let piece = &boundary[whole as usize % boundary.len()];
        let next = end.min(whole + 1.0);
        let (a, b) = piece.range();
        sides.push(Side::Body(piece.part(a + (b - a) * (at - whole), a + (b - a) * (next - whole))));
        at = next;
    }
}

/// Quadrature on the part of the reference triangle inside a chain, for polynomials of degree `degree`; see
/// [`Cover`](super::Cover) for its error.
pub(super) fn fan(mesh: &Mesh, cell: usize, sides: &[Side], degree: usize) -> Rule<Point> {
    let mut rule = Rule { degree, points: Vec::new(), weights: Vec::new() };
    let starts: Vec<Point> = sides.iter().map(|side| start(mesh, cell, side)).collect();
    let apex = starts.iter().sum::<Point>() / starts.len().max(1) as f64;
    let cell_size = mesh.cell_area(cell).sqrt();
    for side in sides {
        match side {
            Side::Edge { from, to } => {
                let gauss = gauss(degree / 2 + 2);
                for (s, w) in gauss.points.iter().zip(&gauss.weights) {
                    add_cone(&mut rule, apex, from * (1.0 - s) + to * *s, (to - from) * *w);
                }
            }
            Side::Body(piece) => {
                let (from, to) = piece.range();
                let (length, turn) = match piece {
                    Piece::Segment { from, to } => ((to - from).norm(), 0.0),
                    Piece::Arc { axes: [a, b], .. } => (a.norm().max(b.norm()) * (to - from), to - from),
                };
                let parts = (4.0 * length / cell_size).max(2.0 * turn).ceil().clamp(1.0, 64.0);
                let gauss = gauss(degree / 2 + 8);
                let step = (to - from) / parts;
                for part in 0..parts as usize {
                    for (s, w) in gauss.points.iter().zip(&gauss.weights) {
                        let t = from + (part as f64 + s) * step;
                        let xi = pulled(mesh, cell, piece.at(t));
                        let inverse = mesh.map(cell).at(xi).1.try_inverse().expect("the cell map is regular");
                        add_cone(&mut rule, apex, xi, inverse * piece.slope(t) * (w * step));
                    }
                }
            }
        }
    }
    rule
}

fn start(mesh: &Mesh, cell: usize, side: &Side) -> Point {
    match side {
        Side::Edge { from, .. } => *from,
        Side::Body(piece) => pulled(mesh, cell, piece.ends()[0]),
    }
}

/// The reference point of a point of the cell.
fn pulled(mesh: &Mesh, cell: usize, x: Point) -> Point {
    invert(mesh, cell, x).expect("points of a cell have reference points")
}
