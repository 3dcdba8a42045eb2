//! What accuracy costs: every setting as a process of its own, its errors against its time, and the settings that no
//! other beats.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Deserialize, Serialize};

use super::child::{self, Job, RunSummary};
use super::run_launcher::clear;
use super::tradeoff_file::{Reference, Setting, TradeoffStudy};
use super::{StudyError, table, tradeoff_table};
use crate::measure::errors::Norm;
use crate::output::lock::{self, Room};
use crate::output::progress::Verbosity;
use crate::output::{OutputError, console, write_whole};
use crate::run::unsaved::UnsavedWork;

/// How a study is run.
#[derive(Debug, Clone)]
pub struct TradeoffOptions<'a> {
    /// This program.
    pub program: &'a Path,
    /// Folder of the results.
    pub out: PathBuf,
    /// Each setting is run so often, and its median time taken.
    pub repeat: usize,
    /// Of each process.
    pub threads: usize,
    /// How much is said.
    pub verbosity: Verbosity,
}

/// A measured error; where the reference itself is no better, a bound on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Error {
    /// The difference.
    pub value: f64,
    /// Whether the difference to the reference is below the error of the reference: `value` is the sum of both.
    pub is_bound: bool,
}

/// What became of a setting.
#[derive(Debug, Clone)]
pub struct Point {
    /// Its name.
    pub setting: String,
    /// By measure.
    pub errors: BTreeMap<String, Error>,
    /// Median of the wall seconds.
    pub seconds: f64,
    /// Most memory at a time, where the system tells.
    pub memory_mib: Option<f64>,
    /// Number of cells.
    pub cells: usize,
    /// Of all fields.
    pub unknowns: usize,
    /// Nonlinear iterations of all steps.
    pub iterations: usize,
    /// Measures in which no other setting is at once as fast and as exact.
    pub front: Vec<String>,
    /// Why it did not get there.
    pub failure: Option<String>,
}

/// All that was found.
#[derive(Debug, Clone)]
pub struct Tradeoff {
    /// One for each setting.
    pub points: Vec<Point>,
    /// Error of the reference by measure; empty for exact fields.
    pub reference: BTreeMap<String, f64>,
    /// Whether some are missing because somebody asked to stop.
    pub interrupted: bool,
}

/// Ending of the file of a setting's times.
const TIMES: &str = ".times.json";

/// Kept beside a setting's results, so that it is not run again.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Timing {
    seconds: Vec<f64>,
}

/// Which of the points (time, error) no other point beats in both: on the front are those to which none is faster
/// without being less exact. Points that are alike are all on it; a point that is not finite is never, nor does it beat
/// any.
pub fn pareto(points: &[(f64, f64)]) -> Vec<bool> {
    let finite = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite();
    let beats = |a: &(f64, f64), b: &(f64, f64)| finite(a) && a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1);
    points.iter().map(|p| finite(p) && !points.iter().any(|other| beats(other, p))).collect()
}

/// Error of the finer of two values, by Richardson: `|f − c|/(r^p − 1)` for cells `r` times longer in the coarser one;
/// where the meshes are alike the whole difference.
pub fn reference_error(fine: f64, coarse: f64, ratio: f64, order: f64) -> f64 {
    let difference = (fine - coarse).abs();
    if ratio > 1.0 { difference / (ratio.powf(order) - 1.0) } else { difference }
}

/// The error of `value` against a reference of the error `uncertainty`.
pub fn error_against(value: f64, reference: f64, uncertainty: f64) -> Error {
    let difference = (value - reference).abs();
    let is_bound = difference < uncertainty;
    Error { value: if is_bound { difference + uncertainty } else { difference }, is_bound }
}

/// Runs the reference and every setting, one after the other; what a folder holds of the same study is kept. Tables and
/// plots are written after each.
///
/// # Errors
/// A folder with other results, a reference that fails, files that cannot be written.
pub fn run(study: &TradeoffStudy, options: &TradeoffOptions, interrupt: &AtomicBool) -> Result<Tradeoff, StudyError> {
    let _unsaved = UnsavedWork::new();
    let runs = names_of_runs(study);
    let names: Vec<&str> = NAMES.into_iter().chain(runs.iter().map(String::as_str)).collect();
    lock::alone(&options.out, Room::Without(&names), || Runner { study, options, interrupt }.all())
}

/// Names of what a study of a trade-off leaves beside the folders of its runs.
const NAMES: [&str; 4] = ["study.toml", "tradeoff.csv", "tradeoff*.svg", "tradeoff*.png"];

/// Names of the folders of all runs, and of the files of their times.
fn names_of_runs(study: &TradeoffStudy) -> Vec<String> {
    let settings = (1..).zip(&study.settings).map(|(at, setting)| folder_of(at, setting));
    let reference = match &study.reference {
        Reference::Exact => Vec::new(),
        Reference::Finest { finest, coarser, .. } => vec![finest.name.clone(), coarser.name.clone()],
    };
    settings.chain(reference).flat_map(|folder| [format!("{folder}{TIMES}"), folder]).collect()
}

/// The folder of the setting of a number, from 1.
fn folder_of(at: usize, setting: &Setting) -> String {
    format!("{at:02}-{}", folder_name(&setting.name))
}

/// A study at work.
struct Runner<'r> {
    study: &'r TradeoffStudy,
    options: &'r TradeoffOptions<'r>,
    interrupt: &'r AtomicBool,
}

impl Runner<'_> {
    fn all(&self) -> Result<Tradeoff, StudyError> {
        let Self { study, options, interrupt } = *self;
        let out = &options.out;
        prepare(study, out)?;
        let mut found = Tradeoff { points: Vec::new(), reference: BTreeMap::new(), interrupted: false };
        let (values, start) = self.reference(&mut found)?;
        for (at, setting) in study.settings.iter().enumerate() {
            found.interrupted = interrupt.load(Ordering::Relaxed);
            if found.interrupted {
                break;
            }
            let folder = out.join(folder_of(at + 1, setting));
            let point = match self.setting(setting, start.as_deref(), &folder, options.repeat)? {
                Ok((summary, seconds)) => point(study, setting, &summary, &seconds, &values, &found.reference),
                Err(reason) => failed(setting, reason),
            };
            if interrupt.load(Ordering::Relaxed) && point.failure.is_some() {
                found.interrupted = true;
                break;
            }
            found.points.push(point);
            mark_front(study, &mut found.points);
            if options.verbosity > Verbosity::Quiet {
                console::note(&tradeoff_table::told(study, found.points.last().expect("just pushed")));
            }
            tradeoff_table::write(study, &found, out)?;
        }
        Ok(found)
    }

    /// The reference's values, and the state at which all runs begin if they do; its errors go into `found`.
    fn reference(&self, found: &mut Tradeoff) -> Result<(Values, Option<PathBuf>), StudyError> {
        let Self { study, options, .. } = *self;
        let Reference::Finest { finest, coarser, order, start } = &study.reference else {
            return Ok((BTreeMap::new(), None));
        };
        let folder = |setting: &Setting| options.out.join(&setting.name);
        let run = |setting: &Setting, from: Option<&Path>| {
            let reason = match self.setting(setting, from, &folder(setting), 1)? {
                Ok((summary, _)) => return Ok(summary),
                Err(reason) => reason,
            };
            Err(StudyError::NoReference { name: setting.name.clone(), reason })
        };
        let fine = run(finest, None)?;
        let checkpoint = folder(finest).join("checkpoint.bin");
        let from = start
            .then(|| std::path::absolute(&checkpoint))
            .transpose()
            .map_err(|e| OutputError::io(&checkpoint, &e))?;
        let coarse = run(coarser, from.as_deref())?;
        let ratio = (fine.mesh.cells as f64 / coarse.mesh.cells as f64).sqrt();
        let (numbers, others) = (fine.numbers(), coarse.numbers());
        for name in &study.measures {
            let pair = numbers.get(name).zip(others.get(name));
            let reason = || format!("it has no finite `{name}`");
            let (f, c) = pair.ok_or_else(|| StudyError::NoReference { name: finest.name.clone(), reason: reason() })?;
            found.reference.insert(name.clone(), reference_error(*f, *c, ratio, *order));
        }
        Ok((numbers, from))
    }

    /// Runs a setting until it has been timed `repeat` times; the reason if it does not get to its end.
    fn setting(
        &self,
        setting: &Setting,
        start: Option<&Path>,
        folder: &Path,
        repeat: usize,
    ) -> Result<Result<(RunSummary, Vec<f64>), String>, StudyError> {
        // the folder of a run holds its own files only
        let kept = folder.with_file_name(folder.file_name().unwrap_or_default().to_string_lossy().into_owned() + TIMES);
        let read = || serde_json::from_slice::<Timing>(&std::fs::read(&kept).ok()?).ok();
        let mut timing = read().unwrap_or_default();
        let mut last = RunSummary::read(folder).filter(|summary| summary.status == "finished");
        if last.is_none() {
            timing = Timing::default();
        }
        while last.is_none() || timing.seconds.len() < repeat {
            let lock = lock::take(folder, Room::Empty)?;
            clear(folder)?;
            let scene = self.study.scene_of(setting, start)?.resolved_toml();
            let TradeoffOptions { program, threads, verbosity, .. } = *self.options;
            let (out, verbose) = (folder.to_owned(), verbosity == Verbosity::Verbose);
            let lock = lock.file().try_clone().ok();
            let job = Job { program, scene: &scene, out, threads, resume: false, memory: None, verbose, lock };
            let ended = child::run(job, self.interrupt, &|line| {
                if verbose {
                    console::note(line);
                }
            })?;
            match &ended.summary {
                Some(summary) if summary.status == "finished" => timing.seconds.push(summary.seconds_total),
                Some(summary) => return Ok(Err(summary.reason.clone().unwrap_or_else(|| summary.status.clone()))),
                None => return Ok(Err(ended.reason())),
            }
            last = ended.summary;
            let text = serde_json::to_vec(&timing).map_err(|e| OutputError::io(&kept, &e.into()))?;
            write_whole(&kept, |file| file.write_all(&text))?;
        }
        Ok(last.map(|summary| (summary, timing.seconds)).ok_or_else(|| "it was not run".to_owned()))
    }
}

/// Makes the folder, or takes up one with the same study.
fn prepare(study: &TradeoffStudy, out: &Path) -> Result<(), StudyError> {
    let text = study.text();
    if std::fs::read_to_string(out.join("study.toml")).is_ok_and(|old| old == text) {
        return Ok(());
    }
    table::refuse_occupied(out)?;
    table::write_study(&text, out)
}

type Values = BTreeMap<String, f64>;

fn point(
    study: &TradeoffStudy,
    setting: &Setting,
    summary: &RunSummary,
    seconds: &[f64],
    values: &Values,
    uncertainties: &Values,
) -> Point {
    let numbers = summary.numbers();
    let error = |name: &String| match &study.reference {
        Reference::Exact => {
            let (field, norm) = name.split_once(' ').unwrap_or((name, Norm::Square.name()));
            summary.error(field, norm).map(|value| Error { value, is_bound: false })
        }
        Reference::Finest { .. } => {
            let against = |value: &f64| error_against(*value, values[name], uncertainties[name]);
            numbers.get(name).map(against)
        }
    };
    let errors: BTreeMap<String, Error> =
        study.measures.iter().filter_map(|name| Some((name.clone(), error(name)?))).collect();
    let missing = study.measures.iter().find(|name| !errors.contains_key(*name));
    Point {
        setting: setting.name.clone(),
        failure: missing.map(|name| format!("it has no finite `{name}`")),
        errors,
        seconds: median(seconds),
        memory_mib: summary.peak_memory_mib,
        cells: summary.mesh.cells,
        unknowns: summary.unknowns.solved(),
        iterations: summary.counts.nonlinear_iterations,
        front: Vec::new(),
    }
}

fn failed(setting: &Setting, reason: String) -> Point {
    Point {
        setting: setting.name.clone(),
        errors: BTreeMap::new(),
        seconds: f64::NAN,
        memory_mib: None,
        cells: 0,
        unknowns: 0,
        iterations: 0,
        front: Vec::new(),
        failure: Some(reason),
    }
}

fn mark_front(study: &TradeoffStudy, points: &mut [Point]) {
    points.iter_mut().for_each(|point| point.front.clear());
    for name in &study.measures {
        let places: Vec<(f64, f64)> =
            points.iter().map(|p| (p.seconds, p.errors.get(name).map_or(f64::NAN, |e| e.value))).collect();
        for (point, _) in points.iter_mut().zip(pareto(&places)).filter(|(_, on)| *on) {
            point.front.push(name.clone());
        }
    }
}

/// The middle one, or the mean of the two in the middle.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        count => 0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]),
    }
}

fn folder_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '-' }).collect()
}

#[cfg(test)]
mod tests {
    use super::{error_against, median, pareto, reference_error};

    #[test]
    fn the_front_has_what_no_other_beats() {
        let points = [(1.0, 1.0), (2.0, 0.5), (3.0, 0.5), (0.5, 3.0), (2.0, 2.0), (4.0, 0.1)];
        assert_eq!(pareto(&points), [true, true, false, true, false, true]);
        // as fast and less exact, as exact and slower
        assert_eq!(pareto(&[(1.0, 1.0), (1.0, 2.0), (2.0, 1.0)]), [true, false, false]);
    }

    #[test]
    fn points_that_are_alike_share_their_place() {
        assert_eq!(pareto(&[(1.0, 1.0), (1.0, 1.0), (2.0, 2.0)]), [true, true, false]);
    }

    #[test]
    fn what_is_not_finite_is_on_no_front_and_beats_nothing() {
        let none = f64::NAN;
        let points = [(1.0, none), (none, 1.0), (f64::NEG_INFINITY, 0.0), (2.0, 3.0), (f64::INFINITY, 0.0)];
        assert_eq!(pareto(&points), [false, false, false, true, false]);
        assert!(pareto(&[]).is_empty());
    }

    #[test]
    fn the_error_of_the_reference_is_that_of_a_power() {
        let value = |h: f64| 2.0 + 0.3 * h * h;
        assert!((reference_error(value(0.1), value(0.15), 1.5, 2.0) - 0.003).abs() < 1e-12);
        // the same mesh and another degree: no order is known
        assert!((reference_error(1.0, 1.25, 1.0, 2.0) - 0.25).abs() < 1e-15);
    }

    #[test]
    fn errors_below_that_of_the_reference_are_bounds() {
        let clear = error_against(1.5, 1.0, 0.1);
        assert!(!clear.is_bound && (clear.value - 0.5).abs() < 1e-15);
        let lost = error_against(1.05, 1.0, 0.1);
        assert!(lost.is_bound && (lost.value - 0.15).abs() < 1e-12);
    }

    #[test]
    fn a_median_is_in_the_middle() {
        assert!((median(&[3.0, 1.0, 2.0]) - 2.0).abs() < 1e-15 && (median(&[4.0, 1.0]) - 2.5).abs() < 1e-15);
        assert!(median(&[]).is_nan());
    }
}
