//! Data that depend on the time, where a state at rest is looked for.

use std::collections::BTreeMap;

use super::Checker;
use crate::expression::Expression;
use crate::mesh::generate::MeshScene;
use crate::model::Conditions;
use crate::scene::error::SceneError;
use crate::scene::path::quoted;
use crate::scene::{Sources, Time};

/// The formulas of a scene, by key.
fn data<'d>(
    boundary: &'d BTreeMap<String, Conditions>,
    sources: &'d Sources,
) -> impl Iterator<Item = (String, &'d Expression)> {
    let of_tags = boundary.iter().flat_map(|(tag, conditions)| {
        conditions.formulas().map(|(key, formulas)| (format!("boundary.{}.{key}", quoted(tag)), formulas))
    });
    let of_sources = sources.data().map(|(key, formulas)| (key.to_owned(), formulas));
    of_tags.chain(of_sources).flat_map(|(key, formulas)| formulas.into_iter().map(move |f| (key.clone(), f)))
}

impl Checker<'_> {
    /// A search for a steady state needs data without `t`.
    pub(super) fn without_time(
        &self,
        boundary: &BTreeMap<String, Conditions>,
        sources: &Sources,
    ) -> Result<(), SceneError> {
        let rule = "must not depend on t where a steady state is searched for";
        let hint = "take `t` out of the formula, or the table [steady] (the flag --steady) away";
        for (key, formula) in data(boundary, sources) {
            self.require(!formula.depends_on_time(), &key, "a formula of t", rule, hint)?;
        }
        Ok(())
    }

    /// From when on all data are constant, where the run may stop at rest: before, it would stop while the data only
    /// pause.
    pub(super) fn rest(
        &self,
        time: &Time,
        mesh: &MeshScene,
        boundary: &BTreeMap<String, Conditions>,
        sources: &Sources,
    ) -> Result<f64, SceneError> {
        let stop = match (time.stop_residual, time.stop_energy_rate) {
            (None, None) => return Ok(0.0),
            (Some(_), _) => "time.stop.residual",
            (None, Some(_)) => "time.stop.energy_rate",
        };
        let everywhere = [[f64::NEG_INFINITY, f64::INFINITY]; 2];
        let place = mesh.bounds().unwrap_or(everywhere);
        let mut latest = 0.0_f64;
        for (key, formula) in data(boundary, sources) {
            let Some(from) = formula.constant_from(place) else {
                let rule =
                    format!("is not constant from some time on, and `{stop}` would end the run before it has changed");
                let hint = format!(
                    "remove `{stop}`, or let the formula stay at a value: `if(t < 10, …, …)`, or `min(t, 10)` in place of `t`"
                );
                return Err(self.error(&key, format!("\"{}\"", formula.text()), &rule, &hint));
            };
            latest = latest.max(from);
        }
        Ok(latest)
    }
}
