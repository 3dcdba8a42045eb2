//! The table of accepted steps, one row each, flushed as it grows.

use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};

use super::{OutputError, number, write_whole};

/// An open `history.csv`.
#[derive(Debug)]
pub struct History {
    path: PathBuf,
    columns: Vec<String>,
    writer: csv::Writer<File>,
}

/// The entry of a step in a column of a table on disk.
pub fn entry(path: &Path, step: usize, column: &str) -> Option<f64> {
    let mut reader = csv::Reader::from_path(path).ok()?;
    let at = reader.headers().ok()?.iter().position(|name| name == column)?;
    let of_step = |row: &csv::StringRecord| row.get(0).and_then(|s| s.parse().ok()) == Some(step);
    let row = reader.records().map_while(Result::ok).find(of_step)?;
    row.get(at)?.parse().ok()
}

/// First column: the number of the step.
const STEP: &str = "step";

impl History {
    /// Begins a new table; `columns` follow the column `step`.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be written.
    pub fn create(path: &Path, columns: Vec<String>) -> Result<Self, OutputError> {
        let file = File::create(path).map_err(|e| OutputError::io(path, &e))?;
        let mut history = Self { path: path.into(), columns, writer: csv::Writer::from_writer(file) };
        let header: Vec<String> = std::iter::once(STEP.into()).chain(history.columns.iter().cloned()).collect();
        history.record(&header)?;
        Ok(history)
    }

    /// Continues a table after step `last`: later rows are dropped, columns that it lacks are added empty.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be written; a table that cannot be read.
    pub fn resume(path: &Path, columns: Vec<String>, last: usize) -> Result<Self, OutputError> {
        let malformed = |what: String| OutputError::Malformed {
            path: path.display().to_string(),
            what,
            hint: "it is not the table of this run; move it away to begin a new one",
        };
        let mut reader = csv::Reader::from_path(path).map_err(|e| malformed(e.to_string()))?;
        let header = reader.headers().map_err(|e| malformed(e.to_string()))?.clone();
        if header.get(0) != Some(STEP) {
            return Err(malformed(format!("does not begin with the column `{STEP}`")));
        }
        let mut all: Vec<String> = header.iter().skip(1).map(str::to_owned).collect();
        let new: Vec<String> = columns.into_iter().filter(|c| !all.contains(c)).collect();
        let empty = new.len();
        all.extend(new);
        let mut kept = csv::Writer::from_writer(Vec::new());
        let row = |step: &str| std::iter::once(step.to_owned()).chain(all.iter().cloned());
        kept.write_record(row(STEP)).map_err(|e| malformed(e.to_string()))?;
        // the row that a crash cut off, if any, is the last and not needed
        for row in reader.records().map_while(Result::ok) {
            if row.get(0).and_then(|s| s.parse().ok()).is_some_and(|step: usize| step <= last) {
                let filled = row.iter().chain(std::iter::repeat_n("", empty));
                kept.write_record(filled).map_err(|e| malformed(e.to_string()))?;
            }
        }
        let bytes = kept.into_inner().map_err(|e| malformed(e.to_string()))?;
        write_whole(path, |file| file.write_all(&bytes))?;
        let file = OpenOptions::new().append(true).open(path).map_err(|e| OutputError::io(path, &e))?;
        Ok(Self { path: path.into(), columns: all, writer: csv::Writer::from_writer(file) })
    }

    /// Appends a row; `value` gives the entry of each column, `None` for an empty one.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be written.
    pub fn append(&mut self, step: usize, value: impl Fn(&str) -> Option<f64>) -> Result<(), OutputError> {
        let cell = |column: &String| value(column).map_or_else(String::new, number);
        let row: Vec<String> = std::iter::once(step.to_string()).chain(self.columns.iter().map(cell)).collect();
        self.record(&row)
    }

    fn record(&mut self, row: &[String]) -> Result<(), OutputError> {
        let written = self.writer.write_record(row).map_err(std::io::Error::other);
        written.and_then(|()| self.writer.flush()).map_err(|e| OutputError::io(&self.path, &e))
    }
}
