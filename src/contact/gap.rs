//! Gaps between shapes: signed distance, the nearest points, and the direction in which the gap opens.
//!
//! Every shape is a core and a radius about it: a point, a segment, a convex polygon, or an ellipse. Between
//! cores without an ellipse the gap is closed form; with one it is the maximum over directions n of
//! `min_b n·b − max_a n·a`, which is found by bisection to rounding.

use super::smooth;
use crate::mesh::Point;
use crate::shape::{self, Figure, Pose, Shape, Twist, turned};

/// One place where two shapes are near each other. Flat sides that face each other have two of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Which corner it is of; 0 where the pair can only touch in one place.
    pub slot: u32,
    /// Gap `D`, negative where the shapes overlap.
    pub gap: f64,
    /// Unit normal from the first to the second.
    pub normal: Point,
    /// Nearest point of the first shape.
    pub on_first: Point,
    /// Nearest point of the second.
    pub on_second: Point,
}

impl Touch {
    /// Midway between the nearest points.
    pub fn point(&self) -> Point {
        0.5 * (self.on_first + self.on_second)
    }

    /// `∂D/∂(x, y, θ)` of the first body, whose centre is `centre`: `(−n, −(c − x)×n)`.
    pub fn gradient_first(&self, centre: Point) -> [f64; 3] {
        let arm = self.on_first - centre;
        [-self.normal.x, -self.normal.y, -arm.perp(&self.normal)]
    }

    /// `∂D/∂(x, y, θ)` of the second body.
    pub fn gradient_second(&self, centre: Point) -> [f64; 3] {
        let arm = self.on_second - centre;
        [self.normal.x, self.normal.y, arm.perp(&self.normal)]
    }
}

/// `g · (V, ω)`
pub fn along(gradient: [f64; 3], twist: &Twist) -> f64 {
    gradient[0] * twist.velocity.x + gradient[1] * twist.velocity.y + gradient[2] * twist.spin
}

/// A shape where it is: all points within `radius` of a core.
#[derive(Debug, Clone)]
pub struct Placed {
    /// What is rounded.
    pub core: Core,
    /// By how much.
    pub radius: f64,
    /// Centre of the shape.
    pub centre: Point,
}

/// What a shape is rounded about.
#[derive(Debug, Clone)]
pub enum Core {
    /// Of a disc.
    Point(Point),
    /// Two points, or the corners of a convex polygon, counterclockwise.
    Corners(Vec<Point>),
    /// Centre, semi-axes, and the direction of the first of them.
    Ellipse {
        /// Its middle.
        centre: Point,
        /// Half of its length along its first axis and across.
        semi_axes: [f64; 2],
        /// Unit vector along the first axis.
        direction: Point,
    },
}

impl Placed {
    /// `shape` at `pose`.
    pub fn new(shape: &Shape, pose: &Pose) -> Self {
        let centre = pose.position;
        let (core, radius) = match shape.figure() {
            Figure::Around { core: shape::Core::Point, radius } => (Core::Point(centre), radius),
            Figure::Around { core, radius } => {
                (Core::Corners(core.corners().iter().map(|v| pose.to_space(*v)).collect()), radius)
            }
            Figure::Ellipse { semi_axes } => {
                let direction = turned(Point::new(1.0, 0.0), pose.angle);
                (Core::Ellipse { centre, semi_axes, direction }, 0.0)
            }
        };
        Self { core, radius, centre }
    }

    /// The corners of the core; none of an ellipse.
    pub(super) fn corners(&self) -> &[Point] {
        match &self.core {
            Core::Point(p) => std::slice::from_ref(p),
            Core::Corners(corners) => corners,
            Core::Ellipse { .. } => &[],
        }
    }
}

/// Where two shapes are nearest, with the places within `reach` of touching beside the nearest one.
pub fn touches(first: &Placed, second: &Placed, reach: f64, out: &mut Vec<Touch>) {
    match (&first.core, &second.core) {
        (Core::Point(p), Core::Point(q)) => out.push(rounded(0, *p, *q, first, second, Point::new(1.0, 0.0))),
        (Core::Point(_) | Core::Corners(_), Core::Point(_) | Core::Corners(_)) => corners(first, second, reach, out),
        (Core::Ellipse { .. }, _) | (_, Core::Ellipse { .. }) => out.push(smooth::touch(first, second)),
    }
}

/// The touch of two shapes of which `p` and `q` are nearest points of the cores; `normal` serves where they coincide.
fn rounded(slot: u32, p: Point, q: Point, first: &Placed, second: &Placed, normal: Point) -> Touch {
    let distance = (q - p).norm();
    let normal = if distance > 0.0 { (q - p) / distance } else { normal };
    faced(slot, &Nearest { p, q, distance, normal }, first, second)
}

/// Nearest points of the cores of two shapes.
struct Nearest {
    /// On the first core, and on the second.
    p: Point,
    q: Point,
    /// How far the second is from the first along `normal`; negative where they overlap.
    distance: f64,
    normal: Point,
}

/// The touch of two shapes whose cores are nearest there.
fn faced(slot: u32, cores: &Nearest, first: &Placed, second: &Placed) -> Touch {
    let normal = cores.normal;
    let (on_first, on_second) = (cores.p + first.radius * normal, cores.q - second.radius * normal);
    Touch { slot, gap: cores.distance - (first.radius + second.radius), normal, on_first, on_second }
}

/// A side of a core: its place among the sides, start, unit direction, length and outward normal.
#[derive(Debug, Clone, Copy)]
struct Side {
    index: usize,
    start: Point,
    along: Point,
    length: f64,
    normal: Point,
}

impl Side {
    /// Signed distance of a point from the line of the side.
    fn height(&self, x: Point) -> f64 {
        self.normal.dot(&(x - self.start))
    }

    /// Whether a point projects on the side.
    fn spans(&self, x: Point) -> bool {
        let slack = 1e-12 * self.length;
        (-slack..=self.length + slack).contains(&self.along.dot(&(x - self.start)))
    }
}

fn sides(corners: &[Point]) -> impl Iterator<Item = Side> {
    let n = corners.len();
    (0..if n < 2 { 0 } else { n }).map(move |index| {
        let (start, end) = (corners[index], corners[(index + 1) % n]);
        let length = (end - start).norm();
        let along = (end - start) / length;
        Side { index, start, along, length, normal: Point::new(along.y, -along.x) }
    })
}

/// The side that separates most, with the separation.
fn best_side(of: &[Point], from: &[Point]) -> Option<(Side, f64)> {
    let separation = |side: Side| {
        let least = from.iter().map(|x| side.height(*x)).fold(f64::INFINITY, f64::min);
        (side, least)
    };
    sides(of).map(separation).reduce(|best, next| if next.1 > best.1 { next } else { best })
}

/// The nearest pair of corners: indices and distance.
fn nearest_corners(first: &[Point], second: &[Point]) -> (usize, usize, f64) {
    let mut best = (0, 0, f64::INFINITY);
    for (i, p) in first.iter().enumerate() {
        for (j, q) in second.iter().enumerate() {
            let distance = (q - p).norm();
            if distance < best.2 {
                best = (i, j, distance);
            }
        }
    }
    best
}

/// Least distance of corners from sides that they project on.
fn nearest_side(of: &[Point], from: &[Point]) -> f64 {
    let distance = |side: Side| {
        let spanned = from.iter().filter(move |x| side.spans(**x));
        spanned.map(move |x| side.height(*x).abs()).fold(f64::INFINITY, f64::min)
    };
    sides(of).map(distance).fold(f64::INFINITY, f64::min)
}

/// Sides of which the normals are opposite within about 25° can come to lie on each other.
const FACING: f64 = -0.9;

/// Slot of the first corner of the second shape; those of the first shape start at 1.
const SECOND: u32 = 1 << 16;

/// Touches of cores with corners: corner to corner, or the corners of either core that face the separating side and its
/// opposite.
fn corners(first: &Placed, second: &Placed, reach: f64, out: &mut Vec<Touch>) {
    let (p, q) = (first.corners(), second.corners());
    let single = p.len() == 1 || q.len() == 1;
    let (of_first, of_second) = (best_side(p, q), best_side(q, p));
    let flipped = of_first.is_none_or(|a| of_second.is_some_and(|b| b.1 > a.1));
    let (side, separation) = if flipped { of_second } else { of_first }.expect("one of the cores is no point");
    let (i, j, apart) = nearest_corners(p, q);
    if separation > 0.0 {
        let nearest = apart.min(nearest_side(p, q)).min(nearest_side(q, p));
        if nearest > separation + 1e-14 * (separation + side.length) && apart <= nearest {
            let normal = if flipped { -side.normal } else { side.normal };
            out.push(rounded(if single { 0 } else { 1 + i as u32 }, p[i], q[j], first, second, normal));
            return;
        }
    }
    let (owner, other) = if flipped { (q, p) } else { (p, q) };
    let start = out.len();
    let touch = |index: usize, in_first: bool, side: &Side, x: Point| {
        let height = side.height(x);
        let foot = x - height * side.normal;
        let slot = if single { 0 } else { index as u32 + if in_first { 1 } else { SECOND } };
        let (p, q, normal) = if in_first { (x, foot, -side.normal) } else { (foot, x, side.normal) };
        faced(slot, &Nearest { p, q, distance: height, normal }, first, second)
    };
    let lowest = (0..other.len()).fold(0, |a, b| if side.height(other[b]) < side.height(other[a]) { b } else { a });
    let opposite =
        sides(other).reduce(|a, b| if b.normal.dot(&side.normal) < a.normal.dot(&side.normal) { b } else { a });
    let opposite = opposite.filter(|o| o.normal.dot(&side.normal) < FACING);
    let near = reach + first.radius + second.radius;
    let ends = |side: &Side, count: usize| [side.index, (side.index + 1) % count];
    for (index, x) in other.iter().enumerate() {
        let facing = opposite.is_some_and(|o| ends(&o, other.len()).contains(&index) && side.height(*x) <= near);
        if (index == lowest || facing) && side.spans(*x) {
            out.push(touch(index, flipped, &side, *x));
        }
    }
    for index in opposite.iter().flat_map(|_| ends(&side, owner.len())) {
        let (x, opposite) = (owner[index], opposite.expect("the loop runs over it"));
        let inside = opposite.along.dot(&(x - opposite.start));
        if inside > 0.0 && inside < opposite.length && opposite.height(x) <= near {
            out.push(touch(index, !flipped, &opposite, x));
        }
    }
    if out.len() == start {
        // deep overlaps only: the lowest corner lies beyond the side's ends
        out.push(touch(lowest, flipped, &side, other[lowest]));
    }
}
