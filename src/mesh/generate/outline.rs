//! The boundary of a domain as closed loops of straight and circular pieces, and its division into edges.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use super::size::Size;
use super::stretch::Stretch;
use super::{MeshScene, Shape};
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
struct Piece {
    from: Point,
    to: Point,
    arc: Option<Arc>,
    tag: Option<usize>,
}

/// The boundary of the domain (or of its upper half) in the isotropic coordinates.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    loops: Vec<Vec<Piece>>,
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
    /// The outline of a scene whose values have been checked; its upper half if the mesh is to be symmetric.
    pub fn new(scene: &MeshScene, shape: Shape) -> Self {
        let half = scene.symmetric == Some(true);
        let radius = scene.radius.unwrap_or(1.0);
        let centre = Point::from(scene.centre.unwrap_or_default());
        let tags = shape.tags(scene.discs_on_track() == 0);
        let mut outline =
            Self { loops: Vec::new(), tags: tags.iter().map(|t| (*t).to_owned()).collect(), curves: Vec::new() };
        match shape {
            Shape::Square | Shape::SquareWithCircle => unreachable!("squares are structured"),
            Shape::Strip => outline.with_strip(scene, half, None),
            Shape::StripWithDisc => outline.with_strip(scene, half, Some((centre, radius))),
            Shape::Disc => {
                let pieces = if half { outline.half_disc(centre, radius) } else { outline.circle(centre, radius, 0) };
                outline.loops.push(pieces);
                outline
            }
            Shape::Annulus => {
                let inner = scene.inner_radius.unwrap_or(0.5);
                outline.with_annulus(centre, inner, radius, half)
            }
            Shape::Racetrack => outline.with_racetrack(scene, half),
        }
    }

    /// Numbers a circle.
    fn curve(&mut self, centre: Point, radius: f64) -> usize {
        self.curves.push(Curve::Circle { centre, radius });
        self.curves.len() - 1
    }

    /// A part of curve `curve`. Its ends are axis points or poles, which the angles would miss by rounding.
    fn arc(&self, curve: usize, start: f64, turn: f64, tag: usize) -> Piece {
        let Curve::Circle { centre, radius } = self.curves[curve];
        let pole = |angle: f64| centre + pole(angle) * radius;
        let (from, to) = (pole(start), pole(start + turn));
        Piece { from, to, arc: Some(Arc { curve, centre, radius, start, turn }), tag: Some(tag) }
    }

    /// The whole circle as two arcs.
    fn circle(&mut self, centre: Point, radius: f64, tag: usize) -> Vec<Piece> {
        let curve = self.curve(centre, radius);
        vec![self.arc(curve, 0.0, PI, tag), self.arc(curve, PI, PI, tag)]
    }

    fn half_disc(&mut self, centre: Point, radius: f64) -> Vec<Piece> {
        let curve = self.curve(centre, radius);
        let rim = self.arc(curve, 0.0, PI, 0);
        vec![line(rim.to, rim.from, None), rim]
    }

    fn with_annulus(mut self, centre: Point, inner: f64, outer: f64, half: bool) -> Self {
        if half {
            let (small, large) = (self.curve(centre, inner), self.curve(centre, outer));
            let (inside, outside) = (self.arc(small, PI, -PI, 0), self.arc(large, 0.0, PI, 1));
            let joined = |a: &Piece, b: &Piece| line(a.to, b.from, None);
            self.loops.push(vec![joined(&inside, &outside), outside, joined(&outside, &inside), inside]);
        } else {
            let rims = [self.circle(centre, inner, 0), self.circle(centre, outer, 1)];
            self.loops.extend(rims);
        }
        self
    }

    fn with_strip(mut self, scene: &MeshScene, half: bool, disc: Option<(Point, f64)>) -> Self {
        let [x0, x1] = Stretch::new(scene).image();
        let top = 0.5 * scene.width.unwrap_or(1.0);
        let bottom = if half { 0.0 } else { -top };
        let [a, b] = [Point::new(x0, bottom), Point::new(x1, bottom)];
        let [c, d] = [Point::new(x1, top), Point::new(x0, top)];
        let mut rim = match (half, disc) {
            (false, None) => vec![line(a, b, Some(2))],
            (true, None) => vec![line(a, b, None)],
            (false, Some((centre, radius))) => {
                let hole = self.circle(centre, radius, 3);
                self.loops.push(hole);
                vec![line(a, b, Some(2))]
            }
            (true, Some((centre, radius))) => {
                let curve = self.curve(centre, radius);
                let over = self.arc(curve, PI, -PI, 3);
                vec![line(a, over.from, None), over, line(over.to, b, None)]
            }
        };
        rim.extend([line(b, c, Some(1)), line(c, d, Some(2)), line(d, a, Some(0))]);
        self.loops.push(rim);
        self
    }

    fn with_racetrack(mut self, scene: &MeshScene, half: bool) -> Self {
        let (turn, width) = (scene.turn_radius.unwrap_or(1.0), scene.width.unwrap_or(1.0));
        let radius = scene.radius.unwrap_or(1.0);
        let east = Point::new(0.5 * scene.arm.unwrap_or(0.0), 0.0);
        let rims = [(turn + 0.5 * width, 0), (turn - 0.5 * width, 1)].map(|(r, tag)| {
            let (right, left) = (self.curve(east, r), self.curve(-east, r));
            self.stadium(right, left, tag, half)
        });
        let disc = Point::new(0.0, turn);
        let discs: Vec<Vec<Piece>> =
            [disc, -disc][..scene.discs_on_track()].iter().map(|at| self.circle(*at, radius, 2)).collect();
        if half {
            let [outer, mut inner] = rims;
            inner = inner.into_iter().rev().map(reversed).collect();
            let (first, last) = (inner[0], inner[inner.len() - 1]);
            let (begin, end) = (outer[0], outer[outer.len() - 1]);
            let mut band = vec![line(last.to, begin.from, None)];
            band.extend(outer);
            band.push(line(end.to, first.from, None));
            band.extend(inner);
            self.loops.push(band);
            // the lower one is the image of the upper one
            self.loops.extend(discs.into_iter().take(1));
        } else {
            self.loops.extend(rims);
            self.loops.extend(discs);
        }
        self
    }

    /// Straight pieces joined by arcs of two equal circles, counterclockwise from the east; the upper half is open.
    fn stadium(&self, right: usize, left: usize, tag: usize, half: bool) -> Vec<Piece> {
        if half {
            let (east, west) = (self.arc(right, 0.0, FRAC_PI_2, tag), self.arc(left, FRAC_PI_2, FRAC_PI_2, tag));
            vec![east, line(east.to, west.from, Some(tag)), west]
        } else {
            let (east, west) = (self.arc(right, -FRAC_PI_2, PI, tag), self.arc(left, FRAC_PI_2, PI, tag));
            vec![east, line(east.to, west.from, Some(tag)), west, line(west.to, east.from, Some(tag))]
        }
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

fn line(from: Point, to: Point, tag: Option<usize>) -> Piece {
    Piece { from, to, arc: None, tag }
}

fn reversed(piece: Piece) -> Piece {
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
