//! The exact state of a march on disc: compressed, checksummed, and tied to the problem that it belongs to.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use serde::{Deserialize, Serialize};

use super::{OutputError, write_whole};
use crate::time::Checkpoint;

const MAGIC: &str = "monolayer checkpoint 3";

/// A checkpoint and the scene that it continues.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Saved {
    magic: String,
    /// The resolved scene.
    pub scene: String,
    /// [`crate::mesh::Mesh::fingerprint`] of the mesh that the state lives on.
    pub mesh: u64,
    pub march: Checkpoint,
}

impl Saved {
    /// Binds a checkpoint to its scene.
    pub fn new(scene: String, mesh: u64, march: Checkpoint) -> Self {
        Self { magic: MAGIC.into(), scene, mesh, march }
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
        let saved: Self = postcard::from_bytes(&bytes).map_err(|e| damaged(format!("cannot be read ({e})")))?;
        if saved.magic != MAGIC {
            return Err(damaged(format!("is marked `{}`, not `{MAGIC}`", saved.magic)));
        }
        Ok(saved)
    }
}
