//! What is solved: parameters, formulas, boundary conditions. Knows nothing of files; [`crate::scene`] does.

mod beside;
pub mod boundary;
pub(crate) mod closed;
pub mod compressible;
pub mod condensed;
pub mod description;
pub mod fields;
pub mod floating;
pub(crate) mod formulas;
pub mod frames;
pub mod immersed;
pub mod incompressible;
pub mod lagged;
pub mod limiter;
pub mod manufactured;
pub mod mobility;
pub mod momentum;
pub mod numbers;
pub mod parameters;
pub mod passive;
pub mod polarity;
mod pushed;
pub mod reactions;
pub mod rotation;
pub(crate) mod scales;
pub mod sources;
pub mod start;

mod table;
pub mod tangent;
pub mod terms;
pub mod walls;

pub use boundary::{Conditions, Held, PolarityCondition, VelocityCondition};
pub use compressible::Compressible;
pub use description::{Degrees, Description};
pub use fields::{FieldId, Residuals, State};
pub use incompressible::Incompressible;
pub use manufactured::Exact;
pub use numbers::{Fluid, Numbers};
pub use parameters::{DensityLaw, ElasticForce, ModelKind, ModelScene, Parameters};
pub use reactions::Reactions;
pub use sources::Sources;
pub use terms::TermStatus;

use crate::expression::{Expression, ExpressionError, Formula};
use crate::mesh::Point;

/// A rule of the model that a value breaks. `key` is relative to the table that was checked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
#[error("`{key}` = {value}: {rule}; hint: {hint}")]
pub struct ModelError {
    pub key: String,
    pub value: String,
    pub rule: String,
    pub hint: String,
}

impl ModelError {
    pub(crate) fn new(
        key: &str,
        value: impl std::fmt::Display,
        rule: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        Self { key: key.to_owned(), value: value.to_string(), rule: rule.into(), hint: hint.into() }
    }

    /// The formula of a density under `key`.
    ///
    /// # Errors
    /// A bad formula; a number below zero. A formula's values are not looked at.
    pub(crate) fn parse_density(
        key: &str,
        formula: &Formula,
        parameters: &[(&str, f64)],
    ) -> Result<Expression, ModelError> {
        let density = formula.parse(parameters).map_err(|error| Self::of_expression(key, &error))?;
        if density.is_constant() && density.eval(Point::zeros(), 0.0) < 0.0 {
            let hint = "0 is no tissue, 1 the density of the reference sheet";
            return Err(Self::new(key, format!("\"{formula}\""), "a density must not be negative", hint));
        }
        Ok(density)
    }

    /// The error of the formula under `key`, in this error's parts.
    pub(crate) fn of_expression(key: &str, error: &ExpressionError) -> Self {
        // the expression's own message ends in its hint
        let message = error.to_string();
        let (rule, hint) = message.split_once("; hint: ").unwrap_or((&message, ""));
        Self::new(key, format!("\"{}\"", error.text()), rule, hint)
    }
}
