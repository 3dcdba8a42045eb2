//! Plots of a sweep: a column of its table over another.

use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;

use super::StudyError;
use super::columns::Column;
use super::results::{Row, table};
use super::source::refuse;
use super::sweep_file::SweepStudy;
use crate::names::{absent, did_you_mean};
use crate::output::OutputError;
use crate::output::plot::{self, Plot, Scale, Series};
use crate::results::{label, names};
use crate::scene::{SceneSource, renamed};
use crate::schema::in_order;

/// `plot = { x = "model.peclet", y = "overshoot_velocity", series = "model.elasticity", log = "x" }`
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = in_order::<Self>)]
pub struct PlotSpec {
    /// A key that varies, or a column of counts.
    pub x: String,
    /// A measure.
    pub y: String,
    /// A key that varies: a curve for each of its values.
    pub series: Option<String>,
    /// Axes that are logarithmic.
    #[schemars(extend("enum" = ["x", "y", "xy"]))]
    pub log: Option<String>,
}

/// Columns of every table that have numbers.
const COUNTS: [&str; 10] = [
    "cells",
    "unknowns",
    "time",
    "steps",
    "rejected",
    "iterations",
    "residual",
    "distance",
    "seconds",
    "peak_memory_mib",
];

impl PlotSpec {
    /// # Errors
    /// Names of nothing that a table of the study has.
    pub(super) fn check(&self, source: &SceneSource, keys: &[&str], measures: &[&str]) -> Result<(), StudyError> {
        let fits = |name: &String| {
            let measured = measures.iter().any(|k| name == k || name.starts_with(&format!("{k}_")));
            measured || keys.contains(&name.as_str()) || COUNTS.contains(&name.as_str()) || name.starts_with("error_")
        };
        let known: Vec<&str> = keys.iter().chain(measures).copied().chain(COUNTS).collect();
        for (part, name) in [("x", Some(&self.x)), ("y", Some(&self.y))] {
            if let Some(name) = name.filter(|name| !fits(name)) {
                let rule = format!("`{part}` names no column of the table{}", did_you_mean(name, &known));
                let hint = format!("choose among {}", known.join(", "));
                return Err(refuse(source, "plot", format!("\"{name}\""), &rule, &hint));
            }
        }
        if let Some(name) = self.series.as_ref().filter(|name| !keys.contains(&name.as_str())) {
            let rule = format!("`series` names no key that varies{}", did_you_mean(name, keys));
            let hint = format!("what varies is {}", keys.join(", "));
            return Err(refuse(source, "plot", format!("\"{name}\""), &rule, &hint));
        }
        if !cfg!(feature = "pictures") {
            let hint = "remove [[plot]], results.csv tells the same; or build with `--features pictures`";
            return Err(refuse(source, "plot", "(given)".to_owned(), &absent(plot::FEATURE, plot::DOES), hint));
        }
        match self.log.as_deref() {
            None | Some("x" | "y" | "xy") => Ok(()),
            Some(other) => {
                let rule = "`log` must name the axes that are logarithmic";
                Err(refuse(source, "plot", format!("\"{other}\""), rule, "\"x\", \"y\" or \"xy\""))
            }
        }
    }

    fn scale(&self, axis: char) -> Scale {
        if self.log.as_ref().is_some_and(|log| log.contains(axis)) { Scale::Log } else { Scale::Linear }
    }
}

/// Writes the plots that a study asks for into `plots`, as far as there are points.
///
/// # Errors
/// Files that cannot be written.
pub fn write(study: &SweepStudy, rows: &[Row], out: &Path) -> Result<(), StudyError> {
    if study.plots.is_empty() {
        return Ok(());
    }
    let good: Vec<Row> = rows.iter().filter(|row| row.found.is_good() && row.found.is_complete()).cloned().collect();
    let columns = table(study, &good);
    let folder = out.join("plots");
    std::fs::create_dir_all(&folder).map_err(|e| OutputError::io(&folder, &e))?;
    let shared = shared_parameters(&good, out);
    let mut stems: Vec<String> = Vec::new();
    for spec in &study.plots {
        let stem = format!("{}-by-{}", spec.y, spec.x);
        let count = stems.iter().filter(|name| **name == stem).count();
        let name = if count == 0 { stem.clone() } else { format!("{stem}-{}", count + 1) };
        stems.push(stem);
        if let Some(plot) = plot(study, spec, &columns, good.len(), &shared) {
            plot.write(&folder.join(&name)).map_err(|error| OutputError::Malformed {
                path: folder.join(&name).display().to_string(),
                what: error.to_string(),
                hint: "the table beside it is complete",
            })?;
        }
    }
    Ok(())
}

/// The model's parameters that are the same in all these runs, on one line.
fn shared_parameters(rows: &[Row], out: &Path) -> String {
    let text = |row: &Row| std::fs::read_to_string(out.join(&row.case.folder).join("scene.toml")).ok();
    let scene = |row: &Row| renamed::table(&text(row)?).ok();
    let scenes: Vec<toml::Table> = rows.iter().filter_map(scene).collect();
    label::shared(&scenes.iter().collect::<Vec<_>>())
}

/// A curve for each combination of the other keys; `None` without a single point.
fn plot(study: &SweepStudy, spec: &PlotSpec, columns: &[Column], rows: usize, shared: &str) -> Option<Plot> {
    let of = |name: &str| columns.iter().find(|column| column.name == name);
    let (x, y) = (of(&spec.x)?, of(&spec.y)?);
    let mut others: Vec<&str> = study.keys().into_iter().filter(|key| *key != spec.x && *key != spec.y).collect();
    if let Some(series) = &spec.series {
        others.retain(|key| key != series);
        others.insert(0, series);
    }
    let others: Vec<&Column> = others.into_iter().filter_map(of).collect();
    let differs = |column: &&&Column| (0..rows).any(|row| column.text(row) != column.text(0));
    let (named, fixed): (Vec<&Column>, Vec<&Column>) = others.iter().copied().partition(|column| differs(&column));
    let label = |columns: &[&Column], row: usize| {
        let part = |column: &&Column| format!("{} = {}", names::words(&column.name), column.text(row));
        columns.iter().filter(|column| !column.text(row).is_empty()).map(part).collect::<Vec<_>>().join(", ")
    };
    // parameters of the model are among the shared ones
    let is_aside =
        |column: &&Column| !(column.name.starts_with("model.") && names::symbol(&column.name) != column.name);
    let fixed: Vec<&Column> = fixed.into_iter().filter(is_aside).collect();
    let subtitle: Vec<String> = [shared.to_owned(), label(&fixed, 0)].into_iter().filter(|s| !s.is_empty()).collect();
    let mut curves: Vec<(String, Vec<(f64, f64)>)> = Vec::new();
    for row in 0..rows {
        let Some(point) = x.number(row).zip(y.number(row)) else { continue };
        let name = label(&named, row);
        match curves.iter_mut().find(|(other, _)| *other == name) {
            Some((_, points)) => points.push(point),
            None => curves.push((name, vec![point])),
        }
    }
    for (_, points) in &mut curves {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    (!curves.is_empty()).then(|| Plot {
        title: study.title.clone().unwrap_or_else(|| names::over(&spec.y, &spec.x)),
        subtitle: subtitle.join(", "),
        x: names::axis(&spec.x, spec.scale('x')),
        y: names::axis(&spec.y, spec.scale('y')),
        series: curves.into_iter().map(|(name, points)| Series::new(name, points)).collect(),
        slopes: Vec::new(),
    })
}
