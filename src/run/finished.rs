//! What a run has left in its folder: scene, mesh, model and last state, without solving anything.

use std::path::Path;

use super::setup::{self, Setup};
use super::{OutputError, RunError};
use crate::output::checkpoint::Saved;
use crate::scene::Scene;
use crate::time::{Checkpoint, March};

/// A run that has ended, or was interrupted.
#[derive(Debug)]
pub struct Finished {
    pub scene: Scene,
    pub setup: Setup,
    saved: Checkpoint,
}

impl Finished {
    /// Reads `scene.toml` and `checkpoint.bin` of a run's folder.
    ///
    /// # Errors
    /// A folder without them; files that cannot be read or do not belong together; a mesh file that has changed since.
    pub fn read(folder: &Path) -> Result<Self, RunError> {
        for file in ["scene.toml", "checkpoint.bin"] {
            if !folder.join(file).is_file() {
                return Err(RunError::NoRun { folder: folder.display().to_string(), file });
            }
        }
        let checkpoint = folder.join("checkpoint.bin");
        let file = || checkpoint.display().to_string();
        let scene = Scene::read(&folder.join("scene.toml"))?;
        let saved = Saved::read(&checkpoint)?;
        if let Some(key) = setup::first_difference(&saved.scene, &scene.resolved_toml()) {
            return Err(RunError::OtherProblem { file: file(), key });
        }
        // nothing will be solved for, so the memory of a run is not needed
        let setup = Setup::within(&scene, None)?;
        if saved.mesh != setup.mesh.fingerprint() || !setup.fits(&saved.march) {
            let what = "does not fit the mesh of its scene".to_owned();
            let hint = "the mesh file of the run has changed since: restore it, or run the scene again";
            return Err(RunError::Output(OutputError::Malformed { path: file(), what, hint }));
        }
        Ok(Self { scene, setup, saved: saved.march })
    }

    /// The march at its last state.
    pub fn march(&self) -> March<'_> {
        March::resume(&*self.setup.model, self.scene.march(), self.saved.clone())
    }
}
