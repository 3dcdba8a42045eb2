//! Space–time pictures: what becomes of a quantity along a cut.

use super::{Draw, PlotKind, When};
use crate::output::plot::grid::Grid;
use crate::results::curves::{CurveSettings, Drawn, Image, Picture, Source};
use crate::results::sections::{GAP, Quantity, Section, chosen, kind_of, unit, unknown};
use crate::results::{Results, ResultsError, label};

/// A quantity along a cut over time, as colours.
pub const KYMOGRAPH: PlotKind = PlotKind {
    name: "kymograph",
    help: "a quantity along a cut over time, as colours",
    needs: "`cuts` with `every` in an [[output]] of the scene",
    when: When::Named,
    draw: Draw::With(draw),
};

/// Most times of a picture, about as many as it has pixels.
const MOST: usize = 800;

/// A cut at the times at which it was written, ascending; all have the same points.
struct Course<'a> {
    run: &'a Results,
    /// The run in a legend; empty where it is the only one.
    entry: &'a str,
    cut: &'a str,
    sections: Vec<(f64, Section)>,
}

fn draw(kind: &'static PlotKind, source: &Source, drawn: &mut Drawn) -> Result<(), ResultsError> {
    let quantities = Quantity::wanted(source.wish, kind_of(source.runs));
    let mut courses = Vec::new();
    for cut in chosen(source)? {
        for (run, entry) in source.runs.iter().zip(source.labels) {
            let sections = read(run, cut, source, drawn);
            let entry = if source.runs.len() > 1 { entry } else { "" };
            courses.extend((sections.len() > 1).then_some(Course { run, entry, cut, sections }));
        }
    }
    for quantity in &quantities {
        let before = drawn.pictures.len();
        let axes = [unit(source.runs), source.histories(drawn).x.1.to_owned()];
        let pictures = courses.iter().filter_map(|course| course.picture(kind, quantity, &axes, source.wish));
        drawn.pictures.extend(pictures);
        if drawn.pictures.len() == before && !source.wish.quantities.is_empty() && !courses.is_empty() {
            let headers = courses.iter().flat_map(|course| course.sections[0].1.table.header.clone());
            return Err(unknown(quantity, headers.collect()));
        }
    }
    Ok(())
}

/// A cut of a run at all times, or at some of many.
fn read(run: &Results, cut: &str, source: &Source, drawn: &mut Drawn) -> Vec<(f64, Section)> {
    let histories = source.histories(drawn);
    let table = histories.of(run);
    let Some((steps, times)) = table.and_then(|table| table.numbers("step").zip(table.numbers(histories.x.0))) else {
        return Vec::new();
    };
    // the last state's section belongs to the last row
    let row = |step: Option<usize>| match step {
        Some(step) => steps.iter().position(|one| *one == step as f64),
        None => steps.len().checked_sub(1),
    };
    let named = run.sections.iter().filter(|file| file.name == cut);
    let mut files: Vec<_> = named.filter_map(|file| Some((times[row(file.step)?], file))).collect();
    files.sort_by(|a, b| a.0.total_cmp(&b.0));
    files.dedup_by_key(|(time, _)| *time);
    let stride = files.len().div_ceil(MOST).max(1);
    let mut sections: Vec<(f64, Section)> = Vec::new();
    for (time, file) in files.into_iter().step_by(stride) {
        match Section::read(file) {
            Ok(section) if sections.first().is_none_or(|(_, first)| first.along() == section.along()) => {
                sections.push((time, section));
            }
            Ok(_) => drawn.notes.push(format!("{}: {cut} has other points at t = {time}: left out", run.name)),
            Err(error) => drawn.notes.push(error.to_string()),
        }
    }
    sections
}

impl Course<'_> {
    /// Its picture; `unit` is that of lengths, `time` names the vertical axis.
    fn picture(
        &self,
        kind: &'static PlotKind,
        quantity: &Quantity,
        [unit, time]: &[String; 2],
        wish: &CurveSettings,
    ) -> Option<Picture> {
        let columns = self.columns(wish);
        let rows: Option<Vec<Vec<f64>>> =
            self.sections.iter().map(|(_, section)| quantity.values(&section.table)).collect();
        let row = |row: &Vec<f64>| columns.iter().map(|(_, k)| k.map_or(f64::NAN, |k| row[k])).collect::<Vec<_>>();
        let values: Vec<f64> = rows?.iter().flat_map(row).collect();
        if columns.len() < 2 || !values.iter().any(|value| value.is_finite()) {
            return None;
        }
        let (way, cut) = (self.sections[0].1.way, self.cut.replace('-', " "));
        let place = way.place();
        let place = if place.is_empty() { place } else { format!(" ({place})") };
        let told = [self.entry.to_owned(), label::common(&[self.run])];
        let grid = Grid {
            title: format!("{} on {cut}{place} over time", quantity.symbol),
            subtitle: told.into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>().join("; "),
            axes: [way.axis(unit), time.clone()],
            x: columns.iter().map(|(x, _)| *x).collect(),
            y: self.sections.iter().map(|(time, _)| *time).collect(),
            values,
            name: quantity.symbol.clone(),
            signed: quantity.signed,
        };
        let run = if self.entry.is_empty() { String::new() } else { format!("-{}", self.run.name) };
        let name = format!("kymograph-{}-{}{run}", self.cut, quantity.file_name());
        Some(Picture { name, kind, image: Image::Colours(grid) })
    }

    /// The points along the cut inside of the window, ascending, with their rows in a table; in a hole stands a point
    /// without a row.
    fn columns(&self, wish: &CurveSettings) -> Vec<(f64, Option<usize>)> {
        let along = self.sections[0].1.along().unwrap_or_default();
        let inside = |x: &f64| x.is_finite() && wish.window.is_none_or(|[lo, hi]| (lo..=hi).contains(x));
        let mut points: Vec<(f64, Option<usize>)> =
            along.iter().copied().enumerate().filter(|(_, x)| inside(x)).map(|(k, x)| (x, Some(k))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points.dedup_by_key(|(x, _)| *x);
        let mut distances: Vec<f64> = points.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
        distances.sort_by(f64::total_cmp);
        let usual = distances.get(distances.len() / 2).copied().unwrap_or(0.0);
        let holes = points.windows(2).filter(|pair| pair[1].0 - pair[0].0 > GAP * usual);
        let holes: Vec<_> = holes.map(|pair| ((pair[0].0 + pair[1].0) / 2.0, None)).collect();
        points.extend(holes);
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    }
}
