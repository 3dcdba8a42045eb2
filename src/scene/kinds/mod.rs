//! Kinds of scenes, each with its own keys: one row in [`ALL`]. What a kind does is a row of its own in
//! `run::kinds`.

pub mod advection;
pub mod particles;
pub mod stokes;

use std::fmt;

use serde_json::Value;

use super::error::SceneError;
use super::source::SceneSource;
use super::tables::{SceneFile, SpaceTable, TimeTable};
use crate::measure::OutputField;
use crate::model::fields::{DENSITY, POLARITY, PRESSURE, VELOCITY};
use crate::model::{FieldId, ModelScene};
use crate::schema::{self, fields};

/// Every kind; one that is none of them is read as the first.
pub static ALL: [&SceneKind; 4] = [&TISSUE, &stokes::KIND, &particles::KIND, &advection::KIND];

/// A kind of scene: what its file may say.
pub struct SceneKind {
    /// The values of `model.kind` that make it.
    pub names: &'static [&'static str],
    /// As in messages.
    pub shown: &'static str,
    /// The keys that its scenes may have.
    pub keys: Keys,
    /// The fields of its model; of a tissue some depend on its parameters. From them follow those that its runs can
    /// write, cut and draw.
    pub fields: &'static [FieldId],
    /// [`SceneSource::set`] for its scenes.
    pub set: fn(&mut SceneSource, &str, &str) -> Result<(), SceneError>,
    /// All that is said of the keys of its file, see [`schema::of`].
    pub said: fn() -> Value,
}

/// Keys of a kind: those of the structs that its tables are read into, see [`fields`].
pub struct Keys {
    /// Of the whole file.
    pub top: KeysOf,
    /// Of `[model]`.
    pub model: KeysOf,
    /// Of `[time]`.
    pub time: KeysOf,
    /// Of `[space]`.
    pub space: KeysOf,
}

/// The keys of a table.
pub type KeysOf = fn() -> &'static [&'static str];

impl Keys {
    /// The tables whose keys are told apart by kind, the first one being the whole file, and their keys.
    pub fn tables(&self) -> [(&'static str, &'static [&'static str]); 4] {
        [("", (self.top)()), ("model", (self.model)()), ("time", (self.time)()), ("space", (self.space)())]
    }

    /// Of a table that a kind does not have.
    pub fn none() -> &'static [&'static str] {
        &[]
    }
}

impl SceneKind {
    /// By the text of `model.kind`.
    pub fn of(name: &str) -> &'static SceneKind {
        ALL.into_iter().find(|kind| kind.names.contains(&name)).unwrap_or(&TISSUE)
    }

    /// Whether its runs have such a field.
    pub fn has(&self, field: &OutputField) -> bool {
        field.is_made_of(self.fields)
    }

    /// Whether something flows.
    pub fn flows(&self) -> bool {
        self.fields.contains(&VELOCITY)
    }
}

impl PartialEq for SceneKind {
    fn eq(&self, other: &Self) -> bool {
        self.names == other.names
    }
}

impl Eq for SceneKind {}

impl fmt::Debug for SceneKind {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.shown)
    }
}

/// `"incompressible"` and `"compressible"`, and whatever is no kind at all.
pub static TISSUE: SceneKind = SceneKind {
    names: &["incompressible", "compressible"],
    shown: "tissue (kind = \"incompressible\" or \"compressible\")",
    keys: Keys {
        top: fields::<SceneFile>,
        model: fields::<ModelScene>,
        time: fields::<TimeTable>,
        space: fields::<SpaceTable>,
    },
    fields: &[VELOCITY, PRESSURE, DENSITY, POLARITY],
    set: SceneSource::set_in::<SceneFile>,
    said: schema::of::<SceneFile>,
};
