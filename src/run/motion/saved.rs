//! The exact state of moving bodies on disc, tied to its scene.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use serde::{Deserialize, Serialize};

use crate::mesh::Mesh;
use crate::output::{OutputError, write_whole};
use crate::run::RunError;
use crate::time::march::Counts;

const MAGIC: &str = "monolayer bodies 3";

/// A checkpoint and the scene that it continues.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedMotion {
    magic: String,
    /// The resolved scene.
    pub scene: String,
    /// [`crate::mesh::Mesh::fingerprint`], 0 without a mesh.
    pub mesh: u64,
    /// Time of the state.
    pub t: f64,
    /// Totals up to here.
    pub counts: Counts,
    /// Largest overlap after a step so far, 0 without one.
    pub overlap: f64,
    /// What the bodies and the flow are, as their stepper packs it.
    pub state: Vec<u8>,
}

impl SavedMotion {
    /// Binds a state to its scene.
    pub fn new(scene: String, mesh: u64, t: f64, counts: Counts, overlap: f64, state: Vec<u8>) -> Self {
        Self { magic: MAGIC.into(), scene, mesh, t, counts, overlap, state }
    }

    /// Refuses another mesh.
    ///
    /// # Errors
    /// [`RunError::OtherProblem`]
    pub(in crate::run) fn check_mesh(&self, mesh: &Mesh, file: &Path) -> Result<(), RunError> {
        if self.mesh == mesh.fingerprint() {
            return Ok(());
        }
        Err(RunError::OtherProblem { file: file.display().to_string(), key: "mesh".into() })
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

    /// Reads a file that [`SavedMotion::write`] wrote.
    ///
    /// # Errors
    /// A file that is missing, damaged, or no checkpoint of moving bodies of this version.
    pub fn read(path: &Path) -> Result<Self, OutputError> {
        let damaged = |what: String| OutputError::Malformed {
            path: path.display().to_string(),
            what,
            hint: "it is no checkpoint of moving bodies of this version, or was cut off",
        };
        let bytes = unpacked(path)?;
        let (magic, _) =
            postcard::take_from_bytes::<String>(&bytes).map_err(|e| damaged(format!("cannot be read ({e})")))?;
        if magic != MAGIC {
            return Err(damaged(format!("is marked `{magic}`, not `{MAGIC}`")));
        }
        postcard::from_bytes(&bytes).map_err(|e| damaged(format!("cannot be read ({e})")))
    }
}

/// The resolved scene that a checkpoint of any kind continues; `None` where there is no sound checkpoint.
pub fn scene_of(path: &Path) -> Option<String> {
    if let Ok(saved) = SavedMotion::read(path) {
        return Some(saved.scene);
    }
    crate::output::checkpoint::Saved::read(path).ok().map(|saved| saved.scene)
}

fn unpacked(path: &Path) -> Result<Vec<u8>, OutputError> {
    let file = File::open(path).map_err(|error| OutputError::io(path, &error))?;
    let mut bytes = Vec::new();
    GzDecoder::new(file).read_to_end(&mut bytes).map_err(|e| OutputError::Malformed {
        path: path.display().to_string(),
        what: format!("cannot be unpacked ({e})"),
        hint: "it is no checkpoint of this version, or was cut off",
    })?;
    Ok(bytes)
}
