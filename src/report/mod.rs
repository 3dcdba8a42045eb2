//! One self-contained HTML page of what runs and studies found.
//!
//! The page needs nothing from outside: pictures are data URIs, style and the script that sorts tables are in it, and a
//! content security policy forbids every request. It works without the script, and on paper.

mod bodies;
mod comparison;
mod equations;
mod pictures;
mod run;
mod side_by_side;
mod study;
mod tables;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::names::MADE_BY;
use crate::results::curves::{CurveSettings, curves};
use crate::results::{Results, ResultsKind, differing};

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("sort.js");
/// Nothing is loaded, whatever a title or a picture says.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

/// The page of some folders of results.
pub fn page(folders: &[Results]) -> String {
    let title = match folders {
        [only] => only.title(),
        [] | [_, ..] => format!("{} results", folders.len()),
    };
    let mut budget = pictures::ByteBudget::of_page();
    let document = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content={ (MADE_BY) " " (env!("CARGO_PKG_VERSION")) };
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    @if folders.len() > 1 {
                        h1 { (title) }
                        (contents(folders))
                        (together(folders))
                    }
                    @for (k, folder) in folders.iter().enumerate() {
                        (section(k, folder, folders.len(), &mut budget.share(folders.len() - k)))
                    }
                }
                footer { "Written by monolayer " (env!("CARGO_PKG_VERSION")) ". Everything is dimensionless." }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    };
    document.into_string()
}

fn contents(folders: &[Results]) -> Markup {
    html! {
        nav aria-label="Results" {
            ul {
                @for (k, folder) in folders.iter().enumerate() {
                    li { a href={ "#results-" (k + 1) } { (folder.title()) } " (" (folder.path.display()) ")" }
                }
            }
        }
    }
}

/// What several runs have in common: their measures in one table, their curves in common pictures.
fn together(folders: &[Results]) -> Markup {
    let runs: Vec<&Results> =
        folders.iter().filter(|f| matches!(f.kind, ResultsKind::Run | ResultsKind::Sections)).collect();
    if runs.len() < 2 {
        return html! {};
    }
    let drawn = curves(&runs, &CurveSettings::default()).unwrap_or_default();
    html! {
        section {
            h2 { "Side by side" }
            (tables::notes(&[], &drawn.notes))
            (side_by_side::table(&runs, &differing(&runs)))
            (pictures::drawn(&drawn))
        }
    }
}

fn section(number: usize, folder: &Results, count: usize, budget: &mut pictures::ByteBudget) -> Markup {
    let one_of_many = count > 1;
    html! {
        section id={ "results-" (number + 1) } {
            @if one_of_many { h2 { (folder.title()) } } @else { h1 { (folder.title()) } }
            p.path { (kind(folder.kind)) " in " code { (folder.path.display()) } }
            @match folder.kind {
                ResultsKind::Run | ResultsKind::Sections => (run::section(folder, budget)),
                ResultsKind::Comparison => (comparison::section(folder, budget)),
                ResultsKind::Sweep | ResultsKind::Order | ResultsKind::Branches | ResultsKind::Tradeoff => {
                    (study::section(folder, budget))
                }
            }
            @if let Some(settings) = &folder.settings {
                details {
                    summary {
                        "Settings (" (if folder.kind == ResultsKind::Run { "scene.toml" } else { "study.toml" }) ")"
                    }
                    pre { (settings) }
                }
            }
        }
    }
}

fn kind(kind: ResultsKind) -> &'static str {
    match kind {
        ResultsKind::Run => "A run",
        ResultsKind::Sweep => "A study",
        ResultsKind::Order => "A study of orders of convergence",
        ResultsKind::Branches => "Branches of steady states",
        ResultsKind::Tradeoff => "Errors and what they cost",
        ResultsKind::Comparison => "A comparison with measured velocities",
        ResultsKind::Sections => "Sections",
    }
}
