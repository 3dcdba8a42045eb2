//! One run of a study in its folder, whatever an earlier process left there.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::child::{self, Ended, Job, RunSummary};
use super::memory_gate::{self, MemoryGate};
use super::results::Found;
use crate::output::checkpoint::Saved;
use crate::output::lock::{LOCK, Lock};
use crate::output::progress::Verbosity;
use crate::output::{OutputError, console};
use crate::run::AnyScene;
use crate::run::{Options, estimate, kinds};
use crate::scene::renamed;

/// How runs are done.
#[derive(Debug)]
pub struct RunLauncher<'a> {
    /// Runs are processes of this program; without one they are done in this process.
    pub program: Option<&'a Path>,
    pub threads: usize,
    /// Where more than one goes on at a time.
    pub gate: Option<MemoryGate>,
    pub verbosity: Verbosity,
    pub interrupt: &'a AtomicBool,
}

/// One attempt at a run.
#[derive(Clone, Copy)]
struct Attempt<'r> {
    folder: &'r Path,
    scene: &'r AnyScene,
    /// The scene as a file.
    text: &'r str,
    /// Whether it goes on from the checkpoint in the folder.
    resume: bool,
    /// Bytes that it may take, where others go on at the same time.
    memory: Option<f64>,
    lock: &'r Lock,
}

/// A process that was killed may not be the only one: time for the same to happen to this one before it calls that a
/// failure.
const SIGNAL_DELAY: Duration = Duration::from_millis(300);

impl RunLauncher<'_> {
    /// Does a run, continues it, or finds it done; and the seconds that it took. `None` if it was interrupted before it
    /// could say anything. What is half done goes on from its checkpoint, but for searches for steady states, which
    /// have the same bits only when they begin anew.
    ///
    /// # Errors
    /// A folder that cannot be written, a program that cannot be started.
    pub fn ensure(&self, folder: &Path, scene: &AnyScene, lock: &Lock) -> Result<Option<(Found, f64)>, OutputError> {
        let text = scene.resolved_toml();
        let same = std::fs::read_to_string(folder.join("scene.toml")).is_ok_and(|old| renamed::modern(&old).0 == text);
        let summary = RunSummary::read(folder).filter(|_| same);
        if let Some(done) = summary.filter(RunSummary::is_complete) {
            let seconds = done.seconds_total;
            return Ok(Some((Found::Ran(Box::new(done)), seconds)));
        }
        let resumable = same
            && scene.tissue().is_none_or(|scene| scene.steady.is_none())
            && Saved::read(&folder.join("checkpoint.bin")).is_ok_and(|saved| renamed::modern(&saved.scene).0 == text);
        let pass = self.gate.as_ref().map(|gate| gate.enter(memory_gate::need(scene).unwrap_or(0.0)));
        if self.interrupt.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let limit = pass.as_ref().and_then(|pass| pass.limit);
        let anew = Attempt { folder, scene, text: &text, resume: false, memory: limit, lock };
        if resumable {
            let (found, seconds) = self.attempt(&Attempt { resume: true, ..anew })?;
            match found {
                // what a crash of the system has torn is done anew
                Some(Found::Refused(_)) => {}
                found => return Ok(found.map(|found| (found, seconds))),
            }
        }
        clear(folder)?;
        let (found, seconds) = self.attempt(&anew)?;
        Ok(found.map(|found| (found, seconds)))
    }

    /// What came of an attempt, and the seconds that it took.
    fn attempt(&self, run: &Attempt) -> Result<(Option<Found>, f64), OutputError> {
        match self.program {
            Some(program) => self.in_a_process(program, run),
            None => Ok(self.in_this_process(run)),
        }
    }

    fn in_this_process(&self, run: &Attempt) -> (Option<Found>, f64) {
        let begin = Instant::now();
        // what a summary of an earlier process says is not about this one
        let _ = std::fs::remove_file(run.folder.join("summary.json"));
        let (out, resume) = (run.folder.into(), run.resume);
        let options = Options { out, resume, verbosity: self.verbosity, interrupt: self.interrupt };
        let found = match kinds::run_held(run.scene, &options) {
            Ok(_) => RunSummary::read(run.folder).map(|summary| Found::Ran(Box::new(summary))),
            Err(error) => Some(Found::Refused(error.to_string())),
        };
        (found, begin.elapsed().as_secs_f64())
    }

    fn in_a_process(&self, program: &Path, run: &Attempt) -> Result<(Option<Found>, f64), OutputError> {
        let name = run.folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let verbose = self.verbosity == Verbosity::Verbose;
        let said = |line: &str| {
            if verbose {
                console::note(&format!("{name}: {line}"));
            }
        };
        let Attempt { folder, text: scene, resume, memory, lock, .. } = *run;
        let (threads, out) = (self.threads, PathBuf::from(folder));
        let lock = lock.file().try_clone().ok();
        let job = Job { program, scene, out, threads, resume, memory, verbose, lock };
        let ended = child::run(job, self.interrupt, &said)?;
        let seconds = ended.seconds;
        Ok((self.judge(folder, ended)?, seconds))
    }

    /// What a process that has ended leaves; `None` if it was interrupted before it could say anything.
    fn judge(&self, folder: &Path, ended: Ended) -> Result<Option<Found>, OutputError> {
        let interrupted = self.interrupt.load(Ordering::Relaxed) || ended.status.code() == Some(130);
        if ended.was_killed() {
            std::thread::sleep(SIGNAL_DELAY);
        }
        let reason = ended.reason();
        let summary = match ended.summary {
            // the run itself is there, and what became of its estimates is told
            Some(summary) if summary.status == "finished" && !interrupted && !summary.is_complete() => {
                estimate::give_up(folder, &reason)?;
                RunSummary::read(folder)
            }
            summary => summary,
        };
        let own_error = ended.last_lines.iter().any(|line| line.starts_with("error: "));
        Ok(match summary {
            Some(summary) => Some(Found::Ran(Box::new(summary))),
            None if interrupted => None,
            None if own_error && ended.status.code() == Some(1) => Some(Found::Refused(reason)),
            None => Some(Found::Died(reason)),
        })
    }
}

/// Takes away all that an earlier process left, but the lock.
///
/// # Errors
/// Files that cannot be removed.
pub fn clear(folder: &Path) -> Result<(), OutputError> {
    let failed = |path: &Path, error: std::io::Error| OutputError::io(path, &error);
    for entry in std::fs::read_dir(folder).map_err(|e| failed(folder, e))? {
        let path = entry.map_err(|e| failed(folder, e))?.path();
        if path.file_name().is_some_and(|name| name == LOCK) {
            continue;
        }
        let removed = if path.is_dir() { std::fs::remove_dir_all(&path) } else { std::fs::remove_file(&path) };
        removed.map_err(|e| failed(&path, e))?;
    }
    Ok(())
}
