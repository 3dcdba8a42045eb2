//! The part of a straight segment that a body covers.

use crate::mesh::Point;
use crate::shape::figure::Side;
use crate::shape::{Core, Figure, Shape, edges};

/// Shares of a face below this are nothing.
pub(super) const NOTHING: f64 = 1e-14;

/// The shares `s` between which the points `a + s (b − a)`, `0 ≤ s ≤ 1`, lie in the shape, all in the body's frame; a
/// side of a polygon along the segment counts as inside.
pub(super) fn covered(shape: &Shape, [a, b]: [Point; 2]) -> Option<[f64; 2]> {
    let all = match shape.figure() {
        Figure::Ellipse { semi_axes: [p, q] } => {
            let scaled = |y: Point| Point::new(y.x / p, y.y / q);
            in_disc(scaled(a), scaled(b - a))
        }
        Figure::Around { core: Core::Polygon(vertices), radius: 0.0 } => in_polygon(vertices, a, b),
        Figure::Around { core, radius } => around(&core, radius, [a, b]),
    };
    let [from, to] = all.map(|[s, t]| [s.max(0.0), t.min(1.0)])?;
    let snap = |s: f64| {
        if s < NOTHING {
            0.0
        } else if s > 1.0 - NOTHING {
            1.0
        } else {
            s
        }
    };
    (to - from > NOTHING).then(|| [snap(from), snap(to)])
}

/// Within a radius of a core: in a disc about a corner, or between the sides that are moved out by the radius. The
/// parts make one interval, for the whole is convex.
fn around(core: &Core, radius: f64, [a, b]: [Point; 2]) -> Option<[f64; 2]> {
    let discs = core.corners().iter().map(|corner| in_disc((a - corner) / radius, (b - a) / radius));
    let moved = |side: Side| [side.from + radius * side.normal, side.to + radius * side.normal];
    let middle: Vec<Point> = core.sides().flat_map(moved).collect();
    let middle = if middle.is_empty() { None } else { in_polygon(&middle, a, b) };
    discs.chain([middle]).flatten().reduce(|[p, q], [u, v]| [p.min(u), q.max(v)])
}

/// In the unit disc.
fn in_disc(a: Point, along: Point) -> Option<[f64; 2]> {
    let length = along.norm();
    let apart = (a.perp(&along) / length).abs();
    let middle = -a.dot(&along) / (length * length);
    (apart < 1.0).then(|| {
        let half = ((1.0 - apart) * (1.0 + apart)).sqrt() / length;
        [middle - half, middle + half]
    })
}

fn in_polygon(vertices: &[Point], a: Point, b: Point) -> Option<[f64; 2]> {
    let [mut from, mut to] = [0.0_f64, 1.0_f64];
    for (p, q) in edges(vertices) {
        let edge = q - p;
        let (u, v) = (edge.perp(&(a - p)), edge.perp(&(b - p)));
        let rounding = 1e-14 * edge.norm() * (edge.norm() + (a - p).norm() + (b - p).norm());
        if u >= -rounding && v >= -rounding {
            continue;
        }
        if u <= rounding && v <= rounding {
            return None;
        }
        let crossing = u / (u - v);
        if u < v {
            from = from.max(crossing);
        } else {
            to = to.min(crossing);
        }
    }
    (from < to).then_some([from, to])
}
