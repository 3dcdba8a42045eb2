//! How much tissue there is.

use super::{OutputField, Part, Symbol, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::fields;

const SYMBOL: Symbol = Symbol::same(fields::DENSITY.symbol);

/// `ρ`
pub const DENSITY: OutputField = OutputField {
    name: fields::DENSITY.name,
    symbol: SYMBOL,
    help: "density, where it is a field",
    unit: DIMENSIONLESS,
    value: Value::Scalar,
    columns: &["density"],
    parts: &[Part::component("density", "density", SYMBOL, 0).unsigned().in_curves()],
    needs: &[fields::DENSITY],
    rules: &[],
    tool: None,
    find: |at| at.fields.field(fields::DENSITY),
};
