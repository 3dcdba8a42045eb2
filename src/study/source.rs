//! What the files of all studies have in common: their text, the scene they name, overrides, and whom to blame.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use super::StudyError;
use super::branch_file::BranchFile;
use super::file::OrderFile;
use super::sweep_file::SweepFile;
use super::tradeoff_file::TradeoffFile;
use crate::names;
use crate::scene::path::quoted;
use crate::scene::{Place, SceneError, SceneSource, renamed};
use crate::schema::fields;

/// Keys of the scene and their values, as [`SceneSource::set`] takes them.
pub type Values = Vec<(String, String)>;

/// A kind of study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StudyFileKind {
    Order,
    Sweep,
    Branch,
    Tradeoff,
}

impl StudyFileKind {
    /// Keys of the study itself; all others are the scene's.
    pub fn own(self) -> &'static [&'static str] {
        match self {
            StudyFileKind::Order => fields::<OrderFile>(),
            StudyFileKind::Sweep => fields::<SweepFile>(),
            StudyFileKind::Tradeoff => fields::<TradeoffFile>(),
            StudyFileKind::Branch => fields::<BranchFile>(),
        }
    }

    pub fn owns(self, key: &str) -> bool {
        self.own().contains(&key.split('.').next().unwrap_or(""))
    }

    fn example(self) -> &'static str {
        match self {
            StudyFileKind::Order => "give the path of a study, a TOML text such as studies/mms/incompressible.toml",
            StudyFileKind::Sweep => "give the path of a study, a TOML text such as studies/extremes/01-friction.toml",
            StudyFileKind::Tradeoff => "give the path of a study, a TOML text such as studies/tradeoff/mms.toml",
            StudyFileKind::Branch => {
                "give the path of a study, a TOML text such as studies/strip/branches-by-peclet.toml"
            }
        }
    }
}

/// Reads a study's text and applies those of the `sets` that change its own keys.
///
/// # Errors
/// A file that cannot be read, that is a scene or another kind of study; a value that does not fit.
pub(super) fn read<T: DeserializeOwned>(
    path: &Path,
    kind: StudyFileKind,
    sets: &[(String, String)],
) -> Result<SceneSource, StudyError> {
    let mut source = SceneSource::read(path).map_err(|error| match error {
        SceneError::Unreadable { file, reason, .. } => SceneError::Unreadable { file, reason, hint: kind.example() },
        other => other,
    })?;
    let has = |key: &str| source.value(key).is_some();
    let file = source.origin().to_owned();
    match kind {
        StudyFileKind::Order | StudyFileKind::Sweep | StudyFileKind::Branch | StudyFileKind::Tradeoff
            if has("data") && !has("scene") =>
        {
            return Err(StudyError::OtherKind {
                file,
                is: "a comparison with measured velocities",
                command: "compare",
            });
        }
        StudyFileKind::Order | StudyFileKind::Sweep | StudyFileKind::Branch | StudyFileKind::Tradeoff
            if has("model") && !has("scene") =>
        {
            return Err(StudyError::NoStudy { file });
        }
        StudyFileKind::Order | StudyFileKind::Sweep | StudyFileKind::Branch if has("setting") => {
            return Err(StudyError::OtherKind { file, is: "a study of a trade-off", command: "tradeoff" });
        }
        StudyFileKind::Tradeoff if has("levels") => {
            return Err(StudyError::OtherKind { file, is: "a study of orders, not of a trade-off", command: "order" });
        }
        StudyFileKind::Tradeoff if has("parameter") => {
            return Err(StudyError::OtherKind { file, is: "a study of branches", command: "branch" });
        }
        StudyFileKind::Tradeoff if has("vary") || has("case") => {
            return Err(StudyError::OtherKind { file, is: "a sweep, not a study of a trade-off", command: "study" });
        }
        StudyFileKind::Order if has("scene") && !has("levels") && (has("case") || has("set")) => {
            return Err(StudyError::OtherKind { file, is: "a sweep, not a study of orders", command: "study" });
        }
        StudyFileKind::Order | StudyFileKind::Sweep if has("parameter") => {
            return Err(StudyError::OtherKind { file, is: "a study of branches", command: "branch" });
        }
        StudyFileKind::Branch if has("levels") => {
            return Err(StudyError::OtherKind { file, is: "a study of orders, not of branches", command: "order" });
        }
        StudyFileKind::Branch if has("vary") || has("case") => {
            return Err(StudyError::OtherKind { file, is: "a sweep, not a study of branches", command: "study" });
        }
        StudyFileKind::Sweep if has("levels") => {
            return Err(StudyError::OtherKind { file, is: "a study of orders, not a sweep", command: "order" });
        }
        StudyFileKind::Order | StudyFileKind::Sweep | StudyFileKind::Branch | StudyFileKind::Tradeoff => {}
    }
    for (key, value) in sets.iter().filter(|(key, _)| kind.owns(key)) {
        source.set_in::<T>(key, value)?;
    }
    Ok(source)
}

/// Overrides by the names that their keys have today.
pub(super) fn sets_now(sets: &[(String, String)]) -> Values {
    sets.iter().map(|(key, value)| (renamed::path_now(key).0, value.clone())).collect()
}

/// Notes about words of a study, its scene and its overrides that have another name today.
pub fn renamed_words(file: &Path, sets: &[(String, String)]) -> Vec<String> {
    let text = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
    let (study, mut notes) = renamed::modern(&text(file));
    let scene = study.parse::<toml::Table>().ok().and_then(|table| Some(table.get("scene")?.as_str()?.to_owned()));
    if let (Some(scene), Some(folder)) = (scene, file.parent()) {
        notes.extend(renamed::modern(&text(&folder.join(scene))).1);
    }
    notes.extend(sets.iter().filter_map(|(key, _)| renamed::path_now(key).1));
    notes
}

/// Reads the scene that a study names by `name`.
///
/// # Errors
/// A file that cannot be read or is not TOML.
pub(super) fn read_scene(source: &SceneSource, name: &str) -> Result<SceneSource, StudyError> {
    Ok(SceneSource::read(&scene_file(source, name)?)?)
}

/// Applies those of the `sets` that are the scene's. `fixed` gives rule and hint where the study sets a key itself and
/// would undo the override.
///
/// # Errors
/// A key that no scene has or that the study sets itself, a value of the wrong type.
pub(super) fn apply(
    scene: &mut SceneSource,
    kind: StudyFileKind,
    sets: &[(String, String)],
    fixed: &dyn Fn(&str) -> Option<(String, String)>,
) -> Result<(), StudyError> {
    for (key, value) in sets.iter().filter(|(key, _)| !kind.owns(key)) {
        if let Some((rule, hint)) = fixed(key) {
            let place = Box::new(Place::Set { file: scene.origin().into(), path: key.clone() });
            let (key, value) = (key.clone(), value.clone());
            return Err(SceneError::Value { place, key, value, rule, hint }.into());
        }
        scene.set(key, value).map_err(|error| with_own_keys(error, kind.own()))?;
    }
    Ok(())
}

fn scene_file(source: &SceneSource, name: &str) -> Result<PathBuf, StudyError> {
    let path = source.folder().join(name);
    if path.is_file() {
        return Ok(path);
    }
    let hint = format!("paths start in the study's folder; looked for {}", path.display());
    Err(refuse(source, "scene", format!("\"{name}\""), "there is no such file", &hint))
}

/// A misspelt `--set` may have meant the study's own keys, too.
fn with_own_keys(error: SceneError, own: &[&'static str]) -> SceneError {
    match error {
        SceneError::UnknownKey { place, key, known, suggestion } if !key.contains('.') => {
            let all: Vec<&str> = known.split(", ").chain(own.iter().copied()).collect();
            let better = names::did_you_mean(&key, &all);
            let suggestion = if better.is_empty() { suggestion } else { better };
            let known = format!("{known}, and of the study {}", own.join(", "));
            SceneError::UnknownKey { place, key, suggestion, known }
        }
        other => other,
    }
}

/// The study's text with its overrides; the path of its scene is absolute.
pub(super) fn text<T: DeserializeOwned>(source: &SceneSource, scene: &SceneSource) -> String {
    let mut source = source.clone();
    if let Ok(path) = std::path::absolute(scene.origin()) {
        // a path without quotes might be read as something else
        let value = toml::Value::from(path.to_string_lossy().into_owned()).to_string();
        source.set_in::<T>("scene", &value).expect("the study was checked with a scene");
    }
    source.text()
}

/// Puts a value, as [`SceneSource::set`] takes it, under a key that may have dots into a table of the study.
pub(super) fn put(source: &mut SceneSource, table: &str, key: &str, value: &str) {
    let value = match value.trim() {
        "" => toml_edit::Value::from(""),
        text => text.parse().unwrap_or_else(|_| toml_edit::Value::from(text)),
    };
    source.put(table, key, value);
}

/// The path of a key of the scene in a table of the study, as TOML writes it: `vary."model.peclet"`.
pub(super) fn below(table: &str, key: &str) -> String {
    format!("{table}.{}", quoted(key))
}

/// An error about a key of the study.
pub(super) fn refuse(source: &SceneSource, key: &str, value: String, rule: &str, hint: &str) -> StudyError {
    let place = source.place(key);
    let (key, rule, hint) = (key.to_owned(), rule.to_owned(), hint.to_owned());
    SceneError::Value { place, key, value, rule, hint }.into()
}

/// An error of the scene that a key of the study has caused.
pub(super) fn within(source: &SceneSource, key: &str, error: SceneError) -> StudyError {
    let (place, part) = (source.place(key), format!("`{key}`"));
    StudyError::Within { place, part, error: Box::new(error.into()) }
}

/// The override of the scene that an error is about, if it is about one.
pub(super) fn override_of(error: &SceneError) -> Option<&str> {
    match error {
        SceneError::UnknownKey { place, .. } | SceneError::Value { place, .. } | SceneError::Missing { place, .. } => {
            match place.as_ref() {
                Place::Set { path, .. } => Some(path),
                Place::Line { .. } => None,
            }
        }
        SceneError::Unreadable { .. }
        | SceneError::Study { .. }
        | SceneError::Syntax { .. }
        | SceneError::UnknownTag { .. }
        | SceneError::TagWithoutCondition { .. } => None,
    }
}

/// Refuses the name under `key` unless it can be a folder and is not among `used`.
pub(super) fn check_name<'a>(
    source: &SceneSource,
    key: &str,
    name: &str,
    used: impl IntoIterator<Item = &'a str>,
) -> Result<(), StudyError> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let taken = used.into_iter().any(|other| other.eq_ignore_ascii_case(name));
    if name.is_empty() || !name.chars().all(plain) || taken {
        let rule = "must be a name of its own of letters, digits, - and _: it becomes a folder";
        return Err(refuse(source, key, format!("\"{name}\""), rule, "such as \"newton\""));
    }
    Ok(())
}

/// The values of a table of overrides at `at`, none of which `vary` may set as well; an empty text removes a key.
pub(super) fn check_values(
    source: &SceneSource,
    at: &str,
    set: &BTreeMap<String, toml::Value>,
    varied: &dyn Fn(&str) -> bool,
    when: &str,
) -> Result<Values, StudyError> {
    let value_of = |(key, value): (&String, &toml::Value)| {
        let refuse = |rule: &str, hint: &str| refuse(source, &below(at, key), value.to_string(), rule, hint);
        if varied(key) {
            return Err(refuse(&format!("`vary` sets it {when}"), "take the key out of one of the two"));
        }
        if value.is_table() && !key.contains('.') {
            let rule = format!("would replace the whole table [{key}] of the scene");
            return Err(refuse(&rule, "quote a key that has dots, as in \"coupling.kind\" = \"newton\""));
        }
        Ok((key.clone(), value_text(value)))
    };
    set.iter().map(value_of).collect()
}

/// A value as [`SceneSource::set`] takes it.
pub(super) fn value_text(value: &toml::Value) -> String {
    if value.as_str() == Some("") { String::new() } else { value.to_string() }
}
