//! Curves from sections.

use super::{Draw, PlotKind, When};
use crate::output::plot::{Axis, Line, Markers, Plot, Series};
use crate::results::curves::{CurveSettings, Drawn, Image, Picture, Source};
use crate::results::sections::{Quantity, Section, Way, chosen, kind_of, unit, unknown};
use crate::results::{Results, ResultsError, label};

/// Quantities along the cuts.
pub const SECTIONS: PlotKind = PlotKind {
    name: "sections",
    help: "a quantity along the cuts, broken where an obstacle is",
    needs: "`cuts` in an [[output]] of the scene",
    when: When::Always,
    draw: Draw::With(draw),
};

fn draw(kind: &'static PlotKind, source: &Source, drawn: &mut Drawn) -> Result<(), ResultsError> {
    let Source { runs, labels, wish, .. } = *source;
    let names = chosen(source)?;
    let quantities = Quantity::wanted(wish, kind_of(runs));
    let mut columns: Vec<String> = Vec::new();
    let sections: Vec<(usize, &str, Section)> = names
        .iter()
        .flat_map(|name| runs.iter().enumerate().map(move |(k, run)| (k, *name, *run)))
        .filter_map(|(k, name, run)| Some((k, name, read_latest(run, name, &mut columns, drawn)?)))
        .collect();
    let sheet = Sheet { kind, runs, labels, wish, sections: &sections, unit: unit(runs) };
    for quantity in &quantities {
        let exists = sections.iter().any(|(.., section)| quantity.values(&section.table).is_some());
        if !exists && !wish.quantities.is_empty() && !sections.is_empty() {
            return Err(unknown(quantity, columns));
        }
        drawn.pictures.extend(if runs.len() == 1 { sheet.by_way(quantity) } else { sheet.by_name(&names, quantity) });
    }
    Ok(())
}

/// The last state's section; of a run that has not ended the latest there is.
fn read_latest(run: &Results, name: &str, columns: &mut Vec<String>, drawn: &mut Drawn) -> Option<Section> {
    let named = run.sections.iter().filter(|section| section.name == name);
    let file = named.max_by_key(|section| section.step.map_or(usize::MAX, |step| step))?;
    if let Some(step) = file.step {
        drawn.notes.push(format!("{}: {name} is that of step {step}, not of the last state", run.name));
    }
    match Section::read(file) {
        Ok(section) => {
            columns.extend(section.table.header.iter().cloned());
            Some(section)
        }
        Err(error) => {
            drawn.notes.push(error.to_string());
            None
        }
    }
}

struct Sheet<'a> {
    kind: &'static PlotKind,
    runs: &'a [&'a Results],
    labels: &'a [String],
    wish: &'a CurveSettings,
    sections: &'a [(usize, &'a str, Section)],
    unit: String,
}

impl Sheet<'_> {
    /// Of a single run: the sections of one direction in one picture.
    fn by_way(&self, quantity: &Quantity) -> Vec<Picture> {
        let mut pictures = Vec::new();
        let ways = [("along-x1", Way::Horizontal(0.0)), ("along-x2", Way::Vertical(0.0))];
        for (name, way) in ways {
            let same = |section: &&(usize, &str, Section)| section.2.way.column() == way.column();
            let all: Vec<_> = self.sections.iter().filter(same).collect();
            let label = |(_, name, section): &(usize, &str, Section)| {
                format!("{}, {}", name.replace('-', " "), section.way.place())
            };
            let series = all.iter().enumerate().flat_map(|(k, s)| self.series(k, &label(s), &s.2, quantity)).collect();
            let file = match &all[..] {
                [only] => format!("section-{}-{}", only.1, quantity.file_name()),
                [] | [_, ..] => format!("sections-{name}-{}", quantity.file_name()),
            };
            let title = match &all[..] {
                [only] => format!("{} on {}", quantity.symbol, label(only)),
                [] | [_, ..] => format!("{} on sections along {}", quantity.symbol, way.variable()),
            };
            pictures.extend(self.picture(file, title, way, quantity, series));
        }
        for (_, name, section) in self.sections.iter().filter(|s| matches!(s.2.way, Way::Round | Way::Other)) {
            let series = self.series(0, "", section, quantity);
            let title = format!("{} on {}", quantity.symbol, name.replace('-', " "));
            let file = format!("section-{name}-{}", quantity.file_name());
            pictures.extend(self.picture(file, title, section.way, quantity, series));
        }
        pictures
    }

    /// Of several runs: every section in a picture of its own.
    fn by_name(&self, names: &[&str], quantity: &Quantity) -> Vec<Picture> {
        let picture = |name: &&str| {
            let all: Vec<_> = self.sections.iter().filter(|section| section.1 == *name).collect();
            let way = all.first()?.2.way;
            let label = |run: usize| self.labels.get(run).map_or("", String::as_str);
            let series = all.iter().flat_map(|s| self.series(s.0, label(s.0), &s.2, quantity)).collect();
            let place = way.place();
            let place = if place.is_empty() { place } else { format!(" ({place})") };
            let title = format!("{} on {}{place}", quantity.symbol, name.replace('-', " "));
            self.picture(format!("section-{name}-{}", quantity.file_name()), title, way, quantity, series)
        };
        names.iter().filter_map(picture).collect()
    }

    fn series(&self, number: usize, name: &str, section: &Section, quantity: &Quantity) -> Vec<Series> {
        let piece = |points| Series {
            name: name.to_owned(),
            points,
            line: Line::Auto,
            markers: Markers::Auto,
            colour: Some(number),
        };
        section.pieces(quantity, self.wish).into_iter().map(piece).collect()
    }

    fn picture(
        &self,
        name: String,
        title: String,
        way: Way,
        quantity: &Quantity,
        mut series: Vec<Series>,
    ) -> Option<Picture> {
        if series.is_empty() {
            return None;
        }
        if self.sections.len() == 1 {
            series.iter_mut().for_each(|series| series.name.clear());
        }
        let y = Axis::linear(format!("{} ({})", quantity.symbol, quantity.unit));
        let (x, subtitle) = (Axis::linear(way.axis(&self.unit)), label::common(self.runs));
        let plot = Plot { title, subtitle, x, y, series, slopes: Vec::new() };
        Some(Picture { name, kind: self.kind, image: Image::Curves(plot) })
    }
}
