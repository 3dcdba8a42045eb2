//! Why a run cannot be.

use crate::contact::ContactError;
use crate::expression::ExpressionError;
use crate::measure::MeasureError;
use crate::mesh::MeshError;
use crate::model::momentum::MomentumError;
use crate::output::OutputError;
use crate::output::plot::PlotError;
use crate::scene::SceneError;
use crate::solve::SolveError;
use crate::time::StepFailure;

/// Whatever can stop a run before or after its steps; a step that fails is an [`Ending`](super::Ending).
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum RunError {
    #[error(transparent)]
    Scene(#[from] Box<SceneError>),
    #[error("{origin}: {error}")]
    Mesh { origin: String, error: Box<MeshError> },
    #[error("{}", located(origin, error))]
    Model { origin: String, error: Box<MomentumError> },
    #[error("{origin}: the start cannot be solved for: {error}")]
    Begin { origin: String, error: Box<StepFailure> },
    #[error("{}", located(origin, error))]
    Formula { origin: String, error: Box<ExpressionError> },
    #[error("{origin}: {error}")]
    Contact { origin: String, error: Box<ContactError> },
    #[error(transparent)]
    Measure(MeasureError),
    #[error(transparent)]
    Solve(#[from] SolveError),
    #[error(transparent)]
    Momentum(#[from] MomentumError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("{origin}: {error}")]
    Map { origin: String, error: Box<PlotError> },
    #[error("{folder}: holds no {file} of a run; hint: name the folder that `monolayer run` has written")]
    NoRun { folder: String, file: &'static str },
    #[error(
        "{folder}: holds the results of an earlier run; hint: add `--resume` to continue it, or choose another `--out`"
    )]
    Occupied { folder: String },
    #[error(
        "{folder}: holds no checkpoint.bin to resume from; hint: run without `--resume`, or name the run's folder by `--out`"
    )]
    NothingToResume { folder: String },
    #[error(
        "{file}: belongs to another problem: `{key}` differs; hint: resume with the scene of the run (`scene.toml` in its folder); only `title`, `output`, `coupling`, and of `time` all but `scheme` may change"
    )]
    OtherProblem { file: String, key: String },
    #[error("{origin}: the search for a steady state failed: {reason}")]
    Steady { origin: String, reason: String },
    #[error(
        "{origin}: the run does not fit into memory: it would take about {needed:.0} MiB, and must take at most the {available:.0} MiB that are available; hint: {hint}"
    )]
    Memory { origin: String, needed: f64, available: f64, hint: String },
    #[error(
        "{origin}: the results do not fit onto the disk: a run would write about {needed:.0} MiB, and {free:.0} MiB are free at {folder}; hint: write less often or fewer fields, or choose another `--out`"
    )]
    Disk { origin: String, folder: String, needed: f64, free: f64 },
    #[error("MONOLAYER_MEMORY = `{value}`: must be a positive number of MiB; hint: leave it unset to ask the system")]
    BadMemory { value: String },
    #[error("{what}; hint: {hint}")]
    Extreme { what: String, hint: String },
    #[error("{file}: {what}; hint: {hint}")]
    Start { file: String, what: String, hint: String },
}

impl From<MeasureError> for RunError {
    fn from(error: MeasureError) -> Self {
        match error {
            MeasureError::Momentum(error) => RunError::Momentum(error),
            other => RunError::Measure(other),
        }
    }
}

/// An error behind its place; one that begins with the file itself has it once.
fn located(origin: &str, error: &dyn std::fmt::Display) -> String {
    let text = error.to_string();
    let file = origin.split(", line ").next().unwrap_or(origin);
    let rest = text.strip_prefix(file).and_then(|rest| rest.strip_prefix(": "));
    format!("{origin}: {}", rest.unwrap_or(&text))
}

impl RunError {
    /// A flow that cannot be solved for, in the scene of that origin.
    pub(crate) fn begin(origin: &str, failure: StepFailure) -> Self {
        let origin = origin.to_owned();
        match failure {
            StepFailure::Momentum(error) => RunError::Model { origin, error: Box::new(error) },
            other => RunError::Begin { origin, error: Box::new(other) },
        }
    }
}

impl RunError {
    /// An error of a solver with the hint of `suspect`, which names the value of the scene that is to blame.
    pub(crate) fn blaming(self, suspect: impl FnOnce() -> Option<String>) -> Self {
        let solver = |error: &MomentumError| matches!(error, MomentumError::Solve(_) | MomentumError::Weighted(_));
        let unclear = match &self {
            RunError::Model { error, .. } => solver(error),
            RunError::Momentum(error) => solver(error),
            RunError::Begin { error, .. } => !matches!(**error, StepFailure::Formula(_) | StepFailure::Interrupted),
            RunError::Solve(_) | RunError::Steady { .. } => true,
            RunError::Scene(_)
            | RunError::Mesh { .. }
            | RunError::Formula { .. }
            | RunError::Contact { .. }
            | RunError::Measure(_)
            | RunError::Output(_)
            | RunError::Map { .. }
            | RunError::NoRun { .. }
            | RunError::Occupied { .. }
            | RunError::NothingToResume { .. }
            | RunError::OtherProblem { .. }
            | RunError::Memory { .. }
            | RunError::Disk { .. }
            | RunError::BadMemory { .. }
            | RunError::Extreme { .. }
            | RunError::Start { .. } => false,
        };
        match unclear.then(suspect).flatten() {
            Some(hint) => {
                let message = self.to_string();
                let what = message.split("; hint: ").next().unwrap_or_default().to_owned();
                RunError::Extreme { what, hint }
            }
            None => self,
        }
    }
}

impl From<SceneError> for RunError {
    fn from(error: SceneError) -> Self {
        RunError::Scene(Box::new(error))
    }
}
