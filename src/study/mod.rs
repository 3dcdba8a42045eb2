//! Many computations from one file: sequences of meshes and steps for orders of convergence, sweeps over a scene's
//! values, branches of steady states.

pub(crate) mod axes;
pub mod branch;
pub mod branch_file;
pub mod check;
pub mod child;
pub mod columns;
pub mod compare;
pub(crate) mod expected;
pub(crate) mod figures;
pub(crate) mod file;
mod key_forms;
mod memory_gate;
pub mod order;
pub mod results;
pub(crate) mod richardson;
mod run_launcher;
pub mod schema;
pub mod slurm;
mod source;
pub mod sweep;
pub mod sweep_file;
pub mod table;
pub mod tradeoff;
pub mod tradeoff_file;
pub mod tradeoff_table;
mod warm;
mod work;

use crate::output::OutputError;
use crate::run::RunError;
use crate::scene::{Place, SceneError};

pub use branch_file::BranchStudy;
pub use file::{OrderStudy, Variant};
pub use order::{Level, Outcome, run};
pub use source::renamed_words;
pub use sweep_file::{Case, SweepStudy};
pub use tradeoff_file::TradeoffStudy;

/// Why a study cannot begin or be written; a run that fails is a row of its tables.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum StudyError {
    #[error(transparent)]
    Scene(#[from] Box<SceneError>),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(
        "{place}: the scene has no exact fields to compare with; hint: add [exact] with velocity, pressure (or \
         density), and in a tissue polarity"
    )]
    NoExact { place: String },
    /// Wrong in one level or variant only.
    #[error("{place}, {part}: {error}")]
    Within { place: Box<Place>, part: String, error: Box<StudyError> },
    #[error(
        "{file}: this is a scene, not a study; hint: `monolayer run {file}` runs it; a study names it by `scene` and \
         has `levels`, as studies/mms/incompressible.toml, or `vary` alone, as studies/extremes/01-friction.toml"
    )]
    NoStudy { file: String },
    #[error("{file}: this is {is}; hint: `monolayer {command} {file}` runs it")]
    OtherKind { file: String, is: &'static str, command: &'static str },
    #[error("no branch begins at {parameter} = {start}: {reason}; hint: {hint}")]
    NoBranch { parameter: String, start: f64, reason: String, hint: &'static str },
    /// Wrong in a table of measured values, or in what is asked of it.
    #[error("{place}: {what}; hint: {hint}")]
    Data { place: String, what: String, hint: String },
    #[error(
        "the {name} run failed: {reason}; hint: errors are measured against it, so make its values such that it gets \
         to its end"
    )]
    NoReference { name: String, reason: String },
    #[error("{folder}: holds the results of an earlier study or run; hint: choose another `--out`")]
    Occupied { folder: String },
    #[error(
        "{folder}: holds the results of another study: `{key}` differs; hint: choose another `--out`, or start the \
         study that is in its `study.toml`"
    )]
    OtherStudy { folder: String, key: String },
    #[error(
        "{folder}: holds no study that was begun (there is no study.toml); hint: name the folder of its results, or \
         leave `--resume` out to begin it"
    )]
    NothingToResume { folder: String },
    #[error("{what}; hint: {hint}")]
    Launch { what: String, hint: String },
}

impl From<SceneError> for StudyError {
    fn from(error: SceneError) -> Self {
        StudyError::Scene(Box::new(error))
    }
}
