//! Parquet files of typed columns.

use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};

use super::{Cells, Column};
use crate::output::{OutputError, write_whole};

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
