//! The last state of another run, to start from.

use std::path::Path;
use std::sync::Arc;

use super::RunError;
use super::domain::build_mesh;
use crate::model::ModelKind;
use crate::output::checkpoint::Saved;
use crate::scene::Scene;
use crate::space::{Continuity, Field, Space, project};

/// What is carried in the last state of another run, on that run's own mesh.
pub(super) struct LastState {
    file: String,
    /// Of an incompressible sheet there is no density.
    density: Option<Field>,
    polarity: Field,
}

/// One field of another run.
pub(super) struct Source {
    file: String,
    pub(super) field: Field,
}

impl LastState {
    /// Reads a checkpoint.
    pub(super) fn read(path: &Path) -> Result<Self, RunError> {
        let file = path.display().to_string();
        let wrong = |what: &str| unfit(&file, what.to_owned());
        let saved = Saved::read(path).map_err(|e| unfit(&file, e.to_string()))?;
        let scene = Scene::parse(&saved.scene, path)?;
        let mesh = Arc::new(build_mesh(&scene)?);
        if saved.mesh != mesh.fingerprint() {
            return Err(wrong("the mesh of its run has changed since"));
        }
        let space = |degree: usize, components: usize| {
            Arc::new(Space::new(&mesh, Continuity::Discontinuous, degree, components))
        };
        let polarity = space(scene.space.polarity, 2);
        let density = match scene.parameters.kind() {
            ModelKind::Incompressible => None,
            ModelKind::Compressible => Some(space(scene.space.density, 1)),
        };
        let before = density.as_ref().map_or(0, |space| space.dof_count());
        let march = saved.march().map_err(|_| wrong("its run was not of a tissue in which nothing moves"))?;
        let values = march.past.into_iter().next().map(|(_, y)| y).unwrap_or_default();
        if values.len() != before + polarity.dof_count() {
            return Err(wrong("its fields do not fit its mesh"));
        }
        let (rho, p) = values.split_at(before);
        let density = density.map(|space| Field::new(&space, rho.to_vec()));
        Ok(Self { polarity: Field::new(&polarity, p.to_vec()), density, file })
    }

    pub(super) fn density(self) -> Result<Source, RunError> {
        let Self { file, density, .. } = self;
        match density {
            Some(field) => Ok(Source { file, field }),
            None => Err(unfit(&file, "its run was of an incompressible sheet, which has no density".to_owned())),
        }
    }

    fn polarity(self) -> Source {
        Source { file: self.file, field: self.polarity }
    }
}

impl Source {
    /// Its L² projection on another space.
    pub(super) fn on(&self, space: &Arc<Space>) -> Result<Field, RunError> {
        project::transfer(space, &self.field).map_err(|project::NotCovered(x)| {
            unfit(&self.file, format!("its mesh does not cover the point ({:.4}, {:.4})", x.x, x.y))
        })
    }
}

/// A checkpoint from which this run cannot start.
fn unfit(file: &str, what: String) -> RunError {
    let hint = "give a `checkpoint.bin` of a run on the same domain".to_owned();
    RunError::Start { file: file.to_owned(), what, hint }
}

/// The last polarity of the run that left a checkpoint, on that run's own mesh.
///
/// # Errors
/// A file that is none, a mesh that has changed since.
pub fn last_polarity(checkpoint: &Path) -> Result<Field, RunError> {
    Ok(LastState::read(checkpoint)?.polarity)
}

/// The last polarity of the run that left a checkpoint, projected on another space.
///
/// # Errors
/// As [`last_polarity`]; a domain that does not cover this one.
pub fn polarity_of(space: &Arc<Space>, checkpoint: &Path) -> Result<Field, RunError> {
    LastState::read(checkpoint)?.polarity().on(space)
}
