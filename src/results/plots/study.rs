//! Curves from the table of a study: its measures over what it varies.

use super::{Draw, PlotKind, When};
use crate::output::plot::{Axis, Plot, Scale, Series};
use crate::results::curves::{Drawn, Image, Picture};
use crate::results::names::{estimated, over, words};
use crate::results::study::Columns;
use crate::results::{Results, ResultsKind, Table, label, names};

/// Values this many times as large as the smallest stand on a logarithmic axis.
const LOG_FROM: f64 = 30.0;

/// Measures over the key with the most values.
pub const STUDY: PlotKind = PlotKind {
    name: "study",
    help: "each measure over the key with the most values, a curve for each combination of the others",
    needs: "a study with a number that varies and measures",
    when: When::OfAFolder,
    draw: Draw::With(|kind, source, drawn| {
        let sweeps = source.folders.iter().filter(|folder| folder.kind == ResultsKind::Sweep);
        sweeps.for_each(|folder| draw(kind, folder, drawn));
        Ok(())
    }),
};

fn draw(kind: &'static PlotKind, folder: &Results, drawn: &mut Drawn) {
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
        drawn.pictures.push(Picture { name: format!("study-{file}"), kind, image: Image::Curves(plot) });
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
