//! The one loop of a run: from its start or its checkpoint to its end, with all that it writes on the way.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::time::Instant;

use super::folder::{self, Resumed};
use super::measures::{Gauges, Readings};
use super::stepper::{Ground, Halt, Plan, Stepper, Stride, phases_of};
use super::summary::{Ending, Found, Summary};
use super::unsaved::UnsavedWork;
use super::watch::{Overlaps, lost};
use super::writer::Writer;
use super::{Options, Record, RunError, Totals, cuts, extremes, maps, steady, strain};
use crate::measure::bodies::overlap;
use crate::measure::errors::History;
use crate::measure::list::Taken;
use crate::model::Residuals;
use crate::output::checkpoint::Saved;
use crate::output::progress::{Progress, Status};
use crate::time::phases::Phases;

/// `|dF/dt|` must stay below its bound for so many steps: it vanishes at every extremum of an oscillation, too.
const QUIET_STEPS: usize = 10;

/// When a run began, and what had been factorised and solved in this process before.
#[derive(Debug, Clone, Copy)]
pub(super) struct Begin {
    pub at: Instant,
    pub counts: [usize; 2],
}

impl Begin {
    pub fn now() -> Self {
        Self { at: Instant::now(), counts: crate::solve::sparse::counts() }
    }
}

/// A run on its way.
pub(super) struct Course<'p> {
    pub plan: &'p Plan<'p>,
    pub options: &'p Options<'p>,
    pub gauges: Gauges<'p>,
    pub writer: Writer<'p>,
    pub progress: Progress,
    pub totals: Totals,
    pub t: f64,
    phases: Phases,
    overlaps: Overlaps,
    /// How many of the notes are the scene's.
    remarks: usize,
}

/// Moves until the end. A step that fails ends the run; the last good state is written like any other.
///
/// # Errors
/// Results that cannot be written or continued; measures that the domain does not have.
pub(super) fn run(
    (plan, begin): (&Plan, Begin),
    ground: Option<&Ground>,
    stepper: &mut dyn Stepper,
    options: &Options,
    saved: Option<&Saved>,
    record: &mut Record,
) -> Result<Summary, RunError> {
    let mut gauges = Gauges::new(plan, ground)?;
    gauges.errors = record.errors.take().or(plan.exact.as_ref().map(|_| History::default()));
    if let Some(saved) = saved {
        gauges.errors = gauges.errors.and(saved.kept.errors.clone());
    }
    let resumed = saved.map(|saved| Resumed::at(&options.out, saved.counts.steps, saved.t));
    if let Some(ground) = ground {
        maps::check_all_windows(plan.outputs, plan.source, &ground.mesh)?;
        cuts::check(plan.outputs, ground)?;
    }
    let _stake = UnsavedWork::new();
    folder::write_scene(&options.out, &plan.text, saved.map(|saved| saved.scene.as_str()))?;
    let writer = Writer::new(plan, ground, stepper, &options.out, resumed)?;
    let t = saved.map_or(0.0, |saved| saved.t);
    let mut course = Course {
        plan,
        options,
        gauges,
        writer,
        progress: Progress::new(options.verbosity, t),
        totals: saved.map_or_else(Totals::default, |saved| Totals { counts: saved.counts, overlap: saved.overlap }),
        t,
        phases: Phases::default(),
        overlaps: Overlaps::default(),
        remarks: 0,
    };
    course.totals.counts = stepper.counts().unwrap_or(course.totals.counts);
    course.set_out(stepper, saved, resumed)?;
    let (ending, search) = match plan.tissue.and_then(|scene| Some((scene, scene.steady.as_ref()?))) {
        Some((scene, settings)) => {
            let (ending, report) = steady::search(scene, settings, stepper, &mut course)?;
            (ending, Some(report))
        }
        None => (course.step_to_the_end(stepper)?, None),
    };
    let mut summary = course.arrive(stepper, ground, ending, begin, record)?;
    summary.steady = search;
    summary.write(&options.out.join("summary.json"))?;
    Ok(summary)
}

impl Course<'_> {
    /// Says what is to be said first, and writes what is due at the start or was cut off.
    fn set_out(
        &mut self,
        stepper: &mut dyn Stepper,
        saved: Option<&Saved>,
        resumed: Option<Resumed>,
    ) -> Result<(), RunError> {
        self.plan.remarks.iter().for_each(|remark| self.progress.say(&format!("note: {remark}")));
        self.remarks = self.progress.said().len();
        self.writer.kept = saved.map(|saved| saved.kept.clone()).unwrap_or_default();
        self.progress.recall(&self.writer.kept.said);
        let now = (self.t, self.totals.counts.steps);
        match resumed {
            None => {
                self.plan.said_of_start.iter().for_each(|remark| self.progress.say(&format!("note: {remark}")));
                self.keep();
                self.phases.measure("output", || self.writer.write_due(stepper, now, None))?;
                // a run that is killed early can be resumed, too
                self.writer.write_checkpoint(stepper, self.t, self.totals)
            }
            // a search writes nothing on its way
            Some(resumed) if resumed.cut_off && (!self.plan.is_search() || resumed.step == 0) => {
                let before = resumed.before(&self.options.out);
                self.phases.measure("output", || self.writer.write_due(stepper, now, before))
            }
            Some(_) => Ok(()),
        }
    }

    /// Gathers what the next checkpoint takes along.
    fn keep(&mut self) {
        self.writer.kept.errors = self.gauges.errors.clone();
        self.writer.kept.said = self.progress.said().split_off(self.remarks);
    }

    fn note(&self, text: &str) {
        self.progress.say(&format!("note: {text}"));
    }

    /// A failure, with the value of the scene that may be behind it.
    fn failed(&self, reason: String, blame: bool) -> Ending {
        let (origin, reason) =
            (self.plan.origin(), extremes::hinted(reason, self.plan.suspect.clone().filter(|_| blame)));
        // the march of a tissue names its step, and a formula's error the file itself
        let named = self.plan.tissue.is_some() || reason.contains(&format!("{origin}: "));
        let reason = if named { reason } else { format!("{origin}: {reason}") };
        Ending::Failed { reason }
    }

    fn step_to_the_end(&mut self, stepper: &mut dyn Stepper) -> Result<Ending, RunError> {
        let limits = self.plan.limits;
        if self.t > limits.end {
            let (t, end) = (self.t, limits.end);
            self.note(&format!("the run stands at t = {t}, past its end {end}: nothing is left to do"));
        }
        if let Some(ending) = self.rests_already(stepper)? {
            return Ok(ending);
        }
        loop {
            if let Some(reason) = self.lost(stepper)? {
                return Ok(self.failed(reason, true));
            }
            if self.t >= limits.end * (1.0 - 1e-12) {
                return Ok(Ending::EndTime);
            }
            if limits.max_steps.is_some_and(|most| self.totals.counts.steps >= most) {
                return Ok(Ending::MaxSteps);
            }
            if self.options.interrupt.load(Ordering::Relaxed) {
                return Ok(Ending::Interrupted);
            }
            let before = self.t;
            let landing = self.writer.next_landing(before).fold(limits.end, f64::min);
            let stride = match stepper.advance(before, landing) {
                Ok(stride) => stride,
                Err(Halt::Interrupted) => return Ok(Ending::Interrupted),
                Err(Halt::Failed { reason, blame }) => return Ok(self.failed(reason, blame)),
            };
            if let Some(ending) = self.take_in(stepper, before, &stride)? {
                return Ok(ending);
            }
        }
    }

    /// Measures, tells and writes a step that was taken; an ending if there is nothing more to come.
    fn take_in(&mut self, stepper: &mut dyn Stepper, before: f64, stride: &Stride) -> Result<Option<Ending>, RunError> {
        self.t = stride.t;
        self.count(stepper, stride)?;
        stride.notes.iter().for_each(|note| self.note(note));
        stride.left.iter().for_each(|gone| self.note(&gone.to_string()));
        self.writer.kept.left.extend_from_slice(&stride.left);
        // whatever fails after the step was accepted must not lose it
        let readings = match self.read(stepper, before) {
            Ok(readings) => readings,
            Err(error) => return Ok(Some(Ending::Failed { reason: error.to_string() })),
        };
        let at_rest = self.is_energy_at_rest(stepper, &readings);
        self.tell_of_short_steps(stepper);
        self.keep();
        let (step, counts) = (self.totals.counts.steps, (self.t, self.totals.counts.steps));
        let mut phases = std::mem::take(&mut self.phases);
        phases.measure("output", || {
            self.writer.append_history(step, stride, &readings)?;
            self.writer.write_due(stepper, counts, Some(before))?;
            self.writer.write_checkpoint_if_due(stepper, (before, self.t), self.totals)
        })?;
        self.phases = phases;
        let residual = readings.residuals.as_ref().map(Residuals::total);
        let (t, end) = (self.t, self.plan.limits.end);
        self.progress.show(&Status { step, t, end, dt: stride.dt, iterations: stride.iterations, residual });
        let is_below = |bound: f64| residual.is_some_and(|residual| residual < bound);
        if self.may_rest() && self.plan.limits.stop_residual.is_some_and(is_below) {
            return Ok(Some(Ending::Stationary));
        }
        Ok(at_rest.then_some(Ending::EnergyAtRest))
    }

    fn count(&mut self, stepper: &mut dyn Stepper, stride: &Stride) -> Result<(), RunError> {
        let counts = &mut self.totals.counts;
        counts.steps += 1;
        counts.nonlinear_iterations += stride.iterations;
        counts.rejected += stride.rejected;
        *counts = stepper.counts().unwrap_or(*counts);
        let mut note = None;
        stepper.look(&mut |view| {
            if let Some(bodies) = &view.bodies {
                self.totals.overlap = self.totals.overlap.max(overlap(bodies.contacts));
                note = self.overlaps.look(bodies, view.t);
            }
            Ok(())
        })?;
        note.iter().for_each(|note| self.note(note));
        Ok(())
    }

    fn read(&mut self, stepper: &mut dyn Stepper, before: f64) -> Result<Readings, RunError> {
        let (step, mut readings) = (self.totals.counts.steps, Readings::default());
        if self.gauges.has_work(before, self.t, step) {
            stepper.look(&mut |view| {
                readings = self.gauges.read(view, before, step)?;
                Ok(())
            })?;
        }
        Ok(readings)
    }

    /// The reason why a body is nowhere any more.
    fn lost(&self, stepper: &mut dyn Stepper) -> Result<Option<String>, RunError> {
        let mut reason = None;
        stepper.look(&mut |view| {
            reason = view.bodies.and_then(|bodies| lost(&bodies, view.t));
            Ok(())
        })?;
        Ok(reason)
    }

    /// Whether a state at rest is one: while the data still change, it is none.
    fn may_rest(&self) -> bool {
        self.t >= self.plan.limits.rests_from
    }

    /// Counts the steps of little change of the free energy, where they are asked for.
    fn is_energy_at_rest(&self, stepper: &mut dyn Stepper, readings: &Readings) -> bool {
        let (Some(bound), Some((_, rate))) = (self.plan.limits.stop_energy_rate, readings.energy) else { return false };
        let is_quiet = self.may_rest() && rate.abs() < bound;
        let mut at_rest = false;
        stepper.with_march(&mut |march| {
            march.quiet = if is_quiet { march.quiet + 1 } else { 0 };
            at_rest = march.quiet >= QUIET_STEPS;
        });
        at_rest
    }

    /// Of a run that is resumed after it came to rest: another step would change what it has found.
    fn rests_already(&self, stepper: &mut dyn Stepper) -> Result<Option<Ending>, RunError> {
        let limits = self.plan.limits;
        if self.totals.counts.steps == 0 || !self.may_rest() {
            return Ok(None);
        }
        let mut found = Ok(None);
        stepper.with_march(&mut |march| {
            found = (|| {
                if let Some(bound) = limits.stop_residual
                    && march.residuals()?.total() < bound
                {
                    return Ok(Some(Ending::Stationary));
                }
                let is_below = |bound: f64| march.quiet >= QUIET_STEPS && march.energy().1.abs() < bound;
                Ok(limits.stop_energy_rate.is_some_and(is_below).then_some(Ending::EnergyAtRest))
            })();
        });
        found
    }

    /// Says once that rejected steps have made the others short.
    fn tell_of_short_steps(&mut self, stepper: &mut dyn Stepper) {
        let Some(control) = self.plan.tissue.map(|scene| scene.time.control).filter(|_| !self.writer.kept.told) else {
            return;
        };
        let mut step = f64::INFINITY;
        stepper.with_march(&mut |march| step = march.nominal_step());
        if step < 0.1 * control.step {
            self.writer.kept.told = true;
            self.note(&format!(
                "after {} rejections Δt has fallen to {step:.1e}; it grows again by a factor {} after {:.0} good steps; \
                 lower `time.growth_wait` to let it recover sooner",
                self.totals.counts.rejected,
                control.growth,
                (control.growth_wait * control.step / step).ceil()
            ));
        }
    }

    /// Measures and writes the last state, and says what is to be said of it and of the way.
    fn arrive(
        mut self,
        stepper: &mut dyn Stepper,
        ground: Option<&Ground>,
        mut ending: Ending,
        begin: Begin,
        record: &mut Record,
    ) -> Result<Summary, RunError> {
        self.t = self.time(stepper)?;
        self.totals.counts = stepper.counts().unwrap_or(self.totals.counts);
        if self.plan.is_search() {
            stepper.look(&mut |view| {
                self.gauges.only_now(view);
                Ok(())
            })?;
        }
        self.keep();
        let (mut taken, mut residuals, mut notes) = (Taken::default(), None, Vec::new());
        let mut wrenches = BTreeMap::new();
        let failed = ending.is_failure();
        stepper.look(&mut |view| {
            residuals = view.tissue.and_then(|now| now.model.residuals(now.state, view.t).ok());
            if let (Some(ground), Some(fields)) = (ground, view.fields) {
                notes = strain::notes(ground, fields, residuals.as_ref().map(Residuals::total))?;
            }
            wrenches = view.bodies.map_or_else(BTreeMap::new, |bodies| bodies.wrenches_by_name());
            taken = match self.gauges.all(view) {
                Ok(all) if !failed => all,
                Ok(_) => self.gauges.finite(view),
                Err(error) => {
                    if !failed {
                        ending = Ending::Failed { reason: error.to_string() };
                    }
                    self.gauges.finite(view)
                }
            };
            Ok(())
        })?;
        self.say_at_the_end(&notes);
        record.errors = self.gauges.errors.take();
        self.write_the_end(stepper, &mut ending, &mut taken)?;
        // a picture that cannot be drawn is no failure
        crate::results::curves::write_usual(&self.options.out).iter().for_each(|note| self.progress.say(note));
        record.said = self.progress.said();
        let mut phases = phases_of(stepper);
        [&self.phases, &self.gauges.phases].into_iter().for_each(|other| phases.add(other));
        taken.values.retain(|_, value| value.is_finite() || self.plan.tissue.is_some());
        let (measures, errors) = (taken.values, record.errors.clone());
        let left = self.writer.kept.left.clone();
        let found = Found { ending, time: self.t, residuals, measures, errors, wrenches, left };
        let mut summary = Summary::new(self.plan, ground, self.totals, found, &phases, begin);
        summary.said = record.said.clone();
        Ok(summary)
    }

    fn time(&self, stepper: &mut dyn Stepper) -> Result<f64, RunError> {
        let mut t = self.t;
        stepper.look(&mut |view| {
            t = view.t;
            Ok(())
        })?;
        Ok(t)
    }

    fn say_at_the_end(&mut self, notes: &[String]) {
        let counts = self.totals.counts;
        if let Some(scene) = self.plan.tissue.filter(|_| counts.accepted_late > 0) {
            self.note(&format!(
                "{} of {} steps did not reach `coupling.tolerance` = {:e}, and were accepted below `coupling.accept` = {:e}",
                counts.accepted_late, counts.steps, scene.coupling.tolerance, scene.coupling.accept
            ));
        }
        notes.iter().chain(&self.overlaps.last()).for_each(|note| self.note(note));
        self.progress.finish();
    }

    fn write_the_end(
        &mut self,
        stepper: &mut dyn Stepper,
        ending: &mut Ending,
        taken: &mut Taken,
    ) -> Result<(), RunError> {
        let now = (self.t, self.totals.counts.steps);
        let (failed, interrupt) = (ending.is_failure(), self.options.interrupt);
        let mut phases = std::mem::take(&mut self.phases);
        phases.measure("output", || {
            self.writer.write_checkpoint(stepper, self.t, self.totals)?;
            self.writer.write_last(stepper, now, failed, &|| interrupt.load(Ordering::Relaxed))
        })?;
        self.phases = phases;
        if !(self.writer.left_out.is_empty() || failed) {
            // whoever resumes it gets them
            *ending = Ending::Interrupted;
        }
        for name in &self.writer.left_out {
            self.note(&format!(
                "the cut `{name}` is long, and not written of a run that was stopped; `--resume` does it"
            ));
        }
        self.writer.write_last_defects(now, taken.census.take())
    }
}
