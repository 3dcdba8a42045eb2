//! `kind = "advection"`: a density that a given velocity carries, `∂_t ρ + div(ρv) = 0`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Keys, SceneKind};
use crate::expression::{Expression, Formula, VectorFormula};
use crate::mesh::generate::MeshScene;
use crate::model::fields::{DENSITY, VELOCITY};
use crate::scene::check::{Checker, Course, Scope, shown};
use crate::scene::error::SceneError;
use crate::scene::output::{Output, OutputTable};
use crate::scene::path::quoted;
use crate::scene::resolve;
use crate::scene::source::SceneSource;
use crate::schema::{self, Range, fields};
use crate::scheme::abdf::MAX_ORDER;
use crate::scheme::adaptive::StepBounds;

/// Its row.
pub static KIND: SceneKind = SceneKind {
    names: &["advection"],
    shown: "advection (kind = \"advection\")",
    keys: Keys {
        top: fields::<AdvectionFile>,
        model: fields::<AdvectionModel>,
        time: fields::<AdvectionTime>,
        space: fields::<AdvectionSpace>,
    },
    fields: &[VELOCITY, DENSITY],
    set: SceneSource::set_in::<AdvectionFile>,
    said: schema::of::<AdvectionFile>,
};

/// A density that a given velocity carries, checked as far as possible without its mesh.
#[derive(Debug, Clone)]
pub struct AdvectionScene {
    /// One line for reports.
    pub title: Option<String>,
    /// `v(x, t)`
    pub velocity: [Expression; 2],
    /// What it is computed on.
    pub mesh: MeshScene,
    /// Degree of the density; the velocity has one more.
    pub degree: usize,
    /// By boundary tag: the density of what flows in there.
    pub boundary: BTreeMap<String, Expression>,
    /// At t = 0.
    pub initial: Expression,
    /// How long steps are.
    pub bounds: StepBounds,
    /// Time at which it ends.
    pub end: f64,
    /// Highest order of the A-BDF.
    pub order: usize,
    /// Most steps.
    pub max_steps: Option<usize>,
    /// What is written, and when.
    pub outputs: Vec<Output>,
    resolved: AdvectionFile,
    source: SceneSource,
}

/// A density that a given velocity carries.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct AdvectionFile {
    /// One line for reports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// The velocity.
    pub model: AdvectionModel,
    /// Domain and mesh.
    pub mesh: MeshScene,
    /// Polynomial degree.
    #[serde(default)]
    pub space: AdvectionSpace,
    /// Conditions by boundary tag, for every tag of the mesh.
    #[serde(default)]
    pub boundary: BTreeMap<String, AdvectionBoundary>,
    /// At t = 0.
    pub initial: AdvectionStart,
    /// Steps and end.
    pub time: AdvectionTime,
    /// What is written, and when.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub output: Vec<OutputTable>,
}

/// `[model]` of advection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct AdvectionModel {
    /// A density that a given velocity carries, `∂_t ρ + div(ρv) = 0`.
    #[schemars(extend("const" = "advection"))]
    pub kind: String,
    /// `v`; formulas of `x`, `y` and `t`.
    pub velocity: VectorFormula,
}

/// `[space]` of advection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct AdvectionSpace {
    /// Degree of the density; the velocity is interpolated in P(k+1).
    #[schemars(transform = AdvectionSpace::K.said())]
    pub k: usize,
}

impl AdvectionSpace {
    /// Degrees that there are.
    pub const K: Range = Range::within(0.0, 3.0);
}

impl Default for AdvectionSpace {
    fn default() -> Self {
        Self { k: 1 }
    }
}

/// `[boundary.TAG]` of advection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct AdvectionBoundary {
    /// `ρ` where `v·n < 0`.
    #[schemars(extend("x-rule" = "≥ 0"))]
    pub density: Formula,
}

/// `[initial]` of advection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct AdvectionStart {
    /// `ρ` at `t = 0`.
    #[schemars(extend("x-rule" = "≥ 0"))]
    pub density: Formula,
}

/// `[time]` of advection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct AdvectionTime {
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
    /// Order of the A-BDF.
    #[serde(default = "second")]
    #[schemars(transform = AdvectionTime::ORDER.said())]
    pub order: usize,
    /// Most steps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::SOME.said())]
    pub max_steps: Option<usize>,
}

impl AdvectionTime {
    /// Orders that there are.
    pub const ORDER: Range = Range::within(1.0, MAX_ORDER as f64);
}

fn second() -> usize {
    2
}

impl AdvectionScene {
    /// Checks a scene with its overrides: every rule that does not need the mesh.
    ///
    /// # Errors
    /// Whatever is wrong with it, see [`SceneError`].
    pub fn check(source: SceneSource) -> Result<Self, SceneError> {
        let checker = Checker { source: &source };
        checker.of_kind(&KIND)?;
        checker.keys_of_kind()?;
        let mut file = source.tables::<AdvectionFile>().map_err(|found| found.1)?;
        let velocity = checker.pair("model.velocity", &file.model.velocity, &[])?;
        let degree = file.space.k;
        checker.require(
            AdvectionSpace::K.has_count(degree),
            "space.k",
            degree,
            "must lie between 0 and 3",
            "1 is usual",
        )?;
        checker.mesh(&mut file.mesh)?;
        let density = |key: &str, formula: &Formula| {
            let parsed = crate::model::ModelError::parse_density(key, formula, &[]);
            parsed
                .map(|density| density.given_at(&checker.given(key)))
                .map_err(|error| checker.error(key, error.value, &error.rule, &error.hint))
        };
        let inflow = |(tag, table): (&String, &AdvectionBoundary)| {
            Ok((tag.clone(), density(&format!("boundary.{}.density", quoted(tag)), &table.density)?))
        };
        let boundary = file.boundary.iter().map(inflow).collect::<Result<_, SceneError>>()?;
        let initial = density("initial.density", &file.initial.density)?;
        let (step, end) = (file.time.step, file.time.end);
        checker.positive("time.step", step, "the time step, such as 0.01")?;
        checker.positive("time.end", end, "runs start at t = 0")?;
        checker.step_before_end(step, end)?;
        checker.step_counts(step, end)?;
        let bounds = StepBounds { step, step_min: checker.step_min(step, file.time.step_min)? };
        let (order, max_steps) = (file.time.order, file.time.max_steps);
        let holds = AdvectionTime::ORDER.has_count(order);
        let rule = format!("must lie between 1 and {MAX_ORDER}");
        checker.require(holds, "time.order", shown(order as f64), &rule, "2 is usual")?;
        checker.most_steps(max_steps)?;
        let outputs =
            checker.outputs(&file.output, Scope { tissue: None, kind: &KIND, bodies: &[], boundary: None })?;
        checker.amounts(&outputs, Course { step, end, max_steps })?;
        let (title, mesh) = (file.title.clone(), file.mesh.clone());
        Ok(Self {
            title,
            velocity,
            mesh,
            degree,
            boundary,
            initial,
            bounds,
            end,
            order,
            max_steps,
            outputs,
            resolved: file,
            source,
        })
    }

    /// The text that the scene was checked from, for further overrides.
    pub fn source(&self) -> &SceneSource {
        &self.source
    }

    /// The scene as TOML with every default and override filled in; it parses back to the same scene.
    pub fn resolved_toml(&self) -> String {
        resolve::to_toml(&self.resolved)
    }

    /// The density of what flows in, in the order of these tags of the mesh.
    ///
    /// # Errors
    /// A tag without a density, a density without a tag.
    pub fn inflow(&self, tags: &[String]) -> Result<Vec<Expression>, SceneError> {
        super::stokes::check_tags(&self.source, self.boundary.keys(), tags)?;
        Ok(tags.iter().map(|tag| self.boundary[tag].clone()).collect())
    }
}
