//! Files that are written where a user's own may lie bear a mark, so that they are known as ones that may be replaced.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use super::OutputError;
use crate::names::MADE_BY;

/// What pages had before there was a mark.
const GENERATOR: &str = "name=\"generator\" content=\"monolayer";

/// It is this near to the beginning or the end of a file.
const NEAR: u64 = 4096;

/// Refuses to replace a file without the mark.
///
/// # Errors
/// [`OutputError::Foreign`] for a file that is not ours; one that cannot be read.
pub fn check(path: &Path) -> Result<(), OutputError> {
    match is_marked(path) {
        Ok(true) => Ok(()),
        Ok(false) => Err(OutputError::foreign(path)),
        // also a link that leads nowhere is somebody's
        Err(error) if error.kind() == io::ErrorKind::NotFound && path.symlink_metadata().is_err() => Ok(()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Err(OutputError::foreign(path)),
        Err(error) => Err(OutputError::io(path, &error)),
    }
}

/// Whether a file has the mark.
///
/// # Errors
/// A file that cannot be read.
pub fn is_marked(path: &Path) -> io::Result<bool> {
    let mut file = File::open(path)?;
    let mut ends = Vec::new();
    Read::by_ref(&mut file).take(NEAR).read_to_end(&mut ends)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(NEAR)))?;
    file.take(NEAR).read_to_end(&mut ends)?;
    let holds = |text: &str| ends.windows(text.len()).any(|part| part == text.as_bytes());
    Ok(holds(MADE_BY) || holds(GENERATOR))
}

/// A PNG file with the mark, as a chunk of text after its header.
pub fn png(bytes: &[u8]) -> Vec<u8> {
    /// The signature, and the chunk of the header.
    const HEAD: usize = 8 + 25;
    let text = format!("tEXtSoftware\0{MADE_BY}");
    let mut crc = flate2::Crc::new();
    crc.update(text.as_bytes());
    let length = (text.len() - 4) as u32;
    let (head, rest) = bytes.split_at(HEAD.min(bytes.len()));
    [head, &length.to_be_bytes()[..], text.as_bytes(), &crc.sum().to_be_bytes()[..], rest].concat()
}
