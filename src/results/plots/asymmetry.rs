//! How much the two sides of the disc differ, over time.

use super::{Draw, PlotKind, When};
use crate::output::plot::Scale;
use crate::results::history::Group;

const GROUP: Group = Group {
    file: "asymmetry",
    title: "Asymmetry between the two sides",
    quantity: "asymmetry (dimensionless)",
    scale: Scale::Linear,
    columns: &["asymmetry_velocity", "asymmetry_polarity"],
    several: None,
};

/// Of velocity and polarity.
pub const ASYMMETRY: PlotKind = PlotKind {
    name: "asymmetry",
    help: "asymmetries over time",
    needs: "the measure `asymmetry` with `every` in the scene",
    when: When::Always,
    draw: Draw::OverTime(&[GROUP]),
};
