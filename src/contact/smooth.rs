//! Gaps of ellipses: the largest separation over all directions, to rounding.

use super::gap::{Core, Placed, Touch};
use crate::mesh::Point;

/// Directions that are looked at before the bisection.
const DIRECTIONS: usize = 64;

impl Placed {
    /// Point of the core that is farthest along `n`.
    pub(super) fn support(&self, n: Point) -> Point {
        match &self.core {
            Core::Point(p) => *p,
            Core::Corners(corners) => corners
                .iter()
                .copied()
                .reduce(|a, b| if b.dot(&n) > a.dot(&n) { b } else { a })
                .expect("a core is not empty"),
            Core::Ellipse { centre, semi_axes: [a, b], direction } => {
                let other = Point::new(-direction.y, direction.x);
                let (u, v) = (a * direction.dot(&n), b * other.dot(&n));
                let length = u.hypot(v);
                centre + (a * u / length) * direction + (b * v / length) * other
            }
        }
    }
}

fn unit(angle: f64) -> Point {
    let (s, c) = angle.sin_cos();
    Point::new(c, s)
}

/// Places of the local maxima of a function of the angle whose derivative is `slope`, by signs on a grid and bisection.
pub(super) fn maxima(slope: impl Fn(f64) -> f64, mut found: impl FnMut(f64)) {
    let step = std::f64::consts::TAU / DIRECTIONS as f64;
    // an offset that no axis of symmetry hits
    let at = |k: usize| 0.1234 * step + k as f64 * step;
    let mut left = slope(at(0));
    for k in 0..DIRECTIONS {
        let right = slope(at(k + 1));
        if left > 0.0 && right <= 0.0 {
            let (mut low, mut high) = (at(k), at(k + 1));
            loop {
                let middle = 0.5 * (low + high);
                if middle <= low || middle >= high {
                    break;
                }
                if slope(middle) > 0.0 { low = middle } else { high = middle }
            }
            found(0.5 * (low + high));
        }
        left = right;
    }
}

/// The touch of two convex shapes by `D = max_n (min_b n·b − max_a n·a)`; the derivative with the angle of n is
/// `n^⊥·(b − a)`.
pub(super) fn touch(first: &Placed, second: &Placed) -> Touch {
    let between = |n: Point| (first.support(n), second.support(-n));
    let slope = |angle: f64| {
        let n = unit(angle);
        let (a, b) = between(n);
        Point::new(-n.y, n.x).dot(&(b - a))
    };
    let mut best: Option<(f64, Point)> = None;
    let mut consider = |angle: f64| {
        let n = unit(angle);
        let (a, b) = between(n);
        let separation = n.dot(&(b - a));
        if best.is_none_or(|(most, _)| separation > most) {
            best = Some((separation, n));
        }
    };
    maxima(slope, &mut consider);
    // coincident centres of equal shapes have no slope at all
    consider(0.0);
    let (distance, n) = best.expect("one direction was considered");
    let (a, b) = nearest(first, second, n, distance);
    let gap = distance - (first.radius + second.radius);
    Touch { slot: 0, gap, normal: n, on_first: a + first.radius * n, on_second: b - second.radius * n }
}

/// Nearest points for the normal `n`: that of the ellipse, and across the gap; where both are ellipses their supports.
fn nearest(first: &Placed, second: &Placed, n: Point, distance: f64) -> (Point, Point) {
    let (a, b) = (first.support(n), second.support(-n));
    match (&first.core, &second.core) {
        // a side has no single farthest point: the ellipse tells which one it is
        (_, Core::Corners(_)) => (a, a + distance * n),
        (Core::Corners(_), _) => (b - distance * n, b),
        (Core::Point(_) | Core::Ellipse { .. }, Core::Point(_) | Core::Ellipse { .. }) => (a, b),
    }
}
