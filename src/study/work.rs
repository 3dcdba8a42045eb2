//! The workers of a sweep: each takes the next runs that nobody is at.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::results::{self, Branch, Found, Row, Start};
use super::run_launcher::{RunLauncher, clear};
use super::sweep::{Settings, Shard, is_bad, missing, write_tables};
use super::sweep_file::SweepStudy;
use super::{StudyError, warm};
use crate::output::console;
use crate::output::lock::{self, Lock, Room};
use crate::output::progress::Verbosity;
use crate::run::AnyScene;

pub(super) fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What the workers share.
pub(super) struct Work<'a> {
    pub study: &'a SweepStudy,
    pub out: &'a Path,
    pub settings: &'a Settings<'a>,
    pub launcher: RunLauncher<'a>,
    /// Runs of this shard.
    pub mine: Vec<usize>,
    pub rows: Mutex<Vec<Option<Row>>>,
    pub queue: Mutex<VecDeque<Vec<usize>>>,
    /// What ends all workers.
    pub broken: Mutex<Option<StudyError>>,
}

/// Between two looks at what another process works on.
const PAUSE: Duration = Duration::from_millis(200);

impl Work<'_> {
    fn is_over(&self) -> bool {
        self.settings.interrupt.load(Ordering::Relaxed) || held(&self.broken).is_some()
    }

    /// Works until nothing is left, or somebody interrupts.
    pub fn work(&self) {
        while !self.is_over() {
            let Some(unit) = held(&self.queue).pop_front() else { return };
            match self.unit(&unit) {
                Ok(true) => {}
                // another process is at it
                Ok(false) => {
                    held(&self.queue).push_back(unit);
                    std::thread::sleep(PAUSE);
                }
                Err(error) => *held(&self.broken) = Some(error),
            }
        }
    }

    /// Does the runs of a unit in order; false where another process does one of them.
    fn unit(&self, unit: &[usize]) -> Result<bool, StudyError> {
        for &at in unit {
            if self.is_over() {
                return Ok(true);
            }
            if held(&self.rows)[at].as_ref().is_some_and(|row| row.found.is_complete()) {
                continue;
            }
            let folder = self.out.join(&self.study.cases[at].folder);
            let Some(lock) = lock::try_take(&folder, Room::Empty)? else { return Ok(false) };
            let done = self.case(at, &lock)?;
            drop(lock);
            if let Some(row) = done {
                self.take(at, row)?;
            }
        }
        Ok(true)
    }

    /// Does a run, if that is still to do, and leaves its row.
    fn case(&self, at: usize, lock: &Lock) -> Result<Option<Row>, StudyError> {
        let case = &self.study.cases[at];
        let folder = self.out.join(&case.folder);
        let before = Row::read(case, self.out);
        let again = self.settings.retry_failed && before.as_ref().is_some_and(is_bad);
        if again {
            clear(&folder)?;
        }
        let before = before.filter(|_| !again);
        if before.as_ref().is_some_and(|row| row.found.is_complete()) {
            return Ok(before);
        }
        let (scene, mut said, neighbour) = match self.scene(at)? {
            Ok(scene) => scene,
            Err(error) => {
                Row::leave(&folder, &Found::Refused(error.to_string()), 0.0, &[], None)?;
                return Ok(Row::read(case, self.out));
            }
        };
        let Some((found, seconds)) = self.launcher.ensure(&folder, &scene, lock)? else { return Ok(None) };
        let seconds = seconds + before.map_or(0.0, |row| row.seconds);
        let mut start = (!self.study.warm.is_empty()).then_some(Start { branch: Branch::Start, distance: None });
        if let Some(neighbour) = neighbour.filter(|_| found.is_good() && found.is_complete()) {
            match warm::judge(self.study, &self.launcher, self.out, at, neighbour, lock)? {
                None => return Ok(None),
                Some((judged, notes)) => {
                    start = Some(judged);
                    said.extend(notes);
                }
            }
        }
        Row::leave(&folder, &found, seconds, &said, start.as_ref())?;
        Ok(Row::read(case, self.out))
    }

    /// The scene of a run, what there is to say about its start, and the run whose last state it starts from.
    #[allow(clippy::type_complexity)]
    fn scene(&self, at: usize) -> Result<Result<(AnyScene, Vec<String>, Option<usize>), StudyError>, StudyError> {
        let scene = match self.study.scene_of(at) {
            Ok(scene) => scene,
            Err(error) => return Ok(Err(error)),
        };
        let Some(before) = self.study.cases[at].after else { return Ok(Ok((scene, Vec::new(), None))) };
        let name = &self.study.cases[before].folder;
        let folder = self.out.join(name);
        if !held(&self.rows)[before].as_ref().is_some_and(|row| warm::can_follow(&row.found, &folder)) {
            let note = format!("run {name} left no state to start from: this one began from the scene's own");
            return Ok(Ok((scene, vec![note], None)));
        }
        let Some(tissue) = scene.tissue() else { return Ok(Ok((scene, Vec::new(), None))) };
        let set = warm::start_from(&folder, tissue)?;
        Ok(self.study.scene_with(at, &set).map(|scene| (scene, Vec::new(), Some(before))))
    }

    /// Puts a row into the table.
    fn take(&self, at: usize, row: Row) -> Result<(), StudyError> {
        let mut rows = held(&self.rows);
        let line = told(&row);
        rows[at] = Some(row);
        self.write(&rows, false)?;
        if self.settings.verbosity > Verbosity::Quiet {
            let open = missing(self.study, &self.mine, &rows).len();
            console::note(&format!("{line} ({} of {})", self.mine.len() - open, self.mine.len()));
            // what many runs say is said once
            let others: Vec<&String> = rows
                .iter()
                .enumerate()
                .filter(|(k, _)| *k != at)
                .flat_map(|(_, row)| row)
                .flat_map(|row| &row.said)
                .collect();
            for note in rows[at].iter().flat_map(|row| &row.said).filter(|note| !others.contains(note)) {
                console::note(&format!("    note: {}", note.strip_prefix("note: ").unwrap_or(note)));
            }
        }
        Ok(())
    }

    /// Writes the tables of what is there; others may do so at the same time.
    pub fn write(&self, rows: &[Option<Row>], last: bool) -> Result<(), StudyError> {
        // whether there is room was seen at the beginning
        let _lock = lock::wait_for(self.out, Room::Without(&[]))?;
        let found: Vec<Row> = self.mine.iter().filter_map(|&at| rows[at].clone()).collect();
        match self.settings.shard {
            None => write_tables(self.study, self.out, &found, last),
            Some(Shard { number, of }) => {
                let path = self.out.join(format!("results.{number}-of-{of}.csv"));
                Ok(results::write(self.study, &found, &path)?)
            }
        }
    }
}

/// One line about a run.
fn told(row: &Row) -> String {
    let set: Vec<String> = row.case.set.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    let reason = row.found.reason().map_or_else(String::new, |reason| format!(": {reason}"));
    let ending = match row.summary() {
        Some(summary) => {
            let counts = &summary.counts;
            format!(
                "{}, t = {}, {} steps, {} rejected{reason}",
                summary.status, summary.time, counts.steps, counts.rejected
            )
        }
        None => format!("{}{reason}", row.found.status()),
    };
    format!("{}  {}  {ending}; {:.1} s", row.case.folder, set.join(", "), row.seconds)
}
