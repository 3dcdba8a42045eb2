//! The elastic strain in a run: in the velocity of a state, as if that flow had always been there.

use std::sync::Arc;

use super::RunError;
use super::stepper::Ground;
use super::view::Fields;
use crate::measure::{MeasureError, Strain, Tensor};
use crate::mesh::Mesh;
use crate::model::Conditions;
use crate::model::momentum::tagged;
use crate::scene::{Field, Scene};

/// A residual above this belongs to a flow that changes.
const STEADY: f64 = 1e-4;

/// The equation of a scene that needs it.
///
/// # Errors
/// A structure that contradicts itself.
pub(super) fn prepare(scene: &Scene, mesh: &Arc<Mesh>, conditions: &[Conditions]) -> Result<Option<Strain>, RunError> {
    let Some(settings) = scene.strain_needed() else { return Ok(None) };
    let open = tagged(conditions, |c| !c.is_impermeable());
    Ok(Some(Strain::new(mesh, settings.degree, settings.weissenberg, open)?))
}

/// The strain in the flow of a state; what flows in is not strained.
///
/// # Errors
/// A strain that cannot be solved for.
pub(super) fn at(ground: &Ground, fields: &dyn Fields) -> Result<Option<Tensor>, RunError> {
    let (Some(strain), Some(v)) = (&ground.strain, fields.field(Field::Velocity)?) else { return Ok(None) };
    let found = strain.of(fields.loops(), &v, |_| [0.0; 3]).map_err(MeasureError::from)?;
    Ok(Some(found))
}

/// What is to be said of the strain of the last state, whose stationary equations leave that residual.
pub(super) fn notes(ground: &Ground, fields: &dyn Fields, residual: Option<f64>) -> Result<Vec<String>, RunError> {
    let mut notes = Vec::new();
    let (Some(strain), Some(v)) = (&ground.strain, fields.field(Field::Velocity)?) else { return Ok(notes) };
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
    let stretch = at(ground, fields).ok().flatten().map(|tensor| tensor.least_stretch());
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
