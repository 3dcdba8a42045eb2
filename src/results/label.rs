//! What tells runs from each other, and how a setting is written.

use std::collections::BTreeMap;

use super::Results;

/// A setting of a scene in short: symbol and value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    pub key: String,
    /// As in formulas where the key has a symbol, else the key.
    pub symbol: String,
    pub value: String,
    /// What it means; empty where the key says it.
    pub meaning: &'static str,
}

/// Keys with a symbol: the parameters of the model in the order in which they are told, then sizes.
const SYMBOLS: [(&str, &str, &str); 22] = [
    ("model.peclet", "Pe", "relaxation time of the polarity over that of the flow"),
    ("model.beta", "β", "friction as a share, C_F/(1 + C_F)"),
    ("model.friction", "C_F", "friction with the substrate"),
    ("model.traction", "T_a", "traction force along the polarity"),
    ("model.active_stress", "S_a", "active stress along the polarity"),
    ("model.active_stress_iso", "S_a'", "isotropic active stress"),
    ("model.coherence", "κ", "length over which the polarity is coherent"),
    ("model.elasticity", "B", "polar elasticity over viscosity"),
    ("model.slip", "a", "slip parameter of the objective derivative"),
    ("model.density.penalty", "c_0", "density penalty"),
    ("model.density.exponent", "γ", "exponent of the density penalty"),
    ("model.density.critical", "ρ_{min}", "density below which the polarity vanishes"),
    ("mesh.h", "h", "edge length"),
    ("mesh.h_disc", "h_{disc}", "edge length on the disc"),
    ("mesh.n", "n", "cells per side"),
    ("mesh.width", "width", "extent across the strip"),
    ("time.step", "Δt", "first and largest step"),
    ("time.end", "end", "end time"),
    ("time.scheme", "scheme", "time scheme"),
    ("space.k", "k", "degree of the pressure"),
    ("initial.polarity.random.seed", "seed", "seed of the random start"),
    ("coupling.tolerance", "tolerance", "tolerance of the coupling"),
];

/// Tables that do not change the problem.
const ASIDE: [&str; 2] = ["output", "title"];

/// More settings than these make no legend.
const MOST: usize = 4;

/// How a key is written in formulas; the key itself where it has no symbol.
pub fn symbol(key: &str) -> &str {
    SYMBOLS.iter().find(|(name, ..)| *name == key).map_or(key, |(_, symbol, _)| symbol)
}

/// Short text of a value: texts without quotes, of paths the file alone.
pub(crate) fn value_text(value: &toml::Value) -> String {
    match value {
        toml::Value::String(text) if text.starts_with('/') => text.rsplit('/').next().unwrap_or(text).to_owned(),
        toml::Value::String(text) => text.clone(),
        toml::Value::Float(x) => crate::output::number(*x),
        toml::Value::Integer(_) | toml::Value::Boolean(_) | toml::Value::Datetime(_) => value.to_string(),
        toml::Value::Array(_) | toml::Value::Table(_) => value.to_string(),
    }
}

fn flatten(prefix: &str, table: &toml::Table, out: &mut BTreeMap<String, String>) {
    for (key, value) in table {
        let path = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            toml::Value::Table(inner) => flatten(&path, inner, out),
            other => drop(out.insert(path, value_text(other))),
        }
    }
}

fn flat(results: &Results) -> BTreeMap<String, String> {
    let mut out = BTreeMap::new();
    if let Some(scene) = &results.scene {
        flatten("", scene, &mut out);
    }
    out
}

/// Whether the traction is the friction, as where it is not given: then it says nothing new.
fn traction_follows(run: &Results) -> bool {
    let number = |key: &str| run.setting(key).and_then(|v| v.as_float().or(v.as_integer().map(|n| n as f64)));
    let friction = number("model.friction").or_else(|| number("model.beta").map(|beta| beta / (1.0 - beta)));
    let both = number("model.traction").zip(friction);
    both.is_none_or(|(traction, friction)| (traction - friction).abs() <= 1e-12 * friction.abs())
}

/// Keys whose values differ between the scenes, the known ones first; titles and outputs aside.
pub fn differing(runs: &[&Results]) -> Vec<String> {
    let all: Vec<_> = runs.iter().filter(|run| run.scene.is_some()).map(|run| flat(run)).collect();
    let mut keys: Vec<&String> = all.iter().flat_map(BTreeMap::keys).collect();
    keys.sort();
    keys.dedup();
    let aside = |key: &str| ASIDE.contains(&key.split('.').next().unwrap_or(key));
    let differs = |key: &str| all.iter().any(|settings| settings.get(key) != all[0].get(key));
    let mut found: Vec<String> = keys.into_iter().filter(|key| !aside(key) && differs(key)).cloned().collect();
    let follows = runs.iter().all(|run| traction_follows(run));
    found.retain(|key| match key.as_str() {
        "model.traction" => !follows,
        // a smallest step follows the step where it is not given
        "time.step_min" => !differs("time.step"),
        _ => true,
    });
    let rank = |key: &String| SYMBOLS.iter().position(|(name, ..)| name == key).unwrap_or(SYMBOLS.len());
    found.sort_by_key(rank);
    found
}

/// A legend entry for each run: the given one, or what differs between the scenes, or the folder's name.
pub fn labels(runs: &[&Results], given: &[String]) -> Vec<String> {
    let keys = differing(runs);
    let told = |run: &Results| {
        let one = |key: &String| run.setting(key).map(|value| format!("{} = {}", symbol(key), value_text(value)));
        let settings: Vec<String> = keys.iter().filter_map(one).collect();
        (run.scene.is_some() && !settings.is_empty()).then(|| settings.join(", "))
    };
    let fits = !keys.is_empty() && keys.len() <= MOST;
    let own: Vec<String> =
        runs.iter().map(|run| told(run).filter(|_| fits).unwrap_or_else(|| run.name.clone())).collect();
    let twice = |texts: &[String], k: usize| texts.iter().filter(|text| **text == texts[k]).count() > 1;
    let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
    let label = |k: usize| {
        let apart = || match (twice(&own, k), twice(&names, k)) {
            (false, _) => own[k].clone(),
            (true, false) => format!("{} ({})", own[k], names[k]),
            (true, true) => runs[k].path.display().to_string(),
        };
        given.get(k).cloned().unwrap_or_else(apart)
    };
    (0..runs.len()).map(label).collect()
}

/// The model's parameters of a scene, in the order in which they are told.
pub fn parameters(run: &Results) -> Vec<Setting> {
    let model = SYMBOLS.iter().filter(|(key, ..)| key.starts_with("model."));
    let read = model.filter_map(|(key, symbol, meaning)| {
        let value = value_text(run.setting(key)?);
        Some(Setting { key: (*key).to_owned(), symbol: (*symbol).to_owned(), value, meaning })
    });
    read.collect()
}

/// The parameters that all the runs share, on one line.
pub(crate) fn common(runs: &[&Results]) -> String {
    let Some(first) = runs.iter().find(|run| run.scene.is_some()) else { return String::new() };
    let others: Vec<_> = runs.iter().filter(|run| run.scene.is_some()).map(|run| parameters(run)).collect();
    let shared = parameters(first).into_iter().filter(|setting| others.iter().all(|all| all.contains(setting)));
    let mut settings: Vec<Setting> = shared.collect();
    let follows = runs.iter().all(|run| traction_follows(run));
    settings.retain(|setting| setting.key != "model.traction" || !follows);
    // what is off needs no place in a picture
    settings.retain(|setting| setting.value != "0");
    let told: Vec<String> = settings.iter().map(|s| format!("{} = {}", s.symbol, s.value)).collect();
    told.join(", ")
}
