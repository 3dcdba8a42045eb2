//! `kind = "particles"`: rigid bodies with forces and contact, and nothing between them.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Keys, SceneKind};

use crate::expression::{Expression, VectorFormula};
use crate::scene::bodies::Bodies;
use crate::scene::bodies::tables::{BodiesTable, BodyTable, ContactTable, RigidTable, WallTable, zero};
use crate::scene::error::SceneError;
use crate::scene::output::{Output, OutputTable};
use crate::scene::resolve;
use crate::scene::source::SceneSource;
use crate::scheme::adaptive::StepBounds;

/// Keys of `[time]` of what moves by forces and contact.
pub const MOTION_TIME_KEYS: &[&str] = &["step", "end", "step_min", "tolerance", "max_steps"];

/// Its row.
pub static KIND: SceneKind = SceneKind {
    names: &["particles"],
    shown: "particles (kind = \"particles\")",
    keys: Keys {
        top: &["title", "model", "time", "body", "bodies", "wall", "contact", "output"],
        model: &["kind", "dynamics", "gravity", "drag"],
        time: MOTION_TIME_KEYS,
        space: &[],
    },
    fields: &[],
    set: SceneSource::set_in::<ParticlesFile>,
};

/// A computation with particles, checked.
#[derive(Debug, Clone)]
pub struct ParticlesScene {
    /// One line for reports.
    pub title: Option<String>,
    /// Inertia and drag.
    pub dynamics: Dynamics,
    /// Acceleration of every body, formulas of t.
    pub gravity: [Expression; 2],
    /// Per mass: force `−drag m V`, torque `−drag I ω`.
    pub drag: f64,
    /// At least one; its contact settings are there unless nothing can touch.
    pub bodies: Bodies,
    /// Steps and end.
    pub time: MotionTime,
    /// What is written, and when.
    pub outputs: Vec<Output>,
    pub(in crate::scene) resolved: ParticlesFile,
    pub(in crate::scene) source: SceneSource,
}

/// What forces change.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Dynamics {
    /// `m a = F − drag m V`
    #[default]
    Inertial,
    /// `drag m V = F`
    Overdamped,
}

/// Equal steps, but for those that land on an output and those that would be too long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionTime {
    /// How long steps are.
    pub bounds: StepBounds,
    /// The run ends at this time.
    pub end: f64,
    /// What forces that vary with a body's place may change of its way in a step, relative to its size.
    pub tolerance: f64,
    /// Most steps.
    pub max_steps: Option<usize>,
}

/// The whole file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParticlesFile {
    /// One line for reports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Which kind, and how bodies move.
    pub model: ParticlesModel,
    /// How a flow carries bodies; no flow does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rigid: Option<RigidTable>,
    /// Single bodies.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub body: Vec<BodyTable>,
    /// Bodies in groups.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<BodiesTable>,
    /// What bodies cannot enter.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wall: Vec<WallTable>,
    /// How contact is solved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactTable>,
    /// Steps and end.
    pub time: MotionTimeTable,
    /// What is written, and when.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub output: Vec<OutputTable>,
}

/// `[model]` of particles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParticlesModel {
    /// `"particles"`
    pub kind: String,
    /// With inertia or without.
    #[serde(default)]
    pub dynamics: Dynamics,
    /// Default 0.
    #[serde(default = "nothing")]
    pub gravity: VectorFormula,
    /// γ_d, per mass.
    #[serde(default)]
    pub drag: f64,
}

fn nothing() -> VectorFormula {
    [zero(), zero()]
}

/// `[time]` of particles and of Stokes flow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionTimeTable {
    /// First and largest step.
    pub step: f64,
    /// End time.
    pub end: f64,
    /// The run ends when a step would have to be shorter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_min: Option<f64>,
    /// How well forces that vary with the place are followed, relative to the size of a body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Most steps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_steps: Option<usize>,
}

impl ParticlesScene {
    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// Whatever is wrong with it, see [`SceneError`].
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        Self::check(SceneSource::read(path)?)
    }

    /// Checks a text; `origin` is its file, for messages.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, origin: &Path) -> Result<Self, SceneError> {
        Self::check(SceneSource::parse(text, origin)?)
    }

    /// Checks a scene with its overrides.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn check(source: SceneSource) -> Result<Self, SceneError> {
        crate::scene::check::particles(source)
    }

    /// The text that the scene was checked from, for further overrides.
    pub fn source(&self) -> &SceneSource {
        &self.source
    }

    /// The scene as TOML with every default and override filled in; it parses back to the same scene.
    pub fn resolved_toml(&self) -> String {
        resolve::to_toml(&self.resolved)
    }
}
