//! Length of the steps over time.

use super::{Draw, PlotKind, When};
use crate::output::plot::Scale;
use crate::results::history::{Group, Histories};

const GROUP: Group = Group {
    file: "step",
    title: "Length of the steps",
    quantity: "step Δt (dimensionless)",
    scale: Scale::Log,
    columns: &["dt"],
    several: None,
};

/// `Δt` over time; unasked only where it changes.
pub const STEP: PlotKind = PlotKind {
    name: "step",
    help: "length of the steps, unasked where it changes",
    needs: "a history.csv of two or more steps",
    when: When::OfAFolder,
    draw: Draw::With(|kind, source, drawn| {
        let histories = source.histories(drawn);
        if source.wish.names(kind) || vary(histories) {
            histories.group(kind, &GROUP, drawn);
        }
        Ok(())
    }),
};

/// Steps that differ by less are equal ones, trimmed to land on the times of outputs.
const EQUAL: f64 = 1.5;

fn vary(histories: &Histories) -> bool {
    histories.tables().any(|table| {
        let steps = table.numbers("dt").unwrap_or_default();
        // the first and the last are trimmed to land on times of output
        let mut sorted: Vec<f64> = steps.into_iter().filter(|dt| *dt > 0.0).collect();
        sorted.sort_by(f64::total_cmp);
        let share = |part: f64| sorted.get((part * sorted.len() as f64) as usize).copied().unwrap_or(1.0);
        sorted.len() > 4 && share(0.9) > EQUAL * share(0.1)
    })
}
