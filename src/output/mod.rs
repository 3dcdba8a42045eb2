//! Files that a run leaves behind.

pub mod bodies;
pub mod checkpoint;
pub mod console;
pub mod frames;
pub mod history;
pub mod lock;
pub mod mark;
pub mod plot;
pub mod progress;
pub mod pvd;
pub mod timed;
pub mod vtk;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// What can go wrong while results are written.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum OutputError {
    #[error("{path}: {what}; hint: {hint}")]
    Io { path: String, what: String, hint: &'static str },
    #[error(
        "{path}: field `{field}` has the value {value} in cell {cell} at node {node}, component {component}; hint: \
         {hint}"
    )]
    NonFinite {
        path: String,
        field: String,
        cell: usize,
        node: usize,
        component: usize,
        value: f64,
        hint: &'static str,
    },
    #[error("{path}: {quantity} of {which} is {value}, must be finite; hint: {hint}")]
    NonFiniteBody { path: String, which: String, quantity: &'static str, value: f64, hint: &'static str },
    #[error("{folder}: is in use by {who}; hint: wait for its end, or choose another `--out`")]
    Held { folder: String, who: String },
    #[error(
        "{path}: is there already, not known as a result of this program, and will not be replaced; hint: choose \
         another `--out`, or move it away"
    )]
    Foreign { path: String },
    #[error("{path}: {what}; hint: {hint}")]
    Malformed { path: String, what: String, hint: &'static str },
}

impl OutputError {
    /// What is not ours to replace.
    pub fn foreign(path: &Path) -> Self {
        Self::Foreign { path: path.display().to_string() }
    }

    /// An error of the operating system, with a hint for its kind.
    pub fn io(path: &Path, error: &io::Error) -> Self {
        let hint = match error.kind() {
            io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory => {
                "a file is where a folder should be; choose another folder"
            }
            io::ErrorKind::NotFound => "the folder does not exist",
            io::ErrorKind::PermissionDenied => "choose a folder that can be written to",
            io::ErrorKind::StorageFull => "free some disk space, or write fewer fields less often",
            _ => "check the folder and the disk",
        };
        Self::Io { path: path.display().to_string(), what: error.to_string(), hint }
    }
}

/// Writes a file under a temporary name (`<name>.part`) and renames it, so that at any moment there is the old file,
/// the new file or none, but never half of one.
///
/// # Errors
/// [`OutputError::Io`] when creating, writing or renaming fails; the temporary file is then removed.
pub fn write_whole(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), OutputError> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    let fill = || {
        let mut file = BufWriter::new(File::create(&part)?);
        content(&mut file)?;
        file.into_inner()?.sync_data()?;
        std::fs::rename(&part, path)
    };
    fill().map_err(|error| {
        // The first error is the one to report, whether or not there is something to remove.
        let _ = std::fs::remove_file(&part);
        OutputError::io(path, &error)
    })
}

/// A number for a table: the shortest text that reads back to the same bits, with an exponent where that is shorter.
pub fn number(value: f64) -> String {
    let mut text = String::new();
    push_number(&mut text, value);
    text
}

/// Adds [`number`] to a text.
pub fn push_number(text: &mut String, value: f64) {
    use std::fmt::Write as _;
    // a text takes whatever is written
    let _ = if value == 0.0 || (1e-4..1e9).contains(&value.abs()) {
        write!(text, "{value}")
    } else {
        write!(text, "{value:e}")
    };
}
