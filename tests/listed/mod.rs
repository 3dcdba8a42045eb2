//! Every shape of the list, made of the tables that its file gives as examples.

use monolayer::schema::Range;
use monolayer::shape::{Rules, SHAPES, Shape, ShapeError, ShapeTable};

/// Rules that a program without scenes would have.
struct Plain;

impl Rules for Plain {
    type Error = String;

    fn length(&self, key: &str, value: f64, hint: &str) -> Result<f64, String> {
        if value > 0.0 && value.is_finite() { Ok(value) } else { Err(format!("{key} = {value}; {hint}")) }
    }

    fn within(&self, key: &str, value: f64, range: Range, rule: &str, hint: &str) -> Result<f64, String> {
        if range.has(value) { Ok(value) } else { Err(format!("{key} = {value} {rule}; {hint}")) }
    }

    fn wrong(&self, key: &str, value: String, error: &ShapeError) -> String {
        format!("{key} = {value}: {error}")
    }
}

/// Numbers with a point are lengths.
fn scale_lengths(value: &mut toml::Value, scale: f64) {
    match value {
        toml::Value::Float(length) => *length *= scale,
        toml::Value::Array(all) => all.iter_mut().for_each(|one| scale_lengths(one, scale)),
        toml::Value::Table(all) => all.iter_mut().for_each(|(_, one)| scale_lengths(one, scale)),
        toml::Value::String(_) | toml::Value::Integer(_) | toml::Value::Boolean(_) | toml::Value::Datetime(_) => {}
    }
}

/// The tables of all examples, with the names of their rows.
pub fn tables() -> Vec<(&'static str, toml::Value)> {
    let of_row = |row: &'static monolayer::shape::Row| {
        let name = row.name;
        assert!(!row.examples.is_empty(), "{name} has no example");
        let read = move |text: &&str| (name, toml::from_str(&format!("[{name}]\n{text}")).expect("an example is TOML"));
        row.examples.iter().map(read)
    };
    SHAPES.iter().flat_map(of_row).collect()
}

/// All examples, with lengths times `scale`.
pub fn listed(scale: f64) -> Vec<Shape> {
    let make = |(name, mut value): (&str, toml::Value)| {
        scale_lengths(&mut value, scale);
        let table: ShapeTable = value.try_into().unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(table.name(), name);
        table.make(&Plain).unwrap_or_else(|error| panic!("{name}: {error}")).0
    };
    tables().into_iter().map(make).collect()
}
