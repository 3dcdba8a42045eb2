//! The folder of a run: whether it may be taken, where the run goes on, and what lies beyond that.

use std::path::{Path, PathBuf};

use super::{AnyScene, Options, RunError};
use crate::output::checkpoint::Saved;
use crate::output::lock::{self, Room};
use crate::output::progress::Verbosity;
use crate::output::{OutputError, console, history, mark, write_whole};
use crate::scene::SceneSource;

/// Names of all that runs leave.
pub const NAMES: [&str; 19] = [
    "scene.toml",
    "summary.json",
    "history.csv",
    "checkpoint.bin",
    "fields.pvd",
    "fields",
    "cuts",
    "plots",
    "defects.csv",
    "windings.csv",
    "bodies.csv",
    "bodies.json",
    "bodies.pvd",
    "bodies",
    "contacts.csv",
    "contacts.pvd",
    "frames.csv",
    "frames-*.txt",
    "estimate",
];

/// Where a run goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resumed {
    /// Steps that were accepted.
    pub step: usize,
    /// Time from which the run goes on.
    pub t: f64,
    /// Whether the run was cut off: then what it wrote at this time may be too little, or too much, and is written
    /// again. A run that came to its end, and goes on beyond it, keeps what it has written there.
    pub cut_off: bool,
}

impl Resumed {
    /// From the state of a checkpoint; whether the run came to its end is told by its summary.
    pub fn at(out: &Path, step: usize, t: f64) -> Self {
        let text = std::fs::read(out.join("summary.json")).unwrap_or_default();
        let summary: serde_json::Value = serde_json::from_slice(&text).unwrap_or_default();
        let ended = ["finished", "failed"].iter().any(|status| summary["status"] == **status);
        // a number of steps cuts a run off as a signal does
        Self { step, t, cut_off: !ended || summary["ending"] == "max-steps" }
    }

    /// The last time whose rows and index entries stay.
    pub fn last_time(&self) -> f64 {
        if self.cut_off { self.t.next_down() } else { self.t }
    }

    /// When the step began that led here, from the table of steps; `None` at the start.
    pub fn before(&self, out: &Path) -> Option<f64> {
        match self.step {
            0 => None,
            1 => Some(0.0),
            step => Some(history::entry(&out.join("history.csv"), step - 1, "time").unwrap_or(self.t)),
        }
    }

    /// Takes away what was written for later steps, and the summary, which is not about what follows. `pictures` are
    /// the names of the run's maps. A file under such a name that no run has written stays.
    ///
    /// # Errors
    /// Files that cannot be removed.
    pub fn drop_later(&self, out: &Path, pictures: &[&str]) -> Result<(), OutputError> {
        let first = if self.cut_off { self.step } else { self.step + 1 };
        let later = |name: &str, is_ours: &dyn Fn(&str) -> bool| {
            numbered(name).is_some_and(|(stem, step)| step >= first && is_ours(stem))
        };
        remove_from(&out.join("fields"), &|name| later(name, &|stem| stem == "step"))?;
        remove_from(&out.join("bodies"), &|name| later(name, &|stem| stem == "step" || stem == "contacts"))?;
        remove_from(&out.join("cuts"), &|name| later(name, &|stem| stem.ends_with("-step")))?;
        remove_from(&out.join("plots"), &|name| later(name, &|stem| pictures.contains(&stem)))?;
        remove_from(out, &|name| name == "summary.json" || name == "summary.json.part" || name == "checkpoint.bin.part")
    }
}

/// Runs a scene in a folder that nobody else is at work in.
///
/// # Errors
/// A folder that is in use or holds files of somebody else; nothing to resume; those of the run.
pub(super) fn alone<T>(options: &Options, run: impl FnOnce() -> Result<T, RunError>) -> Result<T, RunError> {
    let out = &options.out;
    let has_checkpoint = out.join("checkpoint.bin").exists();
    if options.resume && !has_checkpoint && !lock::is_marked(out) {
        return Err(RunError::NothingToResume { folder: out.display().to_string() });
    }
    // a run from before folders were marked is known by its checkpoint
    let is_known = !lock::is_marked(out) && has_checkpoint && Saved::read(&out.join("checkpoint.bin")).is_ok();
    lock::alone(out, Room::Without(if is_known { &[] } else { &NAMES }), run)
}

/// Refuses the results of another run; gives the checkpoint to go on from. A run that was killed before it had one
/// begins anew.
///
/// # Errors
/// As [`super::run`].
pub(super) fn prepare(options: &Options) -> Result<Option<PathBuf>, RunError> {
    let out = &options.out;
    let checkpoint = out.join("checkpoint.bin");
    if options.resume && checkpoint.exists() {
        return Ok(Some(checkpoint));
    }
    if options.resume {
        if options.verbosity > Verbosity::Quiet {
            console::note("note: the run was stopped before its first checkpoint: it begins anew");
        }
        forget(out)?;
    } else if ["history.csv", "summary.json", "checkpoint.bin"].iter().any(|name| out.join(name).exists()) {
        return Err(RunError::Occupied { folder: out.display().to_string() });
    }
    std::fs::create_dir_all(out).map_err(|e| OutputError::io(out, &e))?;
    Ok(None)
}

/// Takes away what a run left that never came to a checkpoint.
fn forget(out: &Path) -> Result<(), OutputError> {
    let start = Resumed { step: 0, t: 0.0, cut_off: true };
    start.drop_later(out, &[])?;
    let is_table = |name: &str| NAMES.contains(&name) && (name.ends_with(".csv") || name.ends_with(".pvd"));
    remove_from(out, &|name| is_table(name) || (name.starts_with("frames-") && name.ends_with(".txt")))
}

/// Writes the resolved scene. What somebody else has made of the file since stays if it says the same.
///
/// # Errors
/// A file that was changed and says something else; one that cannot be written.
pub(super) fn write_scene(out: &Path, text: &str, saved: Option<&str>) -> Result<(), OutputError> {
    let path = out.join("scene.toml");
    if let Ok(old) = std::fs::read_to_string(&path) {
        let resolved = || {
            let source = SceneSource::parse(&old, &path).ok()?;
            Some(AnyScene::check(source).ok()?.resolved_toml())
        };
        if old == text {
            return Ok(());
        }
        if saved != Some(old.as_str()) {
            match resolved() {
                Some(resolved) if resolved == text => return Ok(()),
                // as this program writes it
                Some(resolved) if resolved == old => {}
                // as an older program wrote it, with nothing that a person has added
                Some(resolved) if saved == Some(resolved.as_str()) && !old.contains('#') => {}
                Some(_) | None => return Err(OutputError::foreign(&path)),
            }
        }
    }
    write_whole(&path, |file| file.write_all(text.as_bytes()))
}

/// Stem and number of `STEM-NNNNNN.EXT`.
fn numbered(name: &str) -> Option<(&str, usize)> {
    let name = name.strip_suffix(".part").unwrap_or(name);
    let (stem, number) = name.rsplit_once('.')?.0.rsplit_once('-')?;
    let step = number.parse().ok().filter(|_| number.len() >= 6)?;
    Some((stem, step))
}

/// Removes files of a folder by their names.
fn remove_from(folder: &Path, is_over: &dyn Fn(&str) -> bool) -> Result<(), OutputError> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let named = entries.filter(|entry| is_over(&entry.file_name().to_string_lossy())).map(|entry| entry.path());
    for path in named.filter(|path| is_of_a_run(path)) {
        std::fs::remove_file(&path).map_err(|e| OutputError::io(&path, &e))?;
    }
    Ok(())
}

/// Whether a file is one that runs write under such names: it bears the mark, or is a table with their first columns.
/// One that was cut off may be empty.
fn is_of_a_run(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let is_empty = || std::fs::metadata(path).is_ok_and(|file| file.len() == 0);
    match name.rsplit('.').next() {
        Some("vtu" | "vtp" | "svg" | "png") => is_empty() || mark::is_marked(path).unwrap_or(false),
        Some("csv") => {
            let first = std::fs::read(path).unwrap_or_default();
            first.is_empty() || FIRST_COLUMNS.iter().any(|columns| first.starts_with(columns.as_bytes()))
        }
        Some(_) | None => true,
    }
}

/// What tables of a folder of results begin with.
const FIRST_COLUMNS: [&str; 4] = ["s,x1,x2,", "theta,x1,x2,", "time,", "step,"];

#[cfg(test)]
mod tests {
    use super::numbered;

    #[test]
    fn only_files_of_steps_are_numbered() {
        assert_eq!(numbered("speed-000080.png"), Some(("speed", 80)));
        assert_eq!(numbered("axis-1-step-1000000.csv"), Some(("axis-1-step", 1_000_000)));
        assert_eq!(numbered("step-000003.vtu.part"), Some(("step", 3)));
        assert_eq!([numbered("axis-1.csv"), numbered("walls.vtp"), numbered("bodies-last.png")], [None; 3]);
    }
}
