//! Parquet files.

use std::fs::File;
use std::path::Path;

use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use parquet::schema::types::Type;

use super::separator::number;
use super::{NameNumbers, Rows, Separator, Wanted, Wrong, find, is_missing};

/// Reads the wanted columns; others are not unpacked.
///
/// # Errors
/// A file that was cut off or uses what this program does not know, columns that it has not, entries that are no
/// numbers.
pub(super) fn read(path: &Path, wanted: &[Wanted], names: &mut NameNumbers) -> Result<Rows, Wrong> {
    let broken = |error: &ParquetError| {
        let what = format!("is a Parquet file that cannot be read ({error})");
        Wrong::new(None, what, "was it cut off? write it again, or as CSV")
    };
    let file = File::open(path).map_err(ParquetError::from).and_then(SerializedFileReader::new);
    let file = file.map_err(|error| broken(&error))?;
    let schema = file.metadata().file_metadata().schema_descr().root_schema_ptr();
    let known: Vec<String> = schema.get_fields().iter().map(|field| field.name().to_owned()).collect();
    let places = find(&known, wanted, None)?;
    let mut taken: Vec<usize> = places.iter().flatten().copied().collect();
    taken.sort_unstable();
    taken.dedup();
    let fields = taken.iter().map(|at| schema.get_fields()[*at].clone()).collect();
    let part = Type::group_type_builder(schema.name()).with_fields(fields).build().map_err(|error| broken(&error))?;
    let mut found = Rows::default();
    for (at, row) in file.get_row_iter(Some(part)).map_err(|error| broken(&error))?.enumerate() {
        let row = row.map_err(|error| broken(&error))?;
        let entries: Vec<&Field> = row.get_column_iter().map(|(_, field)| field).collect();
        let line = at as u64 + 1;
        let mut entry = |(place, column): (&Option<usize>, &Wanted)| {
            let Some(place) = place else { return Ok(f64::NAN) };
            let field = entries[taken.binary_search(place).expect("taken above")];
            value(field, column, names).ok_or_else(|| {
                let what = format!("{} = {field} in row {line}: must be a finite number, or missing", column.column);
                Wrong::new(None, what, "take another column, or leave the entry empty")
            })
        };
        found.values.push(places.iter().zip(wanted).map(&mut entry).collect::<Result<_, _>>()?);
        found.lines.push(line);
    }
    Ok(found)
}

/// NaN for what is missing, `None` for what is no number.
fn value(field: &Field, column: &Wanted, names: &mut NameNumbers) -> Option<f64> {
    let value = match field {
        Field::Null => return Some(f64::NAN),
        Field::Bool(value) => f64::from(u8::from(*value)),
        Field::Byte(value) => f64::from(*value),
        Field::Short(value) => f64::from(*value),
        Field::Int(value) => f64::from(*value),
        Field::Long(value) => *value as f64,
        Field::UByte(value) => f64::from(*value),
        Field::UShort(value) => f64::from(*value),
        Field::UInt(value) => f64::from(*value),
        Field::ULong(value) => *value as f64,
        Field::Float16(value) => f64::from(f32::from(*value)),
        Field::Float(value) => f64::from(*value),
        Field::Double(value) => *value,
        // in seconds
        Field::TimestampMillis(value) => *value as f64 * 1e-3,
        Field::TimestampMicros(value) => *value as f64 * 1e-6,
        Field::Str(text) if is_missing(text.trim()) => return Some(f64::NAN),
        Field::Str(text) if column.names => names.number(text),
        Field::Str(text) => number(text.trim(), Separator::Tab)?,
        _ => return None,
    };
    // what pandas writes for a missing value
    if value.is_nan() { Some(value) } else { Some(value).filter(|value| value.is_finite()) }
}
