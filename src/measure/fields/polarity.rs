//! Where cells would go, and how much they agree on it.

use super::{OutputField, Part, Symbol, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::fields;

/// `p`
pub const POLARITY: OutputField = OutputField {
    name: fields::POLARITY.name,
    symbol: Symbol::same(fields::POLARITY.symbol),
    help: "polarity",
    unit: DIMENSIONLESS,
    value: Value::Vector,
    columns: &["p1", "p2"],
    parts: &[
        Part::length("polarity", "polarity", Symbol::same("|p|")),
        Part::component("polarity_1", "polarity", Symbol::same("p₁"), 0).in_curves(),
        Part::component("polarity_2", "polarity", Symbol::same("p₂"), 1),
    ],
    needs: &[fields::POLARITY],
    rules: &[],
    tool: None,
    find: |at| at.fields.field(fields::POLARITY),
};
