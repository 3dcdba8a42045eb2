//! `kind = "particles"`: rigid bodies with forces and contact, and nothing between them.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Keys, SceneKind};

use crate::expression::{Expression, VectorFormula};
use crate::scene::bodies::Bodies;
use crate::scene::bodies::tables::{BodiesTable, BodyTable, ContactTable, WallTable, zero};
use crate::scene::error::SceneError;
use crate::scene::output::{Output, OutputTable};
use crate::scene::resolve;
use crate::scene::source::SceneSource;
use crate::schema::{self, Range, fields};
use crate::scheme::adaptive::StepBounds;

/// Its row.
pub static KIND: SceneKind = SceneKind {
    names: &["particles"],
    shown: "particles (kind = \"particles\")",
    keys: Keys {
        top: fields::<ParticlesFile>,
        model: fields::<ParticlesModel>,
        time: fields::<MotionTimeTable>,
        space: Keys::none,
    },
    fields: &[],
    set: SceneSource::set_in::<ParticlesFile>,
    said: schema::of::<ParticlesFile>,
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Dynamics {
    /// `m V' = F − γ_d m V`, and the same for the spin.
    #[default]
    Inertial,
    /// `γ_d m V = F`, and the same for the spin.
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

/// A scene of particles: rigid bodies with forces and contact, and nothing between them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct ParticlesFile {
    /// One line for reports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// What forces change, and forces on all bodies.
    pub model: ParticlesModel,
    /// Rigid bodies, one by one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub body: Vec<BodyTable>,
    /// Discs by the dozen.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<BodiesTable>,
    /// What bodies keep apart from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wall: Vec<WallTable>,
    /// How bodies keep apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactTable>,
    /// Steps and end.
    pub time: MotionTimeTable,
    /// What is written, and when.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub output: Vec<OutputTable>,
}

/// `[model]` of particles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct ParticlesModel {
    /// Bodies with forces and contact, and nothing between them.
    #[schemars(extend("const" = "particles"))]
    pub kind: String,
    /// What forces change.
    #[serde(default)]
    pub dynamics: Dynamics,
    /// Acceleration of all bodies.
    #[serde(default = "nothing")]
    #[schemars(extend("x-rule" = "formulas of `t` alone"))]
    pub gravity: VectorFormula,
    /// `γ_d`, per mass.
    #[serde(default)]
    #[schemars(transform = Range::NOT_NEGATIVE.said(), extend("x-rule" = "> 0 if overdamped"))]
    pub drag: f64,
}

fn nothing() -> VectorFormula {
    [zero(), zero()]
}

/// `[time]` of particles and of Stokes flow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct MotionTimeTable {
    /// First and largest step.
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "time", "x-rule" = "at most `end`"))]
    pub step: f64,
    /// End time; runs start at `t = 0`.
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "time"))]
    pub end: f64,
    /// The run fails where it would need a step below this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::POSITIVE.said())]
    #[schemars(extend("x-unit" = "time", "x-rule" = "at most `step`", "x-default" = "1e-6 `step`"))]
    pub step_min: Option<f64>,
    /// What forces that vary with a body's place may change of its way in a step, relative to its size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = MotionTimeTable::TOLERANCE.said(), extend("default" = MotionTimeTable::USUAL_TOLERANCE))]
    pub tolerance: Option<f64>,
    /// Most steps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::SOME.said())]
    pub max_steps: Option<usize>,
}

impl MotionTimeTable {
    /// Shares of a body's size that make sense.
    pub const TOLERANCE: Range = Range::above(0.0, 1.0);
    /// Where a scene says nothing.
    pub const USUAL_TOLERANCE: f64 = 1e-3;
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
