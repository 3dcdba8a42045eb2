//! What pulls the polarity to where its free energy is least.

use super::{OutputField, Part, Rule, Symbol, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::Parameters;
use crate::model::fields::POLARITY;

/// `L_h`
pub const MOLECULAR_FIELD: OutputField = OutputField {
    name: "molecular_field",
    symbol: Symbol::same("Lₕ"),
    help: "molecular field, needs `B > 0`",
    unit: DIMENSIONLESS,
    value: Value::Vector,
    columns: &["molecular1", "molecular2"],
    parts: &[
        Part::length("molecular_field", "molecular field", Symbol::same("|Lₕ|")),
        Part::component("molecular_field_1", "molecular field", Symbol::same("(Lₕ)₁"), 0),
        Part::component("molecular_field_2", "molecular field", Symbol::same("(Lₕ)₂"), 1),
    ],
    needs: &[POLARITY],
    rules: &[Rule {
        holds: Parameters::has_molecular_field,
        rule: "with elasticity = 0 there is no molecular field",
        hint: "remove it, or give elasticity > 0",
    }],
    tool: None,
    find: |at| Ok(at.fields.tissue().map(|now| now.model.molecular_field(now.state, now.t))),
};
