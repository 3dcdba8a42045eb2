//! Curves from sections.

use super::curves::{CurveSettings, Drawn, Picture, What};
use super::folder::SectionFile;
use super::{Results, ResultsError, Table, label};
use crate::output::plot::{Axis, Line, Markers, Plot, Series};
use crate::scene::renamed::name_now;

/// What is shown along a section.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Quantity {
    /// As on the command line.
    name: String,
    symbol: String,
    /// One column, or the two whose length is taken.
    columns: Vec<String>,
}

/// Name, symbol, columns, and whether it is drawn without being asked for.
const KNOWN: [(&str, &str, &[&str], bool); 11] = [
    ("velocity_1", "v₁", &["v1"], true),
    ("velocity_2", "v₂", &["v2"], false),
    ("speed", "|v|", &["v1", "v2"], false),
    ("pressure", "pressure Π", &["pressure"], true),
    ("polarity_1", "p₁", &["p1"], true),
    ("polarity_2", "p₂", &["p2"], false),
    ("polarity", "|p|", &["p1", "p2"], false),
    ("density", "density ρ", &["density"], true),
    ("polarity_laplacian_1", "κ²Δₕp₁", &["laplacian1"], false),
    ("polarity_laplacian_2", "κ²Δₕp₂", &["laplacian2"], false),
    ("polarity_laplacian", "|κ²Δₕp|", &["laplacian1", "laplacian2"], false),
];

/// Points farther apart than so many times the usual distance lie on both sides of a hole.
const GAP: f64 = 1.5;

/// Rows of a section that are drawn: many for each pixel of a picture.
const MOST_ROWS: usize = 20_000;

/// Which way a section runs.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// Along x₁, at this x₂.
    Horizontal(f64),
    /// Along x₂, at this x₁.
    Vertical(f64),
    /// By the angle, where the table has it.
    Round,
    /// By the distance from its first point.
    Other,
}

struct Section {
    table: Table,
    way: Way,
}

impl Quantity {
    fn known((name, symbol, columns, _): &(&str, &str, &[&str], bool)) -> Self {
        let columns = columns.iter().map(|column| (*column).to_owned()).collect();
        Self { name: (*name).to_owned(), symbol: (*symbol).to_owned(), columns }
    }

    /// Of the wish, or the usual ones.
    fn wanted(wish: &CurveSettings) -> Vec<Self> {
        if wish.quantities.is_empty() {
            return KNOWN.iter().filter(|known| known.3).map(Self::known).collect();
        }
        let named = |name: &String| {
            let now = &name_now(name).0;
            let raw = || Self { name: name.clone(), symbol: name.replace('_', " "), columns: vec![name.clone()] };
            KNOWN.iter().find(|known| known.0 == now).map_or_else(raw, Self::known)
        };
        wish.quantities.iter().map(named).collect()
    }

    /// As in names of files.
    fn file_name(&self) -> String {
        self.name.replace('_', "-")
    }

    fn values(&self, table: &Table) -> Option<Vec<f64>> {
        let mut columns = self.columns.iter().map(|name| table.numbers(name)).collect::<Option<Vec<_>>>()?.into_iter();
        let first = columns.next()?;
        Some(match columns.next() {
            Some(second) => first.into_iter().zip(second).map(|(a, b)| a.hypot(b)).collect(),
            None => first,
        })
    }
}

impl Section {
    fn read(file: &SectionFile) -> Result<Self, ResultsError> {
        let table = Table::read_some(&file.path, MOST_ROWS)?;
        let columns = [table.numbers("x1"), table.numbers("x2")];
        let spread = |values: &[f64]| {
            let (lo, hi) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
            (hi - lo, (lo + hi) / 2.0)
        };
        let way = match &columns {
            [Some(x), Some(y)] => {
                let ((dx, x0), (dy, y0)) = (spread(x), spread(y));
                match () {
                    () if dy <= 1e-9 * dx => Way::Horizontal(y0),
                    () if dx <= 1e-9 * dy => Way::Vertical(x0),
                    () if table.position("theta").is_some() => Way::Round,
                    () => Way::Other,
                }
            }
            [Some(_) | None, Some(_) | None] => Way::Other,
        };
        Ok(Self { table, way })
    }

    fn along(&self) -> Option<Vec<f64>> {
        self.table.numbers(self.way.column())
    }

    /// The pieces between holes.
    fn pieces(&self, quantity: &Quantity, wish: &CurveSettings) -> Vec<Vec<(f64, f64)>> {
        let (Some(x), Some(y)) = (self.along(), quantity.values(&self.table)) else { return Vec::new() };
        let points = wish.inside(x.into_iter().zip(y).collect());
        let mut distances: Vec<f64> = points.windows(2).map(|p| (p[1].0 - p[0].0).abs()).collect();
        distances.sort_by(f64::total_cmp);
        let usual = distances.get(distances.len() / 2).copied().unwrap_or(0.0);
        let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
        let mut last: Option<f64> = None;
        for point in points {
            let finite = point.0.is_finite() && point.1.is_finite();
            let joined = last.is_some_and(|x| (point.0 - x).abs() <= GAP * usual);
            last = finite.then_some(point.0);
            match pieces.last_mut() {
                Some(piece) if joined && finite => piece.push(point),
                Some(_) | None if finite => pieces.push(vec![point]),
                Some(_) | None => {}
            }
        }
        pieces
    }
}

impl Way {
    fn column(self) -> &'static str {
        match self {
            Way::Horizontal(_) => "x1",
            Way::Vertical(_) => "x2",
            Way::Round => "theta",
            Way::Other => "s",
        }
    }

    fn axis(self, unit: &str) -> String {
        match self {
            Way::Horizontal(_) => format!("x₁ ({unit})"),
            Way::Vertical(_) => format!("x₂ ({unit})"),
            Way::Round => "angle θ from the direction of x₁ (radians)".to_owned(),
            Way::Other => format!("distance along the section ({unit})"),
        }
    }

    fn variable(self) -> &'static str {
        match self {
            Way::Horizontal(_) => "x₁",
            Way::Vertical(_) => "x₂",
            Way::Round => "the angle",
            Way::Other => "their length",
        }
    }

    /// Where it runs.
    fn place(self) -> String {
        match self {
            Way::Horizontal(y) => format!("x₂ = {}", rounded(y)),
            Way::Vertical(x) => format!("x₁ = {}", rounded(x)),
            Way::Round | Way::Other => String::new(),
        }
    }
}

/// A place with at most four decimals, without the rounding of sums.
fn rounded(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.replace('-', "−") }
}

pub(super) fn draw(
    runs: &[&Results],
    labels: &[String],
    wish: &CurveSettings,
    drawn: &mut Drawn,
) -> Result<(), ResultsError> {
    let mut names: Vec<&str> = runs.iter().flat_map(|r| r.sections.iter().map(|s| s.name.as_str())).collect();
    names.sort_unstable();
    names.dedup();
    if let Some(axis) = wish.axes.iter().find(|axis| !names.contains(&axis.as_str())) {
        let hint = if names.is_empty() {
            "the scene has no `cuts` in an [[output]]".to_owned()
        } else {
            format!("the cuts are {}", names.join(", "))
        };
        let rule = "none of the folders has this cut".to_owned();
        return Err(ResultsError::Option { option: "--axis", value: axis.clone(), rule, hint });
    }
    names.retain(|name| wish.axes.is_empty() || wish.axes.iter().any(|axis| axis == name));
    let quantities = Quantity::wanted(wish);
    let mut columns: Vec<String> = Vec::new();
    let sections: Vec<(usize, &str, Section)> = names
        .iter()
        .flat_map(|name| runs.iter().enumerate().map(move |(k, run)| (k, *name, *run)))
        .filter_map(|(k, name, run)| Some((k, name, read_latest(run, name, &mut columns, drawn)?)))
        .collect();
    let sheet = Sheet { runs, labels, wish, sections: &sections, unit: unit(runs) };
    for quantity in &quantities {
        let exists = sections.iter().any(|(.., section)| quantity.values(&section.table).is_some());
        if !exists && !wish.quantities.is_empty() && !sections.is_empty() {
            return Err(unknown(quantity, columns));
        }
        drawn.pictures.extend(if runs.len() == 1 { sheet.by_way(quantity) } else { sheet.by_name(&names, quantity) });
    }
    Ok(())
}

fn unknown(quantity: &Quantity, mut columns: Vec<String>) -> ResultsError {
    columns.sort_unstable();
    columns.dedup();
    let known = KNOWN.map(|known| known.0).join(", ");
    ResultsError::Option {
        option: "--quantity",
        value: quantity.name.clone(),
        rule: "none of the sections has it".to_owned(),
        hint: format!("the quantities are {known}, and the columns {}", columns.join(", ")),
    }
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

/// Unit of lengths: radii where a disc of radius 1 is in the domain.
fn unit(runs: &[&Results]) -> String {
    let scenes: Vec<_> = runs.iter().filter(|run| run.scene.is_some()).collect();
    let number = |value: &toml::Value| value.as_float().or(value.as_integer().map(|n| n as f64));
    let in_radii = |run: &&&Results| {
        let shape = run.setting("mesh.shape").and_then(toml::Value::as_str);
        let around = matches!(shape, Some("strip-with-disc" | "racetrack"))
            || run.scene.as_ref().is_some_and(|s| s.get("boundary").is_some_and(|b| b.get("disc").is_some()));
        around && run.setting("mesh.radius").and_then(number).is_none_or(|radius| radius == 1.0)
    };
    let all = !scenes.is_empty() && scenes.iter().all(in_radii);
    (if all { "disc radii" } else { "dimensionless" }).to_owned()
}

struct Sheet<'a> {
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
        let y = Axis::linear(format!("{} (dimensionless)", quantity.symbol));
        let (x, subtitle) = (Axis::linear(way.axis(&self.unit)), label::common(self.runs));
        let plot = Plot { title, subtitle, x, y, series, slopes: Vec::new() };
        Some(Picture { name, what: What::Sections, plot })
    }
}
