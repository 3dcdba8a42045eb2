//! Numbers of the density of a compressible sheet.

use super::{Column, DIMENSIONLESS, Measure, Of, Taken, Taking, Tissue};
use crate::measure::MeasureError;
use crate::model::fields::DENSITY;
use crate::time::SheetKind;

const TOTAL: [Column; 1] = [Column::new("mass", "mass ∫ρ", DIMENSIONLESS, "∫ρ")];
const DEFECT: [Column; 1] =
    [Column::new("mass_defect", "mass ∫ρ beyond what came in", DIMENSIONLESS, "beyond what came in").of_a_march()];
const SMALLEST: [Column; 1] = [Column::new("density_min", "smallest density min ρ", DIMENSIONLESS, "min ρ")];
const LIMITED: [Column; 1] =
    [Column::new("limited_cells", "cells whose density was limited", "", "cells").of_a_march().counting_cells()];

/// `∫ρ`, and what of it did not come in.
pub const MASS: Measure = Measure {
    name: "mass",
    help: "mass `∫ρ`, and how much it exceeds what came in",
    columns: &[TOTAL[0], DEFECT[0]],
    of: Of::Compressible(Taking::At(mass)),
    needs: &[],
    with_residuals: false,
};

/// `min ρ` over every point where the density is evaluated.
pub const DENSITY_MIN: Measure = Measure {
    name: "density_min",
    help: "smallest density `min ρ`, over every point where it is evaluated",
    columns: &SMALLEST,
    of: Of::Compressible(Taking::At(density_min)),
    needs: &[],
    with_residuals: false,
};

/// Cells whose density was limited in the last step.
pub const LIMITED_CELLS: Measure = Measure {
    name: "limited_cells",
    help: "cells whose density was limited in the last step",
    columns: &LIMITED,
    of: Of::Compressible(Taking::At(limited_cells)),
    needs: &[],
    with_residuals: false,
};

fn mass(at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError> {
    if let SheetKind::Compressible(sheet) = at.model.kind() {
        let mass = sheet.density.total(&at.state[DENSITY].values);
        taken.put(&TOTAL, [mass]);
        at.march.iter().for_each(|march| taken.put(&DEFECT, [mass - march.mass_counted]));
    }
    Ok(())
}

fn density_min(at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError> {
    if let SheetKind::Compressible(sheet) = at.model.kind() {
        taken.put(&SMALLEST, [sheet.density.limiter.smallest(&at.state[DENSITY])]);
    }
    Ok(())
}

fn limited_cells(at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError> {
    at.march.iter().for_each(|march| taken.put(&LIMITED, [march.limited as f64]));
    Ok(())
}
