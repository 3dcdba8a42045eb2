//! Boundaries of shapes: smooth pieces in closed form, and the questions that they answer.

use std::f64::consts::TAU;

use super::{Pose, Shape, turned};
use crate::mesh::Point;

/// A smooth piece of a boundary that is run counterclockwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Piece {
    /// `x(t) = from + t (to − from)`, `0 ≤ t ≤ 1`.
    Segment {
        /// First point.
        from: Point,
        /// Last point.
        to: Point,
    },
    /// `x(t) = centre + cos t axes₀ + sin t axes₁`, `from ≤ t ≤ to`: an arc of an ellipse, of which the axes are
    /// conjugate half diameters.
    Arc {
        /// Where the half diameters begin.
        centre: Point,
        /// The half diameters.
        axes: [Point; 2],
        /// First t.
        from: f64,
        /// Last t.
        to: f64,
    },
}

impl Piece {
    /// First and last parameter.
    pub fn range(&self) -> (f64, f64) {
        match *self {
            Piece::Segment { .. } => (0.0, 1.0),
            Piece::Arc { from, to, .. } => (from, to),
        }
    }

    /// `x(t)`
    pub fn at(&self, t: f64) -> Point {
        match *self {
            Piece::Segment { from, to } => from * (1.0 - t) + to * t,
            Piece::Arc { centre, axes: [a, b], .. } => centre + a * t.cos() + b * t.sin(),
        }
    }

    /// `x′(t)`
    pub fn slope(&self, t: f64) -> Point {
        match *self {
            Piece::Segment { from, to } => to - from,
            Piece::Arc { axes: [a, b], .. } => b * t.cos() - a * t.sin(),
        }
    }

    /// First and last point.
    pub fn ends(&self) -> [Point; 2] {
        match *self {
            Piece::Segment { from, to } => [from, to],
            Piece::Arc { from, to, .. } => [self.at(from), self.at(to)],
        }
    }

    /// The part from `t = a` to `t = b`.
    pub fn part(&self, a: f64, b: f64) -> Piece {
        match *self {
            Piece::Segment { .. } => Piece::Segment { from: self.at(a), to: self.at(b) },
            Piece::Arc { centre, axes, .. } => Piece::Arc { centre, axes, from: a, to: b },
        }
    }

    /// The image under `x ↦ place(x)`, whose linear part is `turn`; both must keep the sense of rotation.
    pub fn mapped(&self, place: impl Fn(Point) -> Point, turn: impl Fn(Point) -> Point) -> Piece {
        match *self {
            Piece::Segment { from, to } => Piece::Segment { from: place(from), to: place(to) },
            Piece::Arc { centre, axes, from, to } => {
                Piece::Arc { centre: place(centre), axes: axes.map(turn), from, to }
            }
        }
    }

    /// The parameters strictly inside the range where the piece crosses the line `n·x + d = 0`, ascending, at most two.
    pub fn crossings(&self, n: Point, d: f64) -> impl Iterator<Item = f64> {
        let found = match *self {
            Piece::Segment { from, to } => {
                let (a, b) = (n.dot(&from) + d, n.dot(&to) + d);
                [((a < 0.0) != (b < 0.0)).then(|| a / (a - b)), None]
            }
            Piece::Arc { centre, axes, from, .. } => {
                let (constant, cosine, sine) = (n.dot(&centre) + d, n.dot(&axes[0]), n.dot(&axes[1]));
                let amplitude = cosine.hypot(sine);
                if constant.abs() < amplitude {
                    let (middle, half) = (sine.atan2(cosine), (-constant / amplitude).acos());
                    let [a, b] = [middle - half, middle + half].map(|t| from + (t - from).rem_euclid(TAU));
                    [Some(a.min(b)), Some(a.max(b))]
                } else {
                    [None, None]
                }
            }
        };
        let (first, last) = self.range();
        found.into_iter().flatten().filter(move |&t| t > first && t < last)
    }
}

impl Shape {
    /// Points along the boundary in the body's frame, counterclockwise, the first not repeated: straight parts by their
    /// ends, the round ones by about `points` on a whole turn, at least 8.
    pub fn outline(&self, points: usize) -> Vec<Point> {
        let mut all = Vec::new();
        for piece in self.boundary() {
            match piece {
                Piece::Segment { from, to } if from == to => {}
                Piece::Segment { from, .. } => all.push(from),
                Piece::Arc { from, to, .. } => {
                    // half a turn is half of the points, rounded up, whatever the last digit of π says
                    let share = points.max(8) as f64 * (to - from) / TAU;
                    let count = (share - 1e-9).ceil().max(1.0) as usize;
                    all.extend((0..count).map(|k| piece.at(from + (to - from) * k as f64 / count as f64)));
                }
            }
        }
        all
    }

    /// The shape at a place.
    pub fn at(&self, pose: Pose) -> Placed<'_> {
        Placed { shape: self, pose }
    }
}

/// A shape at its place in space.
#[derive(Debug, Clone, Copy)]
pub struct Placed<'s> {
    /// Its outline, in its own frame.
    pub shape: &'s Shape,
    /// Where it is.
    pub pose: Pose,
}

impl Placed<'_> {
    /// Signed distance of `x` from the boundary, negative inside, and its gradient, a unit vector.
    pub fn signed_distance(&self, x: Point) -> (f64, Point) {
        let (distance, gradient) = self.shape.signed_distance(self.pose.to_body(x));
        (distance, turned(gradient, self.pose.angle))
    }

    /// Whether `x` is a point of the body; the boundary is part of it.
    pub fn contains(&self, x: Point) -> bool {
        self.shape.contains(self.pose.to_body(x))
    }

    /// A point of the body that lies farthest in a direction.
    pub fn support(&self, direction: Point) -> Point {
        self.pose.to_space(self.shape.support(turned(direction, -self.pose.angle)))
    }

    /// Lower left and upper right corner of the smallest box with sides along the axes.
    pub fn bounds(&self) -> [Point; 2] {
        let far = |x: f64, y: f64| self.support(Point::new(x, y));
        [Point::new(far(-1.0, 0.0).x, far(0.0, -1.0).y), Point::new(far(1.0, 0.0).x, far(0.0, 1.0).y)]
    }

    /// As [`Shape::outline`], in space.
    pub fn outline(&self, n: usize) -> Vec<Point> {
        self.shape.outline(n).into_iter().map(|x| self.pose.to_space(x)).collect()
    }

    /// As [`Form::boundary`](super::Form::boundary), in space.
    pub fn boundary(&self) -> Vec<Piece> {
        let (pose, angle) = (self.pose, self.pose.angle);
        let placed = |piece: &Piece| piece.mapped(|x| pose.to_space(x), |y| turned(y, angle));
        self.shape.boundary().iter().map(placed).collect()
    }
}
