//! serde's messages in the words of scenes: key, value, rule, hint.

use serde::de::DeserializeOwned;
use toml_edit::Document;

use super::error::SceneError;
use super::source::SceneSource;
use super::{locate, path};
use crate::names;

/// Keys of studies that must be there and are no tables.
const VALUES: [&str; 6] = ["scene", "measures", "measure", "reference", "parameter", "range"];

/// The key that `error` concerns, and the error as a scene has it. `text` is what was deserialised.
pub(super) fn translate(source: &SceneSource, text: &str, error: &toml_edit::de::Error) -> (String, SceneError) {
    let message = error.message();
    let span = error.span().unwrap_or(0..0);
    let (around, inner) = match Document::parse(text) {
        Ok(document) => (locate::path_of(&document, &span), locate::path_at(&document, span.start)),
        Err(_) => (Vec::new(), Vec::new()),
    };
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let value = text.get(span).unwrap_or("").trim().to_owned();
    if let (true, Some((name, known))) = (message.starts_with("unknown field"), quoted.split_first()) {
        let key = if inner.last().is_some_and(|last| last == name) { path::join(&inner) } else { join(&inner, name) };
        let (suggestion, known) = (names::did_you_mean(name, known), known.join(", "));
        let place = source.place(&key);
        return (key.clone(), SceneError::UnknownKey { place, key, suggestion, known });
    }
    if let (true, [name]) = (message.starts_with("missing field"), &quoted[..]) {
        let key = join(&around, name);
        let hint = match (around.is_empty(), VALUES.contains(name)) {
            (true, true) => format!("add `{name} = …` above the first table"),
            (true, false) => format!("add the table [{name}]"),
            (false, _) => format!("add `{name} = …` to [{}]{}", path::join(&around), other_tags(source, &around)),
        };
        return (key.clone(), SceneError::Missing { place: source.place(&key), key, hint });
    }
    let key = path::join(&inner);
    let (rule, hint) = match (message.starts_with("unknown variant"), quoted.split_first()) {
        (true, Some((name, known))) => {
            let words: Vec<&str> = known.iter().copied().filter(|word| word.contains(char::is_alphanumeric)).collect();
            // a choice that is a mark, such as a tab, is quoted
            let known: Vec<String> = known.iter().copied().map(path::quoted).collect();
            let (suggestion, known) = (names::did_you_mean(name, &words), known.join(", "));
            if inner.last().is_some_and(|last| last == name) {
                return (key.clone(), SceneError::UnknownKey { place: source.place(&key), key, suggestion, known });
            }
            let name = name.escape_debug();
            (format!("`{name}` is not among the choices{suggestion}"), format!("the choices are {known}"))
        }
        (true, None) | (false, _) => (plain(message), example(message).to_owned()),
    };
    let (rule, hint) = if message.contains("newtype variant") {
        let rule = format!("`{}` stands alone, and needs values", value.trim_matches('"'));
        (rule, "write a table of a table, as in shape = { disc = { radius = 0.1 } }".to_owned())
    } else {
        (rule, hint)
    };
    // a table's span is that of its name
    let value = if message.contains("invalid type: map") { "a table".to_owned() } else { value };
    (key.clone(), SceneError::Value { place: source.place(&key), key, value, rule, hint })
}

/// Tables in which a key that stands in the wrong one may belong; the first is the file itself.
const TABLES: [&str; 16] = [
    "",
    "model",
    "mesh",
    "space",
    "time",
    "initial",
    "coupling",
    "steady",
    "strain",
    "rigid",
    "contact",
    "source",
    "exact",
    "model.density",
    "time.stop",
    "space.degree",
];

/// An error about a key that is not known where it stands tells where it is; `T` is the whole file.
pub(super) fn elsewhere<T: DeserializeOwned>(found: (String, SceneError)) -> (String, SceneError) {
    let (path, error) = found;
    let SceneError::UnknownKey { place, key, suggestion, known } = error else { return (path, error) };
    let (around, name) = key.rsplit_once('.').unwrap_or(("", &key));
    let has = |table: &&str| *table != around && keys_of::<T>(table).iter().any(|other| other == name);
    let suggestion = match TABLES.into_iter().find(has).filter(|_| suggestion.is_empty()) {
        Some("") => format!(" (`{name}` stands above the tables)"),
        Some(table) => format!(" (`{name}` belongs into [{table}])"),
        None => suggestion,
    };
    (path, SceneError::UnknownKey { place, key, suggestion, known })
}

/// A list with more elements than its key takes, which the tables read without a word.
pub(super) fn too_long<T: DeserializeOwned>(source: &SceneSource, text: &str) -> Option<(String, SceneError)> {
    let table: toml::Table = text.parse().ok()?;
    let message = toml::Value::Table(table).try_into::<T>().err()?.to_string();
    if !message.contains("fewer elements") {
        return None;
    }
    let found = message.split_whitespace().find_map(|word| word.trim_end_matches(',').parse::<usize>().ok())?;
    let key = message.split('`').nth(1).unwrap_or_default().to_owned();
    let (value, rule) = (format!("(a list of {found})"), "the list is too long".to_owned());
    let hint = "take away what is beyond the first elements: a vector has two, a box two corners".to_owned();
    Some((key.clone(), SceneError::Value { place: source.place(&key), key, value, rule, hint }))
}

/// Keys of a table of the file `T`; none where it has no such table.
fn keys_of<T: DeserializeOwned>(table: &str) -> Vec<String> {
    const NONE: &str = "no-such-key";
    let text = if table.is_empty() { format!("{NONE} = 0") } else { format!("[{table}]\n{NONE} = 0") };
    let Err(error) = toml_edit::de::from_str::<T>(&text) else { return Vec::new() };
    let mut quoted = error.message().split('`').skip(1).step_by(2).map(str::to_owned);
    if quoted.next().as_deref() == Some(NONE) { quoted.collect() } else { Vec::new() }
}

/// The scene's other boundary tags, where a misspelt one may have made a new table.
fn other_tags(source: &SceneSource, around: &[String]) -> String {
    let [boundary, tag] = around else { return String::new() };
    let table = source.value(boundary).and_then(toml_edit::Item::as_table_like).filter(|_| boundary == "boundary");
    let others: Vec<String> = table
        .iter()
        .flat_map(|table| table.iter())
        .map(|(name, _)| name)
        .filter(|name| name != tag)
        .map(path::quoted)
        .collect();
    if others.is_empty() {
        return String::new();
    }
    let names: Vec<&str> = others.iter().map(String::as_str).collect();
    format!("; the other tags of the scene are {}{}", names.join(", "), names::did_you_mean(&path::quoted(tag), &names))
}

fn join(path: &[String], name: &str) -> String {
    path::join(&path.iter().map(String::as_str).chain([name]).collect::<Vec<_>>())
}

fn example(message: &str) -> &'static str {
    if message.contains("invalid type: map, expected a formula") {
        "quote a key that has dots, as in \"mesh.n\" = \"2*n\""
    } else if message.contains("expected a sequence") {
        "write a list: brackets around, commas between"
    } else if message.contains("expected f64") {
        "write a number such as 0.1, without quotes"
    } else if message.contains("expected usize") || message.contains("expected u64") {
        "write a whole number such as 10, without quotes"
    } else if message.contains("array of length 2") {
        "write a list of two, as in [0.0, 1.0]"
    } else if message.contains("expected struct") || message.contains("expected a map") {
        "write a table: braces around, as in { key = value }, or a section [table] of its own"
    } else if message.contains("wanted string or table") {
        "write one of the names, in quotes"
    } else if message.contains("expected a string") {
        "write a text, in quotes"
    } else {
        "studies/strip/strip.toml shows the form"
    }
}

/// serde names Rust's types; a scene's author knows numbers.
fn plain(message: &str) -> String {
    const WORDS: [(&str, &str); 9] = [
        ("floating point `", "number `"),
        ("expected f64", "expected a number"),
        ("expected usize", "expected a whole number, not negative"),
        ("expected u64", "expected a whole number, not negative"),
        ("invalid type: map, ", "wrong type, "),
        ("invalid type: ", "wrong type: "),
        ("expected a sequence", "expected a list"),
        ("expected a map", "expected a table"),
        ("wanted string or table", "expected one of the names"),
    ];
    let message = message.trim().replace('\n', ", ");
    let message =
        message.split_once("expected struct").map_or(message.clone(), |(head, _)| head.to_owned() + "expected a table");
    WORDS.iter().fold(message, |text, (from, to)| text.replace(from, to))
}
