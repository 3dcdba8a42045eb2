//! A sweep: one scene with many values, each run in a folder of its own, all of them in one table.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use super::results::Row;
use super::sweep_file::{Case, SweepStudy};
use super::{StudyError, results, richardson, table};
use crate::measure::errors::History;
use crate::output::progress::Verbosity;
use crate::run::{Ending, Options, Record, RunError, Summary, run_recorded};

/// What became of a run.
#[derive(Debug)]
pub enum Found {
    /// It began; its ending is in the summary.
    Ran { summary: Box<Summary>, errors: Option<History> },
    /// Its scene cannot be run, or its results cannot be written: the reason.
    Refused(String),
}

impl Found {
    /// Whether it went as it should.
    pub fn is_good(&self) -> bool {
        match self {
            Found::Ran { summary, .. } => !summary.ending.is_failure(),
            Found::Refused(_) => false,
        }
    }

    /// Why it did not.
    pub fn reason(&self) -> Option<&str> {
        match self {
            Found::Ran { summary, .. } => {
                if let Ending::Failed { reason } = &summary.ending {
                    Some(reason)
                } else {
                    None
                }
            }
            Found::Refused(reason) => Some(reason),
        }
    }
}

/// The runs of a sweep so far.
#[derive(Debug)]
pub struct Sweep {
    pub rows: Vec<Row>,
    /// Whether somebody stopped it.
    pub interrupted: bool,
}

/// Runs every case into its folder below `out`; the table is written after each of them. A run that fails, or whose scene is
/// refused, is a row like any other.
///
/// # Errors
/// A folder that holds results already, a table that cannot be written.
pub fn run(study: &SweepStudy, out: &Path, verbosity: Verbosity, interrupt: &AtomicBool) -> Result<Sweep, StudyError> {
    table::refuse_occupied(out)?;
    table::write_study(&study.text(), out)?;
    let mut sweep = Sweep { rows: Vec::new(), interrupted: false };
    for (at, case) in study.cases.iter().enumerate() {
        let row = run_case(study, at, out, verbosity, interrupt);
        if verbosity > Verbosity::Quiet {
            eprintln!("{}", told(case, &row));
        }
        sweep.rows.push(row);
        results::write(study, &sweep.rows, &out.join("results.csv"))?;
        richardson::write(study, &sweep.rows, &out.join("richardson.csv"))?;
        sweep.interrupted = interrupt.load(Ordering::Relaxed);
        if sweep.interrupted {
            break;
        }
    }
    Ok(sweep)
}

fn run_case(study: &SweepStudy, at: usize, out: &Path, verbosity: Verbosity, interrupt: &AtomicBool) -> Row {
    let folder = out.join(&study.cases[at].folder);
    let begin = std::time::Instant::now();
    let mut record = Record::default();
    let ran = study.scene_of(at).and_then(|scene| {
        record.errors = scene.sources.exact.as_ref().map(|_| History::default());
        let options = Options { out: folder, resume: false, verbosity, interrupt };
        run_recorded(&scene, &options, &mut record).map_err(|error: RunError| error.into())
    });
    let found = match ran {
        Ok(summary) => {
            let took_steps = summary.counts.steps > 0;
            Found::Ran { summary: Box::new(summary), errors: record.errors.filter(|_| took_steps) }
        }
        Err(error) => Found::Refused(error.to_string()),
    };
    Row { case: study.cases[at].clone(), found, said: record.said, seconds: begin.elapsed().as_secs_f64() }
}

/// One line about a run.
fn told(case: &Case, row: &Row) -> String {
    let set: Vec<String> = case.set.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    let ending = match &row.found {
        Found::Ran { summary, .. } => {
            let reason = row.found.reason().map_or_else(String::new, |reason| format!(": {reason}"));
            let counts = &summary.counts;
            format!(
                "{}, t = {}, {} steps, {} rejected{reason}",
                summary.status, summary.time, counts.steps, counts.rejected
            )
        }
        Found::Refused(reason) => format!("refused: {reason}"),
    };
    format!("{}  {}  {ending}; {:.1} s", case.folder, set.join(", "), row.seconds)
}
