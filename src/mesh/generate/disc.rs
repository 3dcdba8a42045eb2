//! The disc.

use std::f64::consts::{PI, TAU};

use super::keys::{Meaning, keyed};
use super::outline::{Outline, line};
use super::rules::{self, Check};
use super::size::Size;
use super::triangulated::Plan;
use super::{Domain, Named, Scale, Track, about};
use crate::mesh::{Mesh, MeshError, Point};

keyed! {
    /// Disc.
    Disc {
        /// Radius of the disc.
        radius: f64 = 1.0 => Meaning::Length;
        /// Centre of the disc.
        centre: [f64; 2] = [0.0, 0.0] => Meaning::Place;
        /// Edge length.
        h: f64 => Meaning::Edge;
        /// The mesh is its own exact mirror image in x₂ = 0.
        symmetric: bool = false => Meaning::Free;
        /// Degree of the geometry of cells on circles; 1 leaves them straight.
        curved: usize = 3 => Meaning::CURVED;
    }
}

impl Named for Disc {
    const NAME: &'static str = "disc";
}

impl Domain for Disc {
    fn tags(&self) -> &'static [&'static str] {
        &["wall"]
    }

    fn check(&self) -> Check {
        rules::resolves("h", self.h, "radius", self.radius)?;
        rules::on_the_axis(self.symmetric, self.centre)?;
        rules::not_too_many(&Size::even(self.h), self.expected(), self.expected())
    }

    fn build(&self) -> Result<Mesh, MeshError> {
        let mut outline = Outline::new(self.tags());
        let centre = Point::from(self.centre);
        let rim = if self.symmetric {
            let curve = outline.curve(centre, self.radius);
            let over = outline.arc(curve, 0.0, PI, 0);
            vec![line(over.to, over.from, None), over]
        } else {
            outline.circle(centre, self.radius, 0)
        };
        outline.loops.push(rim);
        Plan::new(outline, Size::even(self.h), self.symmetric, self.curved).build()
    }

    fn expected(&self) -> f64 {
        Size::even(self.h).far(0.5 * TAU * self.radius.powi(2))
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        about(self.centre, self.radius)
    }

    fn scale(&self) -> Scale {
        Scale::Inside(self.radius)
    }

    fn track(&self) -> Option<Track> {
        Some(Track::about(self.centre))
    }
}
