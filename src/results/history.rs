//! Curves over time from `history.csv`, for the plots that show some of its columns.

use super::curves::{CurveSettings, Drawn, Image, Picture};
use super::plots::PlotKind;
use super::{Results, Table, label, names};
use crate::output::plot::{Axis, Line, Markers, Plot, Scale, Series};

/// Columns that belong to one picture.
#[derive(Debug, Clone, Copy)]
pub struct Group {
    /// Name of the picture's files.
    pub file: &'static str,
    /// Its title.
    pub title: &'static str,
    /// Of all the columns together, with its unit.
    pub quantity: &'static str,
    /// Of the vertical axis.
    pub scale: Scale,
    /// The columns, which no other plot shows as measures among others.
    pub columns: &'static [&'static str],
    /// What the first column is, where it stands for all of them.
    pub several: Option<Several>,
}

/// The first column of a group, where it stands for all of them: several runs are compared by it, the others are shown
/// where somebody names the plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Several {
    /// One like the others.
    First,
    /// Their total, which stands dashed above them.
    Total,
}

/// Number of the colour black.
const BLACK: Option<usize> = Some(4);

/// The histories of the runs that have one.
pub struct Histories<'a> {
    all: Vec<(&'a Results, Table, &'a str)>,
    /// Column of the horizontal axis, and its name.
    pub x: (&'static str, &'static str),
    subtitle: String,
    wish: &'a CurveSettings,
}

impl<'a> Histories<'a> {
    /// Reads them; what cannot be read is a note.
    pub fn read(runs: &[&'a Results], labels: &'a [String], wish: &'a CurveSettings, drawn: &mut Drawn) -> Self {
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

    /// The tables, in the order of the runs.
    pub fn tables(&self) -> impl ExactSizeIterator<Item = &Table> {
        self.all.iter().map(|(_, table, _)| table)
    }

    /// The tables with the names of their runs in a legend.
    pub fn labelled(&self) -> impl ExactSizeIterator<Item = (&Table, &str)> {
        self.all.iter().map(|(_, table, label)| (table, *label))
    }

    /// The table of a run, where it has one.
    pub fn of(&self, run: &Results) -> Option<&Table> {
        self.all.iter().find(|(other, ..)| std::ptr::eq(*other, run)).map(|(_, table, _)| table)
    }

    /// The table of the only run, where there is one.
    pub fn only(&self) -> Option<&Table> {
        match &self.all[..] {
            [(_, table, _)] => Some(table),
            [] | [_, ..] => None,
        }
    }

    /// A column over time, inside of the window.
    pub fn points(&self, table: &Table, column: &str) -> Vec<(f64, f64)> {
        self.wish.inside(table.points(self.x.0, column))
    }

    /// One picture for a single run, with all columns; for several runs a picture for each column.
    pub fn group(&self, kind: &'static PlotKind, group: &Group, drawn: &mut Drawn) {
        match self.only() {
            Some(table) => drawn.pictures.extend(self.together(kind, group, table)),
            None => self.column_by_column(kind, group, drawn),
        }
    }

    fn together(&self, kind: &'static PlotKind, group: &Group, table: &Table) -> Option<Picture> {
        let named = group.columns.iter().map(|column| (self.points(table, column), names::short(column)));
        let series = named.filter(|(points, _)| points.len() > 1).enumerate();
        let mut series: Vec<Series> = series.map(|(k, (points, name))| curve(k, &name, points)).collect();
        if group.columns.len() == 1 {
            // the axis names it
            series.iter_mut().for_each(|series| series.name.clear());
        }
        if group.several == Some(Several::Total) && series.len() > 1 {
            // the largest part hides it, or it hides that
            let total = series.remove(0);
            series.push(Series { line: Line::Dashed, markers: Markers::None, colour: BLACK, ..total });
        }
        let y = Axis { label: group.quantity.to_owned(), scale: group.scale };
        self.picture(kind, (group.file, group.title), [self.time(), y], series)
    }

    fn column_by_column(&self, kind: &'static PlotKind, group: &Group, drawn: &mut Drawn) {
        let usual = if group.several.is_some() && !self.wish.names(kind) { 1 } else { usize::MAX };
        for (k, column) in group.columns.iter().enumerate().take(usual) {
            let name = names::short(column);
            let alone = group.columns.len() == 1 || k == 0 && group.several == Some(Several::Total);
            let file = match (alone, name.is_ascii()) {
                (true, _) => group.file.to_owned(),
                (false, true) => format!("{}-{}", group.file, name.replace([' ', '/'], "-")),
                (false, false) => file_name(column),
            };
            let title = if alone { group.title.to_owned() } else { format!("{}: {name}", group.title) };
            let y = names::axis(column, group.scale);
            drawn.pictures.extend(self.picture(kind, (&file, &title), [self.time(), y], self.each(column)));
        }
    }

    /// A column of every run.
    pub fn each(&self, column: &str) -> Vec<Series> {
        let all = self.labelled().map(|(table, label)| (self.points(table, column), label));
        all.filter(|(points, _)| points.len() > 1)
            .enumerate()
            .map(|(k, (points, name))| curve(k, name, points))
            .collect()
    }

    /// The horizontal axis of pictures over time.
    pub fn time(&self) -> Axis {
        Axis::linear(self.x.1)
    }

    /// A picture with the name of its files and its title; none without curves.
    pub fn picture(
        &self,
        kind: &'static PlotKind,
        (file, title): (&str, &str),
        [x, y]: [Axis; 2],
        series: Vec<Series>,
    ) -> Option<Picture> {
        if series.is_empty() {
            return None;
        }
        let (title, subtitle) = (title.to_owned(), self.subtitle.clone());
        let plot = Plot { title, subtitle, x, y, series, slopes: Vec::new() };
        Some(Picture { name: file.to_owned(), kind, image: Image::Curves(plot) })
    }
}

/// A column as in names of files.
pub fn file_name(column: &str) -> String {
    column.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
}

/// Solid in the colour of its number; markers tell curves apart where there are several.
pub fn curve(number: usize, name: &str, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.to_owned(), points, colour: Some(number), ..Series::default() }
}
