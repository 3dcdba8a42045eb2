//! What shapes are made of, and the geometry that follows.

use std::f64::consts::{PI, TAU};

use super::ellipse;
use super::outline::Piece;
use super::perpendicular;
use crate::mesh::Point;

/// What a shape is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Figure<'s> {
    /// All points within `radius` of the core: its Minkowski sum with a disc.
    Around {
        /// What is thickened.
        core: Core<'s>,
        /// By so much.
        radius: f64,
    },
    /// Semi-axes along the frame's axes.
    Ellipse {
        /// Half axes along the frame's axes.
        semi_axes: [f64; 2],
    },
}

/// What a shape is thickened about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Core<'s> {
    /// The origin.
    Point,
    /// The points between two that differ.
    Segment([Point; 2]),
    /// A convex polygon, counterclockwise.
    Polygon(&'s [Point]),
}

const ORIGIN: &[Point] = &[Point::new(0.0, 0.0)];

impl Core<'_> {
    /// Its corners, counterclockwise: one of a point, two of a segment.
    pub fn corners(&self) -> &[Point] {
        match self {
            Core::Point => ORIGIN,
            Core::Segment(ends) => ends,
            Core::Polygon(vertices) => vertices,
        }
    }

    /// Its sides with their outward unit normals: none of a point, both sides of a segment.
    pub fn sides(&self) -> impl Iterator<Item = Side> {
        let corners = self.corners();
        let some = if corners.len() > 1 { corners } else { &[] };
        edges(some).map(|(from, to)| {
            let (edge, length) = (to - from, (to - from).norm());
            Side { from, to, length, normal: Point::new(edge.y, -edge.x) / length }
        })
    }

    /// Each corner with the normal before it, and the angle by which the normal turns there.
    fn turns(&self) -> impl Iterator<Item = (Point, Point, f64)> {
        let sides: Vec<Side> = self.sides().collect();
        let after: Vec<Side> = sides.iter().cycle().skip(1).take(sides.len()).copied().collect();
        let turn = |(side, next): (Side, Side)| {
            let angle = side.normal.perp(&next.normal).atan2(side.normal.dot(&next.normal));
            // at the end of a segment it turns by π, whatever the sign of zero says
            (side.to, side.normal, angle.rem_euclid(TAU))
        };
        sides.into_iter().zip(after).map(turn)
    }
}

/// A side of a core.
#[derive(Debug, Clone, Copy)]
pub struct Side {
    /// Where it begins.
    pub from: Point,
    /// Where it ends.
    pub to: Point,
    /// Its length.
    pub length: f64,
    /// Unit normal, outwards.
    pub normal: Point,
}

impl Figure<'_> {
    /// `A + L r + πr²` of a core with area A and circumference L (Steiner).
    pub(super) fn area(&self) -> f64 {
        match self {
            Figure::Ellipse { semi_axes: [a, b] } => PI * a * b,
            Figure::Around { core, radius } => {
                let inner: f64 = core.sides().map(|side| 0.5 * side.from.perp(&side.to)).sum();
                let around: f64 = core.sides().map(|side| side.length).sum();
                inner + radius * (around + PI * radius)
            }
        }
    }

    /// `∫ |x|²`: over the core, a rectangle on each side and a sector at each corner.
    pub(super) fn second_moment(&self) -> f64 {
        let (core, r) = match self {
            Figure::Ellipse { semi_axes: [a, b] } => return 0.25 * PI * a * b * (a * a + b * b),
            Figure::Around { core: Core::Point, radius } => return 0.5 * PI * radius.powi(4),
            Figure::Around { core, radius } => (core, *radius),
        };
        let along = |p: Point, q: Point| p.norm_squared() + p.dot(&q) + q.norm_squared();
        let inner: f64 = core.sides().map(|s| s.from.perp(&s.to) * along(s.from, s.to) / 12.0).sum();
        let rectangle = |s: Side| {
            // x = point of the side + h n, 0 ≤ h ≤ r
            s.length * r * (along(s.from, s.to) / 3.0 + r * s.normal.dot(&s.from) + r * r / 3.0)
        };
        let sector = |(corner, normal, angle): (Point, Point, f64)| {
            let last = super::turned(normal, angle);
            // ∫ n dθ from one normal to the next
            let swept = perpendicular(normal - last);
            angle * r * r * (0.5 * corner.norm_squared() + 0.25 * r * r) + r.powi(3) * corner.dot(&swept) * 2.0 / 3.0
        };
        inner + core.sides().map(rectangle).sum::<f64>() + core.turns().map(sector).sum::<f64>()
    }

    /// Largest distance of a point from the origin.
    pub(super) fn circumradius(&self) -> f64 {
        match self {
            Figure::Ellipse { semi_axes: [a, b] } => a.max(*b),
            Figure::Around { core, radius } => core.corners().iter().map(|v| v.norm()).fold(0.0, f64::max) + radius,
        }
    }

    /// Signed distance and its gradient: that from the core less the radius, also inside of the core, where the nearest
    /// line of a side decides.
    pub(super) fn signed_distance(&self, x: Point) -> (f64, Point) {
        match self {
            Figure::Ellipse { semi_axes } => ellipse::distance(x, *semi_axes),
            Figure::Around { core: Core::Point, radius } => from_round(x, *radius, Point::new(1.0, 0.0)),
            Figure::Around { core: Core::Segment([p, q]), radius } => {
                let along = q - p;
                let share = ((x - p).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                let fallback = perpendicular(along) / along.norm();
                from_round(x - (p * (1.0 - share) + q * share), *radius, fallback)
            }
            Figure::Around { core: Core::Polygon(vertices), radius } => {
                let (distance, gradient) = from_polygon(x, vertices);
                (distance - radius, gradient)
            }
        }
    }

    /// The boundary: sides moved out by the radius, and arcs about the corners.
    pub(super) fn boundary(&self) -> Vec<Piece> {
        let whole = |a: f64, b: f64| Piece::Arc {
            centre: Point::zeros(),
            axes: [Point::new(a, 0.0), Point::new(0.0, b)],
            from: 0.0,
            to: TAU,
        };
        let (core, r) = match self {
            Figure::Ellipse { semi_axes: [a, b] } => return vec![whole(*a, *b)],
            Figure::Around { core: Core::Point, radius } => return vec![whole(*radius, *radius)],
            Figure::Around { core, radius } => (core, *radius),
        };
        let mut pieces = Vec::new();
        for (side, (corner, normal, angle)) in core.sides().zip(core.turns()) {
            let out = r * normal;
            pieces.push(Piece::Segment { from: side.from + out, to: side.to + out });
            if r > 0.0 {
                pieces.push(Piece::Arc { centre: corner, axes: [out, perpendicular(out)], from: 0.0, to: angle });
            }
        }
        pieces
    }

    /// A point that lies farthest in a direction, a unit vector.
    pub(super) fn support(&self, unit: Point) -> Point {
        match self {
            Figure::Ellipse { semi_axes: [a, b] } => {
                let scaled = Point::new(a * unit.x, b * unit.y);
                Point::new(a * scaled.x, b * scaled.y) / scaled.norm()
            }
            Figure::Around { core, radius } => {
                let corners = core.corners();
                let farther = |best: Point, v: &Point| if v.dot(&unit) > best.dot(&unit) { *v } else { best };
                corners.iter().fold(corners[0], farther) + unit * *radius
            }
        }
    }
}

/// The edges of a polygon.
pub fn edges(vertices: &[Point]) -> impl Iterator<Item = (Point, Point)> {
    vertices.iter().zip(vertices.iter().cycle().skip(1)).map(|(p, q)| (*p, *q))
}

/// Distance from the disc about the origin; `fallback` is the gradient at its centre.
pub(super) fn from_round(x: Point, radius: f64, fallback: Point) -> (f64, Point) {
    let r = x.norm();
    (r - radius, if r > 0.0 { x / r } else { fallback })
}

fn from_polygon(x: Point, vertices: &[Point]) -> (f64, Point) {
    let mut inner = (f64::NEG_INFINITY, Point::zeros());
    let mut outer = (f64::INFINITY, Point::zeros());
    for (p, q) in edges(vertices) {
        let (edge, to_x) = (q - p, x - p);
        let length = edge.norm();
        let normal = Point::new(edge.y, -edge.x) / length;
        let height = normal.dot(&to_x);
        if height > inner.0 {
            inner = (height, normal);
        }
        let along = edge.dot(&to_x) / (length * length);
        let apart = to_x - edge * along.clamp(0.0, 1.0);
        let distance = apart.norm();
        if height > 0.0 && distance < outer.0 {
            let beyond = !(0.0..=1.0).contains(&along);
            outer = (distance, if beyond { apart / distance } else { normal });
        }
    }
    if inner.0 <= 0.0 { inner } else { outer }
}
