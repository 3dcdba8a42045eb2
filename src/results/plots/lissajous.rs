//! The free energy and its rate: a figure that closes where the tissue oscillates.

use super::{Draw, PlotKind, When};
use crate::output::plot::{Axis, Line, Markers, Series, Symbol};
use crate::results::curves::{Drawn, Source};
use crate::results::history::curve;

/// `dF/dt` over `F`.
pub const LISSAJOUS: PlotKind = PlotKind {
    name: "lissajous",
    help: "`dF/dt` over `F`, with times beside the curve",
    needs: "the measure `free_energy` with `every` in the scene",
    when: When::Always,
    draw: Draw::With(|kind, source, drawn| {
        draw(kind, source, drawn);
        Ok(())
    }),
};

/// Rate over value of the free energy, with times beside the curve.
fn draw(kind: &'static PlotKind, source: &Source, drawn: &mut Drawn) {
    let histories = source.histories(drawn);
    let (mut series, mut marks) = (Vec::new(), Vec::new());
    let count = histories.tables().len();
    for (table, label) in histories.labelled() {
        let columns = [histories.x.0, "free_energy", "free_energy_rate"].map(|name| table.numbers(name));
        let [Some(x), Some(energy), Some(rate)] = columns else { continue };
        let rows = x.into_iter().zip(energy.into_iter().zip(rate));
        let inside = |t: f64| source.wish.window.is_none_or(|[lo, hi]| (lo..=hi).contains(&t));
        let rows: Vec<(f64, (f64, f64))> =
            rows.filter(|(t, (f, r))| inside(*t) && f.is_finite() && r.is_finite()).collect();
        if rows.len() < 2 {
            continue;
        }
        let colour = series.len();
        let mark = |(t, point): (f64, (f64, f64))| Series {
            name: format!("{} = {}", if histories.x.0 == "time" { "t" } else { "step" }, short(t)),
            points: vec![point],
            line: Line::None,
            markers: Markers::Named(Symbol::Circle),
            colour: Some(colour),
        };
        marks.extend(spread(&rows, if count == 1 { 5 } else { 2 }).into_iter().map(mark));
        let name = if count == 1 { "" } else { label };
        let points = rows.iter().map(|(_, point)| *point).collect();
        series.push(Series { markers: Markers::None, ..curve(colour, name, points) });
    }
    series.extend(marks);
    let axes = ["free energy F (dimensionless)", "its rate dF/dt (dimensionless)"].map(Axis::linear);
    drawn.pictures.extend(histories.picture(kind, ("lissajous", "Free energy and its rate"), axes, series));
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
