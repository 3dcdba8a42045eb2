//! The closed band with straight arms.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::keys::{Filled, Meaning, keyed};
use super::outline::{Outline, Piece, line, reversed};
use super::rules::{self, Check, bad};
use super::size::{GRADING, Size};
use super::triangulated::Plan;
use super::{Domain, Named, Scale, Track};
use crate::mesh::{Mesh, MeshError, Point};
use crate::schema::Range;

keyed! {
    /// Closed band about the origin: two arms along x₁ joined by half rings, a disc taken out of the middle of each
    /// arm, of the upper one alone, or of none.
    Racetrack {
        /// Extent across the strip or the band.
        width: f64 => Meaning::Length;
        /// Radius of the disc.
        radius: Option<f64> = None => Meaning::Length;
        /// Length of a straight arm.
        arm: f64 => Meaning::Length;
        /// Radius of the centre line of the half rings.
        turn_radius: f64 => Meaning::Length;
        /// Discs on the racetrack; 1 is not `symmetric`.
        discs: usize = 2 => DISCS;
        /// Edge length far from the disc.
        h: f64 => Meaning::Edge;
        /// Edge length on the disc.
        h_disc: Option<f64> = None, "`h`" => Meaning::Edge;
        /// Growth of the edge length per unit of distance from the disc.
        grading: Option<f64> = None => Meaning::Growth;
        /// The mesh is its own exact mirror image in x₂ = 0.
        symmetric: bool = false => Meaning::Free;
        /// Degree of the geometry of cells on circles; 1 leaves them straight.
        curved: usize = 3 => Meaning::CURVED;
    }
}

const DISCS: Meaning = Meaning::Within {
    range: Range::within(0.0, 2.0),
    rule: "it must be 0, 1 or 2",
    hint: "a disc in each arm, in the upper one, or none",
};

impl Named for Racetrack {
    const NAME: &'static str = "racetrack";
}

impl Racetrack {
    /// Radius of the discs.
    fn radius(&self) -> f64 {
        self.radius.unwrap_or(1.0)
    }

    /// Edge length on the discs.
    fn h_disc(&self) -> f64 {
        self.h_disc.unwrap_or(self.h)
    }

    /// Where the discs lie, the upper one first.
    fn centres(&self) -> Vec<Point> {
        let upper = Point::new(0.0, self.turn_radius);
        [upper, -upper].into_iter().take(self.discs).collect()
    }

    fn size(&self) -> Size {
        let grading = self.grading.unwrap_or(GRADING);
        Size { h: self.h, h_disc: self.h_disc(), grading, radius: self.radius(), centres: self.centres() }
    }

    fn area(&self) -> f64 {
        (2.0 * self.arm + TAU * self.turn_radius) * self.width
    }

    /// The discs and what is said of them.
    fn check_discs(&self) -> Check {
        let discs = self.discs;
        if discs == 1 && self.symmetric {
            let rule = "a symmetric racetrack has a disc in both arms or in none";
            return Err(bad("discs", discs, rule, "set symmetric = false, or discs = 2"));
        }
        Ok(())
    }

    /// What is said of discs where there are none.
    fn check_without_discs(&self) -> Check {
        let of_the_disc = [("radius", self.radius), ("h_disc", self.h_disc), ("grading", self.grading)];
        if let Some((key, value)) = of_the_disc.into_iter().find_map(|(key, value)| Some((key, value.value()?))) {
            let rule = "a racetrack with discs = 0 has no such key";
            return Err(bad(key, value, rule, "remove it, or set discs = 1 or 2"));
        }
        rules::resolves("h", self.h, "arm", self.arm)
    }

    /// Straight pieces joined by arcs of two equal circles, counterclockwise from the east; the upper half is open.
    fn stadium(&self, outline: &mut Outline, r: f64, tag: usize) -> Vec<Piece> {
        let east = Point::new(0.5 * self.arm, 0.0);
        let (right, left) = (outline.curve(east, r), outline.curve(-east, r));
        if self.symmetric {
            let east = outline.arc(right, 0.0, FRAC_PI_2, tag);
            let west = outline.arc(left, FRAC_PI_2, FRAC_PI_2, tag);
            vec![east, line(east.to, west.from, Some(tag)), west]
        } else {
            let (east, west) = (outline.arc(right, -FRAC_PI_2, PI, tag), outline.arc(left, FRAC_PI_2, PI, tag));
            vec![east, line(east.to, west.from, Some(tag)), west, line(west.to, east.from, Some(tag))]
        }
    }

    fn outline(&self) -> Outline {
        let mut outline = Outline::new(self.tags());
        let (turn, width) = (self.turn_radius, self.width);
        let rims =
            [(turn + 0.5 * width, 0), (turn - 0.5 * width, 1)].map(|(r, tag)| self.stadium(&mut outline, r, tag));
        let discs: Vec<Vec<Piece>> =
            self.centres().into_iter().map(|at| outline.circle(at, self.radius(), 2)).collect();
        if self.symmetric {
            let [outer, mut inner] = rims;
            inner = inner.into_iter().rev().map(reversed).collect();
            let (first, last) = (inner[0], inner[inner.len() - 1]);
            let (begin, end) = (outer[0], outer[outer.len() - 1]);
            let mut band = vec![line(last.to, begin.from, None)];
            band.extend(outer);
            band.push(line(end.to, first.from, None));
            band.extend(inner);
            outline.loops.push(band);
            // the lower one is the image of the upper one
            outline.loops.extend(discs.into_iter().take(1));
        } else {
            outline.loops.extend(rims);
            outline.loops.extend(discs);
        }
        outline
    }
}

impl Domain for Racetrack {
    fn complete(&mut self) {
        if self.discs != 0 {
            self.radius = Some(self.radius());
            self.h_disc = Some(self.h_disc());
            self.grading.get_or_insert(GRADING);
        }
    }

    fn tags(&self) -> &'static [&'static str] {
        if self.discs == 0 { &["outer", "inner"] } else { &["outer", "inner", "disc"] }
    }

    fn check(&self) -> Check {
        rules::finer_on_the_disc(self.h, self.h_disc())?;
        let (turn, width, radius) = (self.turn_radius, self.width, self.radius());
        if 0.5 * width >= turn {
            let rule = format!("half the width {width:?} must be smaller, or the band has no hole");
            return Err(bad("turn_radius", format!("{turn:?}"), rule, "enlarge turn_radius or narrow the band"));
        }
        self.check_discs()?;
        rules::resolves("h", self.h, "width", width)?;
        rules::resolves("h", self.h, "turn_radius - width/2", turn - 0.5 * width)?;
        if self.discs == 0 {
            self.check_without_discs()?;
        } else {
            if self.arm < 2.0 * radius {
                let rule = format!("the disc of radius {radius:?} must fit into the straight part");
                return Err(bad("arm", format!("{:?}", self.arm), rule, "make the arm at least 2·radius long"));
            }
            rules::resolves("h_disc", self.h_disc(), "radius", radius)?;
            rules::gap(radius, self.h_disc(), 0.5 * width - radius, "the band's walls")?;
        }
        rules::not_too_many(&self.size(), self.expected(), self.size().far(self.area()))
    }

    fn build(&self) -> Result<Mesh, MeshError> {
        Plan::new(self.outline(), self.size(), self.symmetric, self.curved).build()
    }

    fn expected(&self) -> f64 {
        self.size().cells(self.area(), self.width)
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        let end = self.turn_radius + 0.5 * self.width;
        let half = 0.5 * self.arm + end;
        [[-half, half], [-end, end]]
    }

    fn scale(&self) -> Scale {
        Scale::Across(self.width)
    }

    fn track(&self) -> Option<Track> {
        Some(Track { centre: Point::zeros(), half_arm: 0.5 * self.arm })
    }
}
