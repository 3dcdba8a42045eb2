//! Folders of results, read again: what a run or a study left, as tables, settings and curves.
//!
//! Nothing here needs the solver: what is read is what the files say. A file that is missing or broken is a sentence in
//! [`Results::problems`], so that a run that was cut off can be looked at like any other.

pub mod bodies;
mod body_curves;
pub mod curves;
pub mod folder;
mod history;
pub(crate) mod label;
pub mod names;
mod sections;
pub mod study;
pub mod table;

pub use curves::{CurveSettings, Drawn, Picture, What};
pub use folder::{Results, ResultsKind};
pub use label::{Setting, differing, labels, parameters};
pub use names::symbol;
pub use table::Table;

/// Why results cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    #[error("{folder}: {what}; hint: {hint}")]
    Folder { folder: String, what: String, hint: &'static str },
    #[error("{file}: {what}; hint: {hint}")]
    Broken { file: String, what: String, hint: &'static str },
    #[error("`{option} {value}`: {rule}; hint: {hint}")]
    Option { option: &'static str, value: String, rule: String, hint: String },
}
