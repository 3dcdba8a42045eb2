//! What a study found.

use maud::{Markup, html};

use super::pictures;
use super::tables::{notes, sortable};
use crate::results::curves::{CurveSettings, curves};
use crate::results::plots::{self, When};
use crate::results::study::Columns;
use crate::results::{Drawn, Results, ResultsKind, Table};

/// Pictures of more runs than these would hide each other.
const FEW: usize = 8;

/// Words for the status of what went well.
const GOOD: [&str; 4] = ["finished", "complete", "done", ""];

/// The whole section of a study.
pub(super) fn section(study: &Results, budget: &mut pictures::ByteBudget) -> Markup {
    let mut remarks = study.problems.clone();
    for part in &study.parts {
        remarks.extend(part.problems.iter().map(|problem| format!("{}: {problem}", part.name)));
    }
    remarks.extend(said(study));
    let failures = failures(study);
    let (shown, count) = pictures::of_folder(study, budget, &mut remarks);
    let parts: Vec<(String, Markup)> = study
        .parts
        .iter()
        .filter(|part| part.kind == ResultsKind::Order)
        .map(|part| (part.name.clone(), pictures::of_folder(part, budget, &mut remarks).0))
        .collect();
    let drawn = own_curves(study, count, &mut remarks);
    html! {
        (counts(study))
        (notes(&failures, &remarks))
        @if study.kind == ResultsKind::Sweep || study.kind == ResultsKind::Tradeoff { (results(study)) }
        @if count > 0 || !drawn.pictures.is_empty() || !parts.is_empty() {
            h3 { "Pictures" }
            (shown)
            (pictures::drawn(&drawn))
            @for (name, pictures) in &parts { h4 { (name) } (pictures) }
        }
        @if study.kind == ResultsKind::Order || study.kind == ResultsKind::Branches { (results(study)) }
    }
}

/// Curves from the tables: measures over parameters where the folder has no pictures, and the curves of a few runs in
/// common.
fn own_curves(study: &Results, pictures: usize, remarks: &mut Vec<String>) -> Drawn {
    let mut all = Drawn::default();
    if study.kind != ResultsKind::Sweep {
        return all;
    }
    let over_parameters = (pictures == 0).then_some(&plots::STUDY);
    let few = study.parts.len() <= FEW;
    let compared = plots::ALL.iter().copied().filter(|kind| few && kind.when == When::Always);
    for what in over_parameters.into_iter().chain(compared) {
        // of the sections one quantity is enough for a page of many runs
        let wish =
            CurveSettings { what: vec![what], quantities: vec!["velocity_1".to_owned()], ..CurveSettings::default() };
        // what the folder does not have is an error for a wish by name alone
        let drawn = curves(&[study], &wish).unwrap_or_default();
        all.pictures.extend(drawn.pictures);
        remarks.extend(drawn.notes);
    }
    all
}

fn main_table(study: &Results) -> Option<&Table> {
    ["results.csv", "runs.csv", "tradeoff.csv"].iter().find_map(|name| study.table(name))
}

fn is_bad(table: &Table, row: usize) -> bool {
    table.at(row, "status").is_some_and(|status| !GOOD.contains(&status))
}

fn name_of(table: &Table, row: usize) -> String {
    let cells = ["run", "variant", "name", "n"].iter().filter_map(|column| {
        let value = table.at(row, column).filter(|value| !value.is_empty())?;
        Some(if *column == "n" { format!("n = {value}") } else { value.to_owned() })
    });
    cells.collect::<Vec<_>>().join(", ")
}

/// Runs that did not go as they should, with their reasons.
fn failures(study: &Results) -> Vec<String> {
    let Some(table) = main_table(study) else { return Vec::new() };
    let bad = (0..table.rows.len()).filter(|&row| is_bad(table, row));
    let told = |row: usize| {
        let status = table.at(row, "status").unwrap_or_default();
        let reason = table.at(row, "reason").filter(|reason| !reason.is_empty()).unwrap_or("no reason is given");
        format!("{} ({status}): {reason}", name_of(table, row))
    };
    bad.map(told).collect()
}

/// What the program said of the runs; one line for runs that had the same said.
fn said(study: &Results) -> Vec<String> {
    let Some(table) = study.table("results.csv") else { return Vec::new() };
    let mut all: Vec<(String, Vec<String>)> = Vec::new();
    for row in 0..table.rows.len() {
        let text = ["said", "note", "notes"].iter().find_map(|column| table.at(row, column));
        let Some(text) = text.filter(|text| !text.trim().is_empty()) else { continue };
        match all.iter_mut().find(|(other, _)| other == text) {
            Some((_, runs)) => runs.push(name_of(table, row)),
            None => all.push((text.to_owned(), vec![name_of(table, row)])),
        }
    }
    let who = |runs: Vec<String>| if runs.len() == table.rows.len() { "all runs".to_owned() } else { runs.join("; ") };
    all.into_iter().map(|(text, runs)| format!("{}: {text}", who(runs))).collect()
}

fn counts(study: &Results) -> Markup {
    let Some(table) = main_table(study) else { return html! {} };
    let rows = table.rows.len();
    let bad = (0..rows).filter(|&row| is_bad(table, row)).count();
    let seconds: f64 = table.numbers("seconds").into_iter().flatten().filter(|s| s.is_finite()).sum();
    let what = if study.kind == ResultsKind::Order { "levels" } else { "runs" };
    html! {
        p.ending {
            span.state.(if bad == 0 { "good" } else { "bad" }) { (rows - bad) " of " (rows) " " (what) " finished" }
            " " (format!("{seconds:.1}")) " seconds in all."
        }
    }
}

/// The tables; of a study's the parameters and what was found first, what the runs cost in another.
fn results(study: &Results) -> Markup {
    html! {
        h3 { "Results" }
        @for (name, table) in &study.tables {
            @match name.as_str() {
                "results.csv" => (sweep(table)),
                "branches.csv" => (sortable("Points of the branches", table, &table.header, &|_| false)),
                "orders.csv" => (sortable("Errors and observed orders", table, &table.header, &|_| false)),
                "runs.csv" => (sortable("Levels and their work", table, &table.header, &|row| is_bad(table, row))),
                other => (sortable(other, table, &table.header, &|row| is_bad(table, row))),
            }
        }
        @for part in study.parts.iter().filter(|part| part.kind == ResultsKind::Order) {
            @for (_, table) in &part.tables {
                (sortable(&format!("Errors and observed orders, {}", part.name), table, &table.header, &|_| false))
            }
        }
    }
}

fn sweep(table: &Table) -> Markup {
    let Columns { keys, measures, others } = Columns::of(table);
    let names: Vec<String> =
        ["run", "name"].map(str::to_owned).into_iter().filter(|n| table.position(n).is_some()).collect();
    // reasons and notes stand above the table
    let beside =
        |column: &&String| !names.contains(column) && !["reason", "said", "note", "notes"].contains(&column.as_str());
    let told = ["status", "ending", "stability"].map(str::to_owned);
    let first: Vec<String> = names.iter().chain(&keys).chain(&told).chain(&measures).cloned().collect();
    let rest = others.iter().filter(beside).filter(|column| !told.contains(column));
    let second: Vec<String> = names.iter().chain(&keys).chain(rest).cloned().collect();
    html! {
        (sortable("What was found", table, &first, &|row| is_bad(table, row)))
        details { summary { "What it cost" } (sortable("What it cost", table, &second, &|row| is_bad(table, row))) }
    }
}
