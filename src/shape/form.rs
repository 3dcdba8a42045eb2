//! What a file of a shape says: its geometry, and its table in scenes.

use super::figure::{Core, Figure};
use super::outline::Piece;
use super::{Shape, ShapeError};
use crate::mesh::Point;
use crate::schema::Range;

/// A convex shape in its own frame, whose origin is its centre of area.
///
/// All follows from its [`Figure`]; a file has what it knows in a shorter closed form.
pub trait Form {
    /// What the shape is made of; contact, cuts and pictures ask for it, never for a name.
    fn figure(&self) -> Figure<'_>;

    /// Area.
    fn area(&self) -> f64 {
        self.figure().area()
    }

    /// `∫ |x|²` over the shape.
    fn second_moment(&self) -> f64 {
        self.figure().second_moment()
    }

    /// Largest distance of a point of the shape from its centre.
    fn circumradius(&self) -> f64 {
        self.figure().circumradius()
    }

    /// Radius of the largest disc about the centre that lies within the shape: half of the thickness.
    fn inradius(&self) -> f64 {
        -self.signed_distance(Point::zeros()).0
    }

    /// Signed distance of a point in the body's frame from the boundary, negative inside, and its gradient.
    ///
    /// The gradient is the unit normal of the boundary at the nearest point; where several are nearest, that of one of
    /// them.
    fn signed_distance(&self, x: Point) -> (f64, Point) {
        self.figure().signed_distance(x)
    }

    /// Whether a point in the body's frame is a point of the body; the boundary is part of it.
    fn contains(&self, x: Point) -> bool {
        self.signed_distance(x).0 <= 0.0
    }

    /// The boundary in the body's frame, counterclockwise, piece after piece.
    fn boundary(&self) -> Vec<Piece> {
        self.figure().boundary()
    }

    /// A point of the shape that lies farthest in a direction, in the body's frame.
    fn support(&self, direction: Point) -> Point {
        self.figure().support(direction.try_normalize(0.0).unwrap_or(Point::new(1.0, 0.0)))
    }

    /// The radius of a shape that turns into itself; `None` of all others.
    fn round_radius(&self) -> Option<f64> {
        match self.figure() {
            Figure::Around { core: Core::Point, radius } => Some(radius),
            Figure::Around { core: Core::Segment(_) | Core::Polygon(_), .. } | Figure::Ellipse { .. } => None,
        }
    }

    /// Whether the shape turns into itself.
    fn is_round(&self) -> bool {
        self.round_radius().is_some()
    }
}

/// What a shape must be for distances and cuts.
pub trait Checked: Sized {
    /// The shape if it is one, in the form that its geometry is computed of.
    ///
    /// # Errors
    /// What is wrong, with a hint.
    fn checked(self) -> Result<Self, ShapeError>;
}

/// The table of a shape in scenes.
pub trait Described {
    /// Tables of shapes that differ, as in a scene, no larger than 0.45; tests go through them.
    const EXAMPLES: &'static [&'static str];

    /// The shape about its centre of area; and where that is in the coordinates of the table, where it has some.
    ///
    /// # Errors
    /// Those of the rules, for the first key with a wrong value.
    fn make<R: Rules>(&self, rules: &R) -> Result<(Shape, Option<Point>), R::Error>;
}

/// Rules on the keys of a table, and how a wrong value is refused.
pub trait Rules {
    /// What can be wrong with it.
    type Error;

    /// A length that can be computed with.
    ///
    /// # Errors
    /// Of one that is not positive, or far from the unit of the scene.
    fn length(&self, key: &str, value: f64, hint: &str) -> Result<f64, Self::Error>;

    /// A value outside of the range is refused.
    ///
    /// # Errors
    /// Of such a value, with the rule and the hint.
    fn within(&self, key: &str, value: f64, range: Range, rule: &str, hint: &str) -> Result<f64, Self::Error>;

    /// The error of a shape, at the key that it comes from.
    fn wrong(&self, key: &str, value: String, error: &ShapeError) -> Self::Error;
}

/// Lengths of bodies, whose areas and moments of inertia stay within the range of numbers.
pub const LENGTHS: Range = Range::within(1e-9, 1e9);

/// The hint of a key that is a length.
pub(super) const LENGTH: &str = "a length, such as 0.1";
