//! The largest elastic strain, and whether it has a bound.

use super::{Column, DIMENSIONLESS, Measure, Of, Premise, Region, Taken, Taking, Tissue};
use crate::measure::MeasureError;
use crate::model::fields::VELOCITY;

const LARGEST: [Column; 4] = [
    Column::new("strain_max", "largest elastic strain", DIMENSIONLESS, "largest"),
    Column::new("strain_max_x1", "x₁ of the largest elastic strain", "", "x₁ of the largest"),
    Column::new("strain_max_x2", "x₂ of the largest elastic strain", "", "x₂ of the largest"),
    Column::new("strain_least_stretch", "least eigenvalue of I + ε", DIMENSIONLESS, "least eigenvalue of I + ε"),
];
const GROWTH: [Column; 3] = [
    Column::new("strain_growth", "growth of the strain at rest, 2 We λ(∇v)", DIMENSIONLESS, "growth 2 We λ(∇v)"),
    Column::new("strain_growth_x1", "x₁ of the largest growth of the strain", "", "x₁ of the growth"),
    Column::new("strain_growth_x2", "x₂ of the largest growth of the strain", "", "x₂ of the growth"),
];

/// Largest elastic strain, and whether it is bounded.
pub const ELASTIC_STRAIN: Measure = Measure {
    name: "elastic_strain",
    help: "largest elastic strain, least eigenvalue of `I + ε`, growth where the flow rests",
    columns: &[LARGEST[0], LARGEST[1], LARGEST[2], LARGEST[3], GROWTH[0], GROWTH[1], GROWTH[2]],
    of: Of::Tissue(Region::WholeMesh, Taking::At(take)),
    needs: &[Premise::Strain],
    with_residuals: false,
};

/// Of the strain in the flow of the state, as if that flow had always been there.
fn take(at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError> {
    let Some(strain) = at.domain.strain else { return Ok(()) };
    let (loops, v) = (at.model.loops(), &at.state[VELOCITY]);
    let tensor = strain.of(loops, v, |_| [0.0; 3])?;
    let largest = tensor.largest();
    taken.put(&LARGEST, [largest.value, largest.x.x, largest.x.y, tensor.least_stretch().value]);
    if let Some(growth) = strain.growth(loops, v) {
        taken.put(&GROWTH, [growth.value, growth.x.x, growth.x.y]);
    }
    Ok(())
}
