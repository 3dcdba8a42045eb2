//! How many defects the polarity has.

use super::{Column, Domain, Gauge, Measure, Of, Region, Taken, Taking, Tissue};
use crate::measure::{Defects, MeasureError};
use crate::model::fields::POLARITY;

const COLUMNS: [Column; 2] = [
    Column::new("defects_plus", "defects of charge +1", "", "charge +1"),
    Column::new("defects_minus", "defects of charge −1", "", "charge −1"),
];

/// Points about which the polarity turns, by charge.
pub const DEFECTS: Measure = Measure {
    name: "defects",
    help: "points about which the polarity turns, how many of charge +1 and −1",
    columns: &COLUMNS,
    of: Of::Tissue(Region::WholeMesh, Taking::Prepared(prepare)),
    needs: &[],
    with_residuals: false,
};

fn prepare(domain: &Domain) -> Result<Box<dyn Gauge>, MeasureError> {
    Ok(Box::new(Defects::new(domain.mesh)))
}

impl Gauge for Defects {
    fn take(&self, at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError> {
        let census = self.of(&at.state[POLARITY]);
        taken.put(&COLUMNS, [1, -1].map(|charge| census.count(charge) as f64));
        taken.census = Some(census);
        Ok(())
    }
}
