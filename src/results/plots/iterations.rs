//! Iterations of the coupling over time.

use super::{Draw, PlotKind, When};
use crate::output::plot::Scale;
use crate::results::history::Group;

const GROUP: Group = Group {
    file: "iterations",
    title: "Iterations of the coupling",
    quantity: "iterations of a step",
    scale: Scale::Linear,
    columns: &["iterations"],
    several: None,
};

/// Those of each step.
pub const ITERATIONS: PlotKind = PlotKind {
    name: "iterations",
    help: "iterations of a step",
    needs: "a history.csv of two or more steps",
    when: When::Named,
    draw: Draw::OverTime(&[GROUP]),
};
