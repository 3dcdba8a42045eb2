//! Kinds of scenes, each with what it does: one row in `ALL`.

pub mod advection;
pub mod particles;
pub(super) mod sheet;
pub mod stokes;
pub mod tissue;

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use super::stepper::{Stage, Wanted};
use super::{Options, Record, RunError, Summary, domain, folder};
use crate::mesh::Mesh;
use crate::mesh::generate::MeshScene;
use crate::model::{Exact, FieldId};
use crate::output::progress::Verbosity;
use crate::scene::kinds::{self, SceneKind};
use crate::scene::maps::MapOptions;
use crate::scene::{MapRule, Output, Scene, SceneError, SceneSource};

/// Checks a scene with its overrides.
type Check = fn(SceneSource) -> Result<AnyScene, SceneError>;

/// Every kind that [`kinds::ALL`] names: how its scenes are checked.
static ALL: [(&SceneKind, Check); 4] = [
    (&kinds::TISSUE, |source| Ok(AnyScene::new(Scene::check(source)?))),
    (&kinds::stokes::KIND, |source| Ok(AnyScene::new(kinds::stokes::StokesScene::check(source)?))),
    (&kinds::particles::KIND, |source| Ok(AnyScene::new(kinds::particles::ParticlesScene::check(source)?))),
    (&kinds::advection::KIND, |source| Ok(AnyScene::new(kinds::advection::AdvectionScene::check(source)?))),
];

/// A scene of some kind: what it says, and what is done with it.
pub trait Kind: fmt::Debug + Send + Sync {
    /// One line for reports.
    fn title(&self) -> Option<&str>;

    /// What is written, and when.
    fn outputs(&self) -> &[Output];

    /// The text that the scene was checked from, for further overrides.
    fn source(&self) -> &SceneSource;

    /// The scene as TOML with every default and override filled in; it parses back to the same scene.
    fn resolved_toml(&self) -> String;

    /// The mesh, where there is one.
    fn mesh(&self) -> Option<&MeshScene>;

    /// Estimate of a run's largest memory in bytes; `None` for a scene that will be refused anyway, or that needs next
    /// to none.
    fn bytes(&self) -> Option<f64>;

    /// What `check` says of it.
    ///
    /// # Errors
    /// All that a run could say before its first step, besides what its folder holds.
    fn report(&self) -> Result<Box<dyn Report>, RunError>;

    /// Makes it ready to move, at its start or where a checkpoint has it, and hands it to `then`.
    ///
    /// # Errors
    /// Anything that is wrong before the first step; those of `then`.
    fn stage(&self, wanted: &Wanted, then: &mut Stage) -> Result<(), RunError>;

    /// The value of the scene that is farthest outside of the usual.
    fn suspect(&self) -> Option<String> {
        super::extremes::of_source(self.source())
    }

    /// Capability: it is a tissue, whose steady states, orders, branches and estimates are asked for.
    fn tissue(&self) -> Option<&Scene> {
        None
    }

    /// Capability: it has exact fields, to which its solutions are compared.
    fn compared(&self) -> Option<Compared<'_>> {
        None
    }

    /// Whether its runs have what is to be drawn.
    ///
    /// # Errors
    /// The first rule that is broken.
    fn check_map(&self, options: &MapOptions) -> Result<(), MapRule> {
        options.check_of(self.source().kind())
    }
}

/// What a scene promises of its distance from exact fields.
#[derive(Debug, Clone)]
pub struct Compared<'a> {
    /// Those that it has.
    pub exact: &'a Exact,
    /// Its first and largest step.
    pub step: f64,
    /// The longest of those that alternate about it.
    pub longest: f64,
    /// Time at which it ends.
    pub end: f64,
    /// Order in the cells' size of each field's error in L², by its degrees, where cells follow the boundary.
    pub orders: Vec<(FieldId, usize)>,
    /// Order in the step; `None` where nothing is carried in time.
    pub order_in_time: Option<usize>,
    /// What solvers leave, relative to the fields.
    pub tolerance: f64,
}

/// What `check` says of a scene.
pub trait Report: fmt::Display {
    /// As JSON.
    ///
    /// # Errors
    /// Numbers that JSON does not have.
    fn json(&self) -> serde_json::Result<String>;

    /// Why a run is refused here and now; empty where it is not.
    fn refused(&self) -> &[String];

    /// How much a run takes.
    fn amounts(&self) -> Amounts;
}

/// How much a run takes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Amounts {
    /// Of the mesh.
    pub cells: usize,
    /// Of the full length; none of a search for a steady state.
    pub steps: f64,
    /// Estimate of the peak memory, MiB.
    pub memory_mib: f64,
    /// Estimate of what is written, MiB.
    pub disk_mib: f64,
}

/// A scene of any kind, as `model.kind` says.
#[derive(Debug, Clone)]
pub struct AnyScene(Arc<dyn Kind>);

impl AnyScene {
    /// A scene whose kind is known.
    pub fn new(scene: impl Kind + 'static) -> Self {
        Self(Arc::new(scene))
    }

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
    /// Whatever is wrong with it, see [`SceneError`].
    pub fn parse(text: &str, origin: &Path) -> Result<Self, SceneError> {
        Self::check(SceneSource::parse(text, origin)?)
    }

    /// Checks a scene with its overrides.
    ///
    /// # Errors
    /// Whatever is wrong with it, see [`SceneError`].
    ///
    /// # Panics
    /// Never: every kind has its row.
    pub fn check(source: SceneSource) -> Result<Self, SceneError> {
        let row = ALL.iter().find(|(kind, _)| *kind == source.kind());
        row.expect("every kind that scenes can name has a row here").1(source)
    }
}

impl std::ops::Deref for AnyScene {
    type Target = dyn Kind;

    fn deref(&self) -> &Self::Target {
        &*self.0
    }
}

/// Runs a scene to its end and leaves the results in `options.out`.
///
/// # Errors
/// Anything that is wrong before the first step, and results that cannot be written. A step that fails ends the run
/// with [`Ending::Failed`](super::Ending::Failed): its last good state is written like any other.
pub fn run(scene: &AnyScene, options: &Options) -> Result<Summary, RunError> {
    folder::alone(options, || run_held(scene, options))
}

/// As [`run`], in a folder that the caller has to itself.
///
/// # Errors
/// As [`run`].
pub fn run_held(scene: &AnyScene, options: &Options) -> Result<Summary, RunError> {
    announce_mesh(scene, options.verbosity);
    super::run_kind(&**scene, options, &mut Record::default())
}

/// What `check` says of a scene.
///
/// # Errors
/// All that a run could say before its first step, besides what its folder holds.
pub fn check(scene: &AnyScene) -> Result<Box<dyn Report>, RunError> {
    scene.report().map_err(|error| error.blaming(|| scene.suspect()))
}

/// Says so where making the mesh takes a while.
pub fn announce_mesh(scene: &AnyScene, verbosity: Verbosity) {
    if let Some(mesh) = scene.mesh() {
        domain::announce_mesh(mesh, verbosity);
    }
}

/// The mesh of a scene.
///
/// # Errors
/// A mesh that cannot be built; a kind that has none.
pub fn mesh(scene: &AnyScene) -> Result<Mesh, RunError> {
    if let Some(mesh) = scene.mesh() {
        return domain::mesh_of(mesh, scene.source());
    }
    let (place, key) = (scene.source().place("model.kind"), "model.kind".to_owned());
    let kind = scene.source().kind();
    let (value, rule) = (format!("\"{}\"", kind.names[0]), format!("{} have no mesh", kind.names[0]));
    let hint = "name a scene of a tissue or of a Stokes flow".to_owned();
    Err(SceneError::Value { place, key, value, rule, hint }.into())
}

#[cfg(test)]
mod tests {
    use super::{ALL, kinds};

    #[test]
    fn every_kind_of_scenes_has_its_row() {
        assert_eq!(ALL.map(|(kind, _)| kind), kinds::ALL);
    }
}
