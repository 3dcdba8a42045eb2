//! The strip around a disc.

use super::keys::{Meaning, keyed};
use super::outline::Outline;
use super::rules::{self, Check};
use super::size::{GRADING, Size};
use super::stretch::{STRETCH, Stretch};
use super::triangulated::Plan;
use super::{Domain, Named, Scale, strip};
use crate::mesh::{Mesh, MeshError, Point};

keyed! {
    /// Strip less a disc.
    StripWithDisc {
        /// Extent along x₁, `[x₀, x₁]`.
        length: [f64; 2] => Meaning::Interval;
        /// Extent across the strip or the band.
        width: f64 => Meaning::Length;
        /// Radius of the disc.
        radius: f64 = 1.0 => Meaning::Length;
        /// Centre of the disc.
        centre: [f64; 2] = [0.0, 0.0] => Meaning::Place;
        /// Edge length far from the disc.
        h: f64 => Meaning::Edge;
        /// Edge length on the disc.
        h_disc: f64 = h, "`h`" => Meaning::Edge;
        /// Growth of the edge length per unit of distance from the disc.
        grading: f64 = GRADING => Meaning::Growth;
        /// Cells are this much longer along x₁ than across, away from the disc.
        stretch: f64 = 1.0 => STRETCH;
        /// The mesh is its own exact mirror image in x₂ = 0.
        symmetric: bool = false => Meaning::Free;
        /// Degree of the geometry of cells on circles; 1 leaves them straight.
        curved: usize = 3 => Meaning::CURVED;
    }
}

impl Named for StripWithDisc {
    const NAME: &'static str = "strip-with-disc";
}

impl StripWithDisc {
    fn size(&self) -> Size {
        let centres = vec![Point::from(self.centre)];
        Size { h: self.h, h_disc: self.h_disc, grading: self.grading, radius: self.radius, centres }
    }

    fn stretch(&self) -> Stretch {
        Stretch::new(self.length, self.stretch, &self.size())
    }

    /// Area in the coordinates of the stretch.
    fn area(&self) -> f64 {
        self.stretch().image_length() * self.width
    }
}

impl Domain for StripWithDisc {
    fn tags(&self) -> &'static [&'static str] {
        &["inlet", "outlet", "walls", "disc"]
    }

    fn check(&self) -> Check {
        rules::finer_on_the_disc(self.h, self.h_disc)?;
        strip::check_sides(self.length, self.width, self.h, self.symmetric)?;
        rules::resolves("h_disc", self.h_disc, "radius", self.radius)?;
        let ([x0, x1], [cx, cy], top) = (self.length, self.centre, 0.5 * self.width);
        let sides = [
            (top - cy, "the upper wall"),
            (top + cy, "the lower wall"),
            (cx - x0, "the inlet"),
            (x1 - cx, "the outlet"),
        ];
        for (distance, side) in sides {
            rules::gap(self.radius, self.h_disc, distance - self.radius, side)?;
        }
        rules::on_the_axis(self.symmetric, self.centre)?;
        rules::not_too_many(&self.size(), self.expected(), self.size().far(self.area()))
    }

    fn build(&self) -> Result<Mesh, MeshError> {
        let stretch = self.stretch();
        let disc = Some((Point::from(self.centre), self.radius));
        let outline = strip::rectangle(Outline::new(self.tags()), stretch.image(), self.width, self.symmetric, disc);
        Plan { outline, size: self.size(), symmetric: self.symmetric, stretch, curved: self.curved }.build()
    }

    fn expected(&self) -> f64 {
        self.size().cells(self.area(), self.width)
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        [self.length, [-0.5 * self.width, 0.5 * self.width]]
    }

    fn scale(&self) -> Scale {
        Scale::Across(self.width)
    }
}
