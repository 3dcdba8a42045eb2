//! Runs and reports of scenes of any kind.

use std::fmt;

use super::motion::MotionSummary;
use super::{Ending, Options, Record, RunError, Summary, folder, particles, report, stokes, tissue};
use crate::mesh::Mesh;
use crate::scene::{AnyScene, SceneError};

/// What a run of any kind has come to.
#[derive(Debug, Clone)]
pub enum AnySummary {
    Tissue(Box<Summary>),
    Motion(Box<MotionSummary>),
}

impl AnySummary {
    /// How it ended.
    pub fn ending(&self) -> &Ending {
        match self {
            Self::Tissue(summary) => &summary.ending,
            Self::Motion(summary) => &summary.ending,
        }
    }

    /// Whether estimates are still to come.
    pub fn estimates_pending(&self) -> bool {
        match self {
            Self::Tissue(summary) => summary.estimates_pending,
            Self::Motion(_) => false,
        }
    }
}

impl fmt::Display for AnySummary {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tissue(summary) => summary.fmt(out),
            Self::Motion(summary) => summary.fmt(out),
        }
    }
}

/// Runs a scene to its end and leaves the results in `options.out`.
///
/// # Errors
/// As [`super::run`].
pub fn run(scene: &AnyScene, options: &Options) -> Result<AnySummary, RunError> {
    folder::alone(options, || run_held(scene, options))
}

/// As [`run`], in a folder that the caller has to itself.
///
/// # Errors
/// As [`run`].
pub fn run_held(scene: &AnyScene, options: &Options) -> Result<AnySummary, RunError> {
    let made = !options.out.exists();
    let result = match scene {
        AnyScene::Tissue(scene) if tissue::has_moving_bodies(scene) => tissue::run(scene, options),
        AnyScene::Tissue(scene) => {
            let summary = super::run_recorded(scene, options, &mut Record::default());
            return summary.map(|summary| AnySummary::Tissue(Box::new(summary)));
        }
        AnyScene::Stokes(scene) => stokes::run(scene, options),
        AnyScene::Particles(scene) => particles::run(scene, options),
    };
    if result.is_err() && made {
        // takes away an empty folder only: nothing was found
        let _ = std::fs::remove_dir(&options.out);
    }
    result.map(|summary| AnySummary::Motion(Box::new(summary)))
}

/// What `check` says of a scene, as text and as JSON.
///
/// # Errors
/// As [`report::report`].
pub fn check(scene: &AnyScene) -> Result<(String, serde_json::Value), RunError> {
    fn both(report: &(impl fmt::Display + serde::Serialize)) -> (String, serde_json::Value) {
        (report.to_string(), serde_json::to_value(report).unwrap_or_default())
    }
    Ok(match scene {
        AnyScene::Tissue(scene) => both(&report::report(scene)?),
        AnyScene::Stokes(scene) => both(&stokes::report(scene)?),
        AnyScene::Particles(scene) => both(&particles::report(scene)),
    })
}

/// The mesh of a scene.
///
/// # Errors
/// As [`super::setup::build_mesh`]; particles, which have none.
pub fn mesh(scene: &AnyScene) -> Result<Mesh, RunError> {
    match scene {
        AnyScene::Tissue(scene) => super::setup::build_mesh(scene),
        AnyScene::Stokes(scene) => super::setup::mesh_of(&scene.mesh, scene.source()),
        AnyScene::Particles(scene) => {
            let (place, key) = (scene.source().place("model.kind"), "model.kind".to_owned());
            let (value, rule) = ("\"particles\"".to_owned(), "particles have no mesh".to_owned());
            let hint = "name a scene of a tissue or of a Stokes flow".to_owned();
            Err(SceneError::Value { place, key, value, rule, hint }.into())
        }
    }
}
