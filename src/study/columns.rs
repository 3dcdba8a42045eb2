//! Tables with typed columns, as CSV and, in a build with the feature `parquet`, as Parquet.

#[cfg(feature = "parquet")]
mod parquet;

use std::path::Path;

#[cfg(feature = "parquet")]
pub use self::parquet::write_parquet;
use super::table::write_rows;
use crate::output::{OutputError, number};

/// A column; `None` where there is nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// At its head.
    pub name: String,
    /// Its entries, one for each row.
    pub cells: Cells,
}

/// The entries of a column, all of one type.
#[derive(Debug, Clone, PartialEq)]
pub enum Cells {
    /// A number that is not finite counts as missing.
    Numbers(Vec<Option<f64>>),
    /// Whole numbers.
    Counts(Vec<Option<i64>>),
    /// An empty text counts as missing.
    Texts(Vec<Option<String>>),
}

impl Column {
    /// A column of numbers.
    pub fn numbers(name: impl Into<String>, cells: impl IntoIterator<Item = Option<f64>>) -> Self {
        let finite = |cell: Option<f64>| cell.filter(|x| x.is_finite());
        Self { name: name.into(), cells: Cells::Numbers(cells.into_iter().map(finite).collect()) }
    }

    /// A column of counts.
    pub fn counts(name: impl Into<String>, cells: impl IntoIterator<Item = Option<usize>>) -> Self {
        let count = |cell: Option<usize>| cell.and_then(|n| i64::try_from(n).ok());
        Self { name: name.into(), cells: Cells::Counts(cells.into_iter().map(count).collect()) }
    }

    /// A column of texts.
    pub fn texts(name: impl Into<String>, cells: impl IntoIterator<Item = Option<String>>) -> Self {
        let some = |cell: Option<String>| cell.filter(|text| !text.is_empty());
        Self { name: name.into(), cells: Cells::Texts(cells.into_iter().map(some).collect()) }
    }

    /// Numbers where every cell is one or missing, else texts.
    pub fn guessed(name: &str, cells: Vec<Option<String>>) -> Self {
        let number = |cell: &Option<String>| match cell {
            None => Some(None),
            Some(text) => text.parse::<f64>().ok().filter(|x| x.is_finite()).map(Some),
        };
        match cells.iter().map(number).collect::<Option<Vec<Option<f64>>>>() {
            Some(numbers) if numbers.iter().any(Option::is_some) => Self::numbers(name, numbers),
            Some(_) | None => Self::texts(name, cells),
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        match &self.cells {
            Cells::Numbers(cells) => cells.len(),
            Cells::Counts(cells) => cells.len(),
            Cells::Texts(cells) => cells.len(),
        }
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A cell as text, empty where there is nothing.
    pub fn text(&self, row: usize) -> String {
        match &self.cells {
            Cells::Numbers(cells) => cells[row].map(number).unwrap_or_default(),
            Cells::Counts(cells) => cells[row].map(|n| n.to_string()).unwrap_or_default(),
            Cells::Texts(cells) => cells[row].clone().unwrap_or_default(),
        }
    }

    /// A cell as a number, where it is one.
    pub fn number(&self, row: usize) -> Option<f64> {
        match &self.cells {
            Cells::Numbers(cells) => cells[row],
            Cells::Counts(cells) => cells[row].map(|n| n as f64),
            Cells::Texts(_) => None,
        }
    }
}

/// Writes columns of one length as CSV.
///
/// # Errors
/// A file that cannot be written.
pub fn write_csv(path: &Path, columns: &[Column]) -> Result<(), OutputError> {
    let mut rows = vec![columns.iter().map(|column| column.name.clone()).collect::<Vec<_>>()];
    let count = columns.first().map_or(0, Column::len);
    rows.extend((0..count).map(|row| columns.iter().map(|column| column.text(row)).collect()));
    write_rows(path, &rows)
}
