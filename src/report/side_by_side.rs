//! Runs side by side.

use maud::{Markup, html};
use serde_json::Value;

use super::run::{get, number, text};
use super::tables::{cell, plain, toml_text};
use crate::results::{Results, ResultsKind, names, symbol};

/// What differs between them, and their measures.
pub(super) fn table(runs: &[&Results], keys: &[String]) -> Markup {
    let mut measures: Vec<String> = Vec::new();
    for run in runs {
        let own = get(run, "/measures").and_then(Value::as_object).into_iter().flat_map(|all| all.keys().cloned());
        for name in own {
            if !measures.contains(&name) {
                measures.push(name);
            }
        }
    }
    let setting = |run: &Results, key: &str| run.setting(key).map_or_else(String::new, toml_text);
    let measure =
        |run: &Results, name: &str| get(run, &format!("/measures/{name}")).map_or_else(String::new, Value::to_string);
    html! {
        div.scroll tabindex="0" role="region" aria-label="Runs side by side" {
            table.sortable.wide {
                caption { "Runs side by side" }
                thead {
                    tr {
                        th scope="col" { "run" }
                        @for key in keys { th scope="col" { (plain(symbol(key))) } }
                        th scope="col" { "status" }
                        @for name in &measures { th.number scope="col" { (names::with_unit(name)) } }
                        th.number scope="col" { "seconds" }
                    }
                }
                tbody {
                    @for run in runs {
                        tr.bad[text(run, "status") == Some("failed")] {
                            th scope="row" { (run.path.display()) }
                            @for key in keys { (cell(&setting(run, key))) }
                            td {
                                (text(run, "status")
                                    .unwrap_or(if run.kind == ResultsKind::Run { "not ended" } else { "" }))
                            }
                            @for name in &measures { (cell(&measure(run, name))) }
                            (cell(&number(run, "/seconds_total").map_or_else(String::new, |s| format!("{s:.1}"))))
                        }
                    }
                }
            }
        }
    }
}
