//! What a comparison with measured velocities found.

use maud::{Markup, html};
use serde_json::Value;

use super::pictures;
use super::tables::{notes, pairs, short};
use crate::results::Results;

/// What each number is, beside its name.
const MEANINGS: [(&str, &str); 15] = [
    ("relative", "root mean square of the difference, relative to the run"),
    ("relative_v1", "the part of the first component in it"),
    ("relative_v2", "the part of the second component in it"),
    ("bias_v1", "mean difference, data less run, of the first component"),
    ("bias_v2", "the same of the second component"),
    ("correlation_v1", "of data and run, first component"),
    ("correlation_v2", "of data and run, second component"),
    ("largest", "largest difference of a bin"),
    ("overshoot_difference", "percent, data less run"),
    ("overshoot_run", "percent, behind the obstacle on axis 1"),
    ("overshoot_measured", "percent, behind the obstacle on axis 1"),
    ("flux_minus", "flux of the data at the left end of the window, before the correction"),
    ("flux_plus", "the same at the right end"),
    ("noise", "what `relative` would be by the scatter of the data alone"),
    ("without_noise", "what is left of `relative` without it"),
];

/// The whole section of a comparison.
pub(super) fn section(found: &Results, budget: &mut pictures::ByteBudget) -> Markup {
    let mut remarks = found.problems.clone();
    let said = found.summary.as_ref().and_then(|summary| summary.get("notes")).and_then(Value::as_array);
    remarks.extend(said.into_iter().flatten().filter_map(|note| note.as_str().map(str::to_owned)));
    let (shown, count) = pictures::of_folder(found, budget, &mut remarks);
    html! {
        (verdict(found))
        (notes(&[], &remarks))
        (readings(found))
        @if count > 0 { h3 { "Pictures" } (shown) }
        (data(found))
    }
}

fn entry(found: &Results, measure: &str, column: &str) -> Option<f64> {
    let table = found.table("comparison.csv")?;
    let row = table.texts("measure")?.position(|name| name == measure)?;
    table.at(row, column)?.trim().parse().ok()
}

/// How far the run is from the data, and how far it would be if it were right.
fn verdict(found: &Results) -> Markup {
    let value = |name: &str| entry(found, name, "value");
    let at = ["largest_x1", "largest_x2"].map(value);
    html! {
        @if let (Some(relative), Some(noise)) = (value("relative"), value("noise")) {
            p.ending {
                "The data are " strong { (short(relative)) }
                @if let Some(error) = entry(found, "relative", "standard_error") { " ± " (short(error)) }
                " from the run (root mean square, relative). Their own scatter makes "
                strong { (short(noise)) } " of this."
            }
            @if let [Some(x1), Some(x2)] = at {
                p { "The largest difference is at (" (short(x1)) ", " (short(x2)) "), in disc radii." }
            }
        } @else if found.table("comparison.csv").is_some() {
            p.ending { "No run was compared with: this is what the data say alone." }
        }
    }
}

fn readings(found: &Results) -> Markup {
    let Some(table) = found.table("comparison.csv") else { return html! {} };
    let place = |name: &str| name.starts_with("largest_x");
    let rows: Vec<(usize, &str)> =
        table.texts("measure").into_iter().flatten().enumerate().filter(|(_, n)| !place(n)).collect();
    let number = |row: usize, column: &str| table.at(row, column).and_then(|text| text.trim().parse::<f64>().ok());
    html! {
        @if !rows.is_empty() {
            h3 { "What was found" }
            div.scroll {
                table {
                    caption { "In the window, with standard errors from leaving out parts of the record" }
                    thead {
                        tr {
                            th scope="col" { "measure" } th.number scope="col" { "value" }
                            th.number scope="col" { "standard error" } th scope="col" { "what it is" }
                        }
                    }
                    tbody {
                        @for (row, name) in rows {
                            tr {
                                th scope="row" { (name.replace('_', " ")) }
                                td.number { (number(row, "value").map_or_else(String::new, short)) }
                                td.number {
                                    @if let Some(error) = number(row, "standard_error") { "± " (short(error)) }
                                }
                                td { (meaning(name)) }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn meaning(measure: &str) -> &'static str {
    MEANINGS.iter().find(|(name, _)| *name == measure).map_or("", |(_, words)| words)
}

/// What was read and averaged.
fn data(found: &Results) -> Markup {
    let value = |path: &str| found.summary.as_ref().and_then(|summary| summary.pointer(path)).filter(|v| !v.is_null());
    let named = [
        ("table", "/data"),
        ("files", "/files"),
        ("rows that could be used", "/rows"),
        ("of them in the box", "/rows_in_box"),
        ("of them in the obstacle", "/rows_in_obstacle"),
        ("frames", "/frames"),
        ("parts for the standard errors", "/blocks"),
        ("bins along and across", "/bins"),
        ("bins with cells", "/bins_filled"),
        ("run", "/run/folder"),
        ("time of the run", "/run/time"),
        ("bins compared", "/run/bins_compared"),
    ];
    let text = |value: &Value| match value {
        Value::String(text) => text.clone(),
        Value::Array(all) => all.iter().map(Value::to_string).collect::<Vec<_>>().join(" × "),
        other => other.to_string(),
    };
    let rows = named.iter().filter_map(|(name, path)| Some(((*name).to_owned(), text(value(path)?))));
    html! { h3 { "What was compared" } (pairs("Data, bins and run", ["", "value"], &rows.collect::<Vec<_>>())) }
}
