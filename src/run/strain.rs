//! The elastic strain in a run: in the velocity of a state, as if that flow had always been there.

use std::sync::Arc;

use super::RunError;
use super::stepper::Ground;
use crate::measure::Strain;
use crate::measure::fields::Fields;
use crate::mesh::Mesh;
use crate::model::Conditions;
use crate::model::fields::VELOCITY;
use crate::model::momentum::tagged;
use crate::scene::StrainSettings;

/// A residual above this belongs to a flow that changes.
const STEADY: f64 = 1e-4;

/// The equation of the strain in a tissue with these conditions.
///
/// # Errors
/// A structure that contradicts itself.
pub(super) fn prepare(
    settings: StrainSettings,
    mesh: &Arc<Mesh>,
    conditions: &[Conditions],
) -> Result<Strain, RunError> {
    let open = tagged(conditions, |c| !c.is_impermeable());
    Ok(Strain::new(mesh, settings.degree, settings.weissenberg, open)?)
}

/// What is to be said of the strain of the last state, whose stationary equations leave that residual.
pub(super) fn notes(ground: &Ground, fields: &dyn Fields, residual: Option<f64>) -> Result<Vec<String>, RunError> {
    let mut notes = Vec::new();
    let (Some(strain), Some(v)) = (&ground.tools.strain, fields.field(VELOCITY)?) else { return Ok(notes) };
    let growth = strain.growth(fields.loops(), &v).filter(|growth| growth.value >= 1.0);
    if let Some(growth) = growth {
        notes.push(format!(
            "the elastic strain has no bound: near ({:.4}, {:.4}), where the flow comes to rest, 2 We λ(∇v) = {:.3} is not \
             below 1, and what is shown there depends on the mesh; a `strain.weissenberg` below {:.3} gives a bounded one",
            growth.x.x,
            growth.x.y,
            growth.value,
            strain.weissenberg / growth.value
        ));
    }
    let stretch = strain.of(fields.loops(), &v, |_| [0.0; 3]).ok().map(|tensor| tensor.least_stretch());
    if let Some(stretch) = stretch.filter(|stretch| stretch.value <= 0.0) {
        notes.push(format!(
            "the elastic strain is no strain near ({:.4}, {:.4}): the least eigenvalue of I + ε is {:.3}, which must be \
             positive; take a finer mesh or a smaller `strain.weissenberg`",
            stretch.x.x, stretch.x.y, stretch.value
        ));
    }
    if let Some(residual) = residual.filter(|r| *r > STEADY) {
        notes.push(format!(
            "the elastic strain is that of a flow that stays as it is, but this one still changes (residual {residual:.1e})"
        ));
    }
    Ok(notes)
}
