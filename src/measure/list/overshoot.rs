//! The overshoot behind the disc.

use super::{Column, Measure, Of, Premise, Region, Taken, Taking, Tissue};
use crate::measure::{Inlet, MeasureError, Overshoot};
use crate::model::boundary::PolarityCondition;
use crate::model::fields;

const VELOCITY: [Column; 2] = [
    Column::new("overshoot_velocity", "overshoot of v₁ behind the disc", "percent", "velocity"),
    Column::new("overshoot_velocity_x1", "x₁ of the largest v₁ behind the disc", "", "velocity"),
];
const POLARITY: [Column; 2] = [
    Column::new("overshoot_polarity", "overshoot of p₁ behind the disc", "percent", "polarity"),
    Column::new("overshoot_polarity_x1", "x₁ of the largest p₁ behind the disc", "", "polarity"),
];

/// Largest first component behind the disc on axis 1, over what flows in there, less 1; velocity and polarity.
pub const OVERSHOOT: Measure = Measure {
    name: "overshoot",
    help: "largest `v₁` and `p₁` behind the disc, over what flows in, and where they are",
    columns: &[VELOCITY[0], VELOCITY[1], POLARITY[0], POLARITY[1]],
    of: Of::Tissue(Region::OutsideOfBodies, Taking::At(take)),
    needs: &[Premise::Wake],
    with_residuals: true,
};

/// Relative to what flows in on the axis; empty while that is zero.
fn take(at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError> {
    let (domain, state) = (at.domain, at.state);
    let (mesh, locator) = (domain.mesh, domain.locator);
    let (axis, span) = (domain.centre[1], (domain.centre[0] + domain.radius, domain.end));
    let Some(inlet) = Inlet::on(mesh, axis) else { return Ok(()) };
    // the polarity is imposed weakly: what is given counts, not its trace
    let polarity = match &at.model.conditions()[inlet.tag].polarity {
        PolarityCondition::Dirichlet([first, _]) => Some(first.eval(inlet.x, at.t)),
        PolarityCondition::Neumann => inlet.value(&state[fields::POLARITY], mesh, locator),
    };
    let velocity = inlet.value(&state[fields::VELOCITY], mesh, locator);
    for (field, inflow, columns) in
        [(&state[fields::VELOCITY], velocity, &VELOCITY), (&state[fields::POLARITY], polarity, &POLARITY)]
    {
        if let Some(inflow) = inflow.filter(|inflow| *inflow != 0.0) {
            let found = Overshoot::of(field, mesh, locator, span, (axis, inflow))?;
            taken.put(columns, [found.percent, found.x1]);
        }
    }
    Ok(())
}
