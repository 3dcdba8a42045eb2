//! The file of a study of branches of steady states.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::StudyError;
use super::source::{self, StudyFileKind, check_values, override_of, refuse};
use crate::measure::list::is_of_a_march;
use crate::model::parameters::PolarityForm;
use crate::names;
use crate::scene::{Scene, SceneError, SceneSource};
use crate::schema::{self, Range};
use crate::steady::branch::BranchSettings;

/// Branches of steady states of one scene in one of its parameters.
///
/// ```toml
/// scene = "symmetric.toml"
/// parameter = "model.peclet"
/// range = [1, 4]
/// start = 2.0                       # where the first steady state is searched for
/// measure = "asymmetry_velocity"    # what the diagram shows
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub(super) struct BranchFile {
    /// Title of the diagram.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    title: Option<String>,
    /// The scene, from the study's folder.
    #[schemars(extend("x-values" = "path"))]
    scene: String,
    /// Values that the scene has on all branches.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(schema_with = "schema::any_values")]
    set: BTreeMap<String, toml::Value>,
    /// What changes.
    #[schemars(extend("enum" = parameters(), "x-values" = "`model.` and a number of that table"))]
    parameter: String,
    /// Where it may go.
    #[schemars(extend("x-values" = "`[a, b]`, `a < b`"))]
    range: [f64; 2],
    /// Where the first steady states are searched for.
    #[schemars(extend("x-values" = "in the range"))]
    start: f64,
    /// Whether steps and diagram go by the parameter or its logarithm.
    #[serde(default)]
    scale: ParameterScale,
    /// What the diagram shows, a column that the scene's measures fill, or a residual.
    #[schemars(extend("x-values" = "such as `\"asymmetry_velocity\"`, `\"free_energy\"`"))]
    measure: String,
    /// First step, a share of the range.
    #[serde(default = "default_step")]
    #[schemars(transform = BranchFile::SHARE.said(), extend("x-rule" = "at most `max_step`"))]
    step: f64,
    /// Longest step, a share of the range.
    #[serde(default = "default_max_step")]
    #[schemars(transform = BranchFile::SHARE.said())]
    max_step: f64,
    /// Most points of a branch in each direction; the output says where it ended for lack of points.
    #[serde(default = "default_max_points")]
    #[schemars(transform = BranchFile::POINTS.said())]
    max_points: usize,
    /// Most branches, both directions of one count once; the output says how many were not followed.
    #[serde(default = "default_max_branches")]
    #[schemars(transform = Range::SOME.said())]
    max_branches: usize,
}

impl BranchFile {
    const SHARE: Range = Range::above(0.0, 1.0);
    const POINTS: Range = Range::at_least(2.0);
}

/// Whether steps count on the parameter or on its logarithm, and how the diagram shows it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ParameterScale {
    /// By the parameter.
    #[default]
    Linear,
    /// By its logarithm.
    Log,
}

fn default_step() -> f64 {
    0.05
}

fn default_max_step() -> f64 {
    0.2
}

fn default_max_points() -> usize {
    60
}

fn default_max_branches() -> usize {
    8
}

/// A study of branches, read and checked as far as possible without running.
#[derive(Debug, Clone)]
pub struct BranchStudy {
    /// One line for reports.
    pub title: Option<String>,
    /// The scene, with the overrides that hold for all points.
    pub scene: SceneSource,
    /// Key of the scene that varies.
    pub parameter: String,
    /// Where the parameter may go.
    pub range: [f64; 2],
    /// Where it begins.
    pub start: f64,
    /// How steps of the parameter are measured.
    pub scale: ParameterScale,
    /// Column of the table that the diagram shows.
    pub measure: String,
    /// How branches are followed.
    pub settings: BranchSettings,
    /// Whether the polarity is in direct form on all of the branch, because the model needs that at one of its ends.
    direct: bool,
    source: SceneSource,
}

/// Numbers of `[model]` that a branch may follow.
const PARAMETERS: [&str; 12] = [
    "friction",
    "beta",
    "traction",
    "active_stress",
    "active_stress_iso",
    "peclet",
    "coherence",
    "elasticity",
    "alignment",
    "density.penalty",
    "density.exponent",
    "density.critical",
];

/// The same, as keys of a scene.
fn parameters() -> Vec<String> {
    PARAMETERS.iter().map(|key| format!("model.{key}")).collect()
}

impl BranchStudy {
    /// Reads a study and the scene it names; `sets` change keys of the study or else of the scene.
    ///
    /// # Errors
    /// Whatever is wrong with either, with file, key, value, rule and hint.
    pub fn read(path: &Path, sets: &[(String, String)]) -> Result<Self, StudyError> {
        let sets = &source::sets_now(sets);
        let source = source::read::<BranchFile>(path, StudyFileKind::Branch, sets)?;
        let file: BranchFile = source.tables().map_err(|found| found.1)?;
        let mut scene = source::read_scene(&source, &file.scene)?;
        let varied = |key: &str| key == file.parameter;
        for (key, value) in &check_values(&source, "set", &file.set, &varied, "along the branch")? {
            scene.set(key, value).map_err(|error| source::within(&source, &source::below("set", key), error))?;
        }
        let fixed = |key: &str| {
            let hint = "set `range` and `start` of the study instead".to_owned();
            varied(key).then(|| ("the branch is followed in it".to_owned(), hint))
        };
        source::apply(&mut scene, StudyFileKind::Branch, sets, &fixed)?;
        check(&source, &file)?;
        let settings = BranchSettings {
            step: file.step,
            max_step: file.max_step,
            max_points: file.max_points,
            max_branches: file.max_branches,
            residual: 1e-9,
            eigenvalues: 6,
        };
        let study = Self {
            title: file.title,
            scene,
            parameter: file.parameter,
            range: file.range,
            start: file.start,
            scale: file.scale,
            // as in a scene, where measures have hyphens
            measure: file.measure.replace('-', "_"),
            settings,
            direct: false,
            source,
        };
        let mut direct = false;
        // both ends must be scenes, or every point near them would fail
        for value in [study.start, study.range[0], study.range[1]] {
            let scene = study.scene_at(value)?;
            study.check_measure(&crate::run::measures::columns(&scene.outputs, Some(&scene)))?;
            direct |= !scene.parameters.is_hybrid();
        }
        Ok(Self { direct, ..study })
    }

    /// The measure must be one of the scene's columns that a steady state has.
    fn check_measure(&self, columns: &[&str]) -> Result<(), StudyError> {
        let measure = self.measure.as_str();
        let known: Vec<&str> = columns.iter().copied().filter(|column| !is_of_a_march(column)).collect();
        if known.contains(&measure) {
            return Ok(());
        }
        let rule = match columns.contains(&measure) {
            true => "belongs to a march in time: a steady state has no such number".to_owned(),
            false => format!("the scene measures no such thing{}", names::did_you_mean(measure, &known)),
        };
        let hint = match known.iter().any(|column| !column.starts_with("residual")) {
            true => format!("it measures {}", known.join(", ")),
            false => "name measures in an [[output]] of the scene".to_owned(),
        };
        Err(refuse(&self.source, "measure", format!("\"{measure}\""), &rule, &hint))
    }

    /// The scene at a value of the parameter.
    ///
    /// # Errors
    /// A value that the scene refuses.
    pub fn scene_at(&self, value: f64) -> Result<Scene, StudyError> {
        let mut scene = self.scene.clone();
        let blame = |error: SceneError| -> StudyError {
            match override_of(&error) {
                Some(path) if path == self.parameter => source::within(&self.source, "range", error),
                Some(_) | None => error.into(),
            }
        };
        scene.set(&self.parameter, &format!("{value:?}")).map_err(blame)?;
        if !scene.has("steady") {
            scene.set("steady", "{}")?;
        }
        let mut scene = Scene::check(scene).map_err(blame)?;
        if self.direct {
            scene.parameters.form = PolarityForm::Direct;
        }
        Ok(scene)
    }

    /// The study as it was read, with its overrides; the path of its scene is absolute.
    pub fn text(&self) -> String {
        source::text::<BranchFile>(&self.source, &self.scene)
    }
}

fn check(source: &SceneSource, file: &BranchFile) -> Result<(), StudyError> {
    let number = file.parameter.strip_prefix("model.").filter(|key| PARAMETERS.contains(key));
    if number.is_none() {
        let known = parameters();
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        let rule = format!("must be a number of [model]{}", names::did_you_mean(&file.parameter, &known));
        let (value, hint) = (format!("\"{}\"", file.parameter), format!("the choices are {}", known.join(", ")));
        return Err(refuse(source, "parameter", value, &rule, &hint));
    }
    let [a, b] = file.range;
    let logarithmic = file.scale == ParameterScale::Log;
    if !(a.is_finite() && b.is_finite() && a < b) || (logarithmic && a <= 0.0) {
        let rule = if logarithmic {
            "must be two positive numbers, the smaller first"
        } else {
            "must be two numbers, the smaller first"
        };
        return Err(refuse(source, "range", format!("[{a:?}, {b:?}]"), rule, "such as [1, 4]"));
    }
    if !(a..=b).contains(&file.start) {
        return Err(refuse(
            source,
            "start",
            format!("{:?}", file.start),
            "must lie in the range",
            "such as its middle",
        ));
    }
    let share = |step: f64| BranchFile::SHARE.has(step);
    let ordered = share(file.step) && share(file.max_step) && file.step <= file.max_step;
    if !ordered {
        let key = if source.has("step") { "step" } else { "max_step" };
        let value = format!("{:?}", if source.has("step") { file.step } else { file.max_step });
        let rule = "`step` (default 0.05) must be above 0 and at most `max_step` (default 0.2), which is at most 1";
        return Err(refuse(source, key, value, rule, "shares of the range; give both"));
    }
    let counts =
        [("max_points", file.max_points, BranchFile::POINTS, 2), ("max_branches", file.max_branches, Range::SOME, 1)];
    for (key, value, range, least) in counts {
        if !range.has_count(value) {
            let rule = format!("must be at least {least}");
            return Err(refuse(source, key, value.to_string(), &rule, "leave it out for the usual value"));
        }
    }
    Ok(())
}
