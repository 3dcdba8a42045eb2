//! Runs and reports of scenes of any kind.

use std::fmt;

use super::motion::MotionSummary;
use super::{Ending, Options, Record, RunError, Summary, extremes, folder, particles, report, stokes, tissue};
use crate::mesh::Mesh;
use crate::output::progress::Verbosity;
use crate::scene::{AnyScene, SceneError};

/// What a run of any kind has come to.
#[derive(Debug, Clone)]
pub enum AnySummary {
    /// Of a sheet of tissue without moving bodies.
    Tissue(Box<Summary>),
    /// Of bodies that move, in whatever carries them.
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
    announce_mesh(scene, options.verbosity);
    let result = match scene {
        AnyScene::Tissue(scene) if tissue::has_moving_bodies(scene) => tissue::run(scene, options),
        AnyScene::Tissue(scene) => {
            let summary = super::run_recorded(scene, options, &mut Record::default());
            return summary.map(|summary| AnySummary::Tissue(Box::new(summary)));
        }
        AnyScene::Stokes(scene) => stokes::run(scene, options),
        AnyScene::Particles(scene) => particles::run(scene, options),
    };
    let result = result.map_err(|error| error.blaming(|| suspect(scene)));
    if result.is_err() && made {
        // takes away an empty folder only: nothing was found
        let _ = std::fs::remove_dir(&options.out);
    }
    result.map(|summary| AnySummary::Motion(Box::new(summary)))
}

/// The value of a scene that is farthest outside of the usual.
fn suspect(scene: &AnyScene) -> Option<String> {
    match scene {
        AnyScene::Tissue(scene) => extremes::of_scene(scene),
        AnyScene::Stokes(scene) => extremes::of_source(scene.source()),
        AnyScene::Particles(scene) => extremes::of_source(scene.source()),
    }
}

/// What `check` says of a scene.
#[derive(Debug, Clone, serde::Serialize)]
#[serde(untagged)]
pub enum AnyReport {
    /// Of a sheet of tissue.
    Tissue(Box<report::Report>),
    /// Of a Stokes flow.
    Stokes(Box<stokes::StokesReport>),
    /// Of bodies without a flow.
    Particles(Box<particles::ParticlesReport>),
}

impl fmt::Display for AnyReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tissue(report) => report.fmt(out),
            Self::Stokes(report) => report.fmt(out),
            Self::Particles(report) => report.fmt(out),
        }
    }
}

/// How much a run takes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Amounts {
    /// Cells of the mesh.
    pub cells: usize,
    /// Of the full length; none of a search for a steady state.
    pub steps: f64,
    /// Most memory at a time.
    pub memory_mib: f64,
    /// Size of the results.
    pub disk_mib: f64,
}

impl AnyReport {
    /// Why a run is refused here and now; empty where it is not.
    pub fn refused(&self) -> &[String] {
        match self {
            Self::Tissue(report) => &report.refused,
            Self::Stokes(report) => &report.refused,
            Self::Particles(report) => &report.refused,
        }
    }

    /// The amounts that every kind has.
    pub fn amounts(&self) -> Amounts {
        match self {
            Self::Tissue(report) => Amounts {
                cells: report.mesh.cells(),
                steps: report.steps.unwrap_or(0.0),
                memory_mib: report.memory_mib,
                disk_mib: report.disk_mib,
            },
            Self::Stokes(report) => Amounts {
                cells: report.mesh.cells(),
                steps: report.steps,
                memory_mib: report.memory_mib,
                disk_mib: report.disk_mib,
            },
            Self::Particles(report) => {
                Amounts { cells: 0, steps: report.steps, memory_mib: 0.0, disk_mib: report.disk_mib }
            }
        }
    }
}

/// What `check` says of a scene.
///
/// # Errors
/// All that a run could say before its first step, besides what its folder holds.
pub fn check(scene: &AnyScene) -> Result<AnyReport, RunError> {
    let report = match scene {
        AnyScene::Tissue(scene) => report::report(scene).map(|report| AnyReport::Tissue(Box::new(report))),
        AnyScene::Stokes(scene) => stokes::report(scene).map(|report| AnyReport::Stokes(Box::new(report))),
        AnyScene::Particles(scene) => particles::report(scene).map(|report| AnyReport::Particles(Box::new(report))),
    };
    report.map_err(|error| error.blaming(|| suspect(scene)))
}

/// Says so where making the mesh takes a while.
pub fn announce_mesh(scene: &AnyScene, verbosity: Verbosity) {
    match scene {
        AnyScene::Tissue(scene) => super::domain::announce_mesh(&scene.mesh, verbosity),
        AnyScene::Stokes(scene) => super::domain::announce_mesh(&scene.mesh, verbosity),
        AnyScene::Particles(_) => {}
    }
}

/// The mesh of a scene.
///
/// # Errors
/// As [`super::domain::build_mesh`]; particles, which have none.
pub fn mesh(scene: &AnyScene) -> Result<Mesh, RunError> {
    match scene {
        AnyScene::Tissue(scene) => super::domain::build_mesh(scene),
        AnyScene::Stokes(scene) => super::domain::mesh_of(&scene.mesh, scene.source()),
        AnyScene::Particles(scene) => {
            let (place, key) = (scene.source().place("model.kind"), "model.kind".to_owned());
            let (value, rule) = ("\"particles\"".to_owned(), "particles have no mesh".to_owned());
            let hint = "name a scene of a tissue or of a Stokes flow".to_owned();
            Err(SceneError::Value { place, key, value, rule, hint }.into())
        }
    }
}
