//! How much a run writes, before it does, and how much room there is.

use std::path::Path;

use super::RunError;
use super::memory::MIB;
use crate::element::basis;
use crate::measure::OutputField;
use crate::scene::{Output, SceneSource, What};
use crate::scheme::Schedule;

/// Bytes of a number in a table, and of one of a field: eight, a little less when compressed, and a third more as
/// text.
const TABLE: f64 = 19.0;
const FIELD: f64 = 10.5;
/// Bytes of a picture: pixels and drawing.
const PICTURE: f64 = 400e3;
/// Bytes of a body in the polydata and the tables of one time.
const BODY: f64 = 900.0;
/// Usual columns of a table of a section, and those of the history before its measures.
const COLUMNS: [f64; 2] = [9.0, 8.0];

/// What the size of files follows from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    /// Cells of the mesh.
    pub cells: f64,
    /// Of the grid that fields are written on.
    pub degree: usize,
    /// Rigid bodies.
    pub bodies: usize,
    /// Numbers in a checkpoint.
    pub checkpoint: f64,
    /// Measures in the history.
    pub columns: usize,
    /// Steps of the full length to `end`.
    pub steps: f64,
    /// Time at which the run ends.
    pub end: f64,
}

/// Mebibytes for people.
pub fn shown(mib: f64) -> String {
    match mib {
        m if m < 9.95 => format!("{m:.1} MiB"),
        m if m < 9999.5 => format!("{m:.0} MiB"),
        m => format!("{:.0} GiB", m / 1024.0),
    }
}

/// Steps of the full length that a run takes at most.
pub fn steps(step: f64, end: f64, max_steps: Option<usize>) -> f64 {
    (end / step).ceil().min(max_steps.map_or(f64::INFINITY, |most| most as f64))
}

/// Bytes that a run leaves in its folder, to about a third.
pub fn bytes(outputs: &[Output], sizes: &Sizes) -> f64 {
    // every time that an output asks for ends a step of its own
    let landings = outputs.iter().map(|output| match output.schedule {
        Schedule::Time(_) => output.schedule.count(sizes.steps, sizes.end),
        Schedule::Steps(_) | Schedule::End => 0.0,
    });
    let rows = landings.fold(sizes.steps, f64::max);
    let history = rows * TABLE * (COLUMNS[1] + sizes.columns as f64);
    let written = outputs.iter().map(|output| output.schedule.count(sizes.steps, sizes.end) * once(output, sizes));
    history + 8.0 * sizes.checkpoint + written.sum::<f64>()
}

/// Bytes of an output at one time; a checkpoint takes the place of the one before.
fn once(output: &Output, sizes: &Sizes) -> f64 {
    match &output.what {
        What::Measures(_) | What::Checkpoint => 0.0,
        What::Bodies { .. } => sizes.bodies as f64 * BODY,
        What::Maps(maps) => maps.len() as f64 * PICTURE,
        What::Cuts { cuts, columns } => {
            let named = |fields: &Vec<&OutputField>| 3 + fields.iter().map(|field| field.columns.len()).sum::<usize>();
            let width = columns.as_ref().map_or(COLUMNS[0], |fields| named(fields) as f64);
            cuts.iter().map(|cut| width * TABLE * cut.points() as f64).sum()
        }
        What::Fields(fields) => {
            let numbers: usize = 3 + fields.iter().map(|field| field.value.written()).sum::<usize>();
            sizes.cells * basis::node_count(sizes.degree) as f64 * numbers as f64 * FIELD
        }
    }
}

/// Results are refused that exceed the free space by this factor: sizes are known to a third only.
const OBVIOUS: f64 = 1.5;

/// Refuses to write more into a folder than its disk can obviously take; where that is unknown, nothing is refused.
///
/// # Errors
/// [`RunError::Disk`]
pub fn check(source: &SceneSource, bytes: f64, folder: &Path) -> Result<(), RunError> {
    match free(folder) {
        Some(free) if bytes > OBVIOUS * free => Err(RunError::Disk {
            origin: source.origin().to_owned(),
            folder: folder.display().to_string(),
            needed: bytes / MIB,
            free: free / MIB,
        }),
        Some(_) | None => Ok(()),
    }
}

/// Bytes that can be written below a folder, which need not be there yet; `None` where the system does not tell.
pub fn free(folder: &Path) -> Option<f64> {
    let whole = std::path::absolute(folder).ok()?;
    let there = whole.ancestors().find(|folder| folder.is_dir())?;
    on_unix(there)
}

#[cfg(unix)]
fn on_unix(folder: &Path) -> Option<f64> {
    let found = rustix::fs::statvfs(folder).ok()?;
    Some(found.f_bavail as f64 * found.f_frsize as f64)
}

#[cfg(not(unix))]
fn on_unix(_: &Path) -> Option<f64> {
    None
}
