//! What a run found and what it cost.

use maud::{Markup, html};
use serde_json::Value;

use super::tables::{cell, notes, pairs, short};
use super::{bodies, equations, pictures};
use crate::output::frames::{self, Frame};
use crate::results::curves::{CurveSettings, curves};
use crate::results::{Results, ResultsKind, names};

/// What each ending means, in words.
const ENDINGS: [(&str, &str); 8] = [
    ("end-time", "The end time was reached"),
    ("max-steps", "The largest number of steps was taken"),
    ("stationary", "The residual of the stationary equations fell below its bound"),
    ("energy-at-rest", "The free energy came to rest"),
    ("steady", "A steady state was found"),
    ("oscillating", "No stable steady state was found, but a flow that repeats itself"),
    ("interrupted", "The run was stopped from outside; it can be resumed"),
    ("failed", "A step failed; the last good state was kept"),
];

/// The whole section of a run.
pub(super) fn section(run: &Results, budget: &mut pictures::ByteBudget) -> Markup {
    let mut remarks = run.problems.clone();
    remarks.extend(remarks_of(run));
    let failures: Vec<String> = text(run, "reason").map(str::to_owned).into_iter().collect();
    let frames = frames(run, &mut remarks);
    let (shown, count) = pictures::of_folder(run, budget, &mut remarks);
    let table_of_bodies = bodies::table(run, &mut remarks);
    let own =
        if count == 0 { curves(&[run], &CurveSettings::default()).unwrap_or_default() } else { Default::default() };
    remarks.extend(own.notes.iter().cloned());
    html! {
        (ending(run))
        (notes(&failures, &remarks))
        (measures(run))
        (steady(run))
        (table_of_bodies)
        @if count > 0 || !own.pictures.is_empty() {
            h3 { "Pictures" }
            (shown)
            (pictures::drawn(&own))
            (bodies::films(&frames))
        }
        @if run.kind == ResultsKind::Run {
            h3 { "What was solved" }
            (equations::solved(run))
            (cost(run))
        }
    }
}

/// The pictures that belong to films.
fn frames(run: &Results, remarks: &mut Vec<String>) -> Vec<Frame> {
    let path = run.path.join(frames::TABLE);
    if !path.exists() {
        return Vec::new();
    }
    frames::read(&path).unwrap_or_else(|error| {
        remarks.push(error.to_string());
        Vec::new()
    })
}

pub(super) fn get<'a>(run: &'a Results, path: &str) -> Option<&'a Value> {
    run.summary.as_ref()?.pointer(path)
}

pub(super) fn text<'a>(run: &'a Results, key: &str) -> Option<&'a str> {
    get(run, &format!("/{key}"))?.as_str()
}

pub(super) fn number(run: &Results, path: &str) -> Option<f64> {
    get(run, path)?.as_f64()
}

fn ending(run: &Results) -> Markup {
    let status = text(run, "status");
    let colour = match status {
        Some("finished") => "good",
        Some("failed") => "bad",
        Some(_) => "warn",
        None => "warn",
    };
    let name = text(run, "ending").unwrap_or_default();
    let words = ENDINGS.iter().find(|(ending, _)| *ending == name).map_or(name, |(_, words)| words);
    let reached = number(run, "/time").zip(number(run, "/steps")).map(|(t, steps)| {
        let residual = number(run, "/residual").map_or_else(String::new, |r| format!("; residual {}", short(r)));
        format!(" at t = {} after {} steps{residual}.", short(t), short(steps))
    });
    html! {
        @if run.kind == ResultsKind::Run {
            p.ending {
                span.state.(colour) { (status.unwrap_or("not ended")) } " "
                @if status.is_some() { (words) (reached.unwrap_or_default()) }
            }
        }
    }
}

/// What the summary says that a reader must know: its own notes, and counts that should be zero.
fn remarks_of(run: &Results) -> Vec<String> {
    let mut remarks = Vec::new();
    for key in ["said", "notes"] {
        let listed = get(run, &format!("/{key}")).and_then(Value::as_array);
        remarks.extend(listed.into_iter().flatten().filter_map(|note| note.as_str().map(str::to_owned)));
    }
    let count = |path: &str| number(run, path).filter(|count| *count > 0.0);
    if let Some(reason) = text(run, "not_estimated") {
        remarks.push(format!("the errors of the measures were not estimated: {reason}"));
    }
    let told = remarks.iter().any(|remark| remark.contains("`coupling.accept`"));
    if let Some(late) = count("/accepted_late").filter(|_| !told) {
        remarks.push(format!(
            "{} steps did not reach the tolerance of the coupling, and were accepted with a larger one",
            short(late)
        ));
    }
    if let Some(limited) = count("/limited") {
        remarks.push(format!("the density was limited in {} cells, counted over all steps", short(limited)));
    }
    if let Some(rejected) = count("/rejected") {
        remarks.push(format!("{} steps were rejected and repeated with half the length", short(rejected)));
    }
    match get(run, "/steady/stability").and_then(Value::as_str) {
        Some("unstable") => {
            let size = number(run, "/steady/unstable_dimension")
                .map_or_else(String::new, |n| format!(" in {} directions", short(n)));
            remarks.push(format!("the steady state is unstable: disturbances grow{size}"));
        }
        Some("not-known") => remarks.push("whether the steady state is stable is not known".to_owned()),
        Some(_) | None => {}
    }
    if text(run, "ending") == Some("stationary") {
        remarks.push("whether the state is stable was not examined".to_owned());
    }
    remarks
}

/// An estimate of the error of a measure, whichever form it has.
fn estimate(run: &Results, measure: &str) -> Option<String> {
    let estimates = run.summary.as_ref()?.get("estimates")?;
    let found = estimates.get(measure).or_else(|| {
        let named =
            |entry: &&Value| entry.get("measure").or(entry.get("name")).and_then(Value::as_str) == Some(measure);
        estimates.as_array()?.iter().find(named)
    })?;
    let from = |value: &Value| value.as_f64().filter(|x| x.is_finite());
    let keys = ["error", "estimate", "value"];
    let size = from(found).or_else(|| keys.iter().find_map(|key| found.get(*key).and_then(from)))?;
    Some(short(size.abs()))
}

fn measures(run: &Results) -> Markup {
    let Some(all) = get(run, "/measures").and_then(Value::as_object).filter(|all| !all.is_empty()) else {
        return html! {};
    };
    let estimated = all.keys().any(|name| estimate(run, name).is_some());
    html! {
        h3 { "What was found" }
        div.scroll {
            table {
                caption {
                    "Measures of the last state"
                    @if let Some(from) = get(run, "/estimated/contains").and_then(Value::as_str) {
                        "; the errors are those of " (from)
                    }
                }
                thead {
                    tr {
                        th scope="col" { "measure" }
                        th.number scope="col" { "value" }
                        @if estimated { th.number scope="col" { "estimated error" } }
                    }
                }
                tbody {
                    @for (name, value) in all {
                        tr {
                            th scope="row" { (names::with_unit(name)) }
                            (cell(&value.to_string()))
                            @if estimated {
                                td.number { @if let Some(size) = estimate(run, name) { "± " (size) } @else { "–" } }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn steady(run: &Results) -> Markup {
    let list = |key: &str| get(run, &format!("/steady/{key}")).and_then(Value::as_array).cloned().unwrap_or_default();
    let (eigenvalues, tries) = (list("eigenvalues"), list("tries"));
    let part = |value: &Value, key: &str| value.get(key).and_then(Value::as_f64).map_or_else(String::new, short);
    let stability = get(run, "/steady/stability").and_then(Value::as_str);
    html! {
        @if let Some(stability) = stability { p { "The steady state is " strong { (stability) } "." } }
        @if let Some(oscillation) = get(run, "/steady/oscillation") {
            p {
                "It repeats itself with the period " strong { (part(oscillation, "period")) }
                ", amplitude of the polarity " (part(oscillation, "amplitude")) ", of the velocity "
                (part(oscillation, "amplitude_velocity")) "."
            }
        }
        div.columns {
            @if !eigenvalues.is_empty() {
                div.scroll {
                    table {
                        caption { "Leading eigenvalues: disturbances behave like exp(λt)" }
                        thead {
                            tr {
                                th.number scope="col" { "growth rate" }
                                th.number scope="col" { "angular frequency" }
                            }
                        }
                        tbody {
                            @for e in &eigenvalues {
                                tr { td.number { (part(e, "re")) } td.number { (part(e, "im")) } }
                            }
                        }
                    }
                }
            }
            @if !tries.is_empty() { (tried(&tries)) }
        }
    }
}

/// A value as a word.
fn word(value: &Value, key: &str) -> String {
    match value.get(key) {
        Some(Value::String(text)) => text.clone(),
        Some(other) => other.to_string(),
        None => String::new(),
    }
}

/// The ways in which a steady state was searched for.
fn tried(tries: &[Value]) -> Markup {
    let part = |value: &Value, key: &str| value.get(key).and_then(Value::as_f64).map_or_else(String::new, short);
    html! {
        div.scroll {
            table {
                caption { "Ways that were tried" }
                thead {
                    tr {
                        th scope="col" { "way" }
                        th.number scope="col" { "steps" }
                        th scope="col" { "outcome" }
                    }
                }
                tbody {
                    @for t in tries {
                        tr {
                            th scope="row" { (word(t, "way")) }
                            td.number { (part(t, "steps")) }
                            td { (word(t, "outcome")) }
                        }
                    }
                }
            }
        }
    }
}

fn cost(run: &Results) -> Markup {
    if run.summary.is_none() {
        return html! {};
    }
    let mut phases: Vec<(String, f64)> = get(run, "/seconds")
        .and_then(Value::as_object)
        .into_iter()
        .flatten()
        .filter_map(|(name, seconds)| Some((name.clone(), seconds.as_f64()?)))
        .collect();
    phases.sort_by(|a, b| b.1.total_cmp(&a.1));
    let phases: Vec<(String, String)> = phases.into_iter().map(|(name, s)| (name, format!("{s:.3}"))).collect();
    let found = [
        ("seconds in all", "/seconds_total"),
        ("seconds per iteration", "/seconds_per_iteration"),
        ("peak memory (MiB)", "/peak_memory_mib"),
        ("threads", "/threads"),
        ("steps", "/steps"),
        ("rejected steps", "/rejected"),
        ("nonlinear iterations", "/nonlinear_iterations"),
        ("linear iterations", "/polarity_linear_iterations"),
        ("factorisations", "/factorisations"),
        ("direct solves", "/direct_solves"),
    ];
    let rows = found.iter().filter_map(|(name, path)| {
        let value = get(run, path).filter(|value| value.is_number())?;
        let rounded = value.as_f64().filter(|x| x.fract() != 0.0).map(|x| format!("{x:.3}"));
        Some(((*name).to_owned(), rounded.unwrap_or_else(|| value.to_string())))
    });
    let rows: Vec<(String, String)> = rows.collect();
    html! {
        h3 { "What it cost" }
        div.columns {
            (pairs("Work", ["", "count"], &rows))
            (pairs("Wall time by phase", ["phase", "seconds"], &phases))
        }
    }
}
