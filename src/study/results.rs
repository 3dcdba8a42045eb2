//! `results.csv`: a row for every run of a sweep.

use std::collections::BTreeMap;
use std::path::Path;

use super::StudyError;
use super::sweep::Found;
use super::sweep_file::{Case, SweepStudy};
use super::table::write_rows;
use crate::measure::errors::{ErrorField, History, Norm};
use crate::output::number;
use crate::run::Summary;

/// A run of a sweep and what it left.
#[derive(Debug)]
pub struct Row {
    pub case: Case,
    pub found: Found,
    /// What the program said in notes.
    pub said: Vec<String>,
    pub seconds: f64,
}

/// Columns between the parameters and the measures.
const RUN: [&str; 12] = [
    "status",
    "ending",
    "reason",
    "cells",
    "unknowns",
    "time",
    "steps",
    "rejected",
    "iterations",
    "accepted_late",
    "residual",
    "stability",
];

/// Writes the table of all runs so far.
///
/// # Errors
/// A file that cannot be written.
pub fn write(study: &SweepStudy, rows: &[Row], path: &Path) -> Result<(), StudyError> {
    let keys = study.keys();
    let named = study.cases.iter().any(|case| case.name.is_some());
    let mut measured: Vec<&str> = rows.iter().flat_map(|row| row.numbers().into_keys()).collect();
    measured.sort_unstable();
    measured.dedup();
    let with_errors = rows.iter().any(|row| row.errors().is_some());
    let errors = if with_errors { error_columns(rows) } else { Vec::new() };
    let mut header = vec!["run".to_owned()];
    header.extend(named.then(|| "name".to_owned()));
    header.extend(keys.iter().copied().chain(RUN).chain(measured.iter().copied()).map(str::to_owned));
    header.extend(errors.iter().map(|(name, ..)| name.clone()));
    header.extend(["seconds", "said"].map(str::to_owned));
    let mut table = vec![header];
    for row in rows {
        let mut cells = vec![row.case.folder.clone()];
        cells.extend(named.then(|| row.case.name.clone().unwrap_or_default()));
        cells.extend(keys.iter().map(|key| row.value(key)));
        cells.extend(row.run_columns());
        let numbers = row.numbers();
        cells.extend(measured.iter().map(|name| text(numbers.get(name).copied())));
        cells.extend(errors.iter().map(|(_, field, norm)| text(row.errors().map(|e| e.error(*field, *norm)))));
        let said: Vec<&str> = row.said.iter().map(|remark| remark.strip_prefix("note: ").unwrap_or(remark)).collect();
        cells.extend([number((row.seconds * 1e3).round() / 1e3), said.join("; ")]);
        table.push(cells);
    }
    Ok(write_rows(path, &table)?)
}

/// `error_velocity_L2(L2)` and so on.
fn error_columns(rows: &[Row]) -> Vec<(String, ErrorField, Norm)> {
    let measured = |field: &ErrorField| rows.iter().filter_map(Row::errors).any(|e| e.fields().contains(field));
    let of = |field: ErrorField| Norm::ALL.map(|norm| (format!("error_{}_{}", field.name(), norm.name()), field, norm));
    ErrorField::ALL.into_iter().filter(measured).flat_map(of).collect()
}

/// A number that is none is left out: a table never says NaN.
fn text(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map(number).unwrap_or_default()
}

impl Row {
    fn summary(&self) -> Option<&Summary> {
        match &self.found {
            Found::Ran { summary, .. } => Some(summary),
            Found::Refused(_) => None,
        }
    }

    fn errors(&self) -> Option<&History> {
        match &self.found {
            Found::Ran { errors, .. } => errors.as_ref(),
            Found::Refused(_) => None,
        }
    }

    /// Measures, and what a search for a steady state found.
    pub fn numbers(&self) -> BTreeMap<&'static str, f64> {
        let Some(summary) = self.summary() else { return BTreeMap::new() };
        let mut numbers = summary.measures.clone();
        if let Some(steady) = &summary.steady {
            numbers.extend(steady.numbers());
        }
        numbers
    }

    /// The value that the run gives a key, texts without quotes; nothing where it leaves the scene's.
    fn value(&self, key: &str) -> String {
        let Some((_, value)) = self.case.set.iter().find(|(name, _)| name == key) else { return String::new() };
        match value.parse::<toml::Value>() {
            Ok(toml::Value::String(text)) => text,
            Ok(toml::Value::Float(x)) => number(x),
            Ok(_) | Err(_) => value.clone(),
        }
    }

    fn run_columns(&self) -> [String; 12] {
        let Some(summary) = self.summary() else {
            let mut cells = <[String; 12]>::default();
            (cells[0], cells[2]) = ("refused".to_owned(), self.found.reason().unwrap_or_default().to_owned());
            return cells;
        };
        let (counts, unknowns) = (&summary.counts, &summary.unknowns);
        [
            summary.status.to_owned(),
            summary.ending.name().to_owned(),
            self.found.reason().unwrap_or_default().to_owned(),
            summary.mesh.cells.to_string(),
            (unknowns.stokes_system + unknowns.polarity).to_string(),
            number(summary.time),
            counts.steps.to_string(),
            counts.rejected.to_string(),
            counts.nonlinear_iterations.to_string(),
            counts.accepted_late.to_string(),
            text(summary.residual),
            summary.steady.as_ref().and_then(|s| s.stability).map_or_else(String::new, |s| s.name().to_owned()),
        ]
    }
}
