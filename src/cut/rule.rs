//! Quadrature on regions bounded by segments and arcs.
//!
//! A region is a fan: the cones from one of its points over the pieces of its boundary. A cone over a segment is a
//! triangle. A cone over an arc `x(t)` has the points `o + s (x(t) − o)` and the measure `s (x(t) − o)×x′(t) ds dt`, by
//! Gauss rules in both: exact in s, and in t with an error below the rounding, since the integrand is entire; a whole
//! ellipse has equal weights, which are exact. All weights are positive in a convex region.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use super::region::is_full_turn;
use crate::element::quadrature::{self, Rule};
use crate::mesh::Point;
use crate::shape::outline::Piece;

/// Most points of one Gauss rule along an arc.
pub(super) const MOST: usize = 48;

/// The Gauss–Legendre rule of `count` points on `[0, 1]`: arcs need more points than any polynomial of the forms.
pub(super) fn gauss(count: usize) -> &'static Rule<f64> {
    static RULES: [OnceLock<Rule<f64>>; MOST] = [const { OnceLock::new() }; MOST];
    RULES[count - 1].get_or_init(|| {
        let n = count as f64;
        // the zero x of P_n that Newton's method finds from Tricomi's first term, and P_n′(x)
        let root = |k: usize| {
            let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (mut last, mut value) = (0.0, 1.0);
                for m in 0..count {
                    let m = m as f64;
                    (last, value) = (value, ((2.0 * m + 1.0) * x * value - m * last) / (m + 1.0));
                }
                slope = n * (last - x * value) / ((1.0 - x) * (1.0 + x));
                x -= value / slope;
            }
            (x, slope)
        };
        let (points, weights) = (0..count)
            .map(root)
            .map(|(x, slope)| (0.5 - 0.5 * x, 1.0 / ((1.0 - x) * (1.0 + x) * slope * slope)))
            .unzip();
        Rule { degree: 2 * count - 1, points, weights }
    })
}

/// Quadrature on the part of the reference triangle inside `boundary`, exact for the total degree `degree`.
pub(super) fn fan(boundary: &[Piece], degree: usize) -> Rule<Point> {
    let mut rule = Rule { degree, points: Vec::new(), weights: Vec::new() };
    let Some(apex) = apex(boundary) else { return rule };
    for piece in boundary {
        match piece {
            Piece::Segment { from, to } => add_triangle(&mut rule, [apex, *from, *to]),
            Piece::Arc { .. } => add_sector(&mut rule, apex, piece),
        }
    }
    rule
}

/// The point of the fan: the vertex at which the longest run of segments begins or ends, whose cones vanish; the centre
/// of a round region.
fn apex(boundary: &[Piece]) -> Option<Point> {
    let first = boundary.first()?;
    if let (Piece::Arc { centre, .. }, true) = (first, is_full_turn(first)) {
        return Some(*centre);
    }
    let straight = |piece: &Piece| matches!(piece, Piece::Segment { .. });
    let count = boundary.len();
    let neighbours = |k: &usize| {
        let before = &boundary[(k + count - 1) % count];
        usize::from(straight(before)) + usize::from(straight(&boundary[*k]))
    };
    let best = (0..count).rev().max_by_key(neighbours)?;
    Some(boundary[best].ends()[0])
}

fn add_triangle(rule: &mut Rule<Point>, [a, b, c]: [Point; 3]) {
    let twice_area = (b - a).perp(&(c - a));
    // the region is convex: what is negative is rounding
    if a == b || c == a || twice_area <= 0.0 {
        return;
    }
    let reference = quadrature::triangle(rule.degree);
    rule.points.extend(reference.points.iter().map(|xi| a + (b - a) * xi.x + (c - a) * xi.y));
    rule.weights.extend(reference.weights.iter().map(|w| w * twice_area));
}

fn add_sector(rule: &mut Rule<Point>, apex: Point, arc: &Piece) {
    let degree = rule.degree;
    each_arc_point(arc, degree, |x, slope, weight| {
        if (x - apex).perp(&slope) > 0.0 {
            add_cone(rule, apex, x, slope * weight);
        }
    });
}

/// Adds the points between `apex` and a point `x` of a curve, of which `element` is the weighted tangent.
pub(super) fn add_cone(rule: &mut Rule<Point>, apex: Point, x: Point, element: Point) {
    let radial = quadrature::interval(rule.degree + 1);
    let reach = x - apex;
    let measure = reach.perp(&element);
    rule.points.extend(radial.points.iter().map(|s| apex + reach * *s));
    rule.weights.extend(radial.points.iter().zip(&radial.weights).map(|(s, w)| w * s * measure));
}

/// Calls `visit` with `x(t)`, `x′(t)` and the weight of every point of a rule along an arc, for integrands of degree
/// `degree + 1` in x and x′.
fn each_arc_point(arc: &Piece, degree: usize, mut visit: impl FnMut(Point, Point, f64)) {
    let (from, to) = arc.range();
    if is_full_turn(arc) {
        // a trigonometric polynomial of degree d + 1 over its period
        let count = degree + 2;
        for k in 0..count {
            let t = from + TAU * k as f64 / count as f64;
            visit(arc.at(t), arc.slope(t), TAU / count as f64);
        }
        return;
    }
    let (parts, points) = arc_points(degree, to - from);
    let (gauss, step) = (gauss(points), (to - from) / parts as f64);
    for part in 0..parts {
        for (s, w) in gauss.points.iter().zip(&gauss.weights) {
            let t = from + (part as f64 + s) * step;
            visit(arc.at(t), arc.slope(t), w * step);
        }
    }
}

/// Into how many parts an arc of angle `turn` is divided, and the number of Gauss points of each.
///
/// About its middle an arc is `ρ(τ + (Δ/4) τ² + …)`, `|τ| ≤ 1`: a polynomial of degree d has the coefficient
/// `((d+1)Δ/4)^j/j!` at `τ^(d+1+j)`, of which Gauss rules that miss that power leave `2^−j`.
pub(super) fn arc_points(degree: usize, turn: f64) -> (usize, usize) {
    let needed = |parts: usize| {
        let ratio = (degree + 1) as f64 * turn / parts as f64 / 8.0;
        let (mut j, mut term) = (0, 1.0);
        while term > 1e-16 && j < 80 {
            j += 1;
            term *= ratio / j as f64;
        }
        (degree + 1 + j).div_ceil(2) + 1
    };
    let mut best = (0, usize::MAX);
    for parts in 1..=64 {
        let points = needed(parts);
        if points <= MOST && (best.0 == 0 || parts * points < best.0 * best.1) {
            best = (parts, points);
        }
        if best.0 > 0 && parts * (degree / 2 + 1) > best.0 * best.1 {
            break;
        }
    }
    assert!(best.0 > 0, "an arc has at most a full turn");
    best
}
