//! `F` and `dF/dt`.

use super::{Column, DIMENSIONLESS, Measure, Of, Region, Taken, Taking, Tissue};
use crate::measure::MeasureError;

const COLUMNS: [Column; 2] = [
    Column::new("free_energy", "free energy F", DIMENSIONLESS, "F"),
    Column::new("free_energy_rate", "free energy rate dF/dt", DIMENSIONLESS, "dF/dt"),
];

/// `F` and `dF/dt`
pub const FREE_ENERGY: Measure = Measure {
    name: "free_energy",
    help: "free energy `F` and its rate `dF/dt`",
    columns: &COLUMNS,
    of: Of::Tissue(Region::OutsideOfBodies, Taking::At(take)),
    needs: &[],
    with_residuals: true,
};

fn take(at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError> {
    if let Some((energy, rate)) = at.energy {
        taken.put(&COLUMNS, [energy, rate]);
    }
    Ok(())
}
