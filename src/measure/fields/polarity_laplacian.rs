//! What diffusion does to the polarity.

use super::{OutputField, Part, Symbol, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::fields::POLARITY;

const TITLE: &str = "diffusion of the polarity";

/// `κ²Δ_h p`, in a compressible sheet `κ² div_h(ρ∇p)`.
pub const POLARITY_LAPLACIAN: OutputField = OutputField {
    name: "polarity_laplacian",
    symbol: Symbol::weighed("κ²Δₕp", "κ² divₕ(ρ∇p)"),
    help: "diffusion of the polarity",
    unit: DIMENSIONLESS,
    value: Value::Vector,
    columns: &["laplacian1", "laplacian2"],
    parts: &[
        Part::length("polarity_laplacian", TITLE, Symbol::weighed("|κ²Δₕp|", "|κ² divₕ(ρ∇p)|")),
        Part::component("polarity_laplacian_1", TITLE, Symbol::weighed("κ²Δₕp₁", "κ² divₕ(ρ∇p₁)"), 0),
        Part::component("polarity_laplacian_2", TITLE, Symbol::weighed("κ²Δₕp₂", "κ² divₕ(ρ∇p₂)"), 1),
    ],
    needs: &[POLARITY],
    rules: &[],
    tool: None,
    find: |at| Ok(at.fields.tissue().map(|now| now.model.polarity_laplacian(now.state, now.t))),
};
