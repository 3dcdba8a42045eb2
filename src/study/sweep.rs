//! A sweep: one scene with many values, each run in a folder of its own, all of them in one table.
//!
//! Everything that is known of a run lies in its folder, so that a table is the same whether its runs were done at
//! once, in parallel, in shards, or after any number of interruptions.

use std::collections::VecDeque;
use std::path::Path;
use std::str::FromStr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use super::memory_gate::MemoryGate;
use super::results::Row;
use super::run_launcher::{RunLauncher, clear};
use super::sweep_file::SweepStudy;
use super::work::{Work, held};
use super::{StudyError, figures, results, richardson, table};
use crate::output::OutputError;
use crate::output::lock::{self, Room};
use crate::output::progress::Verbosity;
use crate::run::available::available;
use crate::run::setup::differing;
use crate::run::unsaved::UnsavedWork;
use crate::scene::renamed;

/// What a caller decides about a sweep.
#[derive(Debug)]
pub struct Settings<'a> {
    /// Runs are processes of this program; without one they are done in this process, one after the other.
    pub program: Option<&'a Path>,
    /// Runs at a time; as many as there are cores if it is not given.
    pub jobs: Option<usize>,
    /// Cores that all runs share.
    pub cores: usize,
    /// Which part of the runs; all without one.
    pub shard: Option<Shard>,
    /// Whether it is an error when there is nothing to resume.
    pub must_resume: bool,
    /// Whether runs that failed or were refused are done again.
    pub retry_failed: bool,
    /// How much is said.
    pub verbosity: Verbosity,
    /// Set from outside to end it cleanly.
    pub interrupt: &'a AtomicBool,
}

impl<'a> Settings<'a> {
    /// One run after the other in this process.
    pub fn here(verbosity: Verbosity, interrupt: &'a AtomicBool) -> Self {
        let (program, jobs, cores, shard) = (None, Some(1), 1, None);
        Self { program, jobs, cores, shard, must_resume: false, retry_failed: false, verbosity, interrupt }
    }
}

/// Every `of`-th unit of a sweep, from number `number`, which counts from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    pub number: usize,
    /// How many shards there are.
    pub of: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
        match parts {
            Some((number, of)) if 1 <= number && number <= of => Ok(Self { number, of }),
            Some(_) | None => {
                Err("must be I/N with 1 ≤ I ≤ N; hint: --shard 1/4 to --shard 4/4 are all runs".to_owned())
            }
        }
    }
}

/// The runs of a sweep so far.
#[derive(Debug)]
pub struct Sweep {
    /// In the order of the study.
    pub rows: Vec<Row>,
    /// Folders of runs that have no row yet, or are not complete.
    pub missing: Vec<String>,
    /// Whether somebody stopped it.
    pub interrupted: bool,
}

/// Does every run that is not done yet in its folder below `out`; the table is written after each of them. A run that
/// fails, or whose scene is refused, is a row like any other.
///
/// # Errors
/// A folder that holds something else, a table that cannot be written.
pub fn run(study: &SweepStudy, out: &Path, settings: &Settings) -> Result<Sweep, StudyError> {
    prepare(study, out, settings)?;
    let _unsaved = UnsavedWork::new();
    let units = shard_of(study.units(), settings.shard);
    let mine: Vec<usize> = units.iter().flatten().copied().collect();
    let mut rows: Vec<Option<Row>> = vec![None; study.cases.len()];
    for &at in &mine {
        rows[at] = Row::read(&study.cases[at], out).filter(|row| !(settings.retry_failed && is_bad(row)));
    }
    let is_open =
        |unit: &Vec<usize>| unit.iter().any(|&at| !rows[at].as_ref().is_some_and(|row| row.found.is_complete()));
    let open: VecDeque<Vec<usize>> = units.into_iter().filter(is_open).collect();
    let jobs = match settings.program {
        None => 1,
        Some(_) => settings.jobs.unwrap_or(settings.cores).min(open.len()).max(1),
    };
    let gate = if jobs > 1 { Some(MemoryGate::new(available()?)) } else { None };
    let (threads, program) = ((settings.cores / jobs).max(1), settings.program);
    let launcher = RunLauncher { program, threads, gate, verbosity: settings.verbosity, interrupt: settings.interrupt };
    let work = Work {
        study,
        out,
        settings,
        launcher,
        mine,
        rows: Mutex::new(rows),
        queue: Mutex::new(open),
        broken: Mutex::new(None),
    };
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| work.work());
        }
    });
    if let Some(error) = held(&work.broken).take() {
        return Err(error);
    }
    let rows = held(&work.rows);
    work.write(&rows, true)?;
    let sweep = Sweep {
        rows: work.mine.iter().filter_map(|&at| rows[at].clone()).collect(),
        missing: missing(study, &work.mine, &rows),
        interrupted: settings.interrupt.load(Ordering::Relaxed),
    };
    Ok(sweep)
}

/// Joins whatever runs lie below `out` into one table.
///
/// # Errors
/// A table that cannot be written.
pub fn gather(study: &SweepStudy, out: &Path) -> Result<Sweep, StudyError> {
    let rows: Vec<Option<Row>> = study.cases.iter().map(|case| Row::read(case, out)).collect();
    let all: Vec<usize> = (0..study.cases.len()).collect();
    let found: Vec<Row> = rows.iter().flatten().cloned().collect();
    let _lock = take(study, out)?;
    write_tables(study, out, &found, true)?;
    Ok(Sweep { missing: missing(study, &all, &rows), rows: found, interrupted: false })
}

/// Takes away what runs that failed or were refused have left.
///
/// # Errors
/// Files that cannot be removed.
pub fn forget_failed(study: &SweepStudy, out: &Path) -> Result<(), StudyError> {
    for case in study.cases.iter().filter(|case| Row::read(case, out).is_some_and(|row| is_bad(&row))) {
        let folder = out.join(&case.folder);
        if lock::try_take(&folder, Room::Empty)?.is_some() {
            clear(&folder)?;
        }
    }
    Ok(())
}

pub(super) fn missing(study: &SweepStudy, which: &[usize], rows: &[Option<Row>]) -> Vec<String> {
    let open = |at: &usize| !rows[*at].as_ref().is_some_and(|row| row.found.is_complete());
    which.iter().copied().filter(open).map(|at| study.cases[at].folder.clone()).collect()
}

pub(super) fn is_bad(row: &Row) -> bool {
    row.found.is_complete() && !row.found.is_good()
}

fn shard_of(units: Vec<Vec<usize>>, shard: Option<Shard>) -> Vec<Vec<usize>> {
    let Shard { number, of } = shard.unwrap_or(Shard { number: 1, of: 1 });
    units.into_iter().enumerate().filter(|(at, _)| at % of == number - 1).map(|(_, unit)| unit).collect()
}

pub(super) fn write_tables(study: &SweepStudy, out: &Path, rows: &[Row], last: bool) -> Result<(), StudyError> {
    results::write(study, rows, &out.join("results.csv"))?;
    richardson::write(study, rows, &out.join("richardson.csv"))?;
    if last {
        #[cfg(feature = "parquet")]
        results::write_typed(study, rows, &out.join("results.parquet"))?;
        figures::write(study, rows, out)?;
    }
    Ok(())
}

impl SweepStudy {
    /// Runs that belong together, by number: those that start from each other, in order.
    pub fn units(&self) -> Vec<Vec<usize>> {
        let mut units: Vec<Vec<usize>> = Vec::new();
        for (at, case) in self.cases.iter().enumerate() {
            let chain = case.after.and_then(|before| units.iter_mut().find(|unit| unit.last() == Some(&before)));
            match chain {
                Some(unit) => unit.push(at),
                None => units.push(vec![at]),
            }
        }
        units
    }
}

/// Keys that change nothing in any run.
const HARMLESS: [&str; 7] = ["title", "scene", "duration", "measures", "plot", "slurm", "richardson"];

/// Makes the folder, or finds out that it is one of this study.
///
/// # Errors
/// A folder that holds something else.
pub fn prepare(study: &SweepStudy, out: &Path, settings: &Settings) -> Result<(), StudyError> {
    let folder = || out.display().to_string();
    let file = out.join("study.toml");
    if settings.must_resume && !file.exists() {
        return Err(StudyError::NothingToResume { folder: folder() });
    }
    // several shards may begin at the same time
    let _lock = take(study, out)?;
    for case in &study.cases {
        lock::check(&out.join(&case.folder), Room::Empty)?;
    }
    let old = std::fs::read_to_string(&file).ok();
    match &old {
        None => table::refuse_occupied(out)?,
        Some(old) => {
            if let Some(key) = study.difference(old, out) {
                return Err(StudyError::OtherStudy { folder: folder(), key });
            }
        }
    }
    let text = study.text();
    match old {
        None => table::write_study(&text, out),
        Some(old) if old == text => Ok(()),
        Some(old) => {
            let left = SweepStudy::read_left(out).map(|left| left.text()).ok();
            match left {
                // somebody's own words for the same
                Some(left) if left == text => Ok(()),
                // as this program writes it
                Some(left) if left == old => table::write_study(&text, out),
                Some(_) | None => Err(OutputError::foreign(&file).into()),
            }
        }
    }
}

/// Names of what a sweep leaves beside the folders of its runs, and of what other commands do.
const NAMES: [&str; 12] = [
    "study.toml",
    "scene.toml",
    "summary.json",
    "runs.csv",
    "results.csv",
    "results.parquet",
    "results.*.csv",
    "richardson.csv",
    "plots",
    "slurm.sh",
    "gather.sh",
    "slurm",
];

/// Takes the study's folder, after waiting for others who do the same study.
fn take(study: &SweepStudy, out: &Path) -> Result<lock::Lock, OutputError> {
    let runs = study.cases.iter().map(|case| case.folder.as_str());
    lock::wait_for(out, Room::Without(&NAMES.into_iter().chain(runs).collect::<Vec<_>>()))
}

impl SweepStudy {
    /// The first key that differs from the study whose text is `old` and whose runs lie below `out`.
    fn difference(&self, old: &str, out: &Path) -> Option<String> {
        let read = |text: &str| -> toml::Value {
            let mut table = renamed::table(text).unwrap_or_default();
            table.retain(|key, _| !HARMLESS.contains(&key));
            toml::Value::Table(table)
        };
        if let Some(key) = differing("", &read(old), &read(&self.text())) {
            return Some(key);
        }
        // the scene may have changed since
        let warm = !self.warm.is_empty();
        let read = |text: &str| -> toml::Value {
            let mut table = renamed::table(text).unwrap_or_default();
            if warm {
                table.remove("initial");
            }
            toml::Value::Table(table)
        };
        self.cases.iter().enumerate().find_map(|(at, case)| {
            let old = std::fs::read_to_string(out.join(&case.folder).join("scene.toml")).ok()?;
            let now = self.scene_of(at).ok()?.resolved_toml();
            let key = differing("", &read(&old), &read(&now))?;
            Some(format!("{key} of the scene of run {}", case.folder))
        })
    }
}
