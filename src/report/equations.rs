//! What a run solved: equations and parameters, mesh, boundary conditions, start, and the terms that were on.

use maud::{Markup, html};
use serde_json::Value;

use super::run::get;
use super::tables::{cell, pairs, plain, toml_text};
use crate::results::{Results, Setting, parameters};

const INCOMPRESSIBLE: &str = "−div(σᵀ) + C_F v = T_a p,   div v = 0
Pe [∂_t p + (v·∇)p − W(v)p − a D(v)p] + (|p|² − 1) p − κ²Δp = 0
σ = −Π I + 2D(v) + (a+1)/2 p⊗ℓ + (a−1)/2 ℓ⊗p − κ²B ∇pᵀ·∇p − S_a p⊗p,   ℓ = B [(|p|² − 1) p − κ²Δp]";

/// The equations in words and what stood in them.
pub(super) fn solved(run: &Results) -> Markup {
    let kind = run.setting("model.kind").and_then(toml::Value::as_str);
    html! {
        @if run.scene.is_some() {
            @if kind == Some("particles") {
                p {
                    "Rigid bodies with forces and contact, and no flow: their velocities change by the forces, and are \
                    then projected onto those that let no two bodies, and no body and wall, overlap."
                }
            } @else if kind == Some("stokes") {
                p {
                    "An incompressible viscous flow in which rigid bodies are regions of a viscosity larger by 1/ε: \
                    viscous stress and pressure balance forces and friction; the velocity has no divergence; the \
                    bodies move with the mean of the flow over them."
                }
            } @else if kind == Some("compressible") {
                p {
                    "A compressible sheet: the density is carried by the flow (∂ρ/∂t + div(ρv) = 0) and gives the \
                    pressure c"
                    sub { "0" } " ρ" sup { "γ+1" } "; viscous, elastic and active stress balance friction and \
                    traction, all weighed with the density; the polarity is carried, turned and stretched by the flow, \
                    and relaxes over its coherence length."
                }
            } @else {
                p {
                    "An incompressible sheet: viscous stress, pressure, elastic and active stress balance friction \
                    with the substrate and traction along the polarity; the velocity has no divergence; the polarity \
                    is carried, turned and stretched by the flow, and relaxes to length one over its coherence length."
                }
                pre.equations { (INCOMPRESSIBLE) }
            }
        }
        div.columns {
            div { (parameter_table(&parameters(run))) (mesh(run)) }
            div { (boundary(run)) (course(run)) }
        }
        (terms(run))
    }
}

fn parameter_table(all: &[Setting]) -> Markup {
    html! {
        @if !all.is_empty() {
            div.scroll {
                table {
                    caption { "Parameters" }
                    thead {
                        tr {
                            th scope="col" { "symbol" }
                            th.number scope="col" { "value" }
                            th scope="col" { "meaning" }
                        }
                    }
                    tbody {
                        @for s in all {
                            tr { th scope="row" { (plain(&s.symbol)) } (cell(&s.value)) td { (s.meaning) } }
                        }
                    }
                }
            }
        }
    }
}

fn mesh(run: &Results) -> Markup {
    let mut rows: Vec<(String, String)> = Vec::new();
    for key in ["shape", "file"] {
        rows.extend(run.setting(&format!("mesh.{key}")).map(|value| (key.to_owned(), toml_text(value))));
    }
    let found = [
        ("cells", "/mesh/cells"),
        ("curved cells", "/mesh/curved_cells"),
        ("smallest diameter", "/mesh/h_min"),
        ("largest diameter", "/mesh/h_max"),
        ("area", "/mesh/area"),
    ];
    rows.extend(found.iter().filter_map(|(name, path)| Some(((*name).to_owned(), get(run, path)?.to_string()))));
    let angle = get(run, "/mesh/worst_angle_degrees/value").or(get(run, "/mesh/worst_angle_degrees"));
    rows.extend(angle.filter(|v| v.is_number()).map(|v| ("smallest angle (degrees)".to_owned(), v.to_string())));
    let unknowns = get(run, "/unknowns").and_then(Value::as_object).into_iter().flatten();
    rows.extend(unknowns.map(|(name, value)| (format!("unknowns, {}", name.replace('_', " ")), value.to_string())));
    pairs("Mesh and unknowns", ["", "value"], &rows)
}

fn boundary(run: &Results) -> Markup {
    let Some(tags) = run.setting("boundary").and_then(toml::Value::as_table) else { return html! {} };
    let with_density = tags.values().any(|tag| tag.get("density").is_some());
    let at = |tag: &toml::Value, key: &str| tag.get(key).map_or_else(String::new, toml_text);
    html! {
        div.scroll {
            table {
                caption { "Boundary conditions" }
                thead {
                    tr {
                        th scope="col" { "part" } th scope="col" { "velocity" } th scope="col" { "polarity" }
                        @if with_density { th scope="col" { "density" } }
                    }
                }
                tbody {
                    @for (name, tag) in tags {
                        tr {
                            th scope="row" { (name) } td { (at(tag, "velocity")) } td { (at(tag, "polarity")) }
                            @if with_density { td { (at(tag, "density")) } }
                        }
                    }
                }
            }
        }
    }
}

/// Start, time and coupling as the scene has them.
fn course(run: &Results) -> Markup {
    let keys = [
        "space.k",
        "initial.polarity",
        "initial.density",
        "time.scheme",
        "time.step",
        "time.end",
        "time.stop.residual",
        "time.stop.energy_rate",
        "steady.residual",
        "coupling.kind",
        "coupling.tolerance",
        "accuracy",
    ];
    let rows = keys.iter().filter_map(|key| Some(((*key).to_owned(), toml_text(run.setting(key)?))));
    pairs("Start, time and coupling", ["key", "value"], &rows.collect::<Vec<_>>())
}

fn terms(run: &Results) -> Markup {
    let all = get(run, "/terms").and_then(Value::as_array).cloned().unwrap_or_default();
    let word = |term: &Value, key: &str| term.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
    let is_on = |term: &Value| term.get("on").and_then(Value::as_bool) == Some(true);
    html! {
        @if !all.is_empty() {
            div.scroll {
                table {
                    caption { "Terms of the equations" }
                    thead {
                        tr {
                            th scope="col" { "term" }
                            th scope="col" { "" }
                            th scope="col" { "formula" }
                            th scope="col" { "because" }
                        }
                    }
                    tbody {
                        @for term in &all {
                            tr.off[!is_on(term)] {
                                th scope="row" { (word(term, "name")) }
                                td { (if is_on(term) { "on" } else { "off" }) }
                                td { (word(term, "formula")) }
                                td { (word(term, "reason")) }
                            }
                        }
                    }
                }
            }
        }
    }
}
