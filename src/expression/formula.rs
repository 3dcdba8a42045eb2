//! A formula as a scene file holds it: a string, or a plain number.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, de};

use super::parse::MAX_LENGTH;
use super::{Expression, ExpressionError};

/// A string or a number; written back as it was read.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Formula {
    /// A whole number.
    Integer(i64),
    /// Any other number.
    Number(f64),
    /// A formula.
    Text(String),
}

/// The two components of a vector, each a formula.
pub type VectorFormula = [Formula; 2];

impl Formula {
    /// The expression, with `parameters` bound.
    ///
    /// # Errors
    /// A syntax error with its position, a name that does not exist, a constant formula that is not finite.
    pub fn parse(&self, parameters: &[(&str, f64)]) -> Result<Expression, ExpressionError> {
        Expression::parse(&self.to_string(), parameters)
    }

    /// The expression of a body.
    ///
    /// # Errors
    /// A syntax error with its position, a name that does not exist, a constant formula that is not finite.
    pub fn parse_of_body(&self, parameters: &[(&str, f64)]) -> Result<Expression, ExpressionError> {
        Expression::of_body(&self.to_string(), parameters)
    }
}

/// Both components of a vector as expressions.
///
/// # Errors
/// A syntax error with its position, a name that does not exist, a constant formula that is not finite: that of the
/// first component that fails.
pub fn parse_vector(formulas: &VectorFormula, parameters: &[(&str, f64)]) -> Result<[Expression; 2], ExpressionError> {
    let [first, second] = formulas;
    Ok([first.parse(parameters)?, second.parse(parameters)?])
}

impl fmt::Display for Formula {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Formula::Integer(value) => write!(out, "{value}"),
            Formula::Number(value) => write!(out, "{value}"),
            Formula::Text(text) => out.write_str(text),
        }
    }
}

impl JsonSchema for Formula {
    fn schema_name() -> Cow<'static, str> {
        "Formula".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"], "minLength": 1, "maxLength": MAX_LENGTH, "x-values": "formula" })
    }
}

impl<'de> Deserialize<'de> for Formula {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(FormulaVisitor)
    }
}

/// By hand, because serde's untagged enums answer a wrong type with "did not match any variant".
struct FormulaVisitor;

impl de::Visitor<'_> for FormulaVisitor {
    type Value = Formula;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a formula (a string such as \"1 - y^2\") or a number")
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Formula, E> {
        Ok(Formula::Integer(value))
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Formula, E> {
        Ok(Formula::Number(value))
    }

    fn visit_str<E: de::Error>(self, value: &str) -> Result<Formula, E> {
        Ok(Formula::Text(value.to_owned()))
    }
}
