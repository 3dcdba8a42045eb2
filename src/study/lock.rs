//! Locks that keep two processes from working at the same thing.

use std::fs::{File, OpenOptions, TryLockError};
use std::path::Path;

use crate::output::OutputError;

/// Name of the file that is locked, in the folder that it stands for.
pub const LOCK: &str = "lock";

fn open(folder: &Path) -> Result<File, OutputError> {
    std::fs::create_dir_all(folder).map_err(|e| OutputError::io(folder, &e))?;
    let path = folder.join(LOCK);
    OpenOptions::new().append(true).create(true).open(&path).map_err(|e| OutputError::io(&path, &e))
}

/// Takes the lock of a folder, which lasts as long as the file is open; `None` while somebody else has it. Where the file system
/// knows no locks, nobody is kept out.
///
/// # Errors
/// A folder that cannot be written.
pub fn try_lock(folder: &Path) -> Result<Option<File>, OutputError> {
    let file = open(folder)?;
    match file.try_lock() {
        Ok(()) | Err(TryLockError::Error(_)) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
    }
}

/// As [`try_lock`], after waiting for whoever has it.
///
/// # Errors
/// A folder that cannot be written.
pub fn lock(folder: &Path) -> Result<File, OutputError> {
    let file = open(folder)?;
    // no locks, nobody kept out
    let _ = file.lock();
    Ok(file)
}
