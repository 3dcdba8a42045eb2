//! The function along whose contour lines it flows.

use super::{OutputField, Part, Symbol, Tool, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::fields::VELOCITY;

const SYMBOL: Symbol = Symbol::same("ψ");

/// `ψ`   [B.54]
pub const STREAM_FUNCTION: OutputField = OutputField {
    name: "stream_function",
    symbol: SYMBOL,
    help: "stream function [B.54], of mean zero",
    unit: DIMENSIONLESS,
    value: Value::Scalar,
    columns: &["stream_function"],
    parts: &[Part::component("stream_function", "stream function", SYMBOL, 0)],
    needs: &[VELOCITY],
    rules: &[],
    tool: Some(Tool::StreamFunction),
    find: |at| match (at.tools.stream(at.fields)?, at.fields.field(VELOCITY)?) {
        (Some(stream), Some(v)) => Ok(Some(stream.of(at.fields.loops(), &v)?)),
        (_, _) => Ok(None),
    },
};
