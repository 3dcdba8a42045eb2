//! The ring.

use std::f64::consts::{PI, TAU};

use super::keys::{Meaning, keyed};
use super::outline::{Outline, Piece, line};
use super::rules::{self, Check, bad};
use super::size::Size;
use super::triangulated::Plan;
use super::{Domain, Named, Scale, Track, about};
use crate::mesh::{Mesh, MeshError, Point};

keyed! {
    /// Ring between `inner_radius` and `radius`.
    Annulus {
        /// Radius of the outer circle.
        radius: f64 = 1.0 => Meaning::Length;
        /// Radius of the inner circle.
        inner_radius: f64 => Meaning::Length;
        /// Centre of both circles.
        centre: [f64; 2] = [0.0, 0.0] => Meaning::Place;
        /// Edge length.
        h: f64 => Meaning::Edge;
        /// The mesh is its own exact mirror image in x₂ = 0.
        symmetric: bool = false => Meaning::Free;
        /// Degree of the geometry of cells on circles; 1 leaves them straight.
        curved: usize = 3 => Meaning::CURVED;
    }
}

impl Named for Annulus {
    const NAME: &'static str = "annulus";
}

impl Domain for Annulus {
    fn tags(&self) -> &'static [&'static str] {
        &["inner", "outer"]
    }

    fn check(&self) -> Check {
        let (inner, outer) = (self.inner_radius, self.radius);
        if inner >= outer {
            let rule = format!("it must be smaller than radius = {outer:?}");
            return Err(bad("inner_radius", format!("{inner:?}"), rule, "swap the two, or enlarge radius"));
        }
        rules::resolves("h", self.h, "inner_radius", inner)?;
        rules::resolves("h", self.h, "radius - inner_radius", outer - inner)?;
        rules::on_the_axis(self.symmetric, self.centre)?;
        rules::not_too_many(&Size::even(self.h), self.expected(), self.expected())
    }

    fn build(&self) -> Result<Mesh, MeshError> {
        let mut outline = Outline::new(self.tags());
        let (centre, inner, outer) = (Point::from(self.centre), self.inner_radius, self.radius);
        if self.symmetric {
            let (small, large) = (outline.curve(centre, inner), outline.curve(centre, outer));
            let (inside, outside) = (outline.arc(small, PI, -PI, 0), outline.arc(large, 0.0, PI, 1));
            let joined = |a: &Piece, b: &Piece| line(a.to, b.from, None);
            outline.loops.push(vec![joined(&inside, &outside), outside, joined(&outside, &inside), inside]);
        } else {
            let rims = [outline.circle(centre, inner, 0), outline.circle(centre, outer, 1)];
            outline.loops.extend(rims);
        }
        Plan::new(outline, Size::even(self.h), self.symmetric, self.curved).build()
    }

    fn expected(&self) -> f64 {
        Size::even(self.h).far(0.5 * TAU * (self.radius.powi(2) - self.inner_radius.powi(2)))
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        about(self.centre, self.radius)
    }

    fn scale(&self) -> Scale {
        Scale::Inside(self.radius - self.inner_radius)
    }

    fn track(&self) -> Option<Track> {
        Some(Track::about(self.centre))
    }
}
