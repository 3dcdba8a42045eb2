//! The run of a scene whose bodies move: particles, or bodies in a Stokes flow. One loop for both.

mod files;
pub(super) mod map_tools;
pub mod saved;
pub mod summary;
mod watch;

use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Instant;

use super::folder::{self, Resumed};
use super::maps::Source;
use super::unsaved::UnsavedWork;
use super::{Ending, Options, RunError, extremes};
use crate::body::Body;
use crate::contact::{Contact, Wall};
use crate::form::Integrator;
use crate::measure::list::{Bodies, Flow, Of, Taken};
use crate::measure::{Measure, MeasureError, bodies};
use crate::mesh::quality::Quality;
use crate::model::TermStatus;
use crate::output::bodies::Moment;
use crate::output::plot::map::Picture;
use crate::output::progress::{Progress, Status};
use crate::scene::{Field, MapRequest, Output, measured};
use crate::shape::Wrench;
use crate::shape::{Pose, Twist};
use crate::space;
use crate::time::march::Counts;
use crate::time::phases::Phases;

use files::Files;
use map_tools::MapTools;
use saved::SavedMotion;
pub use summary::MotionSummary;
use watch::{Overlaps, lost};

/// What a loop moves.
pub(super) trait Mover {
    /// One step from `t`, trimmed to land on `landing`. What fails changes nothing.
    ///
    /// # Errors
    /// The reason.
    fn advance(&mut self, t: f64, landing: f64) -> Result<Stride, String>;

    /// The state, for an exact restart.
    fn state(&self) -> Vec<u8>;

    /// One for each body.
    fn poses(&self) -> &[Pose];

    /// One for each body.
    fn twists(&self) -> &[Twist];

    /// Pairs that are close or touch, after the last step.
    fn contacts(&self) -> &[Contact];

    /// What holds the first body, where there is a flow that knows it.
    fn holding(&self) -> Option<Wrench>;

    /// The velocity and what flows, all that no body covers, where there is a flow.
    fn flow(&self) -> Option<(space::Field, Integrator)>;

    /// Writes fields as VTU, where there are some.
    ///
    /// # Errors
    /// A file that cannot be written, a field that is not finite.
    fn write_fields(&mut self, path: &Path, t: f64, fields: &[Field]) -> Result<(), RunError>;

    /// The flow, where there is one, to be shown by `then`.
    ///
    /// # Errors
    /// Those of `then`.
    fn show(&self, then: &mut dyn FnMut(&MapTools, Source) -> Result<(), RunError>) -> Result<(), RunError>;
}

/// A picture of the fields, with the bodies above them.
///
/// # Errors
/// As [`MapTools::draw`].
pub(super) fn draw(mover: &dyn Mover, moment: &Moment, request: &MapRequest) -> Result<Picture, RunError> {
    let mut picture = None;
    mover.show(&mut |map_tools, source| {
        picture = Some(map_tools.draw(source, moment, request)?);
        Ok(())
    })?;
    Ok(picture.expect("maps of fields are refused where there are none"))
}

/// The smallest and the largest value that the picture would show.
///
/// # Errors
/// As [`MapTools::extent`].
pub(super) fn extent(mover: &dyn Mover, moment: &Moment, request: &MapRequest) -> Result<[f64; 2], RunError> {
    let mut extent = None;
    mover.show(&mut |map_tools, source| {
        extent = Some(map_tools.extent(source, moment, request)?);
        Ok(())
    })?;
    Ok(extent.expect("maps of fields are refused where there are none"))
}

/// What a step took.
#[derive(Debug, Clone, Default)]
pub(super) struct Stride {
    /// Where it ended, and its length.
    pub t: f64,
    pub dt: f64,
    pub iterations: usize,
    /// Steps that were too long before it.
    pub rejected: usize,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// A note of a step that was too long.
pub(super) fn shortened(t: f64, dt: f64, why: &str) -> String {
    let why = why.split_once("; hint: ").map_or(why, |(why, _)| why);
    format!("steps are shortened, to {dt:.3e} before t = {t:.6}: {why}")
}

/// What a loop needs of a scene.
pub(super) struct Plan<'a> {
    pub title: Option<&'a str>,
    /// The scene's file, for messages.
    pub origin: &'a str,
    /// The resolved scene.
    pub text: String,
    pub end: f64,
    pub max_steps: Option<usize>,
    /// The value of the scene that is farthest outside of the usual.
    pub suspect: Option<String>,
    pub outputs: &'a [Output],
    pub bodies: &'a [Body],
    pub walls: Vec<Wall>,
    pub terms: Vec<TermStatus>,
    /// What a run should know and no error.
    pub remarks: Vec<String>,
    pub mesh: Option<Quality>,
    /// Of the mesh; 0 without one.
    pub fingerprint: u64,
    /// Of velocity, pressure, and the linear system.
    pub unknowns: [usize; 3],
    pub setup_seconds: f64,
}

/// The checkpoint to go on from, where there is one to; the folder is there then.
///
/// # Errors
/// As [`super::run`].
pub(super) fn prepare(text: &str, options: &Options) -> Result<Option<SavedMotion>, RunError> {
    let Some(checkpoint) = folder::prepare(options)? else { return Ok(None) };
    let saved = SavedMotion::read(&checkpoint)?;
    match super::setup::first_difference(&saved.scene, text) {
        Some(key) => Err(RunError::OtherProblem { file: checkpoint.display().to_string(), key }),
        None => Ok(Some(saved)),
    }
}

/// Moves until the end. A step that fails ends the run; the last good state is written like any other.
///
/// # Errors
/// Results that cannot be written or continued.
pub(super) fn run(
    plan: &Plan,
    mover: &mut dyn Mover,
    options: &Options,
    saved: Option<SavedMotion>,
) -> Result<MotionSummary, RunError> {
    let begin = Instant::now();
    let counts_before = crate::solve::sparse::counts();
    let resumed = saved.as_ref().map(|saved| Resumed::at(&options.out, saved.counts.steps, saved.t));
    let _unsaved = UnsavedWork::new();
    folder::write_scene(&options.out, &plan.text, saved.as_ref().map(|saved| saved.scene.as_str()))?;
    let mut t = saved.as_ref().map_or(0.0, |saved| saved.t);
    let mut totals = saved.as_ref().map_or_else(Totals::default, Totals::of);
    let mut files = Files::new(plan, &options.out, resumed)?;
    let mut phases = Phases::default();
    let mut progress = Progress::new(options.verbosity, t);
    plan.remarks.iter().for_each(|remark| progress.say(&format!("note: {remark}")));
    if saved.is_none() {
        phases.measure("output", || files.write_due(mover, t, 0, None))?;
        files.write_checkpoint(plan, mover, t, totals)?;
    }
    if let Some(resumed) = resumed.filter(|resumed| resumed.cut_off) {
        phases.measure("output", || files.write_due(mover, t, totals.counts.steps, resumed.before(&options.out)))?;
    }
    if t > plan.end {
        progress.say(&format!("note: the run stands at t = {t}, past its end {}: nothing is left to do", plan.end));
    }
    let mut overlaps = Overlaps::default();
    let failed = |reason: String| {
        let reason = extremes::hinted(reason, plan.suspect.clone());
        Ending::Failed { reason: format!("{}: {reason}", plan.origin) }
    };
    let ending = loop {
        if let Some(reason) = lost(plan.bodies, mover, t) {
            break failed(reason);
        }
        if t >= plan.end * (1.0 - 1e-12) {
            break Ending::EndTime;
        }
        if plan.max_steps.is_some_and(|most| totals.counts.steps >= most) {
            break Ending::MaxSteps;
        }
        if options.interrupt.load(Ordering::Relaxed) {
            break Ending::Interrupted;
        }
        let landings = plan.outputs.iter().filter_map(|output| output.schedule.next_time(t));
        let landing = landings.fold(plan.end, f64::min);
        let before = t;
        let stride = match phases.measure("steps", || mover.advance(t, landing)) {
            Ok(stride) => stride,
            Err(reason) => break failed(reason),
        };
        t = stride.t;
        totals.add(&stride, mover);
        stride
            .notes
            .iter()
            .chain(&overlaps.look(plan, mover, t))
            .for_each(|note| progress.say(&format!("note: {note}")));
        let (dt, iterations) = (stride.dt, stride.iterations);
        phases.measure("output", || {
            files.append_history(plan, mover, &Row { before, t, step: totals.counts.steps, stride })?;
            files.write_due(mover, t, totals.counts.steps, Some(before))?;
            files.write_checkpoint_if_due(plan, mover, (before, t), totals)
        })?;
        progress.show(&Status { step: totals.counts.steps, t, end: plan.end, dt, iterations, residual: None });
    };
    phases.measure("output", || {
        files.write_checkpoint(plan, mover, t, totals)?;
        files.write_last(mover, t, totals.counts.steps)
    })?;
    // a picture that cannot be drawn is no failure
    crate::results::curves::write_usual(&options.out).iter().for_each(|note| progress.say(note));
    progress.finish();
    overlaps.last().iter().for_each(|note| progress.say(&format!("note: {note}")));
    let mut taken = Taken::default();
    measured(plan.outputs).into_iter().try_for_each(|measure| take(measure, plan, mover, &mut taken))?;
    let mut measures = taken.values;
    measures.retain(|_, value| value.is_finite());
    let summary =
        MotionSummary::new(plan, ending, t, totals, measures, &phases, begin.elapsed(), counts_before, progress.said());
    summary.write(&options.out.join("summary.json"))?;
    Ok(summary)
}

/// Over all steps, resumed parts included.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Totals {
    pub counts: Counts,
    /// Largest overlap after a step, 0 without one.
    pub overlap: f64,
}

impl Totals {
    /// At a checkpoint.
    fn of(saved: &SavedMotion) -> Self {
        Self { counts: saved.counts, overlap: saved.overlap }
    }

    fn add(&mut self, stride: &Stride, mover: &dyn Mover) {
        self.counts.steps += 1;
        self.counts.nonlinear_iterations += stride.iterations;
        self.counts.rejected += stride.rejected;
        self.overlap = self.overlap.max(bodies::overlap(mover.contacts()));
    }
}

/// An accepted step.
struct Row {
    before: f64,
    t: f64,
    step: usize,
    stride: Stride,
}

/// Takes a measure at the current state.
///
/// # Errors
/// A measure that cannot be taken.
fn take(measure: &Measure, plan: &Plan, mover: &dyn Mover, taken: &mut Taken) -> Result<(), MeasureError> {
    match measure.of {
        Of::Flow(take) => match mover.flow() {
            Some((v, loops)) => take(&Flow { v: &v, loops: &loops }, taken),
            None => Ok(()),
        },
        Of::Bodies(_, take) => {
            let (poses, twists, contacts) = (mover.poses(), mover.twists(), mover.contacts());
            let holding = || Ok(mover.holding());
            take(&Bodies { bodies: plan.bodies, poses, twists, contacts, holding: &holding }, taken)
        }
        // refused with the scene
        Of::Tissue(..) | Of::Compressible(_) => Ok(()),
    }
}
