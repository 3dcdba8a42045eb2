//! The part of a straight cell that a body covers: a convex region of the reference triangle, bounded by segments and
//! arcs of ellipses.

use crate::mesh::Point;
use crate::shape::outline::Piece;

/// Parts of a cell below this share of it are nothing, and above one less it the whole: rounding of the cuts
/// themselves.
pub(super) const NOTHING: f64 = 1e-15;
/// Gaps that are shorter, in reference coordinates, are not closed.
const GAP: f64 = 1e-16;

/// Keeps the part of a convex region, given by its boundary counterclockwise, where `n·x + d > 0`.
///
/// A piece is split where it crosses the line, and a part is kept or not by the side on which it lies; gaps of the
/// boundary then lie on the line and are closed by segments. Whatever rounding does to a part that nearly lies on the
/// line, the boundary is closed.
fn clip(pieces: &[Piece], n: Point, d: f64) -> Vec<Piece> {
    // an arc may touch the line at one of these points, but not at two
    let side = |piece: &Piece, from: f64, to: f64| {
        let levels = [0.3, 0.7].map(|s| n.dot(&piece.at(from + s * (to - from))) + d);
        if levels[0].abs() > levels[1].abs() { levels[0] } else { levels[1] }
    };
    let mut kept: Vec<Piece> = Vec::with_capacity(pieces.len() + 2);
    for piece in pieces {
        let (first, last) = piece.range();
        let mut from = first;
        let mut open: Option<(f64, f64)> = None;
        for to in piece.crossings(n, d).chain([last]) {
            if side(piece, from, to) > 0.0 {
                open = Some((open.map_or(from, |o| o.0), to));
            } else if let Some((a, b)) = open.take() {
                kept.push(piece.part(a, b));
            }
            from = to;
        }
        if let Some((a, b)) = open {
            kept.push(if (a, b) == (first, last) { *piece } else { piece.part(a, b) });
        }
    }
    join_ends(&mut kept);
    close(&kept)
}

/// Joins the last and the first piece if they are one arc that its starting point had cut.
fn join_ends(pieces: &mut Vec<Piece>) {
    let [Piece::Arc { centre, axes, to, .. }, .., Piece::Arc { centre: last, axes: others, from, to: end }] =
        pieces[..]
    else {
        return;
    };
    let turn = std::f64::consts::TAU;
    if last == centre && others == axes && end == turn && pieces[0].range().0 == 0.0 {
        pieces[0] = Piece::Arc { centre, axes, from: from - turn, to };
        pieces.pop();
    }
}

fn close(kept: &[Piece]) -> Vec<Piece> {
    let mut closed = Vec::with_capacity(kept.len() + 2);
    for (k, piece) in kept.iter().enumerate() {
        closed.push(*piece);
        let (from, to) = (piece.ends()[1], kept[(k + 1) % kept.len()].ends()[0]);
        if (to - from).norm() > GAP && !is_full_turn(piece) {
            closed.push(Piece::Segment { from, to });
        }
    }
    closed
}

/// Whether the piece is a whole ellipse.
pub(super) fn is_full_turn(piece: &Piece) -> bool {
    match *piece {
        Piece::Segment { .. } => false,
        Piece::Arc { from, to, .. } => to - from >= std::f64::consts::TAU,
    }
}

/// The part of the reference triangle that a convex region covers.
pub(super) fn in_triangle(boundary: &[Piece]) -> Vec<Piece> {
    let edges = [(Point::new(0.0, 1.0), 0.0), (Point::new(1.0, 0.0), 0.0), (Point::new(-1.0, -1.0), 1.0)];
    edges.iter().fold(boundary.to_vec(), |region, &(n, d)| clip(&region, n, d))
}

/// Area of a region, from its boundary counterclockwise.
pub(super) fn area(pieces: &[Piece]) -> f64 {
    let Some(first) = pieces.first() else { return 0.0 };
    let origin = first.ends()[0];
    let swept = |piece: &Piece| {
        let [p, q] = piece.ends().map(|x| x - origin);
        let triangle = 0.5 * p.perp(&q);
        match *piece {
            Piece::Segment { .. } => triangle,
            Piece::Arc { axes: [a, b], from, to, .. } => triangle + 0.5 * a.perp(&b) * circular_segment(to - from),
        }
    };
    pieces.iter().map(swept).sum()
}

/// `t − sin t`
fn circular_segment(t: f64) -> f64 {
    if t.abs() > 0.5 {
        return t - t.sin();
    }
    // t³/6 (1 − t²/20 (1 − t²/42 (…)))
    let series = [20.0, 42.0, 72.0, 110.0, 156.0, 210.0].iter().rev().fold(1.0, |sum, c| 1.0 - t * t / c * sum);
    t * t * t / 6.0 * series
}
