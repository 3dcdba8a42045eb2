//! The terms of the energy law.

use super::{Column, DIMENSIONLESS, Measure, Of, Region, Taken, Taking, Tissue};
use crate::measure::{Budget, MeasureError};
use crate::model::terms::Side;
use crate::model::terms::power::{COUNT, LINES};
use crate::time::SheetKind;

const RATE: Column = Column::new("budget_rate", "energy law: dF/dt", DIMENSIONLESS, "dF/dt");
const RELAXATION: Column = Column::new("budget_relaxation", "energy law: relaxation", DIMENSIONLESS, "relaxation");
const WALL_FRICTION: Column =
    Column::new("budget_wall_friction", "energy law: friction with walls", DIMENSIONLESS, "friction with walls");
const BODIES: Column =
    Column::new("budget_bodies", "energy law: what bodies take", DIMENSIONLESS, "bodies").with_bodies();
const DEFECT: Column = Column::new("budget_defect", "energy law: what its terms leave", DIMENSIONLESS, "defect");

/// The rate, the lines of terms on the left side, the friction with walls, what bodies take, the relaxation, the lines
/// of terms on the right side, and the defect.
const COLUMNS: [Column; COUNT + 5] = {
    let mut columns = [DEFECT; COUNT + 5];
    columns[0] = RATE;
    let (mut at, mut k) = (1, 0);
    while k < COUNT {
        if k == left() {
            columns[at] = WALL_FRICTION;
            columns[at + 1] = BODIES;
            columns[at + 2] = RELAXATION;
            at += 3;
        }
        let line = LINES[k].line;
        columns[at] = Column::new(line.column, line.words, DIMENSIONLESS, line.short).with(LINES[k].key);
        (at, k) = (at + 1, k + 1);
    }
    columns
};

/// The names of the columns.
pub const BUDGET: [&str; COUNT + 5] = {
    let mut names = [""; COUNT + 5];
    let mut k = 0;
    while k < COUNT + 5 {
        names[k] = COLUMNS[k].name;
        k += 1;
    }
    names
};

/// How many lines are on the left side.
const fn left() -> usize {
    let mut k = 0;
    while k < COUNT && matches!(LINES[k].side, Side::Left) {
        k += 1;
    }
    k
}

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
    let budget = Budget::at(at.model, at.state, at.rate_of_p, at.t)?;
    let walls = (WALL_FRICTION, budget.wall_friction);
    let others = [(RATE, budget.rate), walls, (RELAXATION, budget.relaxation), (DEFECT, budget.defect())];
    taken.values.extend(others.map(|(column, value)| (column.name, value)));
    if matches!(at.model.kind(), SheetKind::Incompressible(model) if model.bodies.is_some()) {
        taken.values.insert(BODIES.name, budget.bodies);
    }
    let lines = LINES.iter().zip(budget.lines).filter(|(listed, _)| listed.is_of(at.model.parameters()));
    taken.values.extend(lines.map(|(listed, power)| (listed.line.column, power)));
    Ok(())
}
