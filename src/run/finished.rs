//! What a run has left in its folder: scene, mesh, model and last state, without solving anything.

use std::path::{Path, PathBuf};

use super::maps::Draft;
use super::moment::with_moment;
use super::stepper::{Ground, Plan, Purpose, Wanted};
use super::view::View;
use super::{AnyScene, RunError, setup};
use crate::mesh::Mesh;
use crate::output::bodies::Solids;
use crate::output::checkpoint::Saved;
use crate::output::plot::map::Picture;
use crate::scene::{MapRequest, Scene};
use crate::time::Checkpoint;

/// Scene and checkpoint of a run, before anything is built of them.
#[derive(Debug)]
pub struct FinishedRun {
    /// What was run, with every default.
    pub scene: Scene,
    saved: Saved,
    /// Of the checkpoint.
    file: PathBuf,
}

impl FinishedRun {
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
        let wanted = Wanted { saved: Some(&self.saved), file: &self.file, purpose: Purpose::Look };
        wanted.check_mesh(mesh)?;
        let march = self.saved.march().ok().filter(fits).ok_or_else(|| wanted.unfit("space"))?;
        Ok((self.scene, march))
    }
}

/// Shows the last state of a run, whatever its kind, to `then`; nothing is solved for that is not shown.
///
/// # Errors
/// A folder without scene or checkpoint; files that do not belong together; those of `then`.
pub fn look(
    folder: &Path,
    scene: &AnyScene,
    then: &mut dyn FnMut(&Last) -> Result<(), RunError>,
) -> Result<(), RunError> {
    let file = folder.join("checkpoint.bin");
    if !file.is_file() {
        return Err(RunError::NoRun { folder: folder.display().to_string(), file: "checkpoint.bin" });
    }
    let saved = Saved::read(&file)?;
    if let Some(key) = setup::first_difference(&saved.scene, &scene.resolved_toml()) {
        return Err(RunError::OtherProblem { file: file.display().to_string(), key });
    }
    let wanted = Wanted { saved: Some(&saved), file: &file, purpose: Purpose::Look };
    scene.stage(&wanted, &mut |plan, ground, stepper| {
        let cast = Solids::new(plan.bodies, &plan.walls);
        stepper.look(&mut |view| then(&Last { plan, ground, view, cast: &cast, steps: saved.counts.steps }))
    })
}

/// The last state of a run.
#[derive(Clone, Copy)]
pub struct Last<'a> {
    /// What was run.
    pub plan: &'a Plan<'a>,
    /// Its mesh, where it has one.
    pub ground: Option<&'a Ground>,
    /// Fields and bodies.
    pub view: &'a View<'a>,
    cast: &'a Solids,
    /// Steps to this state.
    pub steps: usize,
}

impl Last<'_> {
    /// A picture of the fields with the bodies above them.
    ///
    /// # Errors
    /// As [`Draft::draw`].
    pub fn draw(&self, request: &MapRequest) -> Result<Picture, RunError> {
        self.with_draft(|draft| draft.draw(request, &self.plan.caption))
    }

    /// The smallest and the largest value that the picture would show.
    ///
    /// # Errors
    /// As [`Draft::extent`].
    pub fn extent(&self, request: &MapRequest) -> Result<[f64; 2], RunError> {
        self.with_draft(|draft| draft.extent(request, &self.plan.caption))
    }

    fn with_draft<T>(&self, then: impl FnOnce(&Draft) -> Result<T, RunError>) -> Result<T, RunError> {
        let both = self.view.fields.zip(self.ground);
        let (fields, ground) = both.expect("what has no fields is drawn by its bodies");
        with_moment(self.cast, self.view, |moment| then(&Draft::new(fields, ground, self.view.t).with_bodies(moment)))
    }
}
