//! Tables with typed columns, as CSV and as Parquet.

use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};

use super::table::write_rows;
use crate::output::{OutputError, number, write_whole};

/// A column; `None` where there is nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    pub name: String,
    pub cells: Cells,
}

/// The entries of a column, all of one type.
#[derive(Debug, Clone, PartialEq)]
pub enum Cells {
    /// A number that is not finite counts as missing.
    Numbers(Vec<Option<f64>>),
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

/// Writes columns of one length as Parquet: numbers as doubles, counts as 64-bit integers, texts as UTF-8, what is
/// missing as null.
///
/// # Errors
/// A file that cannot be written.
pub fn write_parquet(path: &Path, columns: &[Column]) -> Result<(), OutputError> {
    let bytes = encode(columns).map_err(|error| OutputError::Malformed {
        path: path.display().to_string(),
        what: format!("cannot be encoded ({error})"),
        hint: "the table beside it, as CSV, is complete",
    })?;
    write_whole(path, |file| file.write_all(&bytes))
}

fn encode(columns: &[Column]) -> Result<Vec<u8>, ParquetError> {
    let fields = columns.iter().map(field).collect::<Result<Vec<TypePtr>, _>>()?;
    let schema = Arc::new(Type::group_type_builder("results").with_fields(fields).build()?);
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, schema, Arc::new(WriterProperties::builder().build()))?;
    let mut group = file.next_row_group()?;
    for column in columns {
        let Some(mut writer) = group.next_column()? else { break };
        match &column.cells {
            Cells::Numbers(cells) => {
                let (levels, values) = present(cells, |x| *x);
                writer.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
            }
            Cells::Counts(cells) => {
                let (levels, values) = present(cells, |n| *n);
                writer.typed::<Int64Type>().write_batch(&values, Some(&levels), None)?;
            }
            Cells::Texts(cells) => {
                let (levels, values) = present(cells, |text| ByteArray::from(text.as_str()));
                writer.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
            }
        }
        writer.close()?;
    }
    group.close()?;
    file.close()?;
    Ok(bytes)
}

fn field(column: &Column) -> Result<TypePtr, ParquetError> {
    let (physical, logical) = match &column.cells {
        Cells::Numbers(_) => (Physical::DOUBLE, None),
        Cells::Counts(_) => (Physical::INT64, None),
        Cells::Texts(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let builder = Type::primitive_type_builder(&column.name, physical).with_repetition(Repetition::OPTIONAL);
    Ok(Arc::new(builder.with_logical_type(logical).build()?))
}

/// Which cells are there (1) or not (0), and the values of those that are.
fn present<T, V>(cells: &[Option<T>], value: impl Fn(&T) -> V) -> (Vec<i16>, Vec<V>) {
    let levels = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    (levels, cells.iter().flatten().map(value).collect())
}

#[cfg(test)]
mod tests {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::{Field, Row};

    use super::*;

    #[test]
    fn types_and_gaps_come_back_from_parquet() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("results.parquet");
        let columns = [
            Column::numbers("overshoot.v", [Some(0.1), None, Some(f64::NAN)]),
            Column::counts("steps", [None, Some(7), Some(0)]),
            Column::texts("status", [Some("κ".to_owned()), Some(String::new()), None]),
        ];
        write_parquet(&path, &columns).expect("a file");
        let reader = SerializedFileReader::new(std::fs::File::open(&path).expect("a file")).expect("Parquet");
        let rows: Vec<Row> = reader.get_row_iter(None).expect("rows").map(|row| row.expect("a row")).collect();
        let cells: Vec<Vec<Field>> =
            rows.iter().map(|row| row.get_column_iter().map(|(_, f)| f.clone()).collect()).collect();
        let text = Field::Str("κ".to_owned());
        assert_eq!(cells[0], [Field::Double(0.1), Field::Null, text]);
        assert_eq!(cells[1], [Field::Null, Field::Long(7), Field::Null]);
        assert_eq!(cells[2], [Field::Null, Field::Long(0), Field::Null]);
        let names: Vec<&String> = rows[0].get_column_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["overshoot.v", "steps", "status"]);
    }

    #[test]
    fn no_row_is_a_table_too() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("results.parquet");
        write_parquet(&path, &[Column::texts("run", [])]).expect("a file");
        let reader = SerializedFileReader::new(std::fs::File::open(&path).expect("a file")).expect("Parquet");
        assert_eq!(reader.get_row_iter(None).expect("rows").count(), 0);
    }
}
