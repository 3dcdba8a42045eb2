//! How fast a flow is.

use super::{Column, DIMENSIONLESS, Flow, Measure, Of, Taken};
use crate::measure::MeasureError;

const COLUMNS: [Column; 1] = [Column::new("mean_speed", "mean speed of the flow", DIMENSIONLESS, "mean speed")];

/// `(1/|Ω|) ∫|v|`, Ω what flows: all that no body covers.
pub const MEAN_SPEED: Measure = Measure {
    name: "mean_speed",
    help: "`∫ abs(v)` over the area of what flows, bodies left out",
    columns: &COLUMNS,
    of: Of::Flow(take),
    needs: &[],
    with_residuals: false,
};

fn take(at: &Flow, taken: &mut Taken) -> Result<(), MeasureError> {
    // the speed is no polynomial
    let degree = 2 * at.v.space.degree;
    let total = at.loops.sum(degree, |x| at.v.vector(&x.site).norm());
    taken.put(&COLUMNS, [total / at.loops.sum(degree, |_| 1.0)]);
    Ok(())
}
