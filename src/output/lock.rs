//! Whose a folder of results is, and who is at work in it.
//!
//! The file `lock` in a folder is its mark: there, what has the name of a result is one, and may be replaced. In a
//! folder without it nothing that is there already may be. While a process works in the folder it holds a lock of the
//! system on the file, which ends with the process, and its first lines tell who that is.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::OutputError;

/// Name of the file that is locked, in the folder that it stands for.
pub const LOCK: &str = "lock";

const MARK: &str = "monolayer keeps results in this folder\n";

/// What a folder may hold that is not marked yet.
#[derive(Debug, Clone, Copy)]
pub enum Room<'a> {
    /// Nothing at all.
    Empty,
    /// Anything but these names, in which `*` stands for any text; folders of these names may be there if they are
    /// empty.
    Without(&'a [&'a str]),
}

/// A folder that this process has to itself, as long as this or a copy of its file is open.
#[derive(Debug)]
pub struct Lock {
    file: File,
    /// Whether the folder had no mark before.
    is_new: bool,
}

/// Takes a folder, which is made if need be.
///
/// # Errors
/// [`OutputError::Held`] while somebody else has it, [`OutputError::Foreign`] where there is no room for results; a
/// folder that cannot be written.
pub fn take(folder: &Path, room: Room) -> Result<Lock, OutputError> {
    try_take(folder, room)?.ok_or_else(|| held(folder))
}

/// As [`take`]; `None` while somebody else has it. Where the file system knows no locks, nobody is kept out.
///
/// # Errors
/// [`OutputError::Foreign`] where there is no room for results; a folder that cannot be written.
pub fn try_take(folder: &Path, room: Room) -> Result<Option<Lock>, OutputError> {
    open(folder, room, |file| match file.try_lock() {
        Ok(()) | Err(TryLockError::Error(_)) => true,
        Err(TryLockError::WouldBlock) => false,
    })
}

/// As [`take`], after waiting for whoever has it.
///
/// # Errors
/// A folder that has no room for results, or cannot be written.
pub fn wait_for(folder: &Path, room: Room) -> Result<Lock, OutputError> {
    let lock = open(folder, room, |file| {
        // no locks, nobody kept out
        let _ = file.lock();
        true
    });
    lock.map(|lock| lock.expect("waited for"))
}

/// Does some work in a folder that nobody else is at work in. If it fails before it leaves anything, the folder is as
/// before.
///
/// # Errors
/// [`OutputError::Held`] while somebody else has it, [`OutputError::Foreign`] where there is no room for results; a
/// folder that cannot be written; what goes wrong in the work.
pub fn alone<T, E: From<OutputError>>(folder: &Path, room: Room, work: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
    let made: Vec<&Path> = folder.ancestors().take_while(|at| !at.as_os_str().is_empty() && !at.exists()).collect();
    let lock = take(folder, room)?;
    let result = work();
    if result.is_err() && lock.is_new && foreign(folder, room).is_none() {
        // while it is still held, so that nobody takes what is about to go
        let _ = std::fs::remove_file(folder.join(LOCK));
        // those that something else has come into stay
        for folder in made {
            let _ = std::fs::remove_dir(folder);
        }
    }
    result
}

/// Whether a folder is marked as one of results.
pub fn is_marked(folder: &Path) -> bool {
    std::fs::read(folder.join(LOCK)).is_ok_and(|text| text.starts_with(MARK.as_bytes()))
}

/// Whether a process is at work in a folder.
pub fn is_held(folder: &Path) -> bool {
    let file = File::open(folder.join(LOCK));
    file.is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
}

/// Refuses a folder that is not marked and has no room.
///
/// # Errors
/// [`OutputError::Foreign`] where there are files that are not ours.
pub fn check(folder: &Path, room: Room) -> Result<(), OutputError> {
    if is_marked(folder) || (folder.join(LOCK).exists() && is_of_a_study(folder)) {
        return Ok(());
    }
    foreign(folder, room).map_or(Ok(()), |path| Err(OutputError::foreign(&path)))
}

/// Tells in the mark of a folder that this process is at work there: its parent holds the lock for it.
pub fn sign(folder: &Path) {
    if let Ok(mut file) = OpenOptions::new().append(true).open(folder.join(LOCK)) {
        // whoever asks learns of the parent
        let _ = write_mark(&mut file);
    }
}

impl Lock {
    /// The open file, for a child that has to hold the lock as well.
    pub fn file(&self) -> &File {
        &self.file
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // nobody is at work here any more
        let _ = self.file.set_len(MARK.len() as u64);
    }
}

fn open(folder: &Path, room: Room, lock: impl Fn(&File) -> bool) -> Result<Option<Lock>, OutputError> {
    let path = folder.join(LOCK);
    let failed = |error: std::io::Error| OutputError::io(&path, &error);
    let made = !folder.exists();
    std::fs::create_dir_all(folder).map_err(|e| OutputError::io(folder, &e))?;
    loop {
        let is_new = !path.exists();
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(&path).map_err(failed)?;
        if !lock(&file) {
            return Ok(None);
        }
        if !is_still_there(&file, &path) {
            // who had it before has taken it away
            continue;
        }
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(failed)?;
        let is_marked = text.starts_with(MARK.as_bytes());
        let in_the_way = match (is_marked, text.is_empty()) {
            (true, _) => None,
            // before it had a content, a study left it behind
            (false, true) if !is_new && is_of_a_study(folder) => None,
            (false, true) => foreign(folder, room),
            (false, false) => Some(path.clone()),
        };
        if let Some(other) = in_the_way {
            if is_new {
                let _ = std::fs::remove_file(&path);
                if made {
                    let _ = std::fs::remove_dir(folder);
                }
            }
            return Err(OutputError::foreign(&other));
        }
        write_mark(&mut file).map_err(failed)?;
        return Ok(Some(Lock { file, is_new: is_new || !is_marked }));
    }
}

fn is_of_a_study(folder: &Path) -> bool {
    let has = |names: &[&str]| names.iter().all(|name| folder.join(name).exists());
    has(&["row.json"]) || has(&["scene.toml", "history.csv"]) || has(&["study.toml", "results.csv"])
}

/// The mark, and who is at work.
fn write_mark(file: &mut File) -> std::io::Result<()> {
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let host = if host.trim().is_empty() { String::new() } else { format!(" on {}", host.trim()) };
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs();
    file.set_len(0)?;
    file.write_all(format!("{MARK}process {}{host}\nsince {since}\n", std::process::id()).as_bytes())
}

/// What is said to somebody who is kept out.
fn held(folder: &Path) -> OutputError {
    let text = std::fs::read_to_string(folder.join(LOCK)).unwrap_or_default();
    let mut lines = text.lines().skip(1);
    let who = lines.next().unwrap_or("another process").to_owned();
    let since = lines.next().and_then(|line| line.strip_prefix("since ")).and_then(|text| text.parse().ok());
    let since = since.map(|seconds| SystemTime::UNIX_EPOCH + Duration::from_secs(seconds));
    let age = since.and_then(|since| since.elapsed().ok()).map(|age| match age.as_secs() {
        seconds @ 0..120 => format!(", which began {seconds} s ago"),
        seconds => format!(", which began {} min ago", seconds / 60),
    });
    OutputError::Held { folder: folder.display().to_string(), who: who + &age.unwrap_or_default() }
}

/// What lies in a folder in which it must not.
fn foreign(folder: &Path, room: Room) -> Option<PathBuf> {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok).map(|entry| entry.path()).collect();
    entries.sort();
    let is_empty_folder = |path: &Path| std::fs::read_dir(path).is_ok_and(|mut inside| inside.next().is_none());
    entries.into_iter().find(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        // under this name it is written first
        let name = name.strip_suffix(".part").unwrap_or(&name);
        let is_in_the_way = match room {
            Room::Empty => true,
            Room::Without(names) => names.iter().any(|pattern| matches(pattern, name)) && !is_empty_folder(path),
        };
        name != LOCK && is_in_the_way
    })
}

fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        Some((begin, end)) => name.len() >= begin.len() + end.len() && name.starts_with(begin) && name.ends_with(end),
        None => pattern == name,
    }
}

/// Whether the path leads to the open file.
#[cfg(unix)]
fn is_still_there(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |of: std::fs::Metadata| (of.dev(), of.ino());
    file.metadata().ok().map(place) == std::fs::metadata(path).ok().map(place)
}

/// An open file cannot be taken away.
#[cfg(not(unix))]
fn is_still_there(_: &File, _: &Path) -> bool {
    true
}
