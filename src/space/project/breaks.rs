//! Cutting a cell along the lines on which a function jumps or has a kink.

use crate::element::quadrature;
use crate::mesh::{CellMap, Point};

/// A triangle in the coordinates of the reference cell.
pub(super) type Piece = [Point; 3];

/// The reference cell.
pub(super) const WHOLE: Piece = [Point::new(0.0, 0.0), Point::new(1.0, 0.0), Point::new(0.0, 1.0)];

/// A cell is cut into so many pieces at most.
const MOST_PIECES: usize = 4096;

/// So often a piece is divided in four until the line is straight in it.
const HALVINGS: usize = 6;
/// Values that differ by this share of the largest are equal: the line then runs along a side, or is straight.
const ALIKE: f64 = 1e-9;
/// Rounding, as a share of the largest value on the cell.
const ROUNDING: f64 = 1e-12;

/// Where a function jumps or has a kink: on the level lines of another one.
pub struct Break<'f> {
    /// A function whose level is the line.
    pub of: Box<dyn Fn(Point) -> f64 + Sync + 'f>,
    /// Which level.
    pub level: Level,
}

/// Which level lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Where it is zero.
    Zero,
    /// Those of all integers.
    Integers,
}

impl Level {
    /// A level strictly between two values: that in the middle of several.
    fn between(self, low: f64, high: f64) -> Option<f64> {
        match self {
            Level::Zero => (low < 0.0 && 0.0 < high).then_some(0.0),
            Level::Integers => {
                let (first, last) = (low.floor() + 1.0, high.ceil() - 1.0);
                (first <= last).then(|| (0.5 * (first + last)).floor())
            }
        }
    }
}

/// The pieces of a cell between the lines of `breaks`. The lines are straight in a piece, or the piece is small; what
/// they are in a curved cell makes no difference.
pub(super) fn cut(map: CellMap, breaks: &[Break]) -> Vec<Piece> {
    let mut pieces = vec![WHOLE];
    for at in breaks {
        let mut knife = Knife { map, at, done: Vec::new() };
        pieces.iter().for_each(|piece| knife.cut(*piece, 0, 0.0));
        if knife.done.len() > MOST_PIECES {
            break;
        }
        pieces = knife.done;
    }
    pieces
}

/// The four triangles between the middles of the sides.
pub(super) fn quarters([a, b, c]: Piece) -> [Piece; 4] {
    let (ab, bc, ca) = ((a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0);
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// The point with the coordinates `xi` in a piece.
pub(super) fn at([a, b, c]: &Piece, xi: Point) -> Point {
    a + (b - a) * xi.x + (c - a) * xi.y
}

pub(super) fn twice_area([a, b, c]: &Piece) -> f64 {
    (b - a).perp(&(c - a))
}

struct Knife<'k> {
    map: CellMap<'k>,
    at: &'k Break<'k>,
    done: Vec<Piece>,
}

impl Knife<'_> {
    /// Cuts along every level line in a piece that was divided `halvings` times, where `scale` is the largest value on
    /// what it was cut from.
    fn cut(&mut self, piece: Piece, halvings: usize, scale: f64) {
        let straight = self.straight(&piece, scale);
        let level = straight.as_ref().and_then(|s| self.at.level.between(s.low - s.off, s.high + s.off));
        let (Some(fit), Some(_)) = (straight, level) else { return self.done.push(piece) };
        if self.done.len() > MOST_PIECES {
            return self.done.push(piece);
        }
        if fit.off > 0.0 && halvings < HALVINGS {
            return quarters(piece).into_iter().for_each(|quarter| self.cut(quarter, halvings + 1, fit.scale));
        }
        let slack = fit.slack;
        let Some(level) = self.at.level.between(fit.low + slack, fit.high - slack) else {
            return self.done.push(piece);
        };
        let heights = fit.corners.map(|value| if (value - level).abs() <= slack { 0.0 } else { value - level });
        for side in [heights, heights.map(|h| -h)] {
            for part in fan(&part_above(&piece, side)) {
                match self.at.level {
                    Level::Zero => self.done.push(part),
                    // one line less in each part
                    Level::Integers => self.cut(part, halvings, fit.scale),
                }
            }
        }
    }

    /// The function at the corners, as a linear one through three inner points has it: corners may lie on other lines.
    fn straight(&self, piece: &Piece, scale: f64) -> Option<Straight> {
        let value = |xi: Point| (self.at.of)(self.map.at(at(piece, xi)).0);
        let inner = [Point::new(1.0, 1.0), Point::new(4.0, 1.0), Point::new(1.0, 4.0)].map(|xi| value(xi / 6.0));
        let mean = inner.iter().sum::<f64>() / 3.0;
        let corners = inner.map(|s| 2.0 * s - mean);
        let (mut off, mut size) = (0.0_f64, corners.iter().fold(0.0, |most: f64, c| most.max(c.abs())));
        for &xi in &quadrature::triangle(8).points {
            let (found, [a, b, c]) = (value(xi), corners);
            off = off.max((found - (a + (b - a) * xi.x + (c - a) * xi.y)).abs());
            size = size.max(found.abs());
            if !found.is_finite() {
                return None;
            }
        }
        let low = corners.into_iter().fold(f64::INFINITY, f64::min);
        let high = corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
        // between the points it may be off by more
        let (scale, slack) = (scale.max(size), (ALIKE * size).max(ROUNDING * scale));
        let off = if off <= slack { 0.0 } else { 2.0 * off };
        size.is_finite().then_some(Straight { corners, low, high, off, slack, scale })
    }
}

/// A linear function on a piece, and how far the true one may be off.
struct Straight {
    corners: [f64; 3],
    low: f64,
    high: f64,
    off: f64,
    /// Values that differ by no more are equal.
    slack: f64,
    /// Largest value on the piece and on what it was cut from.
    scale: f64,
}

/// The polygon in which a linear function with the values `heights` at the corners is positive.
fn part_above(corners: &Piece, heights: [f64; 3]) -> Vec<Point> {
    let mut polygon = Vec::with_capacity(4);
    for k in 0..3 {
        let (a, b) = (heights[k], heights[(k + 1) % 3]);
        if a >= 0.0 {
            polygon.push(corners[k]);
        }
        if a * b < 0.0 {
            polygon.push(corners[k] + (corners[(k + 1) % 3] - corners[k]) * (a / (a - b)));
        }
    }
    polygon
}

/// The triangles of a convex polygon.
pub(super) fn fan(polygon: &[Point]) -> impl Iterator<Item = Piece> {
    let triangles = (2..polygon.len()).map(|k| [polygon[0], polygon[k - 1], polygon[k]]);
    triangles.filter(|piece| twice_area(piece) > 0.0)
}
