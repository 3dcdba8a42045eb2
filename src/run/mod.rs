//! One scene from its description to its folder of results.
//!
//! A kind of scene ([`kinds::Kind`]) makes itself ready: a [`stepper::Plan`], a [`stepper::Ground`] where there is a
//! mesh, and a [`stepper::Stepper`]. One loop moves it, one writer writes it, one checkpoint holds it, one summary
//! tells of it.

pub mod available;
pub mod bodies;
pub mod cuts;
pub mod defects;
pub mod disk;
pub mod domain;
mod error;
pub mod estimate;
pub mod exact;
mod extremes;
pub mod finished;
pub mod folder;
pub mod forecast;
pub mod kinds;
pub mod last_state;
pub mod maps;
pub mod measures;
pub mod memory;
pub mod moment;
pub mod report;
mod resolution;
pub mod setup;
pub mod steady;
pub mod stepper;
mod stepping;
mod strain;
pub mod summary;
pub mod unsaved;
pub mod view;
mod watch;
pub mod writer;

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use crate::measure::errors::History;
use crate::output::checkpoint::Saved;
use crate::output::progress::Verbosity;
use crate::scene::Scene;
use crate::time::march::Counts;

pub use error::RunError;
pub use kinds::AnyScene;
use kinds::Kind;
pub use setup::Setup;
use stepper::{Purpose, Wanted};
use stepping::Begin;
pub use summary::{Ending, Summary};

/// What a caller decides about a run.
#[derive(Debug)]
pub struct Options<'a> {
    /// Folder of the results.
    pub out: PathBuf,
    /// Continue from the folder's checkpoint.
    pub resume: bool,
    /// How much is said on the way.
    pub verbosity: Verbosity,
    /// Set from outside to end the run cleanly after the current step.
    pub interrupt: &'a AtomicBool,
}

/// What a caller learns of a run beside its files.
#[derive(Debug, Default)]
pub struct Record {
    /// Notes and remarks, in order.
    pub said: Vec<String>,
    /// Errors against the scene's exact fields over the steps of this process, for a caller who puts an empty history
    /// here.
    pub errors: Option<History>,
}

/// Over all steps of a run, resumed parts included.
#[derive(Debug, Clone, Copy, Default)]
pub struct Totals {
    /// Steps, rejections, iterations.
    pub counts: Counts,
    /// Largest overlap of bodies after a step, 0 without one.
    pub overlap: f64,
}

/// Runs a scene of a tissue to its end and leaves the results in `options.out`.
///
/// # Errors
/// Anything that is wrong before the first step, and results that cannot be written. A step that fails ends the run
/// with [`Ending::Failed`]: its last good state is written like any other.
pub fn run(scene: &Scene, options: &Options) -> Result<Summary, RunError> {
    folder::alone(options, || run_recorded(scene, options, &mut Record::default()))
}

/// As [`run`], in a folder that the caller has to itself; `record` is filled as far as the run comes.
///
/// # Errors
/// As [`run`].
pub fn run_recorded(scene: &Scene, options: &Options, record: &mut Record) -> Result<Summary, RunError> {
    run_kind(scene, options, record)
}

/// Runs a scene of any kind, from its checkpoint where it is to be resumed.
fn run_kind(scene: &dyn Kind, options: &Options, record: &mut Record) -> Result<Summary, RunError> {
    let made = !options.out.exists();
    let mut result = begin(scene, options, record).map_err(|error| error.blaming(|| scene.suspect()));
    if let (Ok(summary), Some(scene)) = (&mut result, scene.tissue().filter(|scene| estimate::is_asked_for(scene))) {
        // what the run itself has found is on disk by now, and its memory free
        estimate::add(scene, options, summary, record);
        summary.write(&options.out.join("summary.json"))?;
    }
    if result.is_err() && made {
        // takes away an empty folder only: nothing was found
        let _ = std::fs::remove_dir(&options.out);
    }
    result
}

fn begin(scene: &dyn Kind, options: &Options, record: &mut Record) -> Result<Summary, RunError> {
    let (begin, file) = (Begin::now(), options.out.join("checkpoint.bin"));
    let saved = checkpoint_of(&scene.resolved_toml(), options)?;
    let wanted = Wanted { saved: saved.as_ref(), file: &file, purpose: Purpose::Run(options) };
    let mut summary = None;
    scene.stage(&wanted, &mut |plan, ground, stepper| {
        summary = Some(stepping::run((plan, begin), ground, stepper, options, saved.as_ref(), record)?);
        Ok(())
    })?;
    Ok(summary.expect("what is ready is run"))
}

/// The checkpoint to go on from, where there is one to; the folder is there then.
fn checkpoint_of(text: &str, options: &Options) -> Result<Option<Saved>, RunError> {
    let Some(checkpoint) = folder::prepare(options)? else { return Ok(None) };
    let saved = Saved::read(&checkpoint)?;
    match setup::first_difference(&saved.scene, text) {
        Some(key) => Err(RunError::OtherProblem { file: checkpoint.display().to_string(), key }),
        None => Ok(Some(saved)),
    }
}
