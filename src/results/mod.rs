//! Folders of results, read again: what a run or a study left, as tables, settings and curves.
//!
//! Nothing here needs the solver: what is read is what the files say. A file that is missing or broken is a sentence in
//! [`Results::problems`], so that a run that was cut off can be looked at like any other.
//!
//! A run, and what is in its folder:
//!
//! ```
//! use std::path::Path;
//! use std::sync::atomic::AtomicBool;
//!
//! use monolayer::output::progress::Verbosity;
//! use monolayer::results::Results;
//! use monolayer::run::{AnyScene, Options, kinds};
//!
//! const SCENE: &str = r#"
//!     model = { kind = "incompressible", friction = 1, traction = 0, peclet = 1, coherence = 0.3, elasticity = 1 }
//!     mesh = { shape = "disc", h = 0.4 }
//!     boundary.wall = { velocity = "slip", polarity = "neumann" }
//!     initial = { polarity = ["cos(2*y)", "sin(2*x)"] }
//!     time = { scheme = "bdf2", step = 0.1, end = 1 }
//!     output = [{ measures = ["free_energy"], every = { steps = 1 } }]
//! "#;
//! let folder = tempfile::tempdir()?;
//! let out = folder.path().join("run");
//! let (verbosity, interrupt) = (Verbosity::Quiet, &AtomicBool::new(false));
//! kinds::run(&AnyScene::parse(SCENE, Path::new("disc.toml"))?, &Options { out: out.clone(), resume: false, verbosity, interrupt })?;
//!
//! let results = Results::read(&out)?;
//! let history = results.history()?.expect("a run has a history");
//! let energies: Vec<f64> = history.points("time", "free_energy").iter().map(|(_, energy)| *energy).collect();
//! assert!(energies.len() == 10 && energies.is_sorted_by(|a, b| a >= b), "{energies:?}");
//! assert!(results.problems.is_empty(), "{:?}", results.problems);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod bodies;
pub mod curves;
pub mod folder;
pub mod history;
pub(crate) mod label;
pub mod names;
pub mod plots;
pub mod sections;
pub mod study;
pub mod table;

pub use curves::{CurveSettings, Drawn, Image, Picture};
pub use folder::{Results, ResultsKind};
pub use label::{Setting, differing, labels, parameters};
pub use names::symbol;
pub use plots::PlotKind;
pub use table::Table;

/// Why results cannot be shown.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum ResultsError {
    #[error("{folder}: {what}; hint: {hint}")]
    Folder { folder: String, what: String, hint: &'static str },
    #[error("{file}: {what}; hint: {hint}")]
    Broken { file: String, what: String, hint: &'static str },
    #[error("`{option} {value}`: {rule}; hint: {hint}")]
    Option { option: &'static str, value: String, rule: String, hint: String },
}
