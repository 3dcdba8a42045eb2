//! The tables of the polarity's defects.

use std::path::Path;

use super::stepper::Plan;
use crate::measure::defects::{Boundary, Census};
use crate::measure::list::{Asked, DEFECTS};
use crate::output::OutputError;
use crate::output::history::History;
use crate::scheme::Schedule;

/// Columns of `defects.csv` after `step`.
const COLUMNS: [&str; 5] = ["time", "x1", "x2", "charge", "size"];

/// `defects.csv`, a row per defect, and `windings.csv`, a row per time with the turns along every boundary curve.
#[derive(Debug)]
pub struct DefectTables {
    defects: History,
    windings: History,
    names: Vec<String>,
    /// Without `every` the tables hold the last state alone.
    only_last: bool,
}

impl DefectTables {
    /// The tables of a scene that measures defects, with the rows up to step `resume_after`.
    ///
    /// # Errors
    /// Files that cannot be read or written.
    pub fn open(
        plan: &Plan,
        out: &Path,
        boundaries: &[Boundary],
        resume_after: Option<usize>,
    ) -> Result<Self, OutputError> {
        let only_last = plan.is_search() || schedules(plan).all(|s| s == Schedule::End);
        let names: Vec<String> = boundaries.iter().map(|b| b.name.clone()).collect();
        let open = |name: &str, columns: Vec<String>| {
            let path = out.join(name);
            match resume_after {
                Some(step) if path.exists() && !only_last => History::resume(&path, columns, step),
                Some(_) | None => History::create(&path, columns),
            }
        };
        let time = std::iter::once("time".to_owned());
        Ok(Self {
            defects: open("defects.csv", COLUMNS.map(str::to_owned).to_vec())?,
            windings: open("windings.csv", time.chain(names.iter().cloned()).collect())?,
            names,
            only_last,
        })
    }

    /// Appends what was found on the way.
    ///
    /// # Errors
    /// A table that cannot be written.
    pub fn append(&mut self, step: usize, t: f64, census: &Census) -> Result<(), OutputError> {
        if self.only_last { Ok(()) } else { self.write(step, t, census) }
    }

    /// Appends what was found at the last state, where nothing is written on the way.
    ///
    /// # Errors
    /// As [`DefectTables::append`].
    pub fn append_last(&mut self, step: usize, t: f64, census: &Census) -> Result<(), OutputError> {
        if self.only_last { self.write(step, t, census) } else { Ok(()) }
    }

    fn write(&mut self, step: usize, t: f64, census: &Census) -> Result<(), OutputError> {
        for defect in &census.defects {
            self.defects.append(step, |column| match column {
                "time" => Some(t),
                "x1" => Some(defect.x.x),
                "x2" => Some(defect.x.y),
                "charge" => Some(f64::from(defect.charge)),
                "size" => Some(defect.size),
                _ => None,
            })?;
        }
        let winding = |column: &str| {
            let found = self.names.iter().position(|name| name == column);
            found.map(|k| f64::from(census.windings[k]))
        };
        self.windings.append(step, |column| if column == "time" { Some(t) } else { winding(column) })
    }
}

/// When the scene measures defects.
fn schedules<'p>(plan: &'p Plan) -> impl Iterator<Item = Schedule> + 'p {
    let with_defects = plan.outputs.iter().filter(|output| output.what.measures().contains(&Asked::from(&DEFECTS)));
    with_defects.map(|output| output.schedule)
}

/// Whether the scene measures defects at all.
pub fn named(plan: &Plan) -> bool {
    schedules(plan).next().is_some()
}
