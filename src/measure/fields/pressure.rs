//! The pressure: an unknown of a flow free of divergence, in a compressible sheet what follows from density and
//! polarity.

use super::{OutputField, Part, Symbol, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::fields;

const SYMBOL: Symbol = Symbol::weighed("Π", "ρΠ");

/// `Π`, in a compressible sheet `ρΠ`.
pub const PRESSURE: OutputField = OutputField {
    name: fields::PRESSURE.name,
    symbol: SYMBOL,
    help: "pressure; that of a compressible sheet follows from density and polarity",
    unit: DIMENSIONLESS,
    value: Value::Scalar,
    columns: &["pressure"],
    parts: &[Part::component("pressure", "pressure", SYMBOL, 0).in_curves()],
    needs: &[fields::PRESSURE],
    rules: &[],
    tool: None,
    find: |at| at.fields.field(fields::PRESSURE),
};
