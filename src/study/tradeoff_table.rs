//! What a study of a trade-off leaves: `tradeoff.csv`, a plot of error against time for every measure, a table to read.

use std::fmt::Write as _;
use std::path::Path;

use super::StudyError;
use super::table::write_rows;
use super::tradeoff::{Error, Point, Tradeoff};
use super::tradeoff_file::{Reference, TradeoffStudy};
use crate::measure::errors::Norm;
use crate::output::plot::{Axis, Line, Markers, Plot, Series, Symbol, if_drawn};
use crate::output::{OutputError, number};
use crate::results::names;

/// Writes the table and the plots anew.
///
/// # Errors
/// Files that cannot be written.
pub fn write(study: &TradeoffStudy, found: &Tradeoff, out: &Path) -> Result<(), StudyError> {
    write_rows(&out.join("tradeoff.csv"), &rows(study, found))?;
    for name in &study.measures {
        let file = if study.measures.len() == 1 { "tradeoff".to_owned() } else { format!("tradeoff-{}", plain(name)) };
        if_drawn(plot(study, found, name).write(&out.join(&file))).map_err(|error| OutputError::Malformed {
            path: out.join(file).display().to_string(),
            what: error.to_string(),
            hint: "the table beside it is complete",
        })?;
    }
    Ok(())
}

fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' }).collect()
}

/// A row per setting; of each measure its error, whether that is a bound (`≤`), and whether it is on the front.
fn rows(study: &TradeoffStudy, found: &Tradeoff) -> Vec<Vec<String>> {
    let mut header = vec!["setting".to_owned()];
    header.extend(
        study.measures.iter().flat_map(|m| [format!("error {m}"), format!("bound {m}"), format!("on_front {m}")]),
    );
    header.extend(["seconds", "peak_memory_mib", "cells", "unknowns", "iterations", "reason"].map(str::to_owned));
    let mut rows = vec![header];
    for point in &found.points {
        let mut row = vec![point.setting.clone()];
        for name in &study.measures {
            let error = point.errors.get(name);
            row.push(error.map(|e| number(e.value)).unwrap_or_default());
            row.push(error.map(|e| if e.is_bound { "≤" } else { "" }.to_owned()).unwrap_or_default());
            row.push(if point.front.contains(name) { "yes" } else { "no" }.to_owned());
        }
        row.push(if point.seconds.is_finite() { number((point.seconds * 1e3).round() / 1e3) } else { String::new() });
        row.push(point.memory_mib.map(|m| number(m.round())).unwrap_or_default());
        row.extend([point.cells, point.unknowns, point.iterations].map(|count| count.to_string()));
        row.push(point.failure.clone().unwrap_or_default());
        rows.push(row);
    }
    if !found.reference.is_empty() {
        let mut row = vec!["(error of the reference)".to_owned()];
        row.extend(study.measures.iter().flat_map(|m| [number(found.reference[m]), String::new(), String::new()]));
        row.resize(rows[0].len(), String::new());
        rows.push(row);
    }
    rows
}

fn shown(error: Option<&Error>) -> String {
    error.map_or_else(|| "-".to_owned(), |e| format!("{}{:.2e}", if e.is_bound { "≤" } else { "" }, e.value))
}

/// One line about a setting that has run.
pub fn told(study: &TradeoffStudy, point: &Point) -> String {
    let errors: Vec<String> =
        study.measures.iter().map(|name| format!("{name} {}", shown(point.errors.get(name)))).collect();
    match &point.failure {
        Some(reason) => format!("{}: failed: {reason}", point.setting),
        None => format!("{}: {:.2} s, {}", point.setting, point.seconds, errors.join(", ")),
    }
}

/// The table to read; `*` marks the front.
pub fn text(study: &TradeoffStudy, found: &Tradeoff) -> String {
    let widest = found.points.iter().map(|p| p.setting.chars().count()).max().unwrap_or(0).max(22);
    let mut out = String::new();
    let _ = write!(out, "{:<widest$} {:>9} {:>6} {:>9}", "setting", "seconds", "MiB", "unknowns");
    for name in &study.measures {
        let _ = write!(out, " {:>width$}", name, width = name.chars().count().max(11));
    }
    let _ = writeln!(out);
    for point in &found.points {
        let memory = point.memory_mib.map_or_else(|| "-".to_owned(), |m| format!("{m:.0}"));
        let _ = write!(out, "{:<widest$} {:>9.2} {memory:>6} {:>9}", point.setting, point.seconds, point.unknowns);
        for name in &study.measures {
            let mark = if point.front.contains(name) { "*" } else { "" };
            let cell = shown(point.errors.get(name)) + mark;
            let _ = write!(out, " {cell:>width$}", width = name.chars().count().max(11));
        }
        let _ = writeln!(
            out,
            "{}",
            point.failure.as_ref().map_or_else(String::new, |reason| format!("  failed: {reason}"))
        );
    }
    if !found.reference.is_empty() {
        let _ = write!(out, "{:<widest$} {:>9} {:>6} {:>9}", "error of the reference", "", "", "");
        for name in &study.measures {
            let _ = write!(out, " {:>width$.2e}", found.reference[name], width = name.chars().count().max(11));
        }
        let _ = writeln!(out);
    }
    let _ = write!(out, "* no other setting is at once as fast and as exact; ≤ not resolved by the reference");
    out
}

fn marker(at: usize) -> Markers {
    let shapes =
        [Symbol::Square, Symbol::Triangle, Symbol::Circle, Symbol::Diamond, Symbol::TriangleDown, Symbol::Star];
    if (at / 6).is_multiple_of(2) { Markers::Filled(shapes[at % 6]) } else { Markers::Open(shapes[at % 6]) }
}

/// Error over time, a marker for each setting, the front as a line.
fn plot(study: &TradeoffStudy, found: &Tradeoff, name: &str) -> Plot {
    let place = |point: &Point| Some((point.seconds, point.errors.get(name)?.value));
    let mut front: Vec<(f64, f64)> =
        found.points.iter().filter(|p| p.front.iter().any(|m| m == name)).filter_map(place).collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    let line = Series { line: Line::Solid, markers: Markers::None, ..Series::new("no setting beats these", front) };
    let points = found.points.iter().enumerate().filter(|(_, p)| p.failure.is_none()).map(|(at, point)| Series {
        line: Line::None,
        // eleven colours beside the front's and twelve markers make 132 pairs
        colour: Some(at % 11 + 1),
        markers: marker(at),
        ..Series::new(point.setting.clone(), place(point).into_iter().collect())
    });
    let series = std::iter::once(line).chain(points).collect();
    let (measure, error) = match &study.reference {
        Reference::Exact => {
            let (field, norm) = name.split_once(' ').unwrap_or((name, Norm::Square.name()));
            let words = names::error(field, norm).unwrap_or_else(|| name.to_owned());
            (words.clone(), format!("{words} (dimensionless)"))
        }
        Reference::Finest { .. } => (names::words(name), format!("error of the {}", names::with_unit(name))),
    };
    let resolved = found.reference.get(name).map_or_else(String::new, |e| format!("; error of the reference {e:.1e}"));
    Plot {
        title: study.title.clone().unwrap_or_else(|| "Error against time".to_owned()),
        subtitle: format!("{measure}{resolved}"),
        x: Axis::log("wall time, seconds"),
        y: Axis::log(error),
        series,
        slopes: Vec::new(),
    }
}
