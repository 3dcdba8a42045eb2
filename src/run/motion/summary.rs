//! `summary.json` of moving bodies: the keys of a run of tissue as far as they have a meaning.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::time::Duration;

use serde::Serialize;

use super::{Plan, Totals};
use crate::mesh::quality::Quality;
use crate::model::TermStatus;
use crate::output::{OutputError, write_whole};
use crate::run::summary::{Ending, peak_memory_mib};
use crate::time::march::Counts;
use crate::time::phases::Phases;

/// Everything in `summary.json`.
#[derive(Debug, Clone, Serialize)]
pub struct MotionSummary {
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
    /// What lies under the flow.
    pub mesh: Mesh,
    /// How many numbers are solved for.
    pub unknowns: Unknowns,
    /// Number of bodies.
    pub bodies: usize,
    /// Walls beside those of the mesh.
    pub walls: usize,
    /// Totals over all steps.
    #[serde(flatten)]
    pub counts: Counts,
    /// Largest overlap of bodies with each other or with walls after any step, 0 without one; of pairs whose motion is
    /// given, too.
    pub largest_overlap: f64,
    /// Sparse factorisations of this process during the run.
    pub factorisations: usize,
    /// Solves with these factors.
    pub direct_solves: usize,
    /// At the end, by column.
    pub measures: BTreeMap<&'static str, f64>,
    /// Wall seconds by phase.
    pub seconds: BTreeMap<&'static str, f64>,
    /// Wall seconds of all.
    pub seconds_total: f64,
    /// Largest resident memory of the process, where the system tells.
    pub peak_memory_mib: Option<f64>,
    /// How many there were.
    pub threads: usize,
    /// Notes that were given, in order.
    pub said: Vec<String>,
    /// Of the program.
    pub version: &'static str,
}

/// The mesh of a flow; particles have none.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum Mesh {
    /// That of the flow.
    Flow(Box<Quality>),
    /// There is no flow.
    None {
        /// 0
        cells: usize,
    },
}

/// Unknowns by field, and of the linear system; of particles three per body.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Unknowns {
    /// Of v.
    pub velocity: usize,
    /// Of Π.
    pub pressure: usize,
    /// Of p; 0 in a Stokes flow.
    pub polarity: usize,
    /// Rows of the Stokes matrix.
    pub stokes_system: usize,
}

impl MotionSummary {
    #[allow(clippy::too_many_arguments)]
    pub(super) fn new(
        plan: &Plan,
        ending: Ending,
        time: f64,
        totals: Totals,
        measures: BTreeMap<&'static str, f64>,
        phases: &Phases,
        total: Duration,
        counts_before: [usize; 2],
        said: Vec<String>,
    ) -> Self {
        let [factorisations, direct_solves] = crate::solve::sparse::counts();
        let mut seconds = phases.seconds();
        seconds.insert("setup", plan.setup_seconds);
        let [velocity, pressure, stokes_system] = plan.unknowns;
        Self {
            title: plan.title.map(str::to_owned),
            status: ending.status(),
            ending,
            time,
            terms: plan.terms.clone(),
            mesh: plan.mesh.clone().map_or(Mesh::None { cells: 0 }, |quality| Mesh::Flow(Box::new(quality))),
            unknowns: Unknowns { velocity, pressure, polarity: 0, stokes_system },
            bodies: plan.bodies.len(),
            walls: plan.walls.len(),
            counts: totals.counts,
            largest_overlap: totals.overlap,
            factorisations: factorisations - counts_before[0],
            direct_solves: direct_solves - counts_before[1],
            measures,
            seconds,
            seconds_total: plan.setup_seconds + total.as_secs_f64(),
            peak_memory_mib: peak_memory_mib(),
            threads: rayon::current_num_threads(),
            said,
            version: env!("CARGO_PKG_VERSION"),
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

impl fmt::Display for MotionSummary {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = match &self.ending {
            Ending::EndTime => "the end time was reached",
            Ending::MaxSteps => "the largest number of steps was taken",
            Ending::Interrupted => "interrupted; `--resume` continues",
            Ending::Failed { .. } => "a step failed",
            Ending::Stationary | Ending::EnergyAtRest | Ending::Steady | Ending::Oscillating => "the run came to rest",
        };
        writeln!(
            out,
            "t = {} after {} steps ({} rejected): {end}",
            self.time, self.counts.steps, self.counts.rejected
        )?;
        let mean = self.counts.nonlinear_iterations as f64 / self.counts.steps.max(1) as f64;
        let bodies = if self.bodies == 1 { "1 body".to_owned() } else { format!("{} bodies", self.bodies) };
        writeln!(out, "{bodies}, {mean:.1} iterations of contact a step; {:.1} s in all", self.seconds_total)?;
        for (name, value) in &self.measures {
            match value.abs() {
                // six digits would make nothing of it
                size if size > 0.0 && size < 1e-3 => writeln!(out, "{name} = {value:.3e}")?,
                _ => writeln!(out, "{name} = {value:.6}")?,
            }
        }
        if self.largest_overlap > 0.0 {
            writeln!(out, "largest overlap {:.3e}, over all steps", self.largest_overlap)?;
        }
        let memory = self.peak_memory_mib.map_or_else(|| "unknown".into(), |m| format!("{m:.0} MiB"));
        write!(out, "peak memory {memory}")
    }
}
