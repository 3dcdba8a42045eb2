//! Old files in the words of today: keys that have been renamed, and one spelling of the names of data.

use std::ops::Range;

use toml_edit::Document;

use super::locate;
use super::maps::Quantity;
use crate::measure::{Measure, OutputField};
use crate::names::RENAMED;
use crate::schema::Listed;

/// Keys of studies whose values are names of measures.
const MEASURES: [&str; 4] = ["measure", "measures", "x", "y"];
/// Keys whose values are anybody's own words.
const WORDS: [&str; 4] = ["title", "name", "scene", "duration"];

/// A text of a scene or a study in the words of today, line by line as it was, and a note for each word that was
/// replaced.
pub fn modern(text: &str) -> (String, Vec<String>) {
    let Ok(document) = Document::parse(text) else { return (text.to_owned(), Vec::new()) };
    let mut edits: Vec<(Range<usize>, String, String)> = Vec::new();
    let mut paths: Vec<String> = Vec::new();
    locate::walk(document.as_item(), &mut Vec::new(), &mut |path, span| {
        let raw = text.get(span.clone()).unwrap_or("");
        let word = raw.trim_matches(['"', '\'']);
        let key = path.last().is_some_and(|last| last == word);
        if key {
            paths.push(path.join("."));
        }
        let now = if key { key_now(path, word) } else { value_now(path, raw, word) };
        if let Some(now) = now.filter(|_| edits.iter().all(|(other, ..)| other.start != span.start)) {
            edits.push((span, word.to_owned(), now));
        }
    });
    // a key beside the one that took its place stays, to be refused
    edits.retain(|(span, _, now)| {
        let path = locate::path_at(&document, span.start);
        let around = path.split_last().map(|(_, around)| around.join(".")).unwrap_or_default();
        let twin = if around.is_empty() { now.clone() } else { format!("{around}.{now}") };
        !paths.contains(&twin)
    });
    edits.sort_by_key(|(span, ..)| span.start);
    let (mut out, mut notes) = (text.to_owned(), Vec::new());
    for (span, word, now) in edits.iter().rev() {
        let new = text[span.clone()].replacen(word, now, 1);
        out.replace_range(span.clone(), &new);
    }
    for (span, word, now) in edits {
        let path = locate::path_at(&document, span.start).join(".");
        let row = RENAMED.iter().find(|(old, _)| word == *old || path.ends_with(old));
        let note = row.map_or_else(|| told(&word, &now), |(old, new)| told(old, new));
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
    (out, notes)
}

/// The table of a scene or a study, in the words of today.
///
/// # Errors
/// A text that is not TOML.
pub fn table(text: &str) -> Result<toml::Table, toml::de::Error> {
    modern(text).0.parse()
}

/// A path as it is called today, and a note where it was called otherwise.
pub fn path_now(path: &str) -> (String, Option<String>) {
    let row = RENAMED.iter().find(|(old, _)| path == *old);
    row.map_or_else(|| (path.to_owned(), None), |(old, new)| ((*new).to_owned(), Some(told(old, new))))
}

/// The name of a measure, a field or a quantity with `_` for every `-`, and a note where it had one.
pub fn name_now(name: &str) -> (String, Option<String>) {
    let new = name.replace('-', "_");
    let note = (new != name).then(|| told(name, &new));
    (new, note)
}

fn told(old: &str, new: &str) -> String {
    format!("`{old}` is called `{new}` now; the old name still works")
}

/// A key's name now, if it was renamed: by the tables around it, or, in a study, by the whole path in quotes.
fn key_now(path: &[String], word: &str) -> Option<String> {
    let joined = path.join(".");
    let row = |&&(old, _): &&(&str, &str)| joined == old || word == old || joined.ends_with(&format!(".{old}"));
    let (_, new) = RENAMED.iter().find(row)?;
    let last = new.rsplit('.').next().unwrap_or(new);
    Some(if word.contains('.') { *new } else { last }.to_owned())
}

/// A value now, if it names a key that was renamed, or data with a hyphen.
fn value_now(path: &[String], raw: &str, word: &str) -> Option<String> {
    let (first, last) = (path.first()?, path.last()?);
    if !raw.starts_with(['"', '\'']) || WORDS.contains(&last.as_str()) {
        return None;
    }
    if let Some((_, new)) = RENAMED.iter().find(|(old, _)| *old == word) {
        return Some((*new).to_owned());
    }
    let named = path.iter().rev().find(|part| part.parse::<usize>().is_err())?;
    let study = MEASURES.contains(&named.as_str()) && matches!(first.as_str(), "measure" | "measures" | "plot");
    let (new, _) = name_now(word);
    (new != word && (study || (is_output(path) && is_data(&new)))).then_some(new)
}

/// Whether a path leads to a name in an `[[output]]`, of the scene or of one that a study sets.
fn is_output(path: &[String]) -> bool {
    let parts: Vec<&str> = path.iter().flat_map(|part| part.split('.')).collect();
    let Some(at) = parts.iter().position(|part| *part == "output") else { return false };
    let rest: Vec<&&str> = parts[at + 1..].iter().filter(|part| part.parse::<usize>().is_err()).collect();
    matches!(rest[..], [&"measures" | &"fields" | &"columns" | &"maps"] | [&"maps", &"of" | &"arrows"])
}

fn is_data(name: &str) -> bool {
    Measure::named(name).is_some() || OutputField::named(name).is_some() || Quantity::named(name).is_some()
}
