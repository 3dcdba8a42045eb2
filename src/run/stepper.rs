//! What the one loop of a run moves, and what it needs of a scene.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::maps::Caption;
use super::summary::Unknowns;
use super::view::View;
use super::{Options, RunError, Setup};
use crate::body::Body;
use crate::body::leaving::Departure;
use crate::contact::Wall;
use crate::measure::fields::{At, Fields, Tools};
use crate::mesh::Mesh;
use crate::mesh::generate::MeshScene;
use crate::mesh::locate::Locator;
use crate::mesh::quality::Quality;
use crate::model::{Exact, TermStatus};
use crate::output::OutputError;
use crate::output::checkpoint::Saved;
use crate::scene::{Output, Scene, SceneSource};
use crate::time::March;
use crate::time::march::Counts;
use crate::time::phases::Phases;

/// What the loop moves: a tissue, bodies in a tissue or in a Stokes flow, particles.
pub trait Stepper {
    /// One step from `t`, trimmed to land on `landing`. What fails changes nothing.
    ///
    /// # Errors
    /// Why there is no step.
    fn advance(&mut self, t: f64, landing: f64) -> Result<Stride, Halt>;

    /// The state for an exact restart, packed.
    fn state(&self) -> Vec<u8>;

    /// Steps, rejections and iterations so far, resumed parts included, where the stepper counts them itself.
    fn counts(&mut self) -> Option<Counts> {
        None
    }

    /// Shows what there is now to `then`.
    ///
    /// # Errors
    /// Those of `then`; what cannot be solved for.
    fn look(&mut self, then: &mut dyn FnMut(&View) -> Result<(), RunError>) -> Result<(), RunError>;

    /// Columns of the history that tell of a step, before the measures.
    fn step_columns(&self) -> &'static [&'static str] {
        &["time", "dt", "iterations", "rejected"]
    }

    /// Capability: a march in time of carried fields, which can be tested for rest, searched from for steady states,
    /// and whose coupling is counted. `then` is not called where there is none.
    fn with_march(&mut self, then: &mut dyn FnMut(&mut March)) {
        let _ = then;
    }
}

/// A step that was taken.
#[derive(Debug, Clone, Default)]
pub struct Stride {
    /// Where it ended, and its length.
    pub t: f64,
    /// Its length.
    pub dt: f64,
    /// Of the coupling, or of contact.
    pub iterations: usize,
    /// Steps that were too long before it.
    pub rejected: usize,
    /// Of a march: order of its formula, last increment and rate of its coupling.
    pub coupled: Option<Coupled>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// Bodies that left the mesh.
    pub left: Vec<Departure>,
}

/// How the coupling of a step went.
#[derive(Debug, Clone, Copy)]
pub struct Coupled {
    /// Of its formula in time.
    pub order: usize,
    /// The last one [9.1].
    pub increment: f64,
    /// Of the last iterations; not finite where none shows.
    pub rate: f64,
}

impl Stride {
    /// The entry of a column that tells of a step.
    pub fn value(&self, column: &str) -> Option<f64> {
        match column {
            "time" => Some(self.t),
            "dt" => Some(self.dt),
            "iterations" => Some(self.iterations as f64),
            "rejected" => Some(self.rejected as f64),
            "order" => self.coupled.map(|coupled| coupled.order as f64),
            "increment" => self.coupled.map(|coupled| coupled.increment),
            "rate" => self.coupled.map(|coupled| coupled.rate).filter(|rate| rate.is_finite()),
            _ => None,
        }
    }
}

impl From<crate::time::StepReport> for Stride {
    fn from(report: crate::time::StepReport) -> Self {
        let crate::time::StepReport { t, dt, order, iterations, increment, rate, rejected, .. } = report;
        let coupled = Some(Coupled { order, increment, rate });
        Self { t, dt, iterations, rejected, coupled, ..Self::default() }
    }
}

/// The columns of a step of a march.
pub const MARCH_COLUMNS: &[&str] = &["time", "dt", "order", "iterations", "increment", "rate", "rejected"];

/// Why there is no further step.
#[derive(Debug, Clone)]
pub enum Halt {
    /// Somebody wants it to end.
    Interrupted,
    /// The reason; `blame` where a value of the scene that is far from the usual may be behind it.
    Failed {
        /// What went wrong.
        reason: String,
        /// Whether the scene may be to blame.
        blame: bool,
    },
}

impl From<String> for Halt {
    fn from(reason: String) -> Self {
        Halt::Failed { reason, blame: true }
    }
}

/// A note of a step that was too long.
pub(super) fn shortened(t: f64, dt: f64, why: &str) -> String {
    let why = why.split_once("; hint: ").map_or(why, |(why, _)| why);
    format!("steps are shortened, to {dt:.3e} before t = {t:.6}: {why}")
}

/// What ends a run besides failures.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Time at which it ends.
    pub end: f64,
    /// Most steps.
    pub max_steps: Option<usize>,
    /// No state is at rest before: the data still change.
    pub rests_from: f64,
    /// Bound on the residual of a state at rest.
    pub stop_residual: Option<f64>,
    /// Bound on `|dF/dt|` of a state at rest.
    pub stop_energy_rate: Option<f64>,
}

impl Limits {
    /// An end in time, and a number of steps.
    pub fn at(end: f64, max_steps: Option<usize>) -> Self {
        Self { end, max_steps, rests_from: 0.0, stop_residual: None, stop_energy_rate: None }
    }
}

/// What the loop needs of a scene.
pub struct Plan<'a> {
    /// One line for reports.
    pub title: Option<&'a str>,
    /// The text of the scene.
    pub source: &'a SceneSource,
    /// The resolved scene.
    pub text: String,
    /// What ends it.
    pub limits: Limits,
    /// The value of the scene that is farthest outside of the usual.
    pub suspect: Option<String>,
    /// What is written, and when.
    pub outputs: &'a [Output],
    /// Rigid bodies.
    pub bodies: &'a [Body],
    /// What bodies cannot pass.
    pub walls: Vec<Wall>,
    /// Whether the bodies are more than a part of the domain: something moves, or could.
    pub tells_of_bodies: bool,
    /// Those of the equations, on and off.
    pub terms: Vec<TermStatus>,
    /// What a run should know and no error.
    pub remarks: Vec<String>,
    /// A remark on the start alone, which a resumed run does not repeat.
    pub said_of_start: Option<String>,
    /// Exact fields, to which errors are measured.
    pub exact: Option<Arc<Exact>>,
    /// The scene of a tissue, for what only a march of its kind can do: searches, and notes of its coupling.
    pub tissue: Option<&'a Scene>,
    /// Texts of pictures.
    pub caption: Caption,
    /// How many, by field.
    pub unknowns: Unknowns,
    /// Wall seconds before the loop.
    pub setup_seconds: f64,
}

impl Plan<'_> {
    /// Whether a steady state is searched for, and nothing is marched to a time.
    pub fn is_search(&self) -> bool {
        self.tissue.is_some_and(|scene| scene.steady.is_some())
    }

    /// The scene's file, for messages.
    pub fn origin(&self) -> &str {
        self.source.origin()
    }
}

/// The ground of a run: its mesh, and what is found or prepared on it once. Particles have none.
#[derive(Debug)]
pub struct Ground {
    /// The cells.
    pub mesh: Arc<Mesh>,
    /// Sizes and worst cells.
    pub quality: Quality,
    /// Finds the cell of a point.
    pub locator: Arc<Locator>,
    /// What is made once for fields that have to be solved for.
    pub tools: Tools,
    /// As the scene describes it.
    pub shape: MeshScene,
    /// Centre and radius of the one disc, where it is a body.
    pub disc: Option<([f64; 2], f64)>,
}

impl Ground {
    /// A mesh, as the scene describes it.
    pub fn new(mesh: &Arc<Mesh>, shape: &MeshScene) -> Self {
        Self::with(mesh, shape, Arc::new(Locator::new(mesh)))
    }

    /// A mesh whose points are located already.
    pub fn with(mesh: &Arc<Mesh>, shape: &MeshScene, locator: Arc<Locator>) -> Self {
        let (mesh, quality, shape) = (mesh.clone(), mesh.quality(), shape.clone());
        Self { mesh, quality, locator, tools: Tools::default(), shape, disc: None }
    }

    /// Centre and radius of the disc that axes refer to.
    pub fn disc(&self) -> ([f64; 2], f64) {
        self.disc.unwrap_or_else(|| (self.shape.centre(), self.shape.radius()))
    }

    /// A state on it, for output fields.
    pub fn at<'a>(&'a self, fields: &'a dyn Fields) -> At<'a> {
        At { fields, tools: &self.tools }
    }
}

/// Wall time by phase of a stepper that marches.
pub fn phases_of(stepper: &mut dyn Stepper) -> Phases {
    let mut found = Phases::default();
    stepper.with_march(&mut |march| found = march.phases.clone());
    found
}

/// What is done with a scene that is ready to move.
pub type Stage<'s> = dyn FnMut(&Plan, Option<&Ground>, &mut dyn Stepper) -> Result<(), RunError> + 's;

/// How a scene is made ready.
pub struct Wanted<'a> {
    /// To go on from, and its file.
    pub saved: Option<&'a Saved>,
    /// Where the checkpoint lies.
    pub file: &'a Path,
    /// And what for.
    pub purpose: Purpose<'a>,
}

/// What a scene is made ready for.
#[derive(Debug, Clone, Copy)]
pub enum Purpose<'a> {
    /// To be looked at: nothing is solved for that is not shown.
    Look,
    /// To be solved to its end, and nothing of it written; set from outside to end it after the current step.
    Solve(&'a AtomicBool),
    /// To be run, with all that it writes.
    Run(&'a Options<'a>),
}

impl<'a> Purpose<'a> {
    /// Those of a run.
    pub fn options(self) -> Option<&'a Options<'a>> {
        match self {
            Purpose::Run(options) => Some(options),
            Purpose::Look | Purpose::Solve(_) => None,
        }
    }

    /// What ends it from outside; `None` where nothing is to be solved.
    pub fn interrupt(self) -> Option<&'a AtomicBool> {
        match self {
            Purpose::Look => None,
            Purpose::Solve(interrupt) => Some(interrupt),
            Purpose::Run(options) => Some(options.interrupt),
        }
    }
}

impl Wanted<'_> {
    /// Mesh and model of a tissue, where memory and disk are enough for a run that is wanted.
    ///
    /// # Errors
    /// As [`Setup::within`]; results that the disk cannot take.
    pub fn setup(&self, scene: &Scene) -> Result<Setup, RunError> {
        let setup = match self.purpose {
            Purpose::Look => {
                let mut setup = Setup::within(scene, None)?;
                setup.prepare_strain(scene.strain)?;
                setup
            }
            Purpose::Solve(_) | Purpose::Run(_) => Setup::new(scene)?,
        };
        self.purpose.options().map_or(Ok(()), |options| setup.check_disk(scene, &options.out))?;
        Ok(setup)
    }

    /// Refuses another mesh than that of the checkpoint.
    ///
    /// # Errors
    /// A mesh file that has changed since.
    pub fn check_mesh(&self, mesh: &Mesh) -> Result<(), RunError> {
        match self.saved.filter(|saved| saved.mesh != mesh.fingerprint()) {
            Some(_) => Err(self.unfit("mesh")),
            None => Ok(()),
        }
    }

    /// What a checkpoint holds that has the numbers of its scene.
    ///
    /// # Errors
    /// A checkpoint that does not fit.
    pub fn unpack<T: serde::de::DeserializeOwned>(&self) -> Result<Option<T>, RunError> {
        let unpack = |saved: &Saved| postcard::from_bytes(&saved.state).map_err(|_| self.unfit("space"));
        self.saved.map(unpack).transpose()
    }

    /// The error of a checkpoint that is of another mesh, or of other spaces on it.
    pub fn unfit(&self, key: &str) -> RunError {
        let file = self.file.display().to_string();
        match self.purpose {
            Purpose::Run(_) => RunError::OtherProblem { file, key: key.to_owned() },
            Purpose::Look | Purpose::Solve(_) => RunError::Output(OutputError::Malformed {
                path: file,
                what: "does not fit the mesh of its scene".to_owned(),
                hint: "the mesh file of the run has changed since: restore it, or run the scene again",
            }),
        }
    }
}
