//! How fast the flow turns.

use super::{OutputField, Part, Symbol, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::fields::VELOCITY;

const SYMBOL: Symbol = Symbol::same("ω");

/// `ω = ∂₁v₂ − ∂₂v₁`
pub const VORTICITY: OutputField = OutputField {
    name: "vorticity",
    symbol: SYMBOL,
    help: "vorticity `∂_1 v_2 − ∂_2 v_1`, twice the rate at which the flow turns",
    unit: DIMENSIONLESS,
    value: Value::Scalar,
    columns: &["vorticity"],
    parts: &[Part::component("vorticity", "vorticity", SYMBOL, 0)],
    needs: &[VELOCITY],
    rules: &[],
    tool: None,
    find: |at| at.of_gradient(|g| g.m21 - g.m12),
};
