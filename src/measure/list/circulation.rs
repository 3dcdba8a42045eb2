//! How velocity and polarity go around.

use super::{Column, DIMENSIONLESS, Measure, Of, Premise, Region, Taken, Taking, Tissue};
use crate::measure::MeasureError;
use crate::model::fields::{POLARITY, VELOCITY};
use crate::space::Field;

const COLUMNS: [Column; 2] = [
    Column::new("circulation_velocity", "mean velocity along the track", DIMENSIONLESS, "velocity"),
    Column::new("circulation_polarity", "mean polarity along the track", DIMENSIONLESS, "polarity"),
];

/// Mean velocity and polarity along the track.
pub const CIRCULATION: Measure = Measure {
    name: "circulation",
    help: "means of `v·τ` and `p·τ`, `τ` along the way around of a `racetrack`, `annulus` or `disc`",
    columns: &COLUMNS,
    of: Of::Tissue(Region::WholeMesh, Taking::At(take)),
    needs: &[Premise::Track],
    with_residuals: false,
};

/// `(1/|Ω|) ∫ c·τ` of velocity and polarity, τ the unit vector along the track.
fn take(at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError> {
    let Some(track) = at.domain.track else { return Ok(()) };
    let (loops, area, state) = (at.model.loops(), at.model.area(), at.state);
    // the direction is no polynomial
    let degree = 2 * state[VELOCITY].space.degree.max(state[POLARITY].space.degree);
    let mean = |field: &Field| loops.sum(degree, |x| field.vector(&x.site).dot(&track.tangent(x.site.x))) / area;
    taken.put(&COLUMNS, [mean(&state[VELOCITY]), mean(&state[POLARITY])]);
    Ok(())
}
