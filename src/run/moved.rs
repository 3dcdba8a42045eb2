//! What a run with moving bodies in a flow has left in its folder.

use std::path::Path;

use super::motion::saved::SavedMotion;
use super::motion::{self, Mover};
use super::{RunError, setup, stokes, tissue};
use crate::measure::bodies::{Load, loads};
use crate::output::bodies::{Moment, Solids};
use crate::output::plot::map::Picture;
use crate::scene::{AnyScene, MapRequest};

/// The flow and the bodies of a run's checkpoint.
pub struct Moved {
    mover: Box<dyn Mover>,
    solids: Solids,
    loads: Vec<Load>,
    t: f64,
    /// Steps to this state.
    pub steps: usize,
}

impl std::fmt::Debug for Moved {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Moved").field("solids", &self.solids).field("t", &self.t).finish_non_exhaustive()
    }
}

impl Moved {
    /// Whether a scene has such runs.
    pub fn has(scene: &AnyScene) -> bool {
        match scene {
            AnyScene::Tissue(scene) => tissue::has_moving_bodies(scene),
            AnyScene::Stokes(_) => true,
            AnyScene::Particles(_) => false,
        }
    }

    /// Reads the checkpoint of a folder, where `scene` is that of the folder.
    ///
    /// # Errors
    /// A folder without checkpoint, or with one that does not belong to the scene.
    ///
    /// # Panics
    /// For a scene without [`Moved::has`].
    pub fn read(folder: &Path, scene: &AnyScene) -> Result<Self, RunError> {
        let file = folder.join("checkpoint.bin");
        if !file.is_file() {
            return Err(RunError::NoRun { folder: folder.display().to_string(), file: "checkpoint.bin" });
        }
        let saved = SavedMotion::read(&file)?;
        if let Some(key) = setup::first_difference(&saved.scene, &scene.resolved_toml()) {
            return Err(RunError::OtherProblem { file: file.display().to_string(), key });
        }
        let (mover, walls) = match scene {
            AnyScene::Tissue(scene) => tissue::finished(scene, &saved, &file)?,
            AnyScene::Stokes(scene) => stokes::finished(scene, &saved, &file)?,
            AnyScene::Particles(_) => panic!("particles have no flow"),
        };
        let bodies = match scene {
            AnyScene::Tissue(scene) => &scene.bodies,
            AnyScene::Stokes(scene) => &scene.bodies,
            AnyScene::Particles(_) => &None,
        };
        let bodies = bodies.as_ref().map_or(&[][..], |bodies| &bodies.bodies);
        let loads = loads(mover.poses(), mover.contacts());
        Ok(Self { solids: Solids::new(bodies, &walls), loads, t: saved.t, steps: saved.counts.steps, mover })
    }

    /// The bodies.
    pub fn moment(&self) -> Moment<'_> {
        let (poses, twists, contacts) = (self.mover.poses(), self.mover.twists(), self.mover.contacts());
        Moment { solids: &self.solids, time: self.t, poses, twists, loads: &self.loads, contacts }
    }

    /// A picture of the fields with the bodies above them.
    ///
    /// # Errors
    /// As [`super::maps::Draft::draw`].
    pub fn draw(&self, request: &MapRequest) -> Result<Picture, RunError> {
        motion::draw(&*self.mover, &self.moment(), request)
    }

    /// The smallest and the largest value that the picture would show.
    ///
    /// # Errors
    /// As [`super::maps::Draft::extent`].
    pub fn extent(&self, request: &MapRequest) -> Result<[f64; 2], RunError> {
        motion::extent(&*self.mover, &self.moment(), request)
    }
}
