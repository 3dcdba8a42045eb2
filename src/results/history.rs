//! Curves from `history.csv`.

use super::curves::{CurveSettings, Drawn, Picture, What};
use super::{Results, Table, label, names};
use crate::measure::list::BUDGET;
use crate::output::plot::{Axis, Line, Markers, Plot, Scale, Series, Symbol};

/// Columns that belong to one picture.
struct Group {
    what: What,
    file: &'static str,
    title: &'static str,
    /// Of all the columns together, with its unit.
    quantity: &'static str,
    scale: Scale,
    columns: &'static [&'static str],
}

const GROUPS: [Group; 11] = [
    Group {
        what: What::Energy,
        file: "energy",
        title: "Free energy",
        quantity: "free energy F (dimensionless)",
        scale: Scale::Linear,
        columns: &["free_energy"],
    },
    Group {
        what: What::Residual,
        file: "residual",
        title: "Residual of the stationary equations",
        quantity: "residual (dimensionless)",
        scale: Scale::Log,
        columns: &["residual", "residual_velocity", "residual_pressure", "residual_density", "residual_polarity"],
    },
    Group {
        what: What::Overshoot,
        file: "overshoot",
        title: "Overshoot behind the disc",
        quantity: "overshoot (percent)",
        scale: Scale::Linear,
        columns: &["overshoot_velocity", "overshoot_polarity"],
    },
    Group {
        what: What::Overshoot,
        file: "overshoot-place",
        title: "Place of the overshoot",
        quantity: "x₁ of the largest value",
        scale: Scale::Linear,
        columns: &["overshoot_velocity_x1", "overshoot_polarity_x1"],
    },
    Group {
        what: What::Asymmetry,
        file: "asymmetry",
        title: "Asymmetry between the two sides",
        quantity: "asymmetry (dimensionless)",
        scale: Scale::Linear,
        columns: &["asymmetry_velocity", "asymmetry_polarity"],
    },
    Group {
        what: What::Budget,
        file: "budget",
        title: "Terms of the energy law",
        quantity: "power (dimensionless)",
        scale: Scale::Linear,
        columns: &BUDGET,
    },
    Group {
        what: What::Step,
        file: "step",
        title: "Length of the steps",
        quantity: "step Δt (dimensionless)",
        scale: Scale::Log,
        columns: &["dt"],
    },
    Group {
        what: What::Iterations,
        file: "iterations",
        title: "Iterations of the coupling",
        quantity: "iterations of a step",
        scale: Scale::Linear,
        columns: &["iterations"],
    },
    Group {
        what: What::Measures,
        file: "wall-force",
        title: "Force on all walls",
        quantity: "force (dimensionless)",
        scale: Scale::Linear,
        columns: &["wall_force_x1", "wall_force_x2"],
    },
    Group {
        what: What::Measures,
        file: "body-place",
        title: "Place of the first body",
        quantity: "position",
        scale: Scale::Linear,
        columns: &["body_x1", "body_x2"],
    },
    Group {
        what: What::Measures,
        file: "body-velocity",
        title: "Velocity of the first body",
        quantity: "velocity (dimensionless)",
        scale: Scale::Linear,
        columns: &["body_velocity_1", "body_velocity_2"],
    },
];

/// Columns that are no measures.
const ASIDE: [&str; 9] =
    ["step", "time", "dt", "order", "iterations", "increment", "rate", "rejected", "free_energy_rate"];

/// Steps that differ by less are equal ones, trimmed to land on the times of outputs.
const EQUAL_STEPS: f64 = 1.5;

/// Number of the colour black.
const BLACK: Option<usize> = Some(4);

/// The histories of the runs that have one.
struct Runs<'a> {
    all: Vec<(&'a Results, Table, &'a str)>,
    /// Column of the horizontal axis, and its name.
    x: (&'static str, &'static str),
    subtitle: String,
    wish: &'a CurveSettings,
}

pub(super) fn draw(runs: &[&Results], labels: &[String], wish: &CurveSettings, drawn: &mut Drawn) {
    if ![What::Sections, What::Study, What::Bodies].iter().any(|what| wish.what == [*what]) {
        let runs = Runs::read(runs, labels, wish, drawn);
        GROUPS.iter().filter(|group| wish.wants(group.what)).for_each(|group| runs.group(group, drawn));
        if wish.wants(What::Lissajous) {
            drawn.pictures.extend(runs.lissajous());
        }
        if wish.wants(What::Measures) {
            runs.others(drawn);
        }
    }
}

impl<'a> Runs<'a> {
    fn read(runs: &[&'a Results], labels: &'a [String], wish: &'a CurveSettings, drawn: &mut Drawn) -> Self {
        let mut all = Vec::new();
        for (run, label) in runs.iter().zip(labels) {
            match run.history() {
                Ok(Some(table)) => all.push((*run, table, label.as_str())),
                Ok(None) => {}
                Err(error) => drawn.notes.push(error.to_string()),
            }
        }
        let search = all.iter().any(|(run, ..)| run.is_search());
        let x = if search { ("step", "pseudo-step") } else { ("time", "time t (dimensionless)") };
        let with: Vec<&Results> = all.iter().map(|(run, ..)| *run).collect();
        Self { x, subtitle: label::common(&with), all, wish }
    }

    fn points(&self, table: &Table, column: &str) -> Vec<(f64, f64)> {
        self.wish.inside(table.points(self.x.0, column))
    }

    /// One picture for a single run, with all columns; for several runs a picture for each column.
    fn group(&self, group: &Group, drawn: &mut Drawn) {
        if group.what == What::Step && !self.wish.names(What::Step) && !self.steps_vary() {
            return;
        }
        if let [(_, table, _)] = &self.all[..] {
            let named = group.columns.iter().map(|column| (self.points(table, column), names::short(column)));
            let series = named.filter(|(points, _)| points.len() > 1).enumerate();
            let series: Vec<Series> = series.map(|(k, (points, name))| curve(k, &name, points)).collect();
            let single = group.columns.len() == 1;
            let y = Axis { label: group.quantity.to_owned(), scale: group.scale };
            drawn.pictures.extend(self.picture(group.what, group.file, group.title, y, series).map(|mut picture| {
                if single {
                    // the axis names it
                    picture.plot.series.iter_mut().for_each(|series| series.name.clear());
                }
                if group.what == What::Residual && picture.plot.series.len() > 1 {
                    // the largest part hides it, or it hides that
                    let total = picture.plot.series.remove(0);
                    picture.plot.series.push(Series {
                        line: Line::Dashed,
                        markers: Markers::None,
                        colour: BLACK,
                        ..total
                    });
                }
                picture
            }));
            return;
        }
        let usual = match group.what {
            What::Residual | What::Budget if !self.wish.names(group.what) => 1,
            What::Sections | What::Energy | What::Lissajous | What::Residual | What::Overshoot => usize::MAX,
            What::Asymmetry | What::Budget | What::Step | What::Iterations => usize::MAX,
            What::Measures | What::Study | What::Bodies => usize::MAX,
        };
        for (k, column) in group.columns.iter().enumerate().take(usual) {
            let name = names::short(column);
            let alone = group.columns.len() == 1 || k == 0 && group.what == What::Residual;
            let file = match (alone, name.is_ascii()) {
                (true, _) => group.file.to_owned(),
                (false, true) => format!("{}-{}", group.file, name.replace([' ', '/'], "-")),
                (false, false) => file_name(column),
            };
            let title = if alone { group.title.to_owned() } else { format!("{}: {name}", group.title) };
            let y = names::axis(column, group.scale);
            let picture = self.picture(group.what, &file, &title, y, self.each(column));
            drawn.pictures.extend(picture);
        }
    }

    /// A column of every run.
    fn each(&self, column: &str) -> Vec<Series> {
        let all = self.all.iter().map(|(_, table, label)| (self.points(table, column), *label));
        all.filter(|(points, _)| points.len() > 1)
            .enumerate()
            .map(|(k, (points, name))| curve(k, name, points))
            .collect()
    }

    fn picture(&self, what: What, file: &str, title: &str, y: Axis, series: Vec<Series>) -> Option<Picture> {
        if series.is_empty() {
            return None;
        }
        let (title, subtitle) = (title.to_owned(), self.subtitle.clone());
        let plot = Plot { title, subtitle, x: Axis::linear(self.x.1), y, series, slopes: Vec::new() };
        Some(Picture { name: file.to_owned(), what, plot })
    }

    fn steps_vary(&self) -> bool {
        self.all.iter().any(|(_, table, _)| {
            let steps = table.numbers("dt").unwrap_or_default();
            // the first and the last are trimmed to land on times of output
            let inner: Vec<f64> = steps.into_iter().filter(|dt| *dt > 0.0).collect();
            let mut sorted = inner.clone();
            sorted.sort_by(f64::total_cmp);
            let share = |part: f64| sorted.get((part * sorted.len() as f64) as usize).copied().unwrap_or(1.0);
            sorted.len() > 4 && share(0.9) > EQUAL_STEPS * share(0.1)
        })
    }

    /// Rate over value of the free energy, with times beside the curve.
    fn lissajous(&self) -> Option<Picture> {
        let (mut series, mut marks) = (Vec::new(), Vec::new());
        for (_, table, label) in &self.all {
            let columns = [self.x.0, "free_energy", "free_energy_rate"].map(|name| table.numbers(name));
            let [Some(x), Some(energy), Some(rate)] = columns else { continue };
            let rows = x.into_iter().zip(energy.into_iter().zip(rate));
            let inside = |t: f64| self.wish.window.is_none_or(|[lo, hi]| (lo..=hi).contains(&t));
            let rows: Vec<(f64, (f64, f64))> =
                rows.filter(|(t, (f, r))| inside(*t) && f.is_finite() && r.is_finite()).collect();
            if rows.len() < 2 {
                continue;
            }
            let colour = series.len();
            let mark = |(t, point): (f64, (f64, f64))| Series {
                name: format!("{} = {}", if self.x.0 == "time" { "t" } else { "step" }, short(t)),
                points: vec![point],
                line: Line::None,
                markers: Markers::Named(Symbol::Circle),
                colour: Some(colour),
            };
            marks.extend(spread(&rows, if self.all.len() == 1 { 5 } else { 2 }).into_iter().map(mark));
            let name = if self.all.len() == 1 { String::new() } else { (*label).to_owned() };
            let points = rows.iter().map(|(_, point)| *point).collect();
            series.push(Series { markers: Markers::None, ..curve(colour, &name, points) });
        }
        let curves = series.len();
        series.extend(marks);
        let y = Axis::linear("its rate dF/dt (dimensionless)");
        let mut picture = self.picture(What::Lissajous, "lissajous", "Free energy and its rate", y, series)?;
        picture.plot.x = Axis::linear("free energy F (dimensionless)");
        (curves > 0).then_some(picture)
    }

    /// Measures that no group has: of a single run those of one kind, such as `defects_plus` and `defects_minus`, in
    /// one picture.
    fn others(&self, drawn: &mut Drawn) {
        let known =
            |column: &str| ASIDE.contains(&column) || GROUPS.iter().any(|group| group.columns.contains(&column));
        let mut columns: Vec<&str> = Vec::new();
        for column in self.all.iter().flat_map(|(_, table, _)| &table.header) {
            if !known(column) && !column.is_empty() && !columns.contains(&column.as_str()) {
                columns.push(column);
            }
        }
        if let [(_, table, _)] = &self.all[..] {
            let kind = |column: &str| column.split_once('_').map(|(kind, _)| kind.to_owned());
            while let Some(&first) = columns.first() {
                let (same, others) =
                    columns.into_iter().partition(|c| *c == first || kind(c).is_some() && kind(c) == kind(first));
                columns = others;
                self.kind(table, &same, &kind(first).unwrap_or_default(), drawn);
            }
            return;
        }
        for column in columns {
            let y = names::axis(column, Scale::Linear);
            let title = names::title(column);
            drawn.pictures.extend(self.picture(What::Measures, &file_name(column), &title, y, self.each(column)));
        }
    }

    fn kind(&self, table: &Table, columns: &[&str], kind: &str, drawn: &mut Drawn) {
        let name = if let [only] = columns { only } else { kind };
        let legend = |column: &str| match columns {
            [_] => String::new(),
            [] | [_, ..] => names::short(column),
        };
        let all = columns.iter().map(|column| (self.points(table, column), legend(column)));
        let some = all.filter(|(points, _)| points.len() > 1).enumerate();
        let series = some.map(|(k, (points, legend))| curve(k, &legend, points)).collect();
        let (title, y) = match columns {
            [only] => (names::title(only), names::axis(only, Scale::Linear)),
            [] | [_, ..] => (names::title(kind), Axis::linear(kind)),
        };
        drawn.pictures.extend(self.picture(What::Measures, &file_name(name), &title, y, series));
    }
}

fn file_name(column: &str) -> String {
    column.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
}

/// Solid in the colour of its number; markers tell curves apart where there are several.
fn curve(number: usize, name: &str, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.to_owned(), points, colour: Some(number), ..Series::default() }
}

/// Rows at equal distances along the curve, both ends included, none next to another.
fn spread(rows: &[(f64, (f64, f64))], count: usize) -> Vec<(f64, (f64, f64))> {
    let extent = |part: fn(&(f64, f64)) -> f64| {
        let values = rows.iter().map(|(_, point)| part(point));
        let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
        if hi > lo { hi - lo } else { 1.0 }
    };
    let (width, height) = (extent(|p| p.0), extent(|p| p.1));
    let distance = |a: (f64, f64), b: (f64, f64)| ((a.0 - b.0) / width).hypot((a.1 - b.1) / height);
    let mut along = vec![0.0];
    for pair in rows.windows(2) {
        along.push(along[along.len() - 1] + distance(pair[0].1, pair[1].1));
    }
    let total = along[along.len() - 1];
    let mut kept: Vec<(f64, (f64, f64))> = Vec::new();
    for k in 0..count {
        let target = total * k as f64 / (count - 1).max(1) as f64;
        let at = along.iter().position(|s| *s >= target * (1.0 - 1e-12)).unwrap_or(rows.len() - 1);
        let row = if k + 1 == count { rows[rows.len() - 1] } else { rows[at] };
        if kept.iter().all(|other| distance(other.1, row.1) > 0.12) {
            kept.push(row);
        }
    }
    kept
}

/// A time with three digits.
fn short(value: f64) -> String {
    let digits = (2.0 - value.abs().max(1e-3).log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_spread_over_the_curve() {
        let rows: Vec<_> = (0..=100).map(|k| (f64::from(k), (f64::from(k), 0.0))).collect();
        let times: Vec<f64> = spread(&rows, 5).iter().map(|row| row.0).collect();
        assert_eq!(times, [0.0, 25.0, 50.0, 75.0, 100.0]);
        let resting: Vec<_> = (0..=100).map(|k| (f64::from(k), (1.0, 1.0))).collect();
        assert_eq!(spread(&resting, 5).len(), 1, "names above each other cannot be read");
    }

    #[test]
    fn times_are_short() {
        assert_eq!([0.0, 12.5, 400.0, 0.0312, 12345.6].map(short), ["0", "12.5", "400", "0.0312", "12346"]);
    }
}
