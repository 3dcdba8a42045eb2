//! Terms of the energy law over time.

use super::{Draw, PlotKind, When};
use crate::measure::list;
use crate::output::plot::Scale;
use crate::results::history::{Group, Several};

const GROUP: Group = Group {
    file: "budget",
    title: "Terms of the energy law",
    quantity: "power (dimensionless)",
    scale: Scale::Linear,
    columns: &list::BUDGET,
    several: Some(Several::First),
};

/// Every line of the budget.
pub const BUDGET: PlotKind = PlotKind {
    name: "budget",
    help: "terms of the energy law over time; of several runs the rate",
    needs: "the measure `energy_budget` with `every` in the scene",
    when: When::Always,
    draw: Draw::OverTime(&[GROUP]),
};
