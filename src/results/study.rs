//! Curves from the table of a study: its measures over what it varies.

use super::curves::{Drawn, Picture, What};
use super::names::{estimated, over, words};
use super::{Results, Table, label, names};
use crate::output::plot::{Axis, Plot, Scale, Series};

/// Columns that tell how a run went and what it cost, not what it found.
const ASIDE: [&str; 28] = [
    "run",
    "name",
    "status",
    "ending",
    "reason",
    "cells",
    "unknowns",
    "time",
    "steps",
    "rejected",
    "iterations",
    "nonlinear_iterations",
    "accepted_late",
    "residual",
    "stability",
    "seconds",
    "seconds_total",
    "said",
    "memory_mib",
    "peak_memory_mib",
    "threads",
    "attempts",
    "warm_start",
    "branch",
    "distance",
    "from",
    "note",
    "notes",
];

/// Values this many times as large as the smallest stand on a logarithmic axis.
const LOG_FROM: f64 = 30.0;

/// What the columns of a study's table are.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Columns {
    /// Keys of the scene that differ.
    pub keys: Vec<String>,
    /// Numbers that were found.
    pub measures: Vec<String>,
    /// How the runs went and what they cost.
    pub others: Vec<String>,
}

impl Columns {
    /// Sorts the columns of a table: keys have a dot or stand before `status`, measures are numbers that are not about
    /// the run.
    pub fn of(table: &Table) -> Self {
        let before = table.position("status").unwrap_or(0);
        let mut columns = Self::default();
        for (at, name) in table.header.iter().enumerate() {
            let aside = ASIDE.contains(&name.as_str()) || name.starts_with("seconds");
            if !aside && (at < before || (name.contains('.') && !name.starts_with("error_"))) {
                columns.keys.push(name.clone());
            } else if !aside && table.numbers(name).is_some_and(|all| all.iter().any(|x| x.is_finite())) {
                columns.measures.push(name.clone());
            } else {
                columns.others.push(name.clone());
            }
        }
        columns
    }
}

pub(super) fn draw(folder: &Results, drawn: &mut Drawn) {
    let Some(table) = folder.table("results.csv") else { return };
    let columns = Columns::of(table);
    let distinct = |key: &String| {
        let mut values: Vec<&str> = table.texts(key).into_iter().flatten().filter(|v| !v.is_empty()).collect();
        values.sort_unstable();
        values.dedup();
        values.len()
    };
    let is_number = |key: &&String| {
        let mut filled = table.texts(key).into_iter().flatten().filter(|value| !value.is_empty());
        filled.all(|value| value.parse::<f64>().is_ok())
    };
    let mut varied: Vec<&String> = columns.keys.iter().filter(|key| distinct(key) > 1).collect();
    // the first of those with the most values
    let Some(x) = varied.iter().filter(|key| is_number(key)).rev().max_by_key(|key| distinct(key)).copied() else {
        return;
    };
    varied.retain(|key| *key != x);
    let groups: Vec<String> = (0..table.rows.len()).map(|row| told(table, row, &varied)).collect();
    let mut names: Vec<&String> = Vec::new();
    groups.iter().for_each(|group| {
        if !names.contains(&group) {
            names.push(group);
        }
    });
    let runs: Vec<&Results> = folder.parts.iter().collect();
    let subtitle = [folder.title(), label::common(&runs)].join("; ");
    let subtitle = subtitle.trim_end_matches("; ");
    // an error belongs to its measure
    let is_own = |measure: &&String| !estimated(measure).is_some_and(|of| columns.measures.iter().any(|m| m == of));
    for measure in columns.measures.iter().filter(is_own) {
        let (Some(at), Some(values)) = (table.numbers(x), table.numbers(measure)) else { continue };
        let series = names.iter().map(|name| {
            let rows = (0..table.rows.len()).filter(|&row| groups[row] == **name);
            let mut points: Vec<(f64, f64)> =
                rows.map(|row| (at[row], values[row])).filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            Series::new(name.as_str(), points)
        });
        let series: Vec<Series> = series.filter(|series| !series.points.is_empty()).collect();
        let mut places: Vec<f64> = series.iter().flat_map(|s| s.points.iter().map(|p| p.0)).collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        if places.len() < 2 {
            continue;
        }
        let y = names::axis(measure, if measure.starts_with("error_") { Scale::Log } else { Scale::Linear });
        let (title, subtitle) = (over(measure, x), subtitle.to_owned());
        let plot = Plot { title, subtitle, x: axis_of(x, &places), y, series, slopes: Vec::new() };
        let file: String = measure.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        drawn.pictures.push(Picture { name: format!("study-{file}"), what: What::Study, plot });
    }
}

/// The values of the other keys, as a legend has them.
fn told(table: &Table, row: usize, keys: &[&String]) -> String {
    let one = |key: &&String| {
        let value = table.at(row, key).filter(|value| !value.is_empty())?;
        Some(format!("{} = {value}", words(key)))
    };
    keys.iter().filter_map(one).collect::<Vec<_>>().join(", ")
}

fn axis_of(key: &str, sorted: &[f64]) -> Axis {
    let (least, largest) = (sorted[0], sorted[sorted.len() - 1]);
    let wide = least > 0.0 && largest > LOG_FROM * least;
    names::axis(key, if wide { Scale::Log } else { Scale::Linear })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_sorted_without_a_fixed_set() {
        let header = ["run", "model.peclet", "status", "later", "reason", "defects", "seconds", "note"];
        let row = ["01", "2", "finished", "", "", "4", "1.5", "fine"];
        let texts = |all: [&str; 8]| all.map(str::to_owned).to_vec();
        let table = Table { header: texts(header), rows: vec![texts(row)], cut_off: false };
        let columns = Columns::of(&table);
        assert_eq!(columns.keys, ["model.peclet"]);
        assert_eq!(columns.measures, ["defects"]);
        assert_eq!(columns.others, ["run", "status", "later", "reason", "seconds", "note"]);
    }
}
