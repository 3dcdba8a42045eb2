//! Many computations from one file: sequences of meshes and steps for orders of convergence.

pub mod file;
pub mod order;
pub mod table;

use crate::output::OutputError;
use crate::run::RunError;
use crate::scene::{Place, SceneError};

pub use file::{OrderStudy, Variant};
pub use order::{Level, Outcome, run};

/// Why a study cannot begin or be written; a run that fails is a row of its tables.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    #[error(transparent)]
    Scene(#[from] Box<SceneError>),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(
        "{place}: the scene has no exact fields to compare with; hint: add [exact] with velocity, pressure and polarity"
    )]
    NoExact { place: String },
    /// Wrong in one level or variant only.
    #[error("{place}, {part}: {error}")]
    Within { place: Box<Place>, part: String, error: Box<StudyError> },
    #[error(
        "{file}: this is a scene, not a study; hint: `monolayer run {file}` runs it; a study names it by `scene` and has `levels`, as studies/mms/incompressible.toml"
    )]
    NoStudy { file: String },
    #[error("{folder}: holds the results of an earlier study or run; hint: choose another `--out`")]
    Occupied { folder: String },
}

impl From<SceneError> for StudyError {
    fn from(error: SceneError) -> Self {
        StudyError::Scene(Box::new(error))
    }
}
