//! The ellipse.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::{NARROWEST, THICKER};
use super::figure::Figure;
use super::form::{Checked, Described, Form, LENGTH, LENGTHS, Rules};
use super::{Shape, ShapeError};
use crate::mesh::Point;
use crate::schema;

/// Semi-axes along the frame's axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ellipse {
    /// Half axes along the frame's axes.
    pub semi_axes: [f64; 2],
}

/// `{ ellipse = { semi_axes = [a, b] } }`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct EllipseTable {
    /// Along the body's own axes.
    #[schemars(transform = LENGTHS.said(), extend("x-unit" = "length"))]
    pub semi_axes: [f64; 2],
}

impl Described for EllipseTable {
    const EXAMPLES: &'static [&'static str] =
        &["semi_axes = [0.4, 0.15]", "semi_axes = [0.02, 0.35]", "semi_axes = [0.2, 0.2]"];

    fn make<R: Rules>(&self, rules: &R) -> Result<(Shape, Option<Point>), R::Error> {
        let [a, b] = self.semi_axes;
        self.semi_axes.iter().try_for_each(|a| rules.length("semi_axes", *a, LENGTH).map(|_| ()))?;
        let ellipse = Ellipse { semi_axes: [a, b] }.checked();
        let ellipse = ellipse.map_err(|error| rules.wrong("semi_axes", format!("[{a}, {b}]"), &error))?;
        Ok((ellipse.into(), None))
    }
}

impl Checked for Ellipse {
    fn checked(self) -> Result<Self, ShapeError> {
        let [a, b] = self.semi_axes;
        ShapeError::positive("semi_axes[0]", a)?;
        ShapeError::positive("semi_axes[1]", b)?;
        let width = a.min(b) / a.max(b);
        if width < NARROWEST {
            return Err(ShapeError::Sliver { shape: "ellipse", width, hint: THICKER });
        }
        Ok(self)
    }
}

impl Form for Ellipse {
    fn figure(&self) -> Figure<'_> {
        Figure::Ellipse { semi_axes: self.semi_axes }
    }

    fn inradius(&self) -> f64 {
        self.semi_axes[0].min(self.semi_axes[1])
    }

    fn contains(&self, x: Point) -> bool {
        (x.x / self.semi_axes[0]).hypot(x.y / self.semi_axes[1]) <= 1.0
    }
}

/// Signed distance from an ellipse, and its gradient.
pub(super) fn distance(x: Point, [a, b]: [f64; 2]) -> (f64, Point) {
    if a < b {
        let (distance, gradient) = distance(Point::new(x.y, x.x), [b, a]);
        return (distance, Point::new(gradient.y, gradient.x));
    }
    let y = x.abs();
    let nearest = nearest(y, a, b);
    let outside = (y.x / a).hypot(y.y / b) > 1.0;
    let normal = Point::new(nearest.x * (b / a), nearest.y * (a / b)).normalize();
    let distance = (y - nearest).norm();
    let gradient = Point::new(normal.x.copysign(x.x), normal.y.copysign(x.y));
    (if outside { distance } else { -distance }, gradient)
}

/// The point of the ellipse nearest to a point of the first quadrant, `a ≥ b`.
///
/// It is `(a²y₀/(τ+a²), b²y₁/(τ+b²))` with the largest root τ of `(ay₀/(τ+a²))² + (by₁/(τ+b²))² = 1`. In `u = τ/b² + 1`
/// the left side is convex and falls, so that Newton's method from the left of the root never passes it; u keeps its
/// relative accuracy next to the long axis.
fn nearest(y: Point, a: f64, b: f64) -> Point {
    let (ratio, apart) = ((a / b) * (a / b), (a - b) * (a + b) / (b * b));
    let z = Point::new(y.x / a, y.y / b);
    if z.y == 0.0 {
        // on the long axis the nearest point leaves it between the centres of the smallest circles of curvature
        let share = if apart > 0.0 { z.x * ratio / apart } else { f64::INFINITY };
        return if share < 1.0 {
            Point::new(a * share, b * ((1.0 - share) * (1.0 + share)).sqrt())
        } else {
            Point::new(a, 0.0)
        };
    }
    let n = ratio * z.x;
    let mut u = z.y.max(n - apart);
    for _ in 0..200 {
        let (p, q) = (n / (u + apart), z.y / u);
        let excess = p * p + q * q - 1.0;
        let step = 0.5 * excess / (p * p / (u + apart) + q * q / u);
        if excess.is_nan() || step <= f64::EPSILON * u {
            break;
        }
        u += step;
    }
    // both share the rounding of u; the point is put back on the ellipse
    let (p, q) = (n / (u + apart), z.y / u);
    let r = p.hypot(q);
    Point::new(a * p / r, b * q / r)
}
