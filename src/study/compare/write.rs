//! The folder of a comparison.

use std::path::Path;

use serde_json::{Value, json};

use super::{CompareStudy, Comparison, Computed, maps};
use crate::measure::measured::{Binned, Flux, overshoot};
use crate::mesh::Point;
use crate::output::plot::{self, Line, Markers, Plot, Series, Symbol, if_drawn};
use crate::output::{OutputError, number, write_whole};
use crate::scene::{Axis, AxisLine};
use crate::study::StudyError;
use crate::study::table::write_rows;

const AXES: [Axis; 6] = [Axis::Axis1, Axis::Axis2a, Axis::Axis2b, Axis::Axis3, Axis::Axis4, Axis::Axis5];

/// Points of a cut, as many as a run has.
const CUT_POINTS: usize = 1001;

/// Writes tables, cuts, summary and plots.
pub(super) fn write(study: &CompareStudy, found: &Comparison, out: &Path) -> Result<(), StudyError> {
    write_rows(&out.join("field.csv"), &field_rows(found))?;
    if let Some(computed) = &found.computed {
        write_rows(&out.join("run.csv"), &run_rows(computed))?;
    }
    write_rows(&out.join("comparison.csv"), &reading_rows(found))?;
    write_cuts(study, found, out)?;
    write_plots(study, found, out)?;
    maps::write(study, found, &out.join("plots"))?;
    let summary = serde_json::to_string_pretty(&summary(study, found)).expect("a tree of values");
    write_whole(&out.join("summary.json"), |file| file.write_all(summary.as_bytes()))?;
    Ok(())
}

/// Empty for what is not known.
fn cell(value: f64) -> String {
    if value.is_finite() { number(value) } else { String::new() }
}

fn header(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// One row per bin; an empty bin has no velocity.
fn field_rows(found: &Comparison) -> Vec<Vec<String>> {
    let (field, averages) = (&found.measured, &found.averages);
    let row = |bin: usize| {
        let (x, v, var) = (field.bins.centre(bin), field.values[bin], field.variances[bin]);
        let counts = [averages.cells[bin].to_string(), averages.frames[bin].to_string()];
        let numbers = [v.x, v.y, var.x.sqrt(), var.y.sqrt()];
        let shown = numbers.map(|value| if field.is_filled(bin) { cell(value) } else { String::new() });
        [number(x.x), number(x.y)].into_iter().chain(counts).chain(shown).collect()
    };
    let head = header(&["x1", "x2", "count", "frames", "v1", "v2", "se1", "se2"]);
    std::iter::once(head).chain((0..field.bins.len()).map(row)).collect()
}

fn run_rows(computed: &Computed) -> Vec<Vec<String>> {
    let field = &computed.field;
    let row = |bin: usize| {
        let (x, v) = (field.bins.centre(bin), field.values[bin]);
        let shown = [v.x, v.y].map(|value| if field.is_filled(bin) { cell(value) } else { String::new() });
        [x.x, x.y, computed.shares[bin]].map(number).into_iter().chain(shown).collect()
    };
    let head = header(&["x1", "x2", "share", "v1", "v2"]);
    std::iter::once(head).chain((0..field.bins.len()).map(row)).collect()
}

fn reading_rows(found: &Comparison) -> Vec<Vec<String>> {
    let mut rows = vec![header(&["measure", "value", "standard_error"])];
    rows.extend(found.readings.iter().map(|r| vec![r.name.to_owned(), cell(r.value), cell(r.error)]));
    if let Some(Computed { difference, .. }) = &found.computed {
        rows.push(vec!["noise".to_owned(), cell(difference.noise), String::new()]);
        rows.push(vec!["without_noise".to_owned(), cell(difference.without_noise()), String::new()]);
        rows.push(vec!["largest_x1".to_owned(), cell(difference.largest_at.x), String::new()]);
        rows.push(vec!["largest_x2".to_owned(), cell(difference.largest_at.y), String::new()]);
    }
    rows
}

/// Ends of an axis in the box, `None` if it misses the box.
fn ends(axis: Axis, field: &Binned) -> Option<[Point; 2]> {
    let (low, high) = (field.bins.low, field.bins.high);
    let (from, to) = match axis.line() {
        AxisLine::Horizontal(y) => (Point::new(low.x, y), Point::new(high.x, y)),
        AxisLine::Vertical(x) => (Point::new(x, low.y), Point::new(x, high.y)),
    };
    (field.bins.find(from).is_some() && field.bins.find(to).is_some()).then_some([from, to])
}

/// Columns of a run's cuts as far as there are data, then the standard errors.
fn write_cuts(study: &CompareStudy, found: &Comparison, out: &Path) -> Result<(), OutputError> {
    let field = &found.measured;
    let folder = out.join("cuts");
    std::fs::create_dir_all(&folder).map_err(|e| OutputError::io(&folder, &e))?;
    for axis in AXES {
        let Some([from, to]) = ends(axis, field) else { continue };
        let mut rows = vec![header(&["s", "x1", "x2", "v1", "v2", "se1", "se2"])];
        for k in 0..CUT_POINTS {
            let share = k as f64 / (CUT_POINTS - 1) as f64;
            let x = from + (to - from) * share;
            let outside = x.norm() >= study.obstacle;
            if let (true, Some(v), Some(e)) = (outside, field.at(x), field.error_at(x)) {
                rows.push([share * (to - from).norm(), x.x, x.y, v.x, v.y, e.x, e.y].map(cell).to_vec());
            }
        }
        write_rows(&folder.join(format!("{}.csv", axis.name())), &rows)?;
    }
    Ok(())
}

/// `plots/axis-….svg` and `.png`: `v_1` on each axis, of the data and the run.
fn write_plots(study: &CompareStudy, found: &Comparison, out: &Path) -> Result<(), OutputError> {
    let folder = out.join("plots");
    std::fs::create_dir_all(&folder).map_err(|e| OutputError::io(&folder, &e))?;
    for axis in AXES {
        let Some(plot) = axis_plot(study, found, axis) else { continue };
        let path = folder.join(axis.name());
        if_drawn(plot.write(&path)).map_err(|error| OutputError::Malformed {
            path: path.display().to_string(),
            what: error.to_string(),
            hint: "the tables beside it are complete",
        })?;
    }
    Ok(())
}

fn axis_plot(study: &CompareStudy, found: &Comparison, axis: Axis) -> Option<Plot> {
    let field = &found.measured;
    let [from, to] = ends(axis, field)?;
    let (along, across, place) = match axis.line() {
        AxisLine::Horizontal(y) => (0, "x_1 / disc radius", format!("x₂ = {y}")),
        AxisLine::Vertical(x) => (1, "x_2 / disc radius", format!("x₁ = {x}")),
    };
    // NaN in the obstacle and where there is nothing
    let curve = |count: usize, shift: f64, value: &dyn Fn(Point) -> Option<f64>| -> Vec<(f64, f64)> {
        let at = |k: usize| from + (to - from) * ((k as f64 + shift) / (count as f64 - 1.0 + 2.0 * shift));
        let value = |x: Point| Some(x).filter(|x| x.norm() >= study.obstacle).and_then(value).unwrap_or(f64::NAN);
        (0..count).map(|k| (at(k)[along], value(at(k)))).collect()
    };
    let plain = |name: &str, points, line, markers| Series { name: name.into(), points, line, markers, colour: None };
    let centres = curve(field.bins.count[along], 0.5, &|x| Some(field.at(x)?.x));
    let centres = centres.into_iter().filter(|(_, v)| v.is_finite()).collect();
    let mut series = vec![plain("measured", centres, Line::None, Markers::Filled(Symbol::Circle))];
    if let Some(computed) = &found.computed {
        let averaged = curve(CUT_POINTS, 0.0, &|x| Some(computed.field.at(x)?.x));
        let points = curve(CUT_POINTS, 0.0, &|x| Some(computed.run.at(x)?.x));
        let finite = |points: Vec<(f64, f64)>| split(&points);
        for (name, parts) in [("run, treated as the data", finite(averaged)), ("run", finite(points))] {
            let colour = if name == "run" { 2 } else { 1 };
            series.extend(
                parts
                    .into_iter()
                    .map(|points| Series { colour: Some(colour), ..plain(name, points, Line::Solid, Markers::None) }),
            );
        }
    }
    let title = study.title.clone().unwrap_or_else(|| "measured velocity".to_owned());
    let subtitle = format!("{}, {place}; filter {}{}", axis.name(), study.filter, window_text(study));
    let (x, y) = (plot::Axis::linear(across), plot::Axis::linear("v_1"));
    Some(Plot { title, subtitle, x, y, series, slopes: Vec::new() })
}

fn window_text(study: &CompareStudy) -> String {
    study.window.map_or_else(String::new, |l| format!("; flux kept at x₁ = ±{l}"))
}

/// The pieces between gaps.
fn split(points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let pieces = points.split(|(_, v)| !v.is_finite()).filter(|piece| !piece.is_empty());
    pieces.map(<[(f64, f64)]>::to_vec).collect()
}

fn summary(study: &CompareStudy, found: &Comparison) -> Value {
    let bins = found.averages.bins;
    let readings: serde_json::Map<String, Value> = found
        .readings
        .iter()
        .map(|r| (r.name.to_owned(), json!({ "value": r.value, "standard_error": r.error })))
        .collect();
    let in_box = found.tracks.samples.iter().filter(|sample| bins.find(sample.x).is_some()).count();
    let used: u64 = found.averages.cells.iter().sum();
    let flux = |flux: &Option<Flux>| flux.map(|f| json!({ "window": f.window, "minus": f.minus, "plus": f.plus }));
    let end = study.window.unwrap_or(bins.high.x);
    let place = |field: &Binned| overshoot(field, study.obstacle, end).map(|(_, x1)| x1);
    let run = found.computed.as_ref().map(|computed| {
        let d = &computed.difference;
        json!({
            "folder": study.run,
            "time": computed.run.time,
            "bins_compared": d.bins,
            "noise": d.noise,
            "without_noise": d.without_noise(),
            "largest_at": [d.largest_at.x, d.largest_at.y],
            "flux": flux(&computed.flux),
            "overshoot_x1": place(&computed.field),
        })
    });
    json!({
        "title": study.title,
        "data": study.data,
        "files": study.files.len(),
        "notes": found.tracks.notes,
        "rows": found.tracks.samples.len(),
        "rows_in_box": in_box,
        "rows_in_obstacle": in_box as u64 - used,
        "frames": found.tracks.frames,
        "blocks": found.blocks,
        "bins": bins.count,
        "bins_filled": found.averages.frames.iter().filter(|n| **n > 0).count(),
        "flux": flux(&found.flux),
        "overshoot_x1": place(&found.measured),
        "measures": readings,
        "run": run,
        "version": env!("CARGO_PKG_VERSION"),
    })
}
