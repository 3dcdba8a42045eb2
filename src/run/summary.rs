//! `summary.json`: what was solved, how it ended, what it cost, what was found.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::Totals;
use super::estimate::{self, Estimated};
use super::steady::SteadyReport;
use super::stepper::{Ground, Plan};
use super::stepping::Begin;
use crate::body::leaving::Departure;
use crate::measure::Strain;
use crate::measure::errors::{History, Norm};
use crate::mesh::quality::Quality;
use crate::model::Residuals;
use crate::model::TermStatus;
use crate::output::{OutputError, write_whole};
use crate::time::march::Counts;
use crate::time::phases::Phases;

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "ending", rename_all = "kebab-case")]
pub enum Ending {
    /// `time.end` was reached.
    EndTime,
    /// `time.max_steps` were taken.
    MaxSteps,
    /// The residual of the stationary equations fell below `time.stop.residual`.
    Stationary,
    /// `|dF/dt|` stayed below `time.stop.energy_rate`.
    EnergyAtRest,
    /// A steady state was found.
    Steady,
    /// No stable steady state, but a flow that repeats itself.
    Oscillating,
    /// Stopped from outside; the checkpoint continues it.
    Interrupted,
    /// A step failed; the last good state was written.
    Failed {
        /// What went wrong, with a hint.
        reason: String,
    },
}

impl Ending {
    /// Whether a step failed.
    pub fn is_failure(&self) -> bool {
        matches!(self, Ending::Failed { .. })
    }

    /// As in `summary.json`.
    pub fn name(&self) -> &'static str {
        match self {
            Ending::EndTime => "end-time",
            Ending::MaxSteps => "max-steps",
            Ending::Stationary => "stationary",
            Ending::EnergyAtRest => "energy-at-rest",
            Ending::Steady => "steady",
            Ending::Oscillating => "oscillating",
            Ending::Interrupted => "interrupted",
            Ending::Failed { .. } => "failed",
        }
    }

    pub(super) fn status(&self) -> &'static str {
        match self {
            Ending::EndTime | Ending::MaxSteps | Ending::Stationary | Ending::EnergyAtRest => "finished",
            Ending::Steady | Ending::Oscillating => "finished",
            Ending::Interrupted => "interrupted",
            Ending::Failed { .. } => "failed",
        }
    }
}

/// Unknowns by field, and of the linear systems.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Unknowns {
    /// Of each field, by its name.
    #[serde(flatten)]
    pub fields: BTreeMap<&'static str, usize>,
    /// Of the linear system of the flow, boundary conditions removed; of particles three per body.
    pub stokes_system: usize,
    /// Of ψ, where it was computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stream_function: Option<usize>,
    /// Of the strain, where it was computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub elastic_strain: Option<usize>,
}

/// The mesh of a flow; particles have none.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum MeshFacts {
    /// The sizes of its mesh.
    Flow(Box<Quality>),
    /// Without a mesh.
    None {
        /// Always 0.
        cells: usize,
    },
}

impl MeshFacts {
    /// How many cells there are.
    pub fn cells(&self) -> usize {
        match self {
            MeshFacts::Flow(quality) => quality.cells,
            MeshFacts::None { cells } => *cells,
        }
    }
}

/// What is told of rigid bodies that move.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodyFacts {
    /// Number of bodies.
    pub bodies: usize,
    /// Number of walls.
    pub walls: usize,
    /// Largest overlap of bodies with each other or with walls after any step, 0 without one; of pairs whose motion is
    /// given, too.
    pub largest_overlap: f64,
    /// Forces and torques of a Stokes flow on the bodies at the end, by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub wrenches: BTreeMap<String, [f64; 3]>,
    /// Those that have left the mesh on the way, in order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left: Vec<Departure>,
}

/// What a run has come to.
pub(super) struct Found {
    pub ending: Ending,
    /// That was reached.
    pub time: f64,
    pub residuals: Option<Residuals>,
    pub measures: BTreeMap<&'static str, f64>,
    pub errors: Option<History>,
    /// Of a Stokes flow on its bodies, by name.
    pub wrenches: BTreeMap<String, [f64; 3]>,
    /// Bodies that have left.
    pub left: Vec<Departure>,
}

/// Everything in `summary.json`.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// One line for reports.
    pub title: Option<String>,
    /// How the run ended, in a word.
    pub status: &'static str,
    /// How the run ended, and why.
    #[serde(flatten)]
    pub ending: Ending,
    /// Time that was reached.
    pub time: f64,
    /// The terms of the equations, on and off.
    pub terms: Vec<TermStatus>,
    /// Sizes and worst cells.
    pub mesh: MeshFacts,
    /// How many numbers are solved for.
    pub unknowns: Unknowns,
    /// Of rigid bodies, where something moves.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub bodies: Option<BodyFacts>,
    /// Totals over all steps.
    #[serde(flatten)]
    pub counts: Counts,
    /// Sparse factorisations of this process during the run: Stokes, masses, stream function; a polarity matrix only
    /// where its Krylov iteration stalled.
    pub factorisations: usize,
    /// Solves with these factors.
    pub direct_solves: usize,
    /// Residuals of the stationary equations at the last state.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residuals: Option<Residuals>,
    #[serde(skip_serializing_if = "Option::is_none")]
    /// Of the stationary equations at the end, where it was taken.
    pub residual: Option<f64>,
    /// At the end, by column.
    pub measures: BTreeMap<&'static str, f64>,
    /// Of the measures' discretisation errors, where the scene asks for them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimates: Option<BTreeMap<&'static str, f64>>,
    /// Errors of the measures, where they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimated: Option<Estimated>,
    /// Why there are no estimates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_estimated: Option<String>,
    /// Whether the estimates are still to come: in the file while they are made, and where that was interrupted.
    #[serde(skip_serializing_if = "is_false")]
    pub estimates_pending: bool,
    /// By field and norm, against the exact fields over all steps   [9.12]
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub errors: BTreeMap<&'static str, BTreeMap<&'static str, f64>>,
    /// What a search for a steady state found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steady: Option<SteadyReport>,
    /// Wall seconds by phase.
    pub seconds: BTreeMap<&'static str, f64>,
    /// Wall seconds of all.
    pub seconds_total: f64,
    /// Wall seconds of one iteration of the coupling, on average.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds_per_iteration: Option<f64>,
    /// Largest resident memory of the process, where the system tells.
    pub peak_memory_mib: Option<f64>,
    /// How many there were.
    pub threads: usize,
    /// Notes that were given, in order.
    pub said: Vec<String>,
    /// Of the program.
    pub version: &'static str,
}

#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_false(flag: &bool) -> bool {
    !flag
}

/// Phases that belong to an iteration of the coupling.
const ITERATION: [&str; 5] = ["force", "stokes", "polarity assembly", "polarity factors", "polarity solve"];

impl Summary {
    pub(super) fn new(
        plan: &Plan,
        ground: Option<&Ground>,
        totals: Totals,
        found: Found,
        phases: &Phases,
        begin: Begin,
    ) -> Self {
        let [factorisations, direct_solves] = crate::solve::sparse::counts();
        let mut seconds = phases.seconds();
        seconds.insert("setup", plan.setup_seconds);
        let inner: f64 = ITERATION.iter().filter_map(|name| seconds.get(name)).sum();
        // every iteration computes the force once, those of rejected steps as well
        let here = phases.calls("force");
        let Found { ending, time, residuals, measures, errors, wrenches, left } = found;
        let mut summary = Self {
            title: plan.title.map(str::to_owned),
            status: ending.status(),
            estimates_pending: plan.tissue.is_some_and(|scene| estimate::is_pending(scene, &ending)),
            ending,
            time,
            terms: plan.terms.clone(),
            mesh: ground.map_or(MeshFacts::None { cells: 0 }, |g| MeshFacts::Flow(Box::new(g.quality.clone()))),
            unknowns: Unknowns {
                stream_function: ground.and_then(|ground| ground.tools.stream_unknowns()),
                elastic_strain: ground.and_then(|ground| ground.tools.strain.as_ref()).map(Strain::unknowns),
                ..plan.unknowns.clone()
            },
            bodies: plan.tells_of_bodies.then_some(BodyFacts {
                bodies: plan.bodies.len(),
                walls: plan.walls.len(),
                largest_overlap: totals.overlap,
                wrenches,
                left,
            }),
            counts: totals.counts,
            factorisations: factorisations - begin.counts[0],
            direct_solves: direct_solves - begin.counts[1],
            residual: residuals.as_ref().map(Residuals::total),
            residuals,
            measures,
            estimates: None,
            estimated: None,
            not_estimated: None,
            errors: BTreeMap::new(),
            steady: None,
            seconds,
            seconds_total: begin.at.elapsed().as_secs_f64(),
            seconds_per_iteration: (here > 0).then(|| inner / here as f64),
            peak_memory_mib: peak_memory_mib(),
            threads: rayon::current_num_threads(),
            said: Vec::new(),
            version: env!("CARGO_PKG_VERSION"),
        };
        summary.take_errors(errors.as_ref());
        summary
    }

    /// Takes the errors against exact fields over; without a step there are none.
    pub(super) fn take_errors(&mut self, errors: Option<&History>) {
        let Some(history) = errors.filter(|_| self.counts.steps > 0) else { return };
        for field in history.fields() {
            let by_norm = Norm::of(field).map(|norm| (norm.name(), history.error(field, norm)));
            self.errors.insert(field.name, by_norm.collect());
        }
    }

    /// Writes the file.
    ///
    /// # Errors
    /// [`OutputError::Io`]
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        write_whole(path, |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            writeln!(file)
        })
    }
}

/// Peak resident memory as Linux reports it.
pub(super) fn peak_memory_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kib| kib / 1024.0)
}

/// So many bodies that have left are told of at the end.
const MOST_LEFT: usize = 10;

/// Seconds in a unit that leaves digits: `2.1 s`, `35 ms`, `0.46 ms`.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s >= 1.0 => format!("{s:.1} s"),
        s if s >= 0.01 => format!("{:.0} ms", 1e3 * s),
        s => format!("{:.2} ms", 1e3 * s),
    }
}

impl std::fmt::Display for Summary {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let end = match &self.ending {
            Ending::EndTime => "the end time was reached",
            Ending::MaxSteps => "the largest number of steps was taken",
            Ending::Stationary => {
                "the residual fell below its bound: the state is stationary; whether it is stable, `--steady` finds out"
            }
            Ending::EnergyAtRest => "the free energy came to rest",
            Ending::Steady => "a steady state was found",
            Ending::Oscillating => "the flow oscillates",
            Ending::Interrupted => "interrupted; `--resume` continues",
            Ending::Failed { .. } => "a step failed",
        };
        let Counts { steps, rejected, .. } = self.counts;
        if self.steady.is_some() {
            // a search does not march: its steps end at no time, and solve for everything at once
            writeln!(out, "{steps} steps of the search: {end}; {:.1} s in all", self.seconds_total)?;
        } else {
            writeln!(out, "t = {} after {steps} steps ({rejected} rejected): {end}", self.time)?;
            let mean = self.counts.nonlinear_iterations as f64 / steps.max(1) as f64;
            let each = self.seconds_per_iteration.map_or_else(String::new, |s| format!(", {} each", duration(s)));
            let (bodies, of) = match &self.bodies {
                Some(BodyFacts { bodies: 1, .. }) => ("1 body, ".to_owned(), " of contact"),
                Some(BodyFacts { bodies, .. }) => (format!("{bodies} bodies, "), " of contact"),
                None => (String::new(), ""),
            };
            let of = if self.seconds_per_iteration.is_some() { "" } else { of };
            writeln!(out, "{bodies}{mean:.1} iterations{of} a step{each}; {:.1} s in all", self.seconds_total)?;
        }
        if let Some(residual) = self.residual {
            writeln!(out, "residual of the stationary equations {residual:.3e}")?;
        }
        if let Some(steady) = &self.steady {
            writeln!(out, "{steady}")?;
        }
        for (name, value) in &self.measures {
            match value.abs() {
                // six digits would make nothing of it
                size if size > 0.0 && size < 1e-3 => write!(out, "{name} = {value:.3e}")?,
                _ => write!(out, "{name} = {value:.6}")?,
            }
            match self.estimates.as_ref().and_then(|errors| errors.get(name)) {
                Some(error) => writeln!(out, " ± {error:.1e}")?,
                None => writeln!(out)?,
            }
        }
        if let Some(overlap) = self.bodies.as_ref().map(|facts| facts.largest_overlap).filter(|overlap| *overlap > 0.0)
        {
            writeln!(out, "largest overlap {overlap:.3e}, over all steps")?;
        }
        let left = self.bodies.as_ref().map_or(&[][..], |facts| &facts.left);
        left.iter().take(MOST_LEFT).try_for_each(|gone| writeln!(out, "{gone}"))?;
        if left.len() > MOST_LEFT {
            writeln!(out, "{} more bodies have left; summary.json has them all", left.len() - MOST_LEFT)?;
        }
        let memory = self.peak_memory_mib.map_or_else(|| "unknown".into(), |m| format!("{m:.0} MiB"));
        write!(out, "peak memory {memory}")
    }
}
