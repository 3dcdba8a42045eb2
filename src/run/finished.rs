//! What a run has left in its folder: scene, mesh, model and last state, without solving anything.

use std::path::{Path, PathBuf};

use super::setup::{self, Setup};
use super::{OutputError, RunError};
use crate::mesh::Mesh;
use crate::output::checkpoint::Saved;
use crate::scene::Scene;
use crate::time::{Checkpoint, March};

/// Scene and checkpoint of a run, before anything is built of them.
#[derive(Debug)]
pub struct Left {
    /// What was run, with every default.
    pub scene: Scene,
    saved: Saved,
    /// Of the checkpoint.
    file: PathBuf,
}

impl Left {
    /// Reads `scene.toml` and `checkpoint.bin` of a run's folder.
    ///
    /// # Errors
    /// A folder without them; files that cannot be read or do not belong together.
    pub fn read(folder: &Path) -> Result<Self, RunError> {
        for file in ["scene.toml", "checkpoint.bin"] {
            if !folder.join(file).is_file() {
                return Err(RunError::NoRun { folder: folder.display().to_string(), file });
            }
        }
        let file = folder.join("checkpoint.bin");
        let scene = Scene::read(&folder.join("scene.toml"))?;
        let saved = Saved::read(&file)?;
        if let Some(key) = setup::first_difference(&saved.scene, &scene.resolved_toml()) {
            return Err(RunError::OtherProblem { file: file.display().to_string(), key });
        }
        Ok(Self { scene, saved, file })
    }

    /// The scene, and the state on the mesh that was built of it, if it `fits` the fields there.
    ///
    /// # Errors
    /// A mesh file that has changed since.
    pub fn on(self, mesh: &Mesh, fits: impl FnOnce(&Checkpoint) -> bool) -> Result<(Scene, Checkpoint), RunError> {
        if self.saved.mesh != mesh.fingerprint() || !fits(&self.saved.march) {
            let path = self.file.display().to_string();
            let what = "does not fit the mesh of its scene".to_owned();
            let hint = "the mesh file of the run has changed since: restore it, or run the scene again";
            return Err(RunError::Output(OutputError::Malformed { path, what, hint }));
        }
        Ok((self.scene, self.saved.march))
    }
}

/// A run that has ended, or was interrupted.
#[derive(Debug)]
pub struct Finished {
    /// What was run, with every default.
    pub scene: Scene,
    /// Its mesh and model, built anew.
    pub setup: Setup,
    saved: Checkpoint,
}

impl Finished {
    /// Reads the folder of a run and prepares its fields.
    ///
    /// # Errors
    /// As [`Left::read`] and [`Left::on`].
    pub fn read(folder: &Path) -> Result<Self, RunError> {
        let left = Left::read(folder)?;
        // nothing will be solved for, so the memory of a run is not needed
        let setup = Setup::within(&left.scene, None)?;
        let (scene, saved) = left.on(&setup.mesh, |saved| setup.fits(saved))?;
        Ok(Self { scene, setup, saved })
    }

    /// The march at its last state.
    pub fn march(&self) -> March<'_> {
        March::resume(&*self.setup.model, self.scene.march(), self.saved.clone())
    }
}
