//! The scene written back, as a person would lay it out.

use serde::Serialize;
use toml_edit::{DocumentMut, Item, TableLike, Value};

/// TOML text of a scene's tables: a table per section and boundary tag, values on one line.
pub(super) fn to_toml(file: &impl Serialize) -> String {
    let document = toml_edit::ser::to_document(file);
    let mut document: DocumentMut = document.unwrap_or_else(|error| panic!("scene tables are always TOML: {error}"));
    let root = document.as_table_mut();
    for (name, item) in root.iter_mut() {
        open(item);
        if name.get() == "boundary"
            && let Item::Table(tags) = item
        {
            tags.set_implicit(true);
            tags.iter_mut().for_each(|(_, tag)| open(tag));
        }
        shorten_item(item);
    }
    document.to_string()
}

/// Turns an inline table into a section, and a list of tables into sections.
fn open(item: &mut Item) {
    let taken = std::mem::take(item);
    *item = match taken.into_table() {
        Ok(table) => Item::Table(table),
        Err(other) => match other.into_array_of_tables() {
            Ok(tables) => Item::ArrayOfTables(tables),
            Err(other) => other,
        },
    };
}

fn shorten_item(item: &mut Item) {
    match item {
        Item::Table(table) => shorten_table(table),
        Item::ArrayOfTables(tables) => tables.iter_mut().for_each(|table| shorten_table(table)),
        Item::Value(value) => shorten(value),
        Item::None => {}
    }
}

fn shorten_table(table: &mut dyn TableLike) {
    table.iter_mut().for_each(|(_, item)| shorten_item(item));
}

/// Writes 1e-8 as such, not with its zeros; the number stays the same.
fn shorten(value: &mut Value) {
    match value {
        Value::Float(number) => {
            let x = *number.value();
            if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e9) {
                let short = format!("{x:e}").parse::<Value>();
                *value = short.unwrap_or_else(|_| Value::from(x));
            }
        }
        Value::Array(array) => array.iter_mut().for_each(shorten),
        Value::InlineTable(table) => shorten_table(table),
        Value::String(_) | Value::Integer(_) | Value::Boolean(_) | Value::Datetime(_) => {}
    }
}
