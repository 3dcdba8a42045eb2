//! The force of a flow on its boundary, and its torque.

use super::{Column, DIMENSIONLESS, Measure, Of, Spot};
use crate::model::Reactions;

const FORCE: [Column; 2] = [
    Column::new("force_x1", "force along x₁ on the boundary", DIMENSIONLESS, "along x₁"),
    Column::new("force_x2", "force along x₂ on the boundary", DIMENSIONLESS, "along x₂"),
];
const TORQUE: [Column; 1] = [Column::new("torque", "torque on the boundary", DIMENSIONLESS, "torque")];

/// `−∫ n·σ` over a boundary tag, n outwards, as a consistent flux.
pub const FORCE_ON: Measure = Measure {
    name: "force_on",
    help: "force of the flow on a boundary tag, `−∫ n·σ`, as a consistent flux",
    columns: &FORCE,
    of: Of::Boundary { around: false, take: force },
    needs: &[],
    with_residuals: false,
};

/// `−∫ (x−x₀) × (n·σ)` over a boundary tag, likewise.
pub const TORQUE_ON: Measure = Measure {
    name: "torque_on",
    help: "torque of the flow on a boundary tag about the point `around`, likewise",
    columns: &TORQUE,
    of: Of::Boundary { around: true, take: torque },
    needs: &[],
    with_residuals: false,
};

fn force(at: &Reactions, spot: &Spot) -> Vec<f64> {
    let force = at.force(spot.tag);
    vec![force.x, force.y]
}

fn torque(at: &Reactions, spot: &Spot) -> Vec<f64> {
    vec![at.torque(spot.tag, spot.around)]
}
