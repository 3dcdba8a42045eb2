//! The terms of the energy law.

use super::{Column, DIMENSIONLESS, Measure, Of, Region, Taken, Taking, Tissue};
use crate::measure::{Budget, MeasureError};

const COLUMNS: [Column; 8] = [
    Column::new("budget_rate", "energy law: dF/dt", DIMENSIONLESS, "dF/dt"),
    Column::new("budget_friction", "energy law: friction", DIMENSIONLESS, "friction"),
    Column::new("budget_wall_friction", "energy law: friction with walls", DIMENSIONLESS, "friction with walls"),
    Column::new("budget_viscosity", "energy law: viscosity", DIMENSIONLESS, "viscosity"),
    Column::new("budget_relaxation", "energy law: relaxation", DIMENSIONLESS, "relaxation"),
    Column::new("budget_traction", "energy law: traction", DIMENSIONLESS, "traction"),
    Column::new("budget_active_stress", "energy law: active stress", DIMENSIONLESS, "active stress"),
    Column::new("budget_defect", "energy law: what its terms leave", DIMENSIONLESS, "defect"),
];

/// Every term of the energy law, and what they leave.
pub const ENERGY_BUDGET: Measure = Measure {
    name: "energy_budget",
    help: "every term of the energy law, and what they leave",
    columns: &COLUMNS,
    of: Of::Tissue(Region::OutsideOfBodies, Taking::At(take)),
    needs: &[],
    with_residuals: true,
};

fn take(at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError> {
    let budget = Budget::at(at.model, at.state, at.rate_of_p, at.t);
    let defect = budget.defect();
    let Budget { rate, friction, wall_friction, viscosity, relaxation, traction, active_stress } = budget;
    taken.put(&COLUMNS, [rate, friction, wall_friction, viscosity, relaxation, traction, active_stress, defect]);
    Ok(())
}
