//! Columns of tables that others have written, as numbers: separated texts of any kind, gzipped or not, and Parquet.

mod bytes;
mod files;
#[cfg(feature = "parquet")]
mod parquet;
mod separator;
mod text;

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, de};

#[cfg(not(feature = "parquet"))]
use crate::names::absent;
use crate::names::did_you_mean;
use crate::study::StudyError;

pub(super) use files::{FrameFile, is_pattern, list};
pub use separator::Separator;

/// Which column of a table: by its name, or by its number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Column {
    Name(String),
    /// From 1.
    Number(usize),
}

impl JsonSchema for Column {
    fn schema_name() -> Cow<'static, str> {
        "Column".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["string", "integer"], "minimum": 1 })
    }
}

impl<'de> Deserialize<'de> for Column {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = Column;
            fn expecting(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
                out.write_str("the name of a column, or its number from 1")
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<Column, E> {
                Ok(Column::Name(name.to_owned()))
            }
            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Column, E> {
                let number = usize::try_from(number).ok().filter(|n| *n > 0);
                let number = number.ok_or_else(|| E::custom("columns are numbered from 1"))?;
                Ok(Column::Number(number))
            }
        }
        from.deserialize_any(Visitor)
    }
}

impl std::fmt::Display for Column {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Column::Name(name) => write!(out, "`{name}`"),
            Column::Number(number) => write!(out, "column {number}"),
        }
    }
}

/// A column that is to be read.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// The study's key that names it, such as `columns.x`.
    pub key: String,
    pub column: Column,
    /// Its number in files of this form that have no names.
    pub without_names: Option<usize>,
    /// It may be absent, and its values are then missing.
    pub optional: bool,
    /// Its entries are names: each becomes a number of its own.
    pub names: bool,
}

/// How a text is cut into columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cut {
    /// Found out if not given.
    pub separator: Option<Separator>,
    /// Lines above the numbers; found out if not given.
    pub header: Option<usize>,
}

/// Chosen columns, row after row; NaN where a value is missing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Rows {
    /// As many numbers in each row as columns were wanted.
    pub values: Vec<Vec<f64>>,
    /// Line of each row, or its number where a file has no lines.
    pub lines: Vec<u64>,
}

/// What is wrong with a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Wrong {
    pub line: Option<u64>,
    pub what: String,
    pub hint: String,
}

impl Wrong {
    fn new(line: Option<u64>, what: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { line, what: what.into(), hint: hint.into() }
    }

    pub fn in_file(self, file: &Path) -> StudyError {
        let line = self.line.map_or_else(String::new, |line| format!(", line {line}"));
        StudyError::Data { place: format!("{}{line}", file.display()), what: self.what, hint: self.hint }
    }
}

/// Reads the wanted columns of a file; `names` numbers the names in all files alike.
///
/// # Errors
/// A file that cannot be read or is no table, a separator that does not separate it, columns that it has not, an entry
/// that is neither a number nor missing; with the line.
pub fn read(file: &Path, cut: Cut, wanted: &[Wanted], names: &mut NameNumbers) -> Result<Rows, StudyError> {
    let found = bytes::read(file).and_then(|bytes| match is_parquet(&bytes) {
        true => read_parquet(file, wanted, names),
        false => text::read(&bytes::decode(bytes)?, cut, wanted, names),
    });
    found.map_err(|wrong| wrong.in_file(file))
}

/// Whether these are the bytes of a Parquet file.
fn is_parquet(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PAR1")
}

#[cfg(feature = "parquet")]
use parquet::read as read_parquet;

/// A build without Parquet says what it would need.
#[cfg(not(feature = "parquet"))]
fn read_parquet(_: &Path, _: &[Wanted], _: &mut NameNumbers) -> Result<Rows, Wrong> {
    let what = format!("is a Parquet file; {}", absent("parquet", "reads them"));
    Err(Wrong::new(None, what, "write the table as CSV, or build with `--features parquet`"))
}

/// Where the wanted columns are among those that a table names; `None` for an optional one that is absent.
///
/// A name is that of the table, or that without the unit in brackets behind it.
fn find(known: &[String], wanted: &[Wanted], line: Option<u64>) -> Result<Vec<Option<usize>>, Wrong> {
    let columns = || known.iter().map(|name| name.trim()).filter(|name| !name.is_empty()).collect::<Vec<_>>();
    let one = |column: &Wanted| match &column.column {
        Column::Number(number) if *number <= known.len() => Ok(Some(number - 1)),
        Column::Number(number) => {
            let what = format!("there is no column {number}: it has {}", known.len());
            Err(Wrong::new(line, what, format!("the columns are {}; `{}` takes one", shown(&columns()), column.key)))
        }
        Column::Name(name) => match places(known, name)[..] {
            [at] => Ok(Some(at)),
            [] if column.optional => Ok(None),
            [] => {
                let taken = |other: &&str| wanted.iter().any(|w| w.column == Column::Name((*other).to_owned()));
                let free: Vec<&str> = columns().into_iter().filter(|other| !taken(other)).collect();
                let what = format!("there is no column `{name}`{}", did_you_mean(name, &free));
                let hint = format!("the columns are {}; `{}` names the one to take", shown(&columns()), column.key);
                Err(Wrong::new(line, what, hint))
            }
            [..] => {
                let what = format!("{} columns have the name `{name}`", places(known, name).len());
                Err(Wrong::new(line, what, "give each column a name of its own, or take it by its number"))
            }
        },
    };
    wanted.iter().map(one).collect()
}

/// Names of columns for a message, not all of thousands.
fn shown(columns: &[&str]) -> String {
    const MOST: usize = 30;
    match columns.len() {
        0 => "without names".to_owned(),
        n if n > MOST => format!("{}, … ({n} in all)", columns[..MOST].join(", ")),
        _ => columns.join(", "),
    }
}

/// Places of a name, of the same without its unit if there are none.
fn places(known: &[String], name: &str) -> Vec<usize> {
    let of =
        |fits: &dyn Fn(&str) -> bool| -> Vec<usize> { (0..known.len()).filter(|at| fits(known[*at].trim())).collect() };
    let exact = of(&|other| other == name);
    if exact.is_empty() { of(&|other| without_unit(other) == name) } else { exact }
}

/// `x` of `x [px]` and of `x (µm)`.
fn without_unit(name: &str) -> &str {
    let open = match name.chars().last() {
        Some(']') => '[',
        Some(')') => '(',
        Some(_) | None => return name,
    };
    name.rfind(open).map_or(name, |at| name[..at].trim_end())
}

/// Numbers of names, in the order in which they come.
#[derive(Debug, Default)]
pub struct NameNumbers(HashMap<String, usize>);

impl NameNumbers {
    fn number(&mut self, name: &str) -> f64 {
        let next = self.0.len();
        *self.0.entry(name.to_owned()).or_insert(next) as f64
    }
}

/// What stands where there is no value.
fn is_missing(text: &str) -> bool {
    ["", "-", "--", "na", "n/a", "nan", "none", "null", "."].iter().any(|none| text.eq_ignore_ascii_case(none))
        || text.strip_prefix(['-', '+']).is_some_and(|rest| rest.eq_ignore_ascii_case("nan"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_with_and_without_units() {
        let known = ["x [px]", "y (µm)", "u", "u [m/s]", "f(x)"].map(str::to_owned);
        let at = |name: &str| places(&known, name);
        assert_eq!([at("x"), at("x [px]"), at("y"), at("u"), at("z")], [vec![0], vec![0], vec![1], vec![2], vec![]]);
        assert_eq!(at("u [m/s]"), [3]);
    }

    #[test]
    fn what_is_missing_is_told_from_what_is_wrong() {
        for none in ["", "NaN", "nan", "-nan", "None", "NA", "N/A", "null", "-"] {
            assert!(is_missing(none), "{none}");
        }
        for other in ["0", "south", "inf", "-1", "naN2"] {
            assert!(!is_missing(other), "{other}");
        }
    }
}
