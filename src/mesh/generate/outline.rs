//! The boundary of a domain as closed loops of straight and circular pieces, and its division into edges.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use super::size::Size;
use crate::mesh::{Curve, Point};

/// A circular piece: `centre + radius (cos θ, sin θ)` for `θ` from `start` to `start + turn`.
#[derive(Debug, Clone, Copy)]
struct Arc {
    curve: usize,
    centre: Point,
    radius: f64,
    start: f64,
    turn: f64,
}

/// A straight or circular piece of the boundary; without a tag it is the axis of a mirror image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub from: Point,
    pub to: Point,
    arc: Option<Arc>,
    tag: Option<usize>,
}

/// The boundary of the domain (or of its upper half) in the isotropic coordinates.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    pub loops: Vec<Vec<Piece>>,
    pub tags: Vec<String>,
    pub curves: Vec<Curve>,
}

/// The divided boundary.
#[derive(Debug, Clone, Default)]
pub(super) struct Border {
    pub points: Vec<Point>,
    pub edges: Vec<[usize; 2]>,
    /// Tag and curve of every edge; no tag on the axis.
    pub marks: Vec<(Option<usize>, Option<usize>)>,
}

impl Outline {
    /// No loops yet.
    pub fn new(tags: &[&str]) -> Self {
        Self { loops: Vec::new(), tags: tags.iter().map(|tag| (*tag).to_owned()).collect(), curves: Vec::new() }
    }

    /// Numbers a circle.
    pub fn curve(&mut self, centre: Point, radius: f64) -> usize {
        self.curves.push(Curve::Circle { centre, radius });
        self.curves.len() - 1
    }

    /// A part of curve `curve`. Its ends are axis points or poles, which the angles would miss by rounding.
    pub fn arc(&self, curve: usize, start: f64, turn: f64, tag: usize) -> Piece {
        let Curve::Circle { centre, radius } = self.curves[curve];
        let pole = |angle: f64| centre + pole(angle) * radius;
        let (from, to) = (pole(start), pole(start + turn));
        Piece { from, to, arc: Some(Arc { curve, centre, radius, start, turn }), tag: Some(tag) }
    }

    /// The whole circle as two arcs.
    pub fn circle(&mut self, centre: Point, radius: f64, tag: usize) -> Vec<Piece> {
        let curve = self.curve(centre, radius);
        vec![self.arc(curve, 0.0, PI, tag), self.arc(curve, PI, PI, tag)]
    }

    /// Divides every piece into edges whose lengths follow the size function.
    pub fn divide(&self, size: &Size) -> Border {
        let mut border = Border::default();
        for pieces in &self.loops {
            let first = border.points.len();
            for piece in pieces {
                let inner = piece.divisions(size);
                let mark = (piece.tag, piece.arc.map(|arc| arc.curve));
                border.marks.extend(std::iter::repeat_n(mark, inner.len() + 1));
                border.points.push(piece.from);
                border.points.extend(inner.iter().map(|&s| piece.at(s)));
            }
            let end = border.points.len();
            border.edges.extend((first..end).map(|k| [k, if k + 1 == end { first } else { k + 1 }]));
        }
        border
    }
}

impl Piece {
    fn at(&self, s: f64) -> Point {
        match self.arc {
            None => self.from + (self.to - self.from) * s,
            Some(arc) => {
                let (sin, cos) = (arc.start + arc.turn * s).sin_cos();
                arc.centre + Point::new(cos, sin) * arc.radius
            }
        }
    }

    /// Parameters of the inner vertices: `∫ ds/h` between two neighbours is the same for all.
    fn divisions(&self, size: &Size) -> Vec<f64> {
        let length = self.arc.map_or((self.to - self.from).norm(), |arc| arc.radius * arc.turn.abs());
        let least = self.arc.map_or(1, |arc| (arc.turn.abs() / FRAC_PI_4).round() as usize);
        let samples = ((16.0 * length / size.least()).ceil() as usize).clamp(64, 1 << 22);
        let mut total = vec![0.0];
        let step = 1.0 / samples as f64;
        for k in 0..samples {
            let density = length / size.at(self.at((k as f64 + 0.5) * step));
            total.push(total[k] + density * step);
        }
        let sum = total[samples];
        let count = (sum.round() as usize).max(least);
        let mut k = 0;
        let place = |i: usize| {
            let wanted = sum * i as f64 / count as f64;
            while total[k + 1] < wanted {
                k += 1;
            }
            (k as f64 + (wanted - total[k]) / (total[k + 1] - total[k])) * step
        };
        (1..count).map(place).collect()
    }
}

/// A straight piece.
pub(super) fn line(from: Point, to: Point, tag: Option<usize>) -> Piece {
    Piece { from, to, arc: None, tag }
}

/// The same piece from its end.
pub(super) fn reversed(piece: Piece) -> Piece {
    let arc = piece.arc.map(|arc| Arc { start: arc.start + arc.turn, turn: -arc.turn, ..arc });
    Piece { from: piece.to, to: piece.from, arc, ..piece }
}

/// Unit vector at a multiple of a quarter turn, without rounding.
fn pole(angle: f64) -> Point {
    match (angle / FRAC_PI_2).round().rem_euclid(4.0) as usize {
        0 => Point::new(1.0, 0.0),
        1 => Point::new(0.0, 1.0),
        2 => Point::new(-1.0, 0.0),
        3 => Point::new(0.0, -1.0),
        other => unreachable!("quarter {other} of a turn"),
    }
}
