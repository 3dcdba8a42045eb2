//! How fast it flows, and where to.

use super::{OutputField, Part, Symbol, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::fields;

/// `v`
pub const VELOCITY: OutputField = OutputField {
    name: fields::VELOCITY.name,
    symbol: Symbol::same(fields::VELOCITY.symbol),
    help: "velocity",
    unit: DIMENSIONLESS,
    value: Value::Vector,
    columns: &["v1", "v2"],
    parts: &[
        Part::length("speed", "speed", Symbol::same("|v|")),
        Part::component("velocity_1", "velocity", Symbol::same("v₁"), 0).in_curves(),
        Part::component("velocity_2", "velocity", Symbol::same("v₂"), 1),
    ],
    needs: &[fields::VELOCITY],
    rules: &[],
    tool: None,
    find: |at| at.fields.field(fields::VELOCITY),
};
