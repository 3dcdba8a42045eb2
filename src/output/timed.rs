//! Tables of several rows for each time of output, which a resumed run continues.

use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};

use super::{OutputError, number, write_whole};

/// First column.
const TIME: &str = "time";

/// An open table, flushed after every time.
#[derive(Debug)]
pub struct TimedTable {
    path: PathBuf,
    columns: usize,
    /// Of the last rows.
    last: Option<f64>,
    writer: csv::Writer<File>,
}

impl TimedTable {
    /// Begins a new table; `columns` follow the column `time`.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be written.
    pub fn create(path: &Path, columns: &[&str]) -> Result<Self, OutputError> {
        let file = File::create(path).map_err(|e| OutputError::io(path, &e))?;
        let mut table =
            Self { path: path.into(), columns: columns.len(), last: None, writer: csv::Writer::from_writer(file) };
        let header = std::iter::once(TIME).chain(columns.iter().copied()).map(str::to_owned).collect();
        table.append_texts(&[header])?;
        Ok(table)
    }

    /// Continues a table from `time` on: later rows are dropped. Without a file it begins a new one.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be read or written; [`OutputError::Malformed`] for a table with other
    /// columns.
    pub fn resume(path: &Path, columns: &[&str], time: f64) -> Result<Self, OutputError> {
        if !path.exists() {
            return Self::create(path, columns);
        }
        let malformed = |what: String| OutputError::Malformed {
            path: path.display().to_string(),
            what,
            hint: "it is not the table of this run; move it away to begin a new one",
        };
        let mut reader = csv::Reader::from_path(path).map_err(|e| malformed(e.to_string()))?;
        let header = reader.headers().map_err(|e| malformed(e.to_string()))?.clone();
        if !header.iter().eq(std::iter::once(TIME).chain(columns.iter().copied())) {
            let all = std::iter::once(TIME).chain(columns.iter().copied()).collect::<Vec<_>>().join(",");
            return Err(malformed(format!("its columns are not {all}")));
        }
        let (mut kept, mut last) = (csv::Writer::from_writer(Vec::new()), None);
        kept.write_record(&header).map_err(|e| malformed(e.to_string()))?;
        // the row that a crash cut off, if any, is the last and not needed
        for row in reader.records().map_while(Result::ok) {
            if let Some(t) = row.get(0).and_then(|t| t.parse().ok()).filter(|t: &f64| *t <= time) {
                last = Some(t);
                kept.write_record(&row).map_err(|e| malformed(e.to_string()))?;
            }
        }
        let bytes = kept.into_inner().map_err(|e| malformed(e.to_string()))?;
        write_whole(path, |file| file.write_all(&bytes))?;
        let file = OpenOptions::new().append(true).open(path).map_err(|e| OutputError::io(path, &e))?;
        Ok(Self { path: path.into(), columns: columns.len(), last, writer: csv::Writer::from_writer(file) })
    }

    /// Appends the rows of one time: a name or two, then numbers. A time that the table ends with already is left as it
    /// is.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be written.
    ///
    /// # Panics
    /// When a row does not fit the columns.
    pub fn append<'n>(
        &mut self,
        time: f64,
        rows: impl Iterator<Item = (Vec<&'n str>, Vec<f64>)>,
    ) -> Result<(), OutputError> {
        if self.last == Some(time) {
            return Ok(());
        }
        self.last = Some(time);
        let text = |(names, values): (Vec<&str>, Vec<f64>)| {
            assert_eq!(names.len() + values.len(), self.columns, "columns of {}", self.path.display());
            let values = values.into_iter().map(number);
            std::iter::once(number(time)).chain(names.into_iter().map(str::to_owned)).chain(values).collect()
        };
        let rows: Vec<Vec<String>> = rows.map(text).collect();
        self.append_texts(&rows)
    }

    fn append_texts(&mut self, rows: &[Vec<String>]) -> Result<(), OutputError> {
        let written = rows.iter().try_for_each(|row| self.writer.write_record(row)).map_err(std::io::Error::other);
        written.and_then(|()| self.writer.flush()).map_err(|e| OutputError::io(&self.path, &e))
    }
}
