//! `monolayer schema`: the JSON Schema of scenes and studies.

use std::process::ExitCode;

use clap::Args;
use clap::builder::PossibleValuesParser;
use monolayer::output::console;
use monolayer::{scene, study};

use crate::Failure;

/// What `monolayer schema` is told.
#[derive(Debug, Args)]
pub struct SchemaArgs {
    /// Kind of scene, or command of a study [default: scenes of any kind].
    #[arg(value_parser = PossibleValuesParser::new(kinds()))]
    kind: Option<String>,
}

/// Kinds of scenes, then of studies.
fn kinds() -> impl Iterator<Item = &'static str> {
    scene::schema::kinds().into_iter().chain(study::schema::KINDS).map(|kind| kind.name)
}

impl SchemaArgs {
    /// Prints the schema.
    ///
    /// # Errors
    /// Standard output that cannot be written.
    pub fn execute(&self) -> Result<ExitCode, Failure> {
        let of = |kind: &String| scene::schema::of_kind(kind).or_else(|| study::schema::of_kind(kind));
        let schema = self.kind.as_ref().and_then(of).unwrap_or_else(scene::schema::of_scenes);
        console::answer(&serde_json::to_string_pretty(&schema)?)?;
        Ok(ExitCode::SUCCESS)
    }
}
