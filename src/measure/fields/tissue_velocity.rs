//! The velocity as free tissue sees it, which goes along `x_1`.

use super::{OutputField, Part, Rule, Symbol, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::fields::{POLARITY, VELOCITY};

const TITLE: &str = "velocity less that of free tissue";

/// `v − (T_a/C_F) e_1`
pub const TISSUE_VELOCITY: OutputField = OutputField {
    name: "tissue_velocity",
    symbol: Symbol::same("v − (T_a/C_F) e₁"),
    help: "velocity less that of free tissue along `x_1`, needs `C_F > 0`",
    unit: DIMENSIONLESS,
    value: Value::Vector,
    columns: &["tissue_v1", "tissue_v2"],
    parts: &[
        Part::length("tissue_velocity", TITLE, Symbol::same("|v − (T_a/C_F) e₁|")),
        Part::component("tissue_velocity_1", TITLE, Symbol::same("v₁ − T_a/C_F"), 0),
        Part::component("tissue_velocity_2", TITLE, Symbol::same("v₂"), 1),
    ],
    needs: &[VELOCITY, POLARITY],
    rules: &[Rule {
        holds: |p| p.friction > 0.0,
        rule: "v − (T_a/C_F) e_1 needs friction > 0",
        hint: "remove it, or use velocity",
    }],
    tool: None,
    find: |at| {
        let Some(now) = at.fields.tissue() else { return Ok(None) };
        let (m, mut v) = (now.model.parameters(), now.state[VELOCITY].clone());
        let of_free = m.traction / m.friction;
        v.values.iter_mut().step_by(2).for_each(|v1| *v1 -= of_free);
        Ok(Some(v))
    },
};
