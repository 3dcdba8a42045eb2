//! Which keys of `[mesh]` apply to which shape, and their defaults.

use super::{MeshScene, Shape};
use crate::mesh::MeshError;

/// Default of `grading`, chosen so that the reference strip (`h = 1`, `h_disc = 0.13`) has about 3000 cells.
const GRADING: f64 = 0.15;

/// Keys that mean nothing without a disc.
pub(super) const OF_THE_DISC: [&str; 3] = ["radius", "h_disc", "grading"];

/// A refusal of `mesh.<key>`.
pub(super) fn bad(key: &str, value: impl ToString, rule: impl Into<String>, hint: impl Into<String>) -> MeshError {
    let (rule, hint) = (rule.into(), hint.into());
    MeshError::BadKey { key: format!("mesh.{key}"), value: value.to_string(), rule, hint }
}

impl Shape {
    /// The name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Shape::Square => "square",
            Shape::SquareWithCircle => "square-with-circle",
            Shape::Strip => "strip",
            Shape::StripWithDisc => "strip-with-disc",
            Shape::Disc => "disc",
            Shape::Annulus => "annulus",
            Shape::Racetrack => "racetrack",
        }
    }

    /// Tags of the boundary; a racetrack may be without discs.
    pub fn tags(self, without_discs: bool) -> &'static [&'static str] {
        match self {
            Shape::Square | Shape::SquareWithCircle => &["left", "right", "bottom", "top"],
            Shape::Strip => &["inlet", "outlet", "walls"],
            Shape::StripWithDisc => &["inlet", "outlet", "walls", "disc"],
            Shape::Disc => &["wall"],
            Shape::Annulus => &["inner", "outer"],
            Shape::Racetrack if without_discs => &["outer", "inner"],
            Shape::Racetrack => &["outer", "inner", "disc"],
        }
    }

    /// Keys that must be given.
    fn required(self) -> &'static [&'static str] {
        match self {
            Shape::Square => &["n"],
            Shape::SquareWithCircle => &["n", "radius"],
            Shape::Strip | Shape::StripWithDisc => &["length", "width", "h"],
            Shape::Disc => &["h"],
            Shape::Annulus => &["inner_radius", "h"],
            Shape::Racetrack => &["arm", "turn_radius", "width", "h"],
        }
    }

    /// Keys that may be given.
    fn optional(self) -> &'static [&'static str] {
        match self {
            Shape::Square => &["length", "distortion", "seed"],
            Shape::SquareWithCircle => &["length", "centre"],
            Shape::Strip => &["stretch", "symmetric"],
            Shape::StripWithDisc => &["radius", "centre", "h_disc", "grading", "stretch", "symmetric", "curved"],
            Shape::Disc | Shape::Annulus => &["radius", "centre", "symmetric", "curved"],
            Shape::Racetrack => &["discs", "radius", "h_disc", "grading", "symmetric", "curved"],
        }
    }

    fn allows(self, key: &str) -> bool {
        self.required().contains(&key) || self.optional().contains(&key)
    }
}

impl MeshScene {
    /// The same scene with every default that applies to its shape written out; a scene that names a file stays as it is.
    pub fn defaults_filled(&self) -> MeshScene {
        let mut full = self.clone();
        let Some(shape) = self.shape else { return full };
        let fill = |slot: &mut Option<f64>, key: &str, value: f64| {
            let no_disc = shape == Shape::Racetrack && self.discs == Some(0);
            if shape.allows(key) && !(no_disc && OF_THE_DISC.contains(&key)) {
                slot.get_or_insert(value);
            }
        };
        fill(&mut full.distortion, "distortion", 0.0);
        fill(&mut full.radius, "radius", 1.0);
        fill(&mut full.h_disc, "h_disc", self.h.unwrap_or(1.0));
        fill(&mut full.grading, "grading", GRADING);
        fill(&mut full.stretch, "stretch", 1.0);
        if matches!(shape, Shape::Square | Shape::SquareWithCircle) {
            full.length.get_or_insert([0.0, 1.0]);
        }
        if let (Shape::SquareWithCircle, Some([x0, x1])) = (shape, full.length) {
            full.centre.get_or_insert([0.5 * (x0 + x1); 2]);
        }
        if shape.allows("discs") {
            full.discs.get_or_insert(2);
        }
        if shape.allows("seed") {
            full.seed.get_or_insert(0);
        }
        if shape.allows("centre") {
            full.centre.get_or_insert([0.0, 0.0]);
        }
        if shape.allows("symmetric") {
            full.symmetric.get_or_insert(false);
        }
        if shape.allows("curved") {
            full.curved.get_or_insert(3);
        }
        full
    }

    /// Every optional key with its value as text, `None` where it is not given.
    fn given(&self) -> [(&'static str, Option<String>); 19] {
        fn text<T: std::fmt::Debug>(value: &Option<T>) -> Option<String> {
            value.as_ref().map(|v| format!("{v:?}"))
        }
        [
            ("file", text(&self.file)),
            ("slits", text(&self.slits)),
            ("n", text(&self.n)),
            ("distortion", text(&self.distortion)),
            ("seed", text(&self.seed)),
            ("length", text(&self.length)),
            ("width", text(&self.width)),
            ("radius", text(&self.radius)),
            ("inner_radius", text(&self.inner_radius)),
            ("centre", text(&self.centre)),
            ("arm", text(&self.arm)),
            ("turn_radius", text(&self.turn_radius)),
            ("discs", text(&self.discs)),
            ("h", text(&self.h)),
            ("h_disc", text(&self.h_disc)),
            ("grading", text(&self.grading)),
            ("stretch", text(&self.stretch)),
            ("symmetric", text(&self.symmetric)),
            ("curved", text(&self.curved)),
        ]
    }

    /// Refuses keys that do not apply to the shape, and shapes without a key they need.
    pub(super) fn check_keys(&self, shape: Shape) -> Result<(), MeshError> {
        for (key, value) in self.given() {
            match value {
                Some(value) if !shape.allows(key) => {
                    let keys = [shape.required(), shape.optional()].concat().join(", ");
                    let rule = format!("the shape `{}` has no such key", shape.name());
                    return Err(bad(key, value, rule, format!("remove it; the keys are {keys}")));
                }
                None if shape.required().contains(&key) => {
                    let rule = format!("the shape `{}` needs it", shape.name());
                    return Err(bad(key, "(missing)", rule, format!("add `{key} = …` to the table [mesh]")));
                }
                Some(_) | None => {}
            }
        }
        Ok(())
    }
}
