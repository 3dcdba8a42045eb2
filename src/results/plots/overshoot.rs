//! How far velocity and polarity rise behind the disc, and where, over time.

use super::{Draw, PlotKind, When};
use crate::output::plot::Scale;
use crate::results::history::Group;

const VALUE: Group = Group {
    file: "overshoot",
    title: "Overshoot behind the disc",
    quantity: "overshoot (percent)",
    scale: Scale::Linear,
    columns: &["overshoot_velocity", "overshoot_polarity"],
    several: None,
};
const PLACE: Group = Group {
    file: "overshoot-place",
    title: "Place of the overshoot",
    quantity: "x₁ of the largest value",
    scale: Scale::Linear,
    columns: &["overshoot_velocity_x1", "overshoot_polarity_x1"],
    several: None,
};

/// Values, and places in a picture of their own.
pub const OVERSHOOT: PlotKind = PlotKind {
    name: "overshoot",
    help: "overshoots behind the disc over time, and where they are",
    needs: "the measure `overshoot` with `every` in the scene",
    when: When::Always,
    draw: Draw::OverTime(&[VALUE, PLACE]),
};
