//! One scene from its description to its folder of results.

pub mod any;
pub mod available;
pub mod bodies;
pub mod defects;
pub mod disk;
pub mod domain;
pub mod estimate;
pub mod exact;
mod extremes;
pub mod finished;
pub mod folder;
pub mod forecast;
pub mod last_state;
pub mod maps;
pub mod measures;
pub mod memory;
pub mod motion;
pub mod moved;
pub mod particles;
pub mod report;
mod resolution;
pub mod setup;
pub mod stake;
pub mod steady;
pub mod stokes;
mod strain;
pub mod summary;
pub mod tissue;
pub mod writer;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use crate::contact::ContactError;
use crate::expression::ExpressionError;
use crate::measure::MeasureError;
use crate::measure::errors::History;
use crate::measure::list::Taken;
use crate::mesh::MeshError;
use crate::model::Residuals;
use crate::model::momentum::MomentumError;
use crate::output::OutputError;
use crate::output::checkpoint::Saved;
use crate::output::plot::PlotError;
use crate::output::progress::{Progress, Status, Verbosity};
use crate::scene::{Scene, SceneError};
use crate::solve::SolveError;
use crate::time::{March, MarchError, StepFailure};

use folder::Resumed;
use measures::Gauges;
pub use setup::Setup;
pub use summary::{Ending, Summary};
use writer::Writer;

/// Whatever can stop a run before or after its steps; a step that fails is an [`Ending`].
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum RunError {
    #[error(transparent)]
    Scene(#[from] Box<SceneError>),
    #[error("{origin}: {error}")]
    Mesh { origin: String, error: Box<MeshError> },
    #[error("{}", located(origin, error))]
    Model { origin: String, error: Box<MomentumError> },
    #[error("{origin}: the start cannot be solved for: {error}")]
    Begin { origin: String, error: Box<StepFailure> },
    #[error("{}", located(origin, error))]
    Formula { origin: String, error: Box<ExpressionError> },
    #[error("{origin}: {error}")]
    Contact { origin: String, error: Box<ContactError> },
    #[error(transparent)]
    Measure(MeasureError),
    #[error(transparent)]
    Solve(#[from] SolveError),
    #[error(transparent)]
    Momentum(#[from] MomentumError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("{origin}: {error}")]
    Map { origin: String, error: Box<PlotError> },
    #[error("{folder}: holds no {file} of a run; hint: name the folder that `monolayer run` has written")]
    NoRun { folder: String, file: &'static str },
    #[error(
        "{folder}: holds the results of an earlier run; hint: add `--resume` to continue it, or choose another `--out`"
    )]
    Occupied { folder: String },
    #[error(
        "{folder}: holds no checkpoint.bin to resume from; hint: run without `--resume`, or name the run's folder by `--out`"
    )]
    NothingToResume { folder: String },
    #[error(
        "{file}: belongs to another problem: `{key}` differs; hint: resume with the scene of the run (`scene.toml` in its folder); only `title`, `output`, `coupling`, and of `time` all but `scheme` may change"
    )]
    OtherProblem { file: String, key: String },
    #[error("{origin}: the search for a steady state failed: {reason}")]
    Steady { origin: String, reason: String },
    #[error(
        "{origin}: the run does not fit into memory: it would take about {needed:.0} MiB, and must take at most the {available:.0} MiB that are available; hint: {hint}"
    )]
    Memory { origin: String, needed: f64, available: f64, hint: String },
    #[error(
        "{origin}: the results do not fit onto the disk: a run would write about {needed:.0} MiB, and {free:.0} MiB are free at {folder}; hint: write less often or fewer fields, or choose another `--out`"
    )]
    Disk { origin: String, folder: String, needed: f64, free: f64 },
    #[error("MONOLAYER_MEMORY = `{value}`: must be a positive number of MiB; hint: leave it unset to ask the system")]
    BadMemory { value: String },
    #[error("{what}; hint: {hint}")]
    Extreme { what: String, hint: String },
    #[error("{file}: {what}; hint: {hint}")]
    Start { file: String, what: String, hint: String },
}

impl From<MeasureError> for RunError {
    fn from(error: MeasureError) -> Self {
        match error {
            MeasureError::Momentum(error) => RunError::Momentum(error),
            other => RunError::Measure(other),
        }
    }
}

/// An error behind its place; one that begins with the file itself has it once.
fn located(origin: &str, error: &dyn std::fmt::Display) -> String {
    let text = error.to_string();
    let file = origin.split(", line ").next().unwrap_or(origin);
    let rest = text.strip_prefix(file).and_then(|rest| rest.strip_prefix(": "));
    format!("{origin}: {}", rest.unwrap_or(&text))
}

impl RunError {
    /// A flow that cannot be solved for, in the scene of that origin.
    pub(crate) fn begin(origin: &str, failure: StepFailure) -> Self {
        let origin = origin.to_owned();
        match failure {
            StepFailure::Momentum(error) => RunError::Model { origin, error: Box::new(error) },
            other => RunError::Begin { origin, error: Box::new(other) },
        }
    }
}

impl RunError {
    /// An error of a solver with the hint of `suspect`, which names the value of the scene that is to blame.
    pub(crate) fn blaming(self, suspect: impl FnOnce() -> Option<String>) -> Self {
        let solver = |error: &MomentumError| matches!(error, MomentumError::Solve(_) | MomentumError::Weighted(_));
        let unclear = match &self {
            RunError::Model { error, .. } => solver(error),
            RunError::Momentum(error) => solver(error),
            RunError::Begin { error, .. } => !matches!(**error, StepFailure::Formula(_) | StepFailure::Interrupted),
            RunError::Solve(_) | RunError::Steady { .. } => true,
            RunError::Scene(_)
            | RunError::Mesh { .. }
            | RunError::Formula { .. }
            | RunError::Contact { .. }
            | RunError::Measure(_)
            | RunError::Output(_)
            | RunError::Map { .. }
            | RunError::NoRun { .. }
            | RunError::Occupied { .. }
            | RunError::NothingToResume { .. }
            | RunError::OtherProblem { .. }
            | RunError::Memory { .. }
            | RunError::Disk { .. }
            | RunError::BadMemory { .. }
            | RunError::Extreme { .. }
            | RunError::Start { .. } => false,
        };
        match unclear.then(suspect).flatten() {
            Some(hint) => {
                let message = self.to_string();
                let what = message.split("; hint: ").next().unwrap_or_default().to_owned();
                RunError::Extreme { what, hint }
            }
            None => self,
        }
    }
}

impl From<SceneError> for RunError {
    fn from(error: SceneError) -> Self {
        RunError::Scene(Box::new(error))
    }
}

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

/// `|dF/dt|` must stay below its bound for so many steps: it vanishes at every extremum of an oscillation, too.
const QUIET_STEPS: usize = 10;

/// Runs a scene to its end and leaves the results in `options.out`.
///
/// # Errors
/// Anything that is wrong before the first step, and results that cannot be written. A step that fails ends the run
/// with
/// [`Ending::Failed`]: its last good state is written like any other.
pub fn run(scene: &Scene, options: &Options) -> Result<Summary, RunError> {
    folder::alone(options, || run_recorded(scene, options, &mut Record::default()))
}

/// As [`run`], in a folder that the caller has to itself; `record` is filled as far as the run comes.
///
/// # Errors
/// As [`run`].
pub fn run_recorded(scene: &Scene, options: &Options, record: &mut Record) -> Result<Summary, RunError> {
    let made = !options.out.exists();
    let result = run_in_folder(scene, options, record);
    let mut result = result.map_err(|error| error.blaming(|| extremes::of_scene(scene)));
    if let (Ok(summary), true) = (&mut result, estimate::is_asked_for(scene)) {
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

fn run_in_folder(scene: &Scene, options: &Options, record: &mut Record) -> Result<Summary, RunError> {
    let begin = Instant::now();
    let counts_before = crate::solve::sparse::counts();
    let saved = checkpoint_of(scene, options)?;
    let setup = Setup::new(scene)?;
    setup.check_disk(scene, &options.out)?;
    let model = &setup.model;
    let (kept, known) = (saved.as_ref().map(|s| s.kept.clone()), saved.as_ref().map(|s| s.scene.clone()));
    let mut march = match saved {
        Some(saved) => {
            if saved.mesh != setup.mesh.fingerprint() {
                let file = options.out.join("checkpoint.bin").display().to_string();
                return Err(RunError::OtherProblem { file, key: "mesh".into() });
            }
            if !setup.fits(&saved.march) {
                let file = options.out.join("checkpoint.bin").display().to_string();
                return Err(RunError::OtherProblem { file, key: "space".into() });
            }
            March::resume(&**model, scene.march(), saved.march)
        }
        None => setup.start(scene)?,
    };
    march.interrupt = options.interrupt;
    let mut gauges = Gauges::new(scene, &setup)?;
    gauges.errors = record.errors.take().or(scene.sources.exact.as_ref().map(|_| History::default()));
    if let Some(kept) = &kept {
        gauges.errors = gauges.errors.and(kept.errors);
    }
    let resumed = kept.as_ref().map(|_| Resumed::at(&options.out, march.counts.steps, march.t));
    Writer::check_cuts(scene, &setup)?;
    let _stake = stake::Stake::new();
    folder::write_scene(&options.out, &scene.resolved_toml(), known.as_deref())?;
    let mut writer = Writer::new(scene, &setup, &options.out, resumed)?;
    let mut progress = Progress::new(options.verbosity, march.t);
    for remark in setup.remarks(scene) {
        progress.say(&format!("note: {remark}"));
    }
    let remarks = progress.said().len();
    writer.kept = kept.unwrap_or_default();
    progress.recall(&writer.kept.said);
    match resumed {
        None => {
            setup.said_of_start.get().into_iter().for_each(|remark| progress.say(&format!("note: {remark}")));
            keep(&mut writer, &gauges, &progress, remarks);
            writer.write_due(&mut march, &setup, None)?;
            // a run that is killed early can be resumed, too
            writer.write_checkpoint(&march)?;
        }
        // a search writes nothing on its way
        Some(resumed) if resumed.cut_off && (scene.steady.is_none() || resumed.step == 0) => {
            writer.write_due(&mut march, &setup, resumed.before(&options.out))?;
        }
        Some(_) => {}
    }
    let (ending, steady) = match &scene.steady {
        Some(settings) => {
            let search = steady::search(scene, settings, options, &mut march, &mut gauges, &mut writer, &mut progress)?;
            gauges.only_now(&march);
            (search.0, Some(search.1))
        }
        None => (
            step_to_the_end(scene, options, &mut march, &mut gauges, &mut writer, &setup, &mut progress, remarks)?,
            None,
        ),
    };
    keep(&mut writer, &gauges, &progress, remarks);
    let late = march.counts.accepted_late;
    if late > 0 {
        progress.say(&format!(
            "note: {late} of {} steps did not reach `coupling.tolerance` = {:e}, and were accepted below `coupling.accept` = {:e}",
            march.counts.steps, scene.coupling.tolerance, scene.coupling.accept
        ));
    }
    for note in strain::notes(&setup, &mut march) {
        progress.say(&format!("note: {note}"));
    }
    progress.finish();
    let errors = gauges.errors.take();
    (record.said, record.errors) = (progress.said(), errors);
    let residuals = march.residuals().ok();
    let (mut ending, mut taken) = (ending, None);
    if !ending.is_failure() {
        match gauges.all(&mut march) {
            Ok(all) => taken = Some(all),
            Err(error) => ending = Ending::Failed { reason: error.to_string() },
        }
    }
    let Taken { values: measures, census } = taken.unwrap_or_else(|| gauges.finite(&march));
    writer.write_last(&mut march, &setup, ending.is_failure())?;
    if !(writer.left_out.is_empty() || ending.is_failure()) {
        // whoever resumes it gets them
        ending = Ending::Interrupted;
    }
    for name in &writer.left_out {
        progress.say(&format!(
            "note: the cut `{name}` is long, and not written of a run that was stopped; `--resume` does it"
        ));
    }
    writer.write_last_defects(&march, census)?;
    // a picture that cannot be drawn is no failure
    crate::results::curves::write_usual(&options.out).iter().for_each(|note| progress.say(note));
    record.said = progress.said();
    let mut summary =
        Summary::new(scene, &setup, &march, &writer, ending, residuals, measures, begin.elapsed(), counts_before);
    summary.steady = steady;
    summary.said = record.said.clone();
    summary.take_errors(errors.as_ref());
    summary.write(&options.out.join("summary.json"))?;
    Ok(summary)
}

/// Gathers what the next checkpoint takes along; the first `remarks` of what was said are the scene's.
fn keep(writer: &mut Writer, gauges: &Gauges, progress: &Progress, remarks: usize) {
    writer.kept.errors = gauges.errors;
    writer.kept.said = progress.said().split_off(remarks);
}

#[allow(clippy::too_many_arguments)]
fn step_to_the_end(
    scene: &Scene,
    options: &Options,
    march: &mut March,
    gauges: &mut Gauges,
    writer: &mut Writer,
    setup: &Setup,
    progress: &mut Progress,
    remarks: usize,
) -> Result<Ending, RunError> {
    let time = &scene.time;
    if march.t > time.end {
        progress
            .say(&format!("note: the run stands at t = {}, past its end {}: nothing is left to do", march.t, time.end));
    }
    if let Some(ending) = rests_already(scene, march)? {
        return Ok(ending);
    }
    loop {
        if march.t >= time.end * (1.0 - 1e-12) {
            return Ok(Ending::EndTime);
        }
        if time.max_steps.is_some_and(|most| march.counts.steps >= most) {
            return Ok(Ending::MaxSteps);
        }
        if options.interrupt.load(Ordering::Relaxed) {
            return Ok(Ending::Interrupted);
        }
        let before = march.t;
        let landing = writer.next_landing(before).fold(time.end, f64::min);
        let report = match march.advance(landing) {
            Ok(report) => report,
            Err(MarchError::Interrupted { .. }) => return Ok(Ending::Interrupted),
            Err(error) => return Ok(Ending::failed(scene, &error)),
        };
        // whatever fails after the step was accepted must not lose it
        let readings = match gauges.read(march, before) {
            Ok(readings) => readings,
            Err(error) => return Ok(Ending::Failed { reason: error.to_string() }),
        };
        // while the data still change, a state at rest is none
        let settled = march.t >= time.rests_from;
        let mut at_rest = false;
        if let (Some(bound), Some((_, rate))) = (time.stop_energy_rate, readings.energy) {
            march.quiet = if settled && rate.abs() < bound { march.quiet + 1 } else { 0 };
            at_rest = march.quiet >= QUIET_STEPS;
        }
        if !writer.kept.told && march.nominal_step() < 0.1 * time.control.step {
            writer.kept.told = true;
            progress.say(&format!(
                "note: after {} rejections Δt has fallen to {:.1e}; it grows again by a factor {} after {:.0} good steps; lower \
                 `time.growth_wait` to let it recover sooner",
                march.counts.rejected,
                march.nominal_step(),
                time.control.growth,
                (time.control.growth_wait * time.control.step / march.nominal_step()).ceil()
            ));
        }
        let residual = readings.residuals.as_ref().map(Residuals::total);
        writer.append_history(&report, &readings)?;
        keep(writer, gauges, progress, remarks);
        writer.write_due(march, setup, Some(before))?;
        progress.show(&Status {
            step: report.step,
            t: march.t,
            end: time.end,
            dt: report.dt,
            iterations: report.iterations,
            residual,
        });
        if settled && time.stop_residual.is_some_and(|bound| residual.is_some_and(|r| r < bound)) {
            return Ok(Ending::Stationary);
        }
        if at_rest {
            return Ok(Ending::EnergyAtRest);
        }
    }
}

/// Of a run that is resumed after it came to rest: another step would change what it has found.
fn rests_already(scene: &Scene, march: &mut March) -> Result<Option<Ending>, RunError> {
    if march.counts.steps == 0 || march.t < scene.time.rests_from {
        return Ok(None);
    }
    if let Some(bound) = scene.time.stop_residual
        && march.residuals()?.total() < bound
    {
        return Ok(Some(Ending::Stationary));
    }
    let at_rest = |bound: f64, march: &mut March| march.quiet >= QUIET_STEPS && march.energy().1.abs() < bound;
    Ok(scene.time.stop_energy_rate.is_some_and(|bound| at_rest(bound, march)).then_some(Ending::EnergyAtRest))
}

/// The checkpoint to go on from, where there is one to; the folder is there then.
fn checkpoint_of(scene: &Scene, options: &Options) -> Result<Option<Saved>, RunError> {
    let Some(checkpoint) = folder::prepare(options)? else { return Ok(None) };
    let saved = Saved::read(&checkpoint)?;
    match setup::first_difference(&saved.scene, &scene.resolved_toml()) {
        Some(key) => Err(RunError::OtherProblem { file: checkpoint.display().to_string(), key }),
        None => Ok(Some(saved)),
    }
}

impl Ending {
    fn failed(scene: &Scene, error: &MarchError) -> Self {
        let of_formula =
            matches!(error, MarchError::Failed { cause, .. } if matches!(**cause, StepFailure::Formula(_)));
        let suspect = if of_formula { None } else { extremes::of_scene(scene) };
        Ending::Failed { reason: extremes::hinted(error.to_string(), suspect) }
    }
}
