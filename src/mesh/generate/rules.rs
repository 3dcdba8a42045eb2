//! The rules on the values of `[mesh]`.

use super::keys::{OF_THE_DISC, bad};
use super::{MeshScene, Shape};
use crate::mesh::MeshError;

/// More cells than this are taken for a misprint in `h`.
const MOST_CELLS: f64 = 5e6;

/// Smallest and largest length; beyond, and for edges below `FINEST` times the largest coordinate, points could coincide
/// by rounding.
const LENGTHS: [f64; 2] = [1e-9, 1e9];
const FINEST: f64 = 1e-9;

type Check = Result<(), MeshError>;

impl MeshScene {
    /// Refuses what no mesh can be made of. Call it on a scene whose defaults are filled in.
    pub(super) fn check(&self, shape: Shape) -> Check {
        self.check_keys(shape)?;
        self.check_ranges()?;
        match shape {
            Shape::Square => self.check_square(),
            Shape::SquareWithCircle => self.check_circle_in_square(),
            Shape::Strip => self.check_strip(),
            Shape::StripWithDisc => self.check_strip().and_then(|()| self.check_disc_in_strip()),
            Shape::Disc => self.check_resolves("h", "radius", self.radius),
            Shape::Annulus => self.check_annulus(),
            Shape::Racetrack => self.check_racetrack(),
        }?;
        self.check_symmetry()?;
        self.check_count(shape)
    }

    /// Rules on single values.
    fn check_ranges(&self) -> Check {
        let lengths = [
            ("width", self.width),
            ("radius", self.radius),
            ("inner_radius", self.inner_radius),
            ("arm", self.arm),
            ("turn_radius", self.turn_radius),
            ("h", self.h),
            ("h_disc", self.h_disc),
        ];
        for (key, value) in lengths {
            let hint = "a length in units of the scene";
            within(key, value, LENGTHS, "it must be positive, between 1e-9 and 1e9", hint)?;
        }
        let hint = "0.15 lets an edge grow by 15 percent of its distance from the disc";
        within("grading", self.grading, [1e-3, 1.0], "it must lie in 0.001 to 1", hint)?;
        within("stretch", self.stretch, [1.0, 1000.0], "it must lie in 1 to 1000", "1 gives isotropic cells")?;
        let hint = "beyond 0.3 cells could turn over";
        within("distortion", self.distortion, [0.0, 0.3], "it must lie in 0 to 0.3", hint)?;
        if let Some(curved) = self.curved.filter(|c| !(1..=3).contains(c)) {
            return Err(bad("curved", curved, "it must be 1, 2 or 3", "3 is the default, 1 keeps straight cells"));
        }
        if let Some(n) = self.n.filter(|&n| n == 0) {
            return Err(bad("n", n, "it must be at least 1", "the square has 2 n² cells"));
        }
        self.check_places()?;
        match (self.h, self.h_disc) {
            (Some(h), Some(h_disc)) if h_disc > h => {
                let rule = format!("it must not exceed h = {h:?}");
                Err(bad("h_disc", format!("{h_disc:?}"), rule, "h_disc refines near the disc"))
            }
            (Some(_) | None, Some(_) | None) => Ok(()),
        }
    }

    /// `length` and `centre` are coordinates; edges must be long against their rounding.
    fn check_places(&self) -> Check {
        let [low, high] = [-LENGTHS[1], LENGTHS[1]];
        for (key, pair) in [("length", self.length), ("centre", self.centre)] {
            if let Some(pair) = pair.filter(|p| !p.iter().all(|x| (low..=high).contains(x))) {
                let rule = "both numbers must be finite, at most 1e9 in size";
                return Err(bad(key, format!("{pair:?}"), rule, "for example [-30.0, 50.0]"));
            }
        }
        if let Some(pair) = self.length.filter(|[a, b]| a >= b) {
            let rule = "the first number must be smaller than the second";
            return Err(bad("length", format!("{pair:?}"), rule, "for example [-30.0, 50.0]"));
        }
        if let Some([a, b]) = self.length {
            let least = LENGTHS[0].max(FINEST * a.abs().max(b.abs()));
            let rule =
                "the extent must be at least 1e-9, and 1e-9 of the coordinates, or rounding makes vertices coincide";
            let hint = "choose a unit of length in which the domain is near 1 across, and an origin in it";
            if b - a < least {
                return Err(bad("length", format!("[{a:?}, {b:?}]"), rule, hint));
            }
        }
        let pairs = self.length.into_iter().chain(self.centre).flatten();
        let sizes = [self.width, self.radius, self.arm, self.turn_radius].into_iter().flatten();
        let largest = pairs.chain(sizes).fold(0.0, |m: f64, x| m.max(x.abs()));
        for (key, value) in [("h", self.h), ("h_disc", self.h_disc)] {
            let rule = "it must exceed 1e-9 of the largest coordinate, or rounding makes vertices coincide";
            within(key, value, [FINEST * largest, f64::INFINITY], rule, "choose it larger, or lengths smaller")?;
        }
        Ok(())
    }

    fn check_square(&self) -> Check {
        match self.n {
            Some(n) if 2.0 * (n as f64).powi(2) > MOST_CELLS => {
                Err(bad("n", n, "2 n² must not exceed 5 million cells", "choose a smaller n"))
            }
            Some(_) | None => Ok(()),
        }
    }

    fn check_circle_in_square(&self) -> Check {
        if let Some(n) = self.n.filter(|n| 14.0 * (*n as f64).powi(2) > MOST_CELLS) {
            return Err(bad("n", n, "14 n² must not exceed 5 million cells", "choose a smaller n"));
        }
        let ([x0, x1], [cx, cy]) = (self.length.unwrap_or_default(), self.centre.unwrap_or_default());
        let radius = self.radius.unwrap_or(0.0);
        let gap = [cx - x0, x1 - cx, cy - x0, x1 - cy].into_iter().fold(f64::INFINITY, f64::min) - radius;
        if gap < 0.01 * (x1 - x0) {
            let rule = format!("the circle must keep a hundredth of the side from the sides (gap {gap:.4})");
            return Err(bad("radius", format!("{radius:?}"), rule, "shrink or move the circle"));
        }
        if radius < 0.01 * (x1 - x0) {
            let rule = "it must be at least a hundredth of the side, or the cells about the circle are too thin";
            return Err(bad("radius", format!("{radius:?}"), rule, "enlarge the circle"));
        }
        Ok(())
    }

    fn check_strip(&self) -> Check {
        let ([x0, x1], width) = (self.length.unwrap_or_default(), self.width.unwrap_or(0.0));
        let (h, stretch) = (self.h.unwrap_or(0.0), self.stretch.unwrap_or(1.0));
        self.check_resolves("h", "width", self.width)?;
        if h > x1 - x0 {
            let rule = format!("it must not exceed the length {:?}", x1 - x0);
            return Err(bad("h", format!("{h:?}"), rule, "choose a smaller h"));
        }
        if self.symmetric == Some(true) && h > 0.5 * width {
            let rule = format!("it must not exceed half the width {width:?} of a symmetric strip");
            return Err(bad("h", format!("{h:?}"), rule, "choose a smaller h"));
        }
        if self.shape == Some(Shape::Strip) && h * stretch > x1 - x0 {
            let rule = format!("one cell, h·stretch = {:?} long, must fit into the length {:?}", h * stretch, x1 - x0);
            return Err(bad("stretch", format!("{stretch:?}"), rule, "choose a smaller stretch or a longer strip"));
        }
        Ok(())
    }

    fn check_disc_in_strip(&self) -> Check {
        let ([x0, x1], width) = (self.length.unwrap_or_default(), self.width.unwrap_or(0.0));
        let ([cx, cy], radius) = (self.centre.unwrap_or_default(), self.radius.unwrap_or(1.0));
        self.check_resolves("h_disc", "radius", self.radius)?;
        let sides = [
            (0.5 * width - cy, "the upper wall"),
            (0.5 * width + cy, "the lower wall"),
            (cx - x0, "the inlet"),
            (x1 - cx, "the outlet"),
        ];
        for (distance, side) in sides {
            self.check_gap("radius", radius, distance - radius, side)?;
        }
        Ok(())
    }

    fn check_annulus(&self) -> Check {
        let (inner, outer) = (self.inner_radius.unwrap_or(0.0), self.radius.unwrap_or(1.0));
        if inner >= outer {
            let rule = format!("it must be smaller than radius = {outer:?}");
            return Err(bad("inner_radius", format!("{inner:?}"), rule, "swap the two, or enlarge radius"));
        }
        self.check_resolves("h", "inner_radius", self.inner_radius)?;
        let gap = outer - inner;
        self.check_resolves("h", "radius - inner_radius", Some(gap))
    }

    fn check_racetrack(&self) -> Check {
        let (arm, turn) = (self.arm.unwrap_or(0.0), self.turn_radius.unwrap_or(0.0));
        let (width, radius) = (self.width.unwrap_or(0.0), self.radius.unwrap_or(1.0));
        if 0.5 * width >= turn {
            let rule = format!("half the width {width:?} must be smaller, or the band has no hole");
            return Err(bad("turn_radius", format!("{turn:?}"), rule, "enlarge turn_radius or narrow the band"));
        }
        let discs = self.discs_on_track();
        if discs > 2 {
            return Err(bad("discs", discs, "it must be 0, 1 or 2", "a disc in each arm, in the upper one, or none"));
        }
        if discs == 1 && self.symmetric == Some(true) {
            let rule = "a symmetric racetrack has a disc in both arms or in none";
            return Err(bad("discs", discs, rule, "set symmetric = false, or discs = 2"));
        }
        self.check_resolves("h", "width", self.width)?;
        self.check_resolves("h", "turn_radius - width/2", Some(turn - 0.5 * width))?;
        if discs == 0 {
            if let Some((key, value)) = self.given_of_the_disc() {
                let rule = "a racetrack with discs = 0 has no such key";
                return Err(bad(key, format!("{value:?}"), rule, "remove it, or set discs = 1 or 2"));
            }
            return self.check_resolves("h", "arm", self.arm);
        }
        if arm < 2.0 * radius {
            let rule = format!("the disc of radius {radius:?} must fit into the straight part");
            return Err(bad("arm", format!("{arm:?}"), rule, "make the arm at least 2·radius long"));
        }
        self.check_resolves("h_disc", "radius", self.radius)?;
        self.check_gap("radius", radius, 0.5 * width - radius, "the band's walls")
    }

    /// A key of the disc that is given.
    fn given_of_the_disc(&self) -> Option<(&'static str, f64)> {
        let values = [self.radius, self.h_disc, self.grading];
        OF_THE_DISC.into_iter().zip(values).find_map(|(key, value)| Some((key, value?)))
    }

    /// A gap narrower than one edge of the disc would be filled with flat cells.
    fn check_gap(&self, key: &str, value: f64, gap: f64, side: &str) -> Check {
        let h_disc = self.h_disc.unwrap_or(0.0);
        if gap <= 0.0 {
            let rule = format!("the disc must not touch {side} (gap {gap:.4})");
            return Err(bad(key, format!("{value:?}"), rule, "shrink or move the disc"));
        }
        if gap < h_disc {
            let rule = format!("it must not exceed the gap {gap:.4} between the disc and {side}");
            return Err(bad("h_disc", format!("{h_disc:?}"), rule, "choose a smaller h_disc, or move the disc"));
        }
        Ok(())
    }

    /// The edge length `key` must not exceed the size called `name`.
    fn check_resolves(&self, key: &str, name: &str, size: Option<f64>) -> Check {
        let h = if key == "h" { self.h } else { self.h_disc };
        match (h, size) {
            (Some(h), Some(size)) if h > size => {
                let rule = format!("it must not exceed {name} = {size:?}");
                Err(bad(key, format!("{h:?}"), rule, format!("choose a smaller {key}")))
            }
            (Some(_) | None, Some(_) | None) => Ok(()),
        }
    }

    fn check_symmetry(&self) -> Check {
        match self.centre {
            Some([x, y]) if self.symmetric == Some(true) && y != 0.0 => {
                let rule = "a symmetric mesh needs its centre on x₂ = 0";
                Err(bad("centre", format!("[{x:?}, {y:?}]"), rule, "set the second number to 0, or symmetric = false"))
            }
            Some(_) | None => Ok(()),
        }
    }

    fn check_count(&self, shape: Shape) -> Check {
        let count = self.expected_cells(shape);
        if count <= MOST_CELLS {
            return Ok(());
        }
        let rule = format!("it would give about {count:.1e} cells; at most 5 million are allowed");
        let far = self.h.unwrap_or(1.0);
        // Blame the size that makes the number.
        match self.h_disc {
            Some(h_disc) if h_disc < far && self.expected_far(shape) < 0.5 * count => {
                Err(bad("h_disc", format!("{h_disc:?}"), rule, "choose a larger h_disc or grading"))
            }
            Some(_) | None => Err(bad("h", format!("{far:?}"), rule, "choose a larger h")),
        }
    }
}

/// Refuses a number outside `[low, high]` (and what is no number).
fn within(key: &str, value: Option<f64>, [low, high]: [f64; 2], rule: &str, hint: &str) -> Check {
    match value {
        Some(v) if !(low..=high).contains(&v) => Err(bad(key, format!("{v:?}"), rule, hint)),
        Some(_) | None => Ok(()),
    }
}
