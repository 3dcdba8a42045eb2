//! The elastic strain in the flow of a state, as if that flow had always been there.

use super::{OutputField, Part, Symbol, Tool, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::fields::{POLARITY, VELOCITY};

const TITLE: &str = "elastic strain";

/// `ε`   [12.3]
pub const ELASTIC_STRAIN: OutputField = OutputField {
    name: "elastic_strain",
    symbol: Symbol::same("ε"),
    help: "elastic strain carried by the flow [12.3], needs `[strain]`; in VTU files in the order 11, 22, 33, 12, 23, \
           13",
    unit: DIMENSIONLESS,
    value: Value::Tensor,
    columns: &["strain_11", "strain_12", "strain_22"],
    parts: &[
        Part::component("elastic_strain_11", TITLE, Symbol::same("ε₁₁"), 0),
        Part::component("elastic_strain_12", TITLE, Symbol::same("ε₁₂"), 1),
        Part::component("elastic_strain_22", TITLE, Symbol::same("ε₂₂"), 2),
    ],
    needs: &[VELOCITY, POLARITY],
    rules: &[],
    tool: Some(Tool::Strain),
    find: |at| match (&at.tools.strain, at.fields.field(VELOCITY)?) {
        // what flows in is not strained
        (Some(strain), Some(v)) => Ok(Some(strain.of(at.fields.loops(), &v, |_| [0.0; 3])?.field())),
        (_, _) => Ok(None),
    },
};
