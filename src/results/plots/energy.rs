//! Free energy over time.

use super::{Draw, PlotKind, When};
use crate::output::plot::Scale;
use crate::results::history::Group;

const GROUP: Group = Group {
    file: "energy",
    title: "Free energy",
    quantity: "free energy F (dimensionless)",
    scale: Scale::Linear,
    columns: &["free_energy"],
    several: None,
};

/// `F` over time.
pub const ENERGY: PlotKind = PlotKind {
    name: "energy",
    help: "free energy `F` over time",
    needs: "the measure `free_energy` with `every` in the scene",
    when: When::Always,
    draw: Draw::OverTime(&[GROUP]),
};
