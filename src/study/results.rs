//! The rows of a sweep: what a run's folder tells, and the table of all of them.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::child::RunSummary;
#[cfg(feature = "parquet")]
use super::columns::write_parquet;
use super::columns::{Column, write_csv};
use super::sweep_file::{Case, SweepStudy};
use crate::measure::errors::Norm;
use crate::measure::list::{Asked, FREE_ENERGY};
use crate::model::fields::{self, FieldId};
use crate::output::{OutputError, number, write_whole};
use crate::results::names::{estimate_of, estimated};
use crate::run::AnyScene;
use crate::run::measures::columns;
use crate::scene::{Scene, measured};

/// What became of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    /// It began; its ending is in the summary.
    Ran(Box<RunSummary>),
    /// Its scene cannot be run, or its results cannot be written: the reason.
    Refused(String),
    /// Its process ended without an end of the run: the reason.
    Died(String),
}

/// A run of a sweep and what it left.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Which run.
    pub case: Case,
    /// What came of it.
    pub found: Found,
    /// What the program said in notes.
    pub said: Vec<String>,
    /// Wall seconds.
    pub seconds: f64,
    /// How it began, in a study with warm starts.
    pub start: Option<Start>,
}

/// How a run of a study with warm starts began.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// That of the state with which the run began.
    pub branch: Branch,
    /// `‖p − p_n‖/‖p_n‖` in L², p_n the polarity of the neighbour that it began with.
    pub distance: Option<f64>,
}

/// On which branch of states a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Branch {
    /// It began from the scene's own state.
    Start,
    /// On that of its neighbour.
    Same,
    /// Probably on another one.
    Changed,
}

impl Branch {
    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            Branch::Start => "start",
            Branch::Same => "same",
            Branch::Changed => "changed",
        }
    }
}

/// `row.json`: what the study knows of a run beside the run's `summary.json`.
#[derive(Debug, Serialize, Deserialize)]
struct RowFile {
    run: String,
    outcome: Outcome,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    seconds: f64,
    /// Notes of the study.
    #[serde(default)]
    said: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    start: Option<Start>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Outcome {
    Ran,
    Refused,
    Died,
}

/// Name of the file.
const FILE: &str = "row.json";

impl Found {
    /// Whether it went as it should.
    pub fn is_good(&self) -> bool {
        match self {
            Found::Ran(summary) => summary.status != "failed",
            Found::Refused(_) | Found::Died(_) => false,
        }
    }

    /// Whether nothing is left to do.
    pub fn is_complete(&self) -> bool {
        match self {
            Found::Ran(summary) => summary.is_complete(),
            Found::Refused(_) | Found::Died(_) => true,
        }
    }

    /// Why it did not go as it should.
    pub fn reason(&self) -> Option<&str> {
        match self {
            Found::Ran(summary) => summary.reason.as_deref(),
            Found::Refused(reason) | Found::Died(reason) => Some(reason),
        }
    }

    /// As in tables.
    pub fn status(&self) -> &str {
        match self {
            Found::Ran(summary) => &summary.status,
            Found::Refused(_) => "refused",
            Found::Died(_) => "failed",
        }
    }
}

impl Row {
    /// Writes what the study knows of the run into its folder; `said` are the study's own notes.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(super) fn leave(
        folder: &Path,
        found: &Found,
        seconds: f64,
        said: &[String],
        start: Option<&Start>,
    ) -> Result<(), OutputError> {
        std::fs::create_dir_all(folder).map_err(|e| OutputError::io(folder, &e))?;
        let (outcome, reason) = match found {
            Found::Ran(_) => (Outcome::Ran, None),
            Found::Refused(reason) => (Outcome::Refused, Some(reason.clone())),
            Found::Died(reason) => (Outcome::Died, Some(reason.clone())),
        };
        let run = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let row = RowFile { run, outcome, reason, seconds, said: said.to_vec(), start: start.cloned() };
        write_whole(&folder.join(FILE), |file| {
            serde_json::to_writer_pretty(&mut *file, &row)?;
            writeln!(file)
        })
    }

    /// The row of a run from its folder below `out`; `None` before it has one.
    pub fn read(case: &Case, out: &Path) -> Option<Self> {
        let folder = out.join(&case.folder);
        let file: RowFile = serde_json::from_slice(&std::fs::read(folder.join(FILE)).ok()?).ok()?;
        let reason = file.reason.unwrap_or_default();
        let found = match file.outcome {
            Outcome::Ran => Found::Ran(Box::new(RunSummary::read(&folder)?)),
            Outcome::Refused => Found::Refused(reason),
            Outcome::Died => Found::Died(reason),
        };
        let notes = match &found {
            Found::Ran(summary) => summary.said.clone(),
            Found::Refused(_) | Found::Died(_) => Vec::new(),
        };
        let said = notes.into_iter().chain(file.said).collect();
        Some(Self { case: case.clone(), found, said, seconds: file.seconds, start: file.start })
    }

    /// The run's own account, if it came to one.
    pub fn summary(&self) -> Option<&RunSummary> {
        match &self.found {
            Found::Ran(summary) => Some(summary),
            Found::Refused(_) | Found::Died(_) => None,
        }
    }

    /// Measures, and what a search for a steady state found.
    pub fn numbers(&self) -> BTreeMap<String, f64> {
        self.summary().map(RunSummary::numbers).unwrap_or_default()
    }

    /// The estimated error of a measure.
    pub fn estimate(&self, measure: &str) -> Option<f64> {
        self.summary()?.estimates.get(measure).copied().flatten()
    }

    /// The error of a field in a norm, where it is known.
    pub fn error(&self, field: FieldId, norm: Norm) -> Option<f64> {
        self.summary()?.error(field.name, norm.name())
    }

    /// The value that the run gives a key, texts without quotes; nothing where it leaves the scene's.
    fn value(&self, key: &str) -> Option<String> {
        let (_, value) = self.case.set.iter().find(|(name, _)| name == key)?;
        Some(match value.parse::<toml::Value>() {
            Ok(toml::Value::String(text)) => text,
            Ok(toml::Value::Float(x)) => number(x),
            Ok(_) | Err(_) => value.clone(),
        })
    }
}

/// Names of the measures that runs of a scene can have, without those that only a name of the scene's makes.
pub(super) fn measures_of(scene: &AnyScene) -> Vec<&'static str> {
    let named =
        || measured(scene.outputs()).into_iter().flat_map(|asked| asked.column_names().collect::<Vec<_>>()).collect();
    scene.tissue().map_or_else(named, measures_of_tissue)
}

fn measures_of_tissue(scene: &Scene) -> Vec<&'static str> {
    let mut names: Vec<&str> =
        columns(&scene.outputs, Some(scene)).into_iter().filter(|name| !name.starts_with("residual")).collect();
    if !measured(&scene.outputs).contains(&Asked::from(&FREE_ENERGY)) {
        names.retain(|name| !name.starts_with("free_energy"));
    }
    if scene.steady.is_some() {
        names.extend(["growth", "frequency", "period", "amplitude_polarity", "amplitude_velocity"]);
    }
    names
}

/// The columns of the table of `rows`: parameters, how each run ended, measures, errors, notes, cost.
pub fn table(study: &SweepStudy, rows: &[Row]) -> Vec<Column> {
    let named = study.cases.iter().any(|case| case.name.is_some());
    let mut columns = vec![Column::texts("run", rows.iter().map(|row| Some(row.case.folder.clone())))];
    if named {
        columns.push(Column::texts("name", rows.iter().map(|row| row.case.name.clone())));
    }
    for key in study.keys() {
        columns.push(Column::guessed(key, rows.iter().map(|row| row.value(key)).collect()));
    }
    columns.extend(endings(rows));
    let numbers: Vec<BTreeMap<String, f64>> = rows.iter().map(Row::numbers).collect();
    let mut measured: Vec<&String> = numbers.iter().flat_map(BTreeMap::keys).collect();
    measured.sort_unstable();
    measured.dedup();
    let measured: Vec<&String> = study.measures.as_ref().map_or(measured, |names| names.iter().collect());
    let value = |(row, of): (&Row, &BTreeMap<String, f64>), name: &String| {
        of.get(name).copied().or_else(|| row.estimate(estimated(name)?))
    };
    for &name in &measured {
        columns.push(Column::numbers(name, rows.iter().zip(&numbers).map(|pair| value(pair, name))));
        let error = estimate_of(name);
        if rows.iter().any(|row| row.estimate(name).is_some()) && !measured.contains(&&error) {
            columns.push(Column::numbers(error, rows.iter().map(|row| row.estimate(name))));
        }
    }
    columns.extend(errors(rows));
    if !study.warm.is_empty() {
        let branch = |row: &Row| row.start.as_ref().map(|start| start.branch.name().to_owned());
        columns.push(Column::texts("branch", rows.iter().map(branch)));
        columns.push(Column::numbers("distance", rows.iter().map(|row| row.start.as_ref()?.distance)));
    }
    let remark = |text: &String| text.strip_prefix("note: ").unwrap_or(text).to_owned();
    let said = rows.iter().map(|row| Some(row.said.iter().map(remark).collect::<Vec<_>>().join("; ")));
    columns.push(Column::texts("said", said));
    let milli = |seconds: f64| (seconds * 1e3).round() / 1e3;
    columns.push(Column::numbers("seconds", rows.iter().map(|row| Some(milli(row.seconds)))));
    columns.push(Column::numbers("peak_memory_mib", rows.iter().map(|row| row.summary()?.peak_memory_mib)));
    columns.push(Column::counts("threads", rows.iter().map(|row| Some(row.summary()?.threads))));
    columns
}

/// How each run ended, and its size and work.
fn endings(rows: &[Row]) -> Vec<Column> {
    let texts = |name: &str, of: &dyn Fn(&Row) -> Option<String>| Column::texts(name, rows.iter().map(of));
    let counts =
        |name: &str, of: fn(&RunSummary) -> usize| Column::counts(name, rows.iter().map(|row| row.summary().map(of)));
    let numbers = |name: &str, of: fn(&RunSummary) -> Option<f64>| {
        Column::numbers(name, rows.iter().map(|row| row.summary().and_then(of)))
    };
    vec![
        texts("status", &|row| Some(row.found.status().to_owned())),
        texts("ending", &|row| Some(row.summary()?.ending.clone())),
        texts("reason", &|row| row.found.reason().map(str::to_owned)),
        counts("cells", |s| s.mesh.cells),
        counts("unknowns", |s| s.unknowns.solved()),
        numbers("time", |s| Some(s.time)),
        counts("steps", |s| s.counts.steps),
        counts("rejected", |s| s.counts.rejected),
        counts("iterations", |s| s.counts.nonlinear_iterations),
        counts("accepted_late", |s| s.counts.accepted_late),
        numbers("residual", |s| s.residual),
        texts("stability", &|row| row.summary()?.steady.as_ref()?.stability.clone()),
    ]
}

/// `error_velocity_L2(L2)` and so on, of the fields that some run has.
fn errors(rows: &[Row]) -> Vec<Column> {
    let measured =
        |field: &FieldId| rows.iter().filter_map(Row::summary).any(|summary| summary.errors.contains_key(field.name));
    let column = |field: FieldId, norm: Norm| {
        let name = format!("error_{}_{}", field.name, norm.name());
        Column::numbers(name, rows.iter().map(move |row| row.error(field, norm)))
    };
    let of = |field: FieldId| Norm::of(field).map(move |norm| column(field, norm));
    fields::ALL.into_iter().filter(measured).flat_map(of).collect()
}

/// Writes the table of all runs so far.
///
/// # Errors
/// A file that cannot be written.
pub fn write(study: &SweepStudy, rows: &[Row], path: &Path) -> Result<(), OutputError> {
    write_csv(path, &table(study, rows))
}

/// As [`write()`], as Parquet.
///
/// # Errors
/// A file that cannot be written.
#[cfg(feature = "parquet")]
pub fn write_typed(study: &SweepStudy, rows: &[Row], path: &Path) -> Result<(), OutputError> {
    write_parquet(path, &table(study, rows))
}
