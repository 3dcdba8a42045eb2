//! The exact state of a run on disc: compressed, checksummed, and tied to the problem that it belongs to.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use serde::{Deserialize, Serialize};

use super::{OutputError, write_whole};
use crate::body::leaving::Departure;
use crate::measure::errors::History;
use crate::time::Checkpoint;
use crate::time::march::Counts;

const MAGIC: &str = "monolayer checkpoint 9";

/// A checkpoint and the scene that it continues.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    magic: String,
    /// The resolved scene.
    pub scene: String,
    /// [`crate::mesh::Mesh::fingerprint`] of the mesh that the state lives on, 0 without one.
    pub mesh: u64,
    /// Time of the state.
    pub t: f64,
    /// All that the march needs.
    pub counts: Counts,
    /// Largest overlap of bodies after a step so far, 0 without one.
    pub overlap: f64,
    /// What moves, as its stepper packs it.
    pub state: Vec<u8>,
    /// What was gathered on the way.
    pub kept: Kept,
}

/// What a run has gathered on its way, for its summary.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    /// Errors against the exact fields so far, where there are some.
    pub errors: Option<History>,
    /// Notes that were given after the start.
    pub said: Vec<String>,
    /// Whether one of them is of the fall of Δt.
    pub told: bool,
    /// Bodies that have left the mesh.
    pub left: Vec<Departure>,
}

impl Saved {
    /// Binds a state, its time, counts and largest overlap to its scene and mesh.
    pub fn new(scene: String, mesh: u64, (t, counts, overlap): (f64, Counts, f64), state: Vec<u8>, kept: Kept) -> Self {
        Self { magic: MAGIC.into(), scene, mesh, t, counts, overlap, state, kept }
    }

    /// The state of a tissue in which nothing moves.
    ///
    /// # Errors
    /// A state of something else.
    pub fn march(&self) -> Result<Checkpoint, postcard::Error> {
        postcard::from_bytes(&self.state)
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// [`OutputError::Io`]
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        write_whole(path, |file| {
            let bytes = postcard::to_stdvec(self).map_err(std::io::Error::other)?;
            let mut packed = GzEncoder::new(file, Compression::fast());
            std::io::Write::write_all(&mut packed, &bytes)?;
            packed.finish()?;
            Ok(())
        })
    }

    /// Reads a file that [`Saved::write`] wrote.
    ///
    /// # Errors
    /// A file that is missing, damaged, or no checkpoint of this version.
    pub fn read(path: &Path) -> Result<Self, OutputError> {
        let file = File::open(path).map_err(|error| OutputError::io(path, &error))?;
        let mut bytes = Vec::new();
        let damaged = |what: String| OutputError::Malformed {
            path: path.display().to_string(),
            what,
            hint: "it is no checkpoint of this version, or was cut off",
        };
        GzDecoder::new(file).read_to_end(&mut bytes).map_err(|e| damaged(format!("cannot be unpacked ({e})")))?;
        let (magic, _) =
            postcard::take_from_bytes::<String>(&bytes).map_err(|e| damaged(format!("cannot be read ({e})")))?;
        if magic != MAGIC {
            return Err(damaged(format!("is marked `{magic}`, not `{MAGIC}`")));
        }
        postcard::from_bytes(&bytes).map_err(|e| damaged(format!("cannot be read ({e})")))
    }
}
