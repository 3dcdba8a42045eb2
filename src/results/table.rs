//! A CSV table as its file has it.

use std::path::Path;

use super::ResultsError;
use crate::scene::renamed::path_now;

/// Rows of texts below a header.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Names of the columns.
    pub header: Vec<String>,
    /// Entries as they stand in the file.
    pub rows: Vec<Vec<String>>,
    /// Whether the last row was cut off, and is left out.
    pub cut_off: bool,
}

impl Table {
    /// Reads a file. A last row that is too short belongs to a program that was stopped while it wrote: it is left out.
    ///
    /// # Errors
    /// [`ResultsError::Broken`]: a file that cannot be read, has no header, or rows of another length.
    pub fn read(path: &Path) -> Result<Self, ResultsError> {
        Self::read_some(path, usize::MAX)
    }

    /// As [`read`](Self::read), of a long table every second row, or every fourth, …: at most `most` of them, evenly
    /// spread from the first on.
    ///
    /// # Errors
    /// [`ResultsError::Broken`]: a file that cannot be read, has no header, or rows of another length.
    pub fn read_some(path: &Path, most: usize) -> Result<Self, ResultsError> {
        let broken = |what: String| ResultsError::Broken {
            file: path.display().to_string(),
            what,
            hint: "it must be a table as the program writes it; run again, or take the file away",
        };
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_path(path).map_err(|e| broken(e.to_string()))?;
        let header: Vec<String> =
            reader.headers().map_err(|e| broken(e.to_string()))?.iter().map(|name| path_now(name.trim()).0).collect();
        if header.iter().all(String::is_empty) {
            return Err(broken("the table is empty".to_owned()));
        }
        let mut table = Self { header, rows: Vec::new(), cut_off: false };
        let (mut row, mut count, mut stride) = (csv::StringRecord::new(), 0, 1);
        while reader.read_record(&mut row).map_err(|e| broken(e.to_string()))? {
            if table.cut_off {
                return Err(broken(format!("row {count} is too short")));
            }
            count += 1;
            if row.len() > table.header.len() {
                return Err(broken(format!("row {count} is too long")));
            }
            table.cut_off = row.len() < table.header.len();
            if table.cut_off || !(count - 1_usize).is_multiple_of(stride) {
                continue;
            }
            if table.rows.len() == most {
                table.thin();
                stride *= 2;
                if !(count - 1).is_multiple_of(stride) {
                    continue;
                }
            }
            table.rows.push(row.iter().map(str::to_owned).collect());
        }
        Ok(table)
    }

    /// Leaves every second row.
    fn thin(&mut self) {
        let mut at = 0;
        self.rows.retain(|_| {
            at += 1;
            at % 2 == 1
        });
    }

    /// Number of a column.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|column| column == name)
    }

    /// The texts of a column.
    pub fn texts(&self, name: &str) -> Option<impl Iterator<Item = &str>> {
        let at = self.position(name)?;
        Some(self.rows.iter().map(move |row| row[at].as_str()))
    }

    /// The numbers of a column; NaN where there is none.
    pub fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        Some(self.texts(name)?.map(|text| text.trim().parse().unwrap_or(f64::NAN)).collect())
    }

    /// Pairs of two columns, of the rows that have both.
    pub fn points(&self, x: &str, y: &str) -> Vec<(f64, f64)> {
        let (Some(x), Some(y)) = (self.numbers(x), self.numbers(y)) else { return Vec::new() };
        x.into_iter().zip(y).filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
    }

    /// The entry of a row.
    pub fn at(&self, row: usize, name: &str) -> Option<&str> {
        let at = self.position(name)?;
        self.rows.get(row).map(|row| row[at].as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::Table;

    #[test]
    fn a_long_table_is_thinned_evenly() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        for count in [0, 1, 7, 8, 9, 100, 1000] {
            let rows: String = (0..count).map(|k| format!("{k},x\n")).collect();
            std::fs::write(&path, format!("a,b\n{rows}")).unwrap();
            assert_eq!(Table::read(&path).unwrap().rows.len(), count);
            let some = Table::read_some(&path, 8).unwrap().numbers("a").unwrap();
            assert!(some.len() <= 8 && 2 * some.len() >= count.min(8), "{count}: {some:?}");
            let stride = some.get(1).copied().unwrap_or(1.0);
            assert!(some.iter().enumerate().all(|(k, a)| *a == stride * k as f64), "{count}: {some:?}");
        }
    }
}
