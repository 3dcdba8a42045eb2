//! Residuals of the stationary equations over time.

use super::{Draw, PlotKind, When};
use crate::output::plot::Scale;
use crate::results::history::{Group, Several};

const GROUP: Group = Group {
    file: "residual",
    title: "Residual of the stationary equations",
    quantity: "residual (dimensionless)",
    scale: Scale::Log,
    columns: &["residual", "residual_velocity", "residual_pressure", "residual_density", "residual_polarity"],
    several: Some(Several::Total),
};

/// The total and its parts.
pub const RESIDUAL: PlotKind = PlotKind {
    name: "residual",
    help: "stationary residuals over time; of several runs the total",
    needs: "`time.stop.residual`, [steady] or any measure with `every` in the scene",
    when: When::Always,
    draw: Draw::OverTime(&[GROUP]),
};
