//! What can be wrong with a scene, and where.

use std::fmt;

use super::path::quoted;

/// Where a value was given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// Line (from 1) of the scene file; `None` if the file has no such place.
    Line {
        /// The scene's file.
        file: String,
        /// From 1, where it is known.
        line: Option<usize>,
    },
    /// An override: `--set`, a study's axis or a test.
    Set {
        /// The scene's file.
        file: String,
        /// The key that was set.
        path: String,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line { file, line: Some(line) } => write!(out, "{file}, line {line}"),
            Place::Line { file, line: None } => write!(out, "{file}"),
            Place::Set { file, path } => write!(out, "{file} with `{path}` set"),
        }
    }
}

/// What can be wrong with a scene.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum SceneError {
    #[error("{file}: cannot be read ({reason}); hint: {hint}")]
    Unreadable { file: String, reason: String, hint: &'static str },
    #[error("{file}: this is a study, not a scene; hint: `monolayer {command} {file}` runs it, its scene is {scene}")]
    Study { file: String, command: &'static str, scene: String },
    #[error("{place}: not TOML: {what}; hint: {hint}")]
    Syntax { place: Box<Place>, what: String, hint: String },
    #[error("{place}: there is no key `{key}`{suggestion}; hint: the keys that exist there are {known}")]
    UnknownKey { place: Box<Place>, key: String, suggestion: String, known: String },
    #[error("{place}: `{key}` = {value}: {rule}; hint: {hint}")]
    Value { place: Box<Place>, key: String, value: String, rule: String, hint: String },
    #[error("{place}: `{key}` is missing; hint: {hint}")]
    Missing { place: Box<Place>, key: String, hint: String },
    #[error(
        "{place}: [boundary.{}] names no part of the mesh's boundary{suggestion}; hint: the mesh's tags are {known}",
        quoted(.tag)
    )]
    UnknownTag { place: Box<Place>, tag: String, suggestion: String, known: String },
    #[error(
        "{file}: the boundary tag `{tag}` of the mesh has no condition; hint: add [boundary.{}] with `velocity` and \
         `polarity`",
        quoted(.tag)
    )]
    TagWithoutCondition { file: String, tag: String },
}
