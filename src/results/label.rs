//! What tells runs from each other, and how a setting is written.

use std::collections::BTreeMap;

use super::Results;
use super::names::{SYMBOLS, symbol};
use crate::model::terms::factor;

/// A setting of a scene in short: symbol and value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// As in the scene, such as `model.peclet`.
    pub key: String,
    /// As in formulas where the key has a symbol, else the key.
    pub symbol: String,
    /// As it is written there.
    pub value: String,
    /// What it means; empty where the key says it.
    pub meaning: &'static str,
}

/// Tables that do not change the problem.
const ASIDE: [&str; 2] = ["output", "title"];

/// More settings than these make no legend.
const MOST: usize = 4;

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

/// The value of a key, such as `model.peclet`.
pub(super) fn value_of<'a>(scene: &'a toml::Table, key: &str) -> Option<&'a toml::Value> {
    let mut parts = key.split('.');
    let first = scene.get(parts.next()?)?;
    parts.try_fold(first, |value, part| value.get(part))
}

/// Whether the traction is the friction, as where it is not given: then it says nothing new.
fn traction_follows(scene: &toml::Table) -> bool {
    let number = |key: &str| value_of(scene, key).and_then(|v| v.as_float().or(v.as_integer().map(|n| n as f64)));
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
    let follows = runs.iter().filter_map(|run| run.scene.as_ref()).all(traction_follows);
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
    run.scene.as_ref().map(parameters_of).unwrap_or_default()
}

fn parameters_of(scene: &toml::Table) -> Vec<Setting> {
    let model = SYMBOLS.iter().filter(|(key, ..)| key.starts_with("model."));
    let model = model.map(|(key, symbol, meaning)| ((*key).to_owned(), *symbol, *meaning));
    let factors = factor::all().map(|(factor, _)| (format!("model.{}", factor.key), factor.symbol, factor.help));
    let read = model.chain(factors).filter_map(|(key, symbol, meaning)| {
        let value = value_text(value_of(scene, &key)?);
        Some(Setting { key, symbol: symbol.to_owned(), value, meaning })
    });
    read.collect()
}

/// The parameters that all the runs share, on one line.
pub(crate) fn common(runs: &[&Results]) -> String {
    shared(&runs.iter().filter_map(|run| run.scene.as_ref()).collect::<Vec<_>>())
}

/// The parameters that all the scenes share, on one line.
pub(crate) fn shared(scenes: &[&toml::Table]) -> String {
    let all: Vec<Vec<Setting>> = scenes.iter().map(|scene| parameters_of(scene)).collect();
    let Some(first) = all.first() else { return String::new() };
    let mut settings: Vec<&Setting> =
        first.iter().filter(|setting| all.iter().all(|one| one.contains(setting))).collect();
    let follows = scenes.iter().all(|scene| traction_follows(scene));
    settings.retain(|setting| setting.key != "model.traction" || !follows);
    // what is off needs no place in a picture
    settings.retain(|setting| setting.value != "0");
    let told: Vec<String> = settings.iter().map(|s| format!("{} = {}", s.symbol, s.value)).collect();
    told.join(", ")
}
