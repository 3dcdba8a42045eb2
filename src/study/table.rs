//! What a study of orders leaves: `orders.csv` and a plot for every variant, `runs.csv` for all, and a table to read.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::StudyError;
use super::expected::short_orders;
use super::file::OrderStudy;
use super::order::{Level, Outcome};
use crate::measure::errors::Norm;
use crate::model::fields::FieldId;
use crate::output::plot::{Axis, Plot, Scale, Series, Slope, if_drawn};
use crate::output::{OutputError, number, write_whole};

/// Names of what a study of orders leaves beside the folders of its variants.
pub const NAMES: [&str; 6] = ["study.toml", "scene.toml", "runs.csv", "orders.csv", "orders.svg", "orders.png"];

/// Whether a folder holds something that a study would overwrite or mix with.
pub fn is_occupied(out: &Path) -> bool {
    ["runs.csv", "results.csv", "study.toml", "scene.toml", "summary.json"].iter().any(|name| out.join(name).exists())
}

/// # Errors
/// A folder with results.
pub fn refuse_occupied(out: &Path) -> Result<(), StudyError> {
    if is_occupied(out) { Err(StudyError::Occupied { folder: out.display().to_string() }) } else { Ok(()) }
}

/// Makes the folders and writes what is studied.
///
/// # Errors
/// A folder that cannot be made or written.
pub fn prepare(study: &OrderStudy, out: &Path) -> Result<(), StudyError> {
    for variant in &study.variants {
        let folder = folder(out, variant.name.as_str());
        std::fs::create_dir_all(&folder).map_err(|e| OutputError::io(&folder, &e))?;
        let scene = study.scene_at(variant, study.levels[0])?.resolved_toml();
        write_whole(&folder.join("scene.toml"), |file| file.write_all(scene.as_bytes()))?;
    }
    write_study(&study.text(), out)
}

/// Makes the folder and writes the study's text.
///
/// # Errors
/// A folder that cannot be made or written.
pub(super) fn write_study(text: &str, out: &Path) -> Result<(), StudyError> {
    std::fs::create_dir_all(out).map_err(|e| OutputError::io(out, &e))?;
    write_whole(&out.join("study.toml"), |file| file.write_all(text.as_bytes()))?;
    Ok(())
}

/// The folder of a variant's results.
fn folder(out: &Path, variant: &str) -> PathBuf {
    if variant.is_empty() { out.to_owned() } else { out.join(variant) }
}

/// Writes all tables and plots anew.
///
/// # Errors
/// Files that cannot be written.
pub fn write(study: &OrderStudy, out: &Path, outcomes: &[Outcome]) -> Result<(), StudyError> {
    for outcome in outcomes {
        let folder = folder(out, &outcome.variant);
        write_rows(&folder.join("orders.csv"), &orders(outcome))?;
        if outcome.complete().len() > 1 {
            let plot = plot(study, outcome);
            if_drawn(plot.write(&folder.join("orders"))).map_err(|error| OutputError::Malformed {
                path: folder.join("orders.svg").display().to_string(),
                what: error.to_string(),
                hint: "the tables beside it are complete",
            })?;
        }
    }
    write_rows(&out.join("runs.csv"), &runs(outcomes))?;
    Ok(())
}

pub(super) fn write_rows(path: &Path, rows: &[Vec<String>]) -> Result<(), OutputError> {
    let mut table = csv::Writer::from_writer(Vec::new());
    for row in rows {
        table.write_record(row).map_err(|e| OutputError::io(path, &std::io::Error::other(e)))?;
    }
    let bytes = table.into_inner().map_err(|e| OutputError::io(path, &std::io::Error::other(e.to_string())))?;
    write_whole(path, |file| file.write_all(&bytes))
}

/// One row per level, field and norm; `order` is that between the level and the last one before it that was complete.
fn orders(outcome: &Outcome) -> Vec<Vec<String>> {
    let header = ["n", "h", "dt", "field", "norm", "error", "order"].map(String::from).to_vec();
    let mut rows = vec![header];
    let mut last: Option<&Level> = None;
    for level in outcome.complete() {
        for field in level.errors.fields() {
            for norm in Norm::of(field) {
                let order = last.map(|coarse| number(outcome.order_between(coarse, level, field, norm)));
                let sizes = [level.n, level.h, level.dt].map(number);
                let names = [field.name, norm.name()].map(String::from);
                let error = number(level.errors.error(field, norm));
                rows.push(sizes.into_iter().chain(names).chain([error, order.unwrap_or_default()]).collect());
            }
        }
        last = Some(level);
    }
    rows
}

/// One row per level of every variant: its size, its work, its ending.
fn runs(outcomes: &[Outcome]) -> Vec<Vec<String>> {
    let header = [
        "variant",
        "n",
        "h",
        "dt",
        "cells",
        "unknowns",
        "steps",
        "rejected",
        "iterations",
        "linear_iterations",
        "accepted_late",
        "factorisations",
        "seconds",
        "status",
        "reason",
    ];
    let mut rows = vec![header.map(String::from).to_vec()];
    for outcome in outcomes {
        for level in &outcome.levels {
            let c = &level.counts;
            let sizes = [level.n, level.h, level.dt].map(number);
            let counts = [
                level.cells,
                level.unknowns,
                c.steps,
                c.rejected,
                c.nonlinear_iterations,
                c.polarity_linear_iterations,
                c.accepted_late,
                level.factorisations,
            ];
            let status = if level.failure.is_some() { "failed" } else { "complete" };
            rows.push(
                std::iter::once(outcome.variant.clone())
                    .chain(sizes)
                    .chain(counts.map(|count| count.to_string()))
                    .chain([number((level.seconds * 1e3).round() / 1e3), status.to_owned()])
                    .chain([level.failure.clone().unwrap_or_default()])
                    .collect(),
            );
        }
    }
    rows
}

/// The fields of the model; of another level if one is empty.
fn fields(levels: &[&Level]) -> Vec<FieldId> {
    let all = levels.iter().map(|level| level.errors.fields().collect::<Vec<_>>());
    all.into_iter().find(|fields| !fields.is_empty()).unwrap_or_default()
}

/// Errors by level, orders between levels, and the fit, as text.
pub fn text(outcome: &Outcome) -> String {
    let levels = outcome.complete();
    let mut out = String::new();
    if !outcome.variant.is_empty() {
        let _ = writeln!(out, "{}", outcome.variant);
    }
    let _ = write!(out, "{:<10} {:<11}", "field", "norm");
    for (k, level) in levels.iter().enumerate() {
        let _ = write!(out, " {:>9}", format!("n={}", level.n));
        if k > 0 {
            let _ = write!(out, " {:>6}", "order");
        }
    }
    let _ = writeln!(out, " {:>6}", "fit");
    for field in fields(&levels) {
        for norm in Norm::of(field) {
            let _ = write!(out, "{:<10} {:<11}", field.name, norm.name());
            for (k, level) in levels.iter().enumerate() {
                let _ = write!(out, " {:>9.2e}", level.errors.error(field, norm));
                if k > 0 {
                    let _ = write!(out, " {:>6.2}", outcome.order_between(levels[k - 1], level, field, norm));
                }
            }
            let fit = outcome.fit(field, norm).map_or_else(|| "-".to_owned(), |fit| format!("{fit:.2}"));
            let _ = writeln!(out, " {fit:>6}");
        }
    }
    out
}

/// Levels that failed and orders that lie below what the study expects, one line each.
pub fn shortfalls(study: &OrderStudy, outcome: &Outcome) -> Vec<String> {
    let failed =
        outcome.levels.iter().filter_map(|l| l.failure.as_ref().map(|reason| format!("n = {}: {reason}", l.n)));
    let mut lines: Vec<String> = failed.collect();
    if let Some(variant) = study.variants.iter().find(|variant| variant.name == outcome.variant) {
        lines.extend(short_orders(variant, outcome));
    }
    lines
}

fn plot(study: &OrderStudy, outcome: &Outcome) -> Plot {
    let levels = outcome.complete();
    let by_mesh = outcome.by_mesh();
    let series = |field: FieldId, norm: Norm| {
        let points = levels.iter().map(|l| (l.size(by_mesh), l.errors.error(field, norm))).collect();
        Series::new(format!("{}, {}", field.symbol, norm.symbol()), points)
    };
    let all = fields(&levels).into_iter().flat_map(|field| Norm::of(field).map(move |norm| (field, norm)));
    let (series, fits): (Vec<Series>, Vec<f64>) =
        all.map(|(field, norm)| (series(field, norm), outcome.fit(field, norm).unwrap_or(f64::NAN))).unzip();
    let mut orders: Vec<f64> = fits.iter().filter(|f| f.is_finite()).map(|f| f.round()).filter(|f| *f >= 1.0).collect();
    orders.sort_by(f64::total_cmp);
    orders.dedup();
    let title = study.title.clone().unwrap_or_else(|| "Errors against exact fields".to_owned());
    let counts: Vec<String> = levels.iter().map(|l| l.n.to_string()).collect();
    let variant = if outcome.variant.is_empty() { String::new() } else { format!("{}, ", outcome.variant) };
    Plot {
        title,
        subtitle: format!("{variant}levels n = {}", counts.join(", ")),
        x: Axis { label: if by_mesh { "h" } else { "Δt" }.to_owned(), scale: Scale::Log },
        y: Axis { label: "error".to_owned(), scale: Scale::Log },
        series,
        slopes: orders.into_iter().map(|order| Slope { order }).collect(),
    }
}
