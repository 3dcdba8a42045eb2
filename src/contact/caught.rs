//! What to say of bodies that cannot move.

use super::mover::Freedom;
use super::step::Step;
use super::{ContactError, Partner};

/// Masses that differ by more cannot be told from held bodies.
const CONTRAST: f64 = 1e12;

impl Step<'_> {
    /// The error of bodies that cannot move.
    pub(super) fn caught(&self, body: usize, second: String, miss: f64) -> ContactError {
        let first = self.movers[body].name.to_owned();
        ContactError::Caught { first, second, miss, iterations: self.effort.iterations, hint: self.hint() }
    }

    /// What to do about bodies that cannot move.
    pub(super) fn hint(&self) -> String {
        let near = self.near.iter().flat_map(|near| {
            let other = match near.pair.partner {
                Partner::Body(other) => Some(other),
                Partner::Wall(_) => None,
            };
            std::iter::once(near.pair.body).chain(other)
        });
        let weights = near.filter_map(|k| match self.movers[k].freedom {
            Freedom::Free { mass, .. } => Some((mass, k)),
            Freedom::Pinned { .. } | Freedom::Given { .. } => None,
        });
        let mut by_weight: Vec<(f64, usize)> = weights.collect();
        by_weight.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if let (Some(light), Some(heavy)) = (by_weight.first(), by_weight.last())
            && heavy.0 > CONTRAST * light.0
        {
            let [light_name, heavy_name] = [light.1, heavy.1].map(|k| self.movers[k].name);
            return format!(
                "\"{heavy_name}\" is {:.0e} times as heavy as \"{light_name}\", and contact between them drowns in \
                 rounding: take densities that differ less, or hold the heavy body",
                heavy.0 / light.0
            );
        }
        let margin = self.solver.settings.margin;
        if self.near.iter().any(|near| near.touch.gap < 0.5 * margin) {
            return format!(
                "there may be no room for gaps of `contact.margin` = {margin}: take a smaller one, or a smaller step"
            );
        }
        "a body may be caught between moving obstacles or walls; or take a smaller step".into()
    }
}
