//! Up–down asymmetry of velocity and polarity.

use super::{Column, DIMENSIONLESS, Domain, Gauge, Measure, Of, Region, Taken, Taking, Tissue};
use crate::form::Integrator;
use crate::measure::{MeasureError, Mirror};
use crate::model::fields::{POLARITY, VELOCITY};

const COLUMNS: [Column; 2] = [
    Column::new("asymmetry_velocity", "asymmetry of v between the two sides", DIMENSIONLESS, "velocity"),
    Column::new("asymmetry_polarity", "asymmetry of p between the two sides", DIMENSIONLESS, "polarity"),
];

/// Up–down asymmetry [10.7]; velocity and polarity.
pub const ASYMMETRY: Measure = Measure {
    name: "asymmetry",
    help: "difference of `v` and of `p` from their mirror images in the disc's `x_2`",
    columns: &COLUMNS,
    of: Of::Tissue(Region::WholeMesh, Taking::Prepared(prepare)),
    needs: &[],
    with_residuals: true,
};

fn prepare(domain: &Domain) -> Result<Box<dyn Gauge>, MeasureError> {
    let loops = Integrator::new(domain.mesh);
    Ok(Box::new(Mirror::new(&loops, domain.locator, domain.centre[1], 2 * domain.polarity)?))
}

impl Gauge for Mirror {
    fn take(&self, at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError> {
        let loops = at.model.loops();
        taken.put(&COLUMNS, [&at.state[VELOCITY], &at.state[POLARITY]].map(|field| self.asymmetry(loops, field)));
        Ok(())
    }
}
