//! The L.

use super::keys::{Meaning, keyed};
use super::outline::{Outline, line};
use super::rules::{self, Check};
use super::size::Size;
use super::triangulated::Plan;
use super::{Domain, Named, Scale};
use crate::mesh::{Mesh, MeshError, Point};

keyed! {
    /// Square `[x₀, x₁]²` less its upper right quarter.
    LShape {
        /// Extent along both axes, `[x₀, x₁]`.
        length: [f64; 2] = [0.0, 1.0] => Meaning::Interval;
        /// Edge length.
        h: f64 => Meaning::Edge;
    }
}

impl Named for LShape {
    const NAME: &'static str = "l-shape";
}

impl LShape {
    /// Width of the two arms.
    fn width(&self) -> f64 {
        0.5 * (self.length[1] - self.length[0])
    }
}

impl Domain for LShape {
    fn tags(&self) -> &'static [&'static str] {
        &["wall"]
    }

    fn check(&self) -> Check {
        rules::resolves("h", self.h, "half the length", self.width())?;
        rules::not_too_many(&Size::even(self.h), self.expected(), self.expected())
    }

    fn build(&self) -> Result<Mesh, MeshError> {
        let [x0, x1] = self.length;
        let middle = 0.5 * (x0 + x1);
        let corners = [[x0, x0], [x1, x0], [x1, middle], [middle, middle], [middle, x1], [x0, x1]].map(Point::from);
        let mut outline = Outline::new(self.tags());
        outline.loops.push((0..6).map(|k| line(corners[k], corners[(k + 1) % 6], Some(0))).collect());
        Plan::new(outline, Size::even(self.h), false, 1).build()
    }

    fn expected(&self) -> f64 {
        Size::even(self.h).far(3.0 * self.width().powi(2))
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        [self.length; 2]
    }

    fn scale(&self) -> Scale {
        Scale::Inside(self.width())
    }
}
