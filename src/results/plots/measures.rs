//! Every measure over time that has no plot of its own.

use super::{ALL, Draw, PlotKind, When};
use crate::output::plot::{Axis, Scale, Series};
use crate::results::curves::Drawn;
use crate::results::history::{Group, Histories, curve, file_name};
use crate::results::{Table, names};

/// Measures that belong together and whose names do not tell.
const GROUPS: [Group; 3] = [
    Group {
        file: "wall-force",
        title: "Force on all walls",
        quantity: "force (dimensionless)",
        scale: Scale::Linear,
        columns: &["wall_force_x1", "wall_force_x2"],
        several: None,
    },
    Group {
        file: "body-place",
        title: "Place of the body",
        quantity: "position",
        scale: Scale::Linear,
        columns: &["body_x1", "body_x2"],
        several: None,
    },
    Group {
        file: "body-velocity",
        title: "Velocity of the body",
        quantity: "velocity (dimensionless)",
        scale: Scale::Linear,
        columns: &["body_velocity_1", "body_velocity_2"],
        several: None,
    },
];

/// Columns that are no measures.
const ASIDE: [&str; 9] =
    ["step", "time", "dt", "order", "iterations", "increment", "rate", "rejected", "free_energy_rate"];

/// Measures over time, of a single run those of one kind in one picture.
pub const MEASURES: PlotKind = PlotKind {
    name: "measures",
    help: "every other measure over time",
    needs: "measures with `every` in the scene",
    when: When::Always,
    draw: Draw::With(|kind, source, drawn| {
        let histories = source.histories(drawn);
        GROUPS.iter().for_each(|group| histories.group(kind, group, drawn));
        others(kind, histories, drawn);
        Ok(())
    }),
};

/// Measures that no group has: of a single run those of one kind, such as `defects_plus` and `defects_minus`, in one
/// picture.
fn others(kind: &'static PlotKind, histories: &Histories, drawn: &mut Drawn) {
    let groups = || ALL.iter().flat_map(|plot| plot.groups()).chain(&GROUPS);
    let known = |column: &str| ASIDE.contains(&column) || groups().any(|group| group.columns.contains(&column));
    let mut columns: Vec<&str> = Vec::new();
    for column in histories.tables().flat_map(|table| &table.header) {
        if !known(column) && !column.is_empty() && !columns.contains(&column.as_str()) {
            columns.push(column);
        }
    }
    if let Some(table) = histories.only() {
        let first_word = |column: &str| column.split_once('_').map(|(word, _)| word.to_owned());
        while let Some(&first) = columns.first() {
            let word = first_word(first);
            let (same, rest) =
                columns.into_iter().partition(|c| *c == first || word.is_some() && first_word(c) == word);
            columns = rest;
            of_one_kind(kind, histories, (table, &same, &word.unwrap_or_default()), drawn);
        }
        return;
    }
    for column in columns {
        let (axes, title) = ([histories.time(), names::axis(column, Scale::Linear)], names::title(column));
        drawn.pictures.extend(histories.picture(kind, (&file_name(column), &title), axes, histories.each(column)));
    }
}

/// Columns of a single run whose names begin with the same word.
fn of_one_kind(
    kind: &'static PlotKind,
    histories: &Histories,
    (table, columns, word): (&Table, &[&str], &str),
    drawn: &mut Drawn,
) {
    let name = if let [only] = columns { only } else { word };
    let legend = |column: &str| match columns {
        [_] => String::new(),
        [] | [_, ..] => names::short(column),
    };
    let all = columns.iter().map(|column| (histories.points(table, column), legend(column)));
    let some = all.filter(|(points, _)| points.len() > 1).enumerate();
    let series: Vec<Series> = some.map(|(k, (points, legend))| curve(k, &legend, points)).collect();
    let (title, y) = match columns {
        [only] => (names::title(only), names::axis(only, Scale::Linear)),
        [] | [_, ..] => (names::title(word), Axis::linear(word)),
    };
    drawn.pictures.extend(histories.picture(kind, (&file_name(name), &title), [histories.time(), y], series));
}
