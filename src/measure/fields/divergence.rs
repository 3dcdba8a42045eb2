//! How fast areas grow.

use super::{OutputField, Part, Symbol, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::fields::VELOCITY;

const SYMBOL: Symbol = Symbol::same("div v");

/// `div v = ∂₁v₁ + ∂₂v₂`
pub const DIVERGENCE: OutputField = OutputField {
    name: "divergence",
    symbol: SYMBOL,
    help: "divergence `∂_1 v_1 + ∂_2 v_2`, the rate at which areas grow",
    unit: DIMENSIONLESS,
    value: Value::Scalar,
    columns: &["divergence"],
    parts: &[Part::component("divergence", "divergence", SYMBOL, 0)],
    needs: &[VELOCITY],
    rules: &[],
    tool: None,
    find: |at| at.of_gradient(|g| g.m11 + g.m22),
};
