//! A scene of any kind.

use std::path::Path;

use super::error::SceneError;
use super::output::Output;
use super::particles::ParticlesScene;
use super::source::SceneSource;
use super::stokes::StokesScene;
use super::{Scene, SceneKind};

/// One computation, as `model.kind` says.
#[derive(Debug, Clone)]
pub enum AnyScene {
    /// A sheet of tissue: `incompressible` or `compressible`.
    Tissue(Box<Scene>),
    /// A Stokes flow that carries rigid bodies.
    Stokes(Box<StokesScene>),
    /// Rigid bodies without a flow.
    Particles(Box<ParticlesScene>),
}

impl AnyScene {
    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// Whatever is wrong with it, see [`SceneError`].
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        Self::check(SceneSource::read(path)?)
    }

    /// Checks a text; `origin` is its file, for messages and relative paths.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, origin: &Path) -> Result<Self, SceneError> {
        Self::check(SceneSource::parse(text, origin)?)
    }

    /// Checks a scene with its overrides.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn check(source: SceneSource) -> Result<Self, SceneError> {
        Ok(match source.kind() {
            SceneKind::Tissue => Self::Tissue(Box::new(Scene::check(source)?)),
            SceneKind::Stokes => Self::Stokes(Box::new(StokesScene::check(source)?)),
            SceneKind::Particles => Self::Particles(Box::new(ParticlesScene::check(source)?)),
        })
    }

    /// The scene of a tissue, where it is one.
    pub fn tissue(&self) -> Option<&Scene> {
        match self {
            Self::Tissue(scene) => Some(scene),
            Self::Stokes(_) | Self::Particles(_) => None,
        }
    }

    /// One line for reports.
    pub fn title(&self) -> Option<&str> {
        match self {
            Self::Tissue(scene) => scene.title.as_deref(),
            Self::Stokes(scene) => scene.title.as_deref(),
            Self::Particles(scene) => scene.title.as_deref(),
        }
    }

    /// What is written, and when.
    pub fn outputs(&self) -> &[Output] {
        match self {
            Self::Tissue(scene) => &scene.outputs,
            Self::Stokes(scene) => &scene.outputs,
            Self::Particles(scene) => &scene.outputs,
        }
    }

    /// The text that the scene was checked from, for further overrides.
    pub fn source(&self) -> &SceneSource {
        match self {
            Self::Tissue(scene) => scene.source(),
            Self::Stokes(scene) => scene.source(),
            Self::Particles(scene) => scene.source(),
        }
    }

    /// The scene as TOML with every default and override filled in; it parses back to the same scene.
    pub fn resolved_toml(&self) -> String {
        match self {
            Self::Tissue(scene) => scene.resolved_toml(),
            Self::Stokes(scene) => scene.resolved_toml(),
            Self::Particles(scene) => scene.resolved_toml(),
        }
    }
}
