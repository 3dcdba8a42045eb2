//! A scene's search for a steady state: its rows in the history, and what the summary says of it.

use std::fmt;

use serde::Serialize;

use super::kinds::sheet::show;
use super::measures::Readings;
use super::stepper::{Coupled, Stepper, Stride};
use super::stepping::Course;
use super::summary::Ending;
use super::{RunError, extremes};
use crate::output::progress::Status;
use crate::scene::Scene;
use crate::steady::spectrum::Disc;
use crate::steady::{
    Event, Found, Oscillation, PseudoStep, Search, SearchSettings, Spectrum, Stability, Stall, Steady, SteadySettings,
    Try, Want, find,
};
use crate::time::{March, StepReport};

/// What the summary says of a search.
#[derive(Debug, Clone, Serialize)]
pub struct SteadyReport {
    /// Of the steady state that was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stability: Option<Stability>,
    /// Leading eigenvalues of its linearisation, largest growth rate first; of a pair the one above the real axis.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub eigenvalues: Vec<Eigenvalue>,
    /// Where all eigenvalues were found.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub searched: Vec<Disc>,
    /// Dimension of the space of growing disturbances.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unstable_dimension: Option<usize>,
    /// Where the flow repeats itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub oscillation: Option<Oscillation>,
    /// What was tried, in order.
    pub tries: Vec<Try>,
}

/// An eigenvalue `λ` of the linearisation: disturbances behave like `e^{λt}`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Eigenvalue {
    /// Growth rate.
    pub re: f64,
    /// Angular frequency.
    pub im: f64,
    /// Relative residual of the eigenpair.
    pub residual: f64,
}

/// Searches from the state of a march and leaves there what was found.
///
/// # Errors
/// Rows that cannot be written; a momentum balance or a formula that fails.
///
/// # Panics
/// Where there is no march to search from: such scenes are refused.
pub(super) fn search(
    scene: &Scene,
    settings: &SteadySettings,
    stepper: &mut dyn Stepper,
    course: &mut Course,
) -> Result<(Ending, SteadyReport), RunError> {
    let mut result = None;
    stepper.with_march(&mut |march| result = Some(search_from(scene, settings, march, course)));
    result.expect("a scene with a search has a march")
}

fn search_from(
    scene: &Scene,
    settings: &SteadySettings,
    march: &mut March,
    course: &mut Course,
) -> Result<(Ending, SteadyReport), RunError> {
    let model = march.model;
    let (start, mut rows) = (march.state.carried(), march.counts.steps);
    let mut phases = std::mem::take(&mut march.phases);
    let mut broken: Option<RunError> = None;
    let interrupt = course.options.interrupt;
    let mut seen = |event: Event| {
        let (stride, readings) = match event {
            Event::Note(text) => {
                course.progress.say(&format!("note: {text}"));
                return Ok(());
            }
            Event::Pseudo(step, _) => {
                course.progress.show_search(step.step, step.dt, step.residual, settings.residual);
                (stride_of(step), Ok(Readings::of_residual(step.residual)))
            }
            Event::Step(report, other) => {
                let readings = read(course, report, other);
                let residual = readings.as_ref().ok().and_then(|r| r.value("residual"));
                let (step, iterations) = (report.step, report.iterations);
                let status = Status { step, t: report.t, end: settings.march, dt: report.dt, iterations, residual };
                course.progress.show(&status);
                (Stride::from(report.clone()), readings)
            }
        };
        rows += 1;
        let written = readings.and_then(|readings| course.writer.append_history(rows, &stride, &readings));
        written.map_err(|error| {
            broken = Some(error);
            Stall::Interrupted
        })
    };
    let search = SearchSettings { steady: *settings, marching: scene.march() };
    let outcome = find(model, start, &search, interrupt, &mut phases, &mut seen);
    march.phases.add(&phases);
    if let Some(error) = broken {
        return Err(error);
    }
    let progress = &course.progress;
    let search = outcome
        .map_err(|stall| RunError::Steady { origin: scene.source().origin().to_owned(), reason: stall.to_string() })?;
    let report = SteadyReport::new(&search);
    let ending = ending_of(scene, &search);
    let state = match search.found {
        Found::Steady(steady) => steady.state,
        Found::Oscillating { .. } | Found::Nothing | Found::Interrupted => {
            model.state_of(&search.last, march.t).map_err(|e| RunError::begin(scene.source().origin(), e))?
        }
    };
    march.adopt(state, rows);
    if let (Some(Stability::Unstable), Want::Stable) = (report.stability, settings.want) {
        progress.say("note: the state is unstable; no stable one was found");
    }
    Ok((ending, report))
}

fn ending_of(scene: &Scene, search: &Search) -> Ending {
    match &search.found {
        Found::Steady(_) => Ending::Steady,
        Found::Oscillating { .. } => Ending::Oscillating,
        Found::Interrupted => Ending::Interrupted,
        Found::Nothing => {
            let tries: Vec<String> = search.tries.iter().map(|t| format!("{}: {}", t.way.name(), t.outcome)).collect();
            let reason = format!("no steady state was found; {}", tries.join("; "));
            // tries have hints of their own
            let suspect = extremes::of_scene(scene).map_or_else(String::new, |suspect| format!("; hint: {suspect}"));
            Ending::Failed { reason: format!("{reason}{suspect}") }
        }
    }
}

/// Measures what is due after a step of a march on the way of a search.
fn read(course: &mut Course, report: &StepReport, march: &March) -> Result<Readings, RunError> {
    let (before, mut readings) = (report.t - report.dt, Readings::default());
    show(march, &mut |view| {
        readings = course.gauges.read(view, before, report.step)?;
        Ok(())
    })?;
    Ok(readings)
}

/// A pseudo-step as a row of the history.
fn stride_of(step: &PseudoStep) -> Stride {
    let coupled = Some(Coupled { order: 1, increment: step.change, rate: f64::INFINITY });
    let PseudoStep { t, dt, products: iterations, rejected, .. } = *step;
    Stride { t, dt, iterations, rejected, coupled, notes: Vec::new(), left: Vec::new() }
}

impl SteadyReport {
    fn new(search: &Search) -> Self {
        let (steady, oscillation): (Option<&Steady>, _) = match &search.found {
            Found::Steady(steady) => (Some(steady), None),
            Found::Oscillating { oscillation, about } => (about.as_deref(), Some(*oscillation)),
            Found::Nothing | Found::Interrupted => (None, None),
        };
        let spectrum = steady.and_then(|s| s.spectrum.as_ref());
        let stability = steady.map(|_| spectrum.map_or(Stability::NotKnown, Spectrum::stability));
        let eigenvalue =
            |m: &crate::steady::spectrum::Mode| Eigenvalue { re: m.value.re, im: m.value.im, residual: m.residual };
        Self {
            stability,
            eigenvalues: spectrum.map(|s| s.modes.iter().map(eigenvalue).collect()).unwrap_or_default(),
            searched: spectrum.map(|s| s.searched.clone()).unwrap_or_default(),
            unstable_dimension: spectrum.map(Spectrum::unstable_dimension),
            oscillation,
            tries: search.tries.clone(),
        }
    }
}

impl SteadyReport {
    /// Growth rate and frequency of the leading mode; period and amplitudes of an oscillation.
    pub fn numbers(&self) -> Vec<(&'static str, f64)> {
        let leading = self.eigenvalues.first().map(|e| [("growth", e.re), ("frequency", e.im)]);
        let cycle = self.oscillation.map(|o| {
            [("period", o.period), ("amplitude_polarity", o.amplitude), ("amplitude_velocity", o.amplitude_velocity)]
        });
        leading.into_iter().flatten().chain(cycle.into_iter().flatten()).collect()
    }
}

impl fmt::Display for SteadyReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, attempt) in self.tries.iter().enumerate() {
            let start = if k == 0 { "" } else { "\n" };
            write!(out, "{start}{}: {} after {} steps", attempt.way.name(), attempt.outcome, attempt.steps)?;
        }
        if let Some(o) = &self.oscillation {
            write!(
                out,
                "\nperiod {:.4}, amplitude {:.3e} of the polarity and {:.3e} of the velocity (root mean square; cycles agree to {:.1} \
                 percent)",
                o.period,
                o.amplitude,
                o.amplitude_velocity,
                100.0 * o.spread
            )?;
        }
        match self.stability {
            None => {}
            Some(Stability::Stable) => write!(out, "\nstable: every disturbance decays")?,
            Some(Stability::Unstable) => {
                write!(out, "\nunstable: {} independent disturbances grow", self.unstable_dimension.unwrap_or(0))?;
            }
            Some(Stability::NotKnown) => write!(out, "\nstability not known")?,
        }
        for (k, e) in self.eigenvalues.iter().take(SHOWN).enumerate() {
            let head = if k == 0 { "\nleading eigenvalues" } else { "," };
            let im = if e.im == 0.0 { String::new() } else { format!(" ± {:.5} i", e.im) };
            write!(out, "{head} {:.5}{im}", e.re)?;
        }
        Ok(())
    }
}

/// Eigenvalues that are printed; all are in the summary's file.
const SHOWN: usize = 3;
