//! Sections that runs have left: which there are, what they show, and along what.

use super::curves::{CurveSettings, Source};
use super::folder::SectionFile;
use super::{Results, ResultsError, Table};
use crate::measure::fields::{Scalar, Value};
use crate::measure::list::DIMENSIONLESS;
use crate::model::ModelKind;
use crate::scene::renamed::name_now;

/// What is shown along a section.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    /// As on the command line.
    pub name: String,
    /// In pictures.
    pub symbol: String,
    /// One column, or the two whose length is taken.
    columns: Vec<String>,
    /// Behind its symbol along an axis.
    pub unit: &'static str,
    /// Whether it may lie on either side of zero.
    pub signed: bool,
}

/// The kind of sheets whose symbols are written: that of all runs.
pub fn kind_of(runs: &[&Results]) -> ModelKind {
    let weighed = |run: &&Results| run.setting("model.kind").and_then(toml::Value::as_str) == Some("compressible");
    if runs.iter().all(weighed) { ModelKind::Compressible } else { ModelKind::Incompressible }
}

/// Points farther apart than so many times the usual distance lie on both sides of a hole.
pub const GAP: f64 = 1.5;

/// Rows of a section that are drawn: many for each pixel of a picture.
const MOST_ROWS: usize = 20_000;

/// Which way a section runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// Along x₁, at this x₂.
    Horizontal(f64),
    /// Along x₂, at this x₁.
    Vertical(f64),
    /// By the angle, where the table has it.
    Round,
    /// By the distance from its first point.
    Other,
}

/// The table of a section.
pub struct Section {
    /// As it was written.
    pub table: Table,
    /// Which way it runs.
    pub way: Way,
}

impl Quantity {
    /// A scalar of a field, in sheets of this kind; that of a field of one component in words, too.
    fn of(scalar: Scalar, kind: ModelKind) -> Self {
        let symbol = scalar.part.symbol.of(kind);
        let shown = match scalar.field.value {
            Value::Scalar => format!("{} {symbol}", scalar.part.title),
            Value::Vector | Value::Tensor => symbol.to_owned(),
        };
        let columns = scalar.columns().iter().map(|column| (*column).to_owned()).collect();
        Self {
            name: scalar.part.name.to_owned(),
            symbol: shown,
            columns,
            unit: scalar.field.unit,
            signed: scalar.part.signed,
        }
    }

    /// Of the wish, or the usual ones.
    pub fn wanted(wish: &CurveSettings, kind: ModelKind) -> Vec<Self> {
        if wish.quantities.is_empty() {
            let usual = Scalar::all().filter(|scalar| scalar.part.in_curves);
            return usual.map(|scalar| Self::of(scalar, kind)).collect();
        }
        let named = |name: &String| {
            let columns = vec![name.clone()];
            let raw = || Self {
                name: name.clone(),
                symbol: name.replace('_', " "),
                columns,
                unit: DIMENSIONLESS,
                signed: true,
            };
            Scalar::named(&name_now(name).0).map_or_else(raw, |scalar| Self::of(scalar, kind))
        };
        wish.quantities.iter().map(named).collect()
    }

    /// As in names of files.
    pub fn file_name(&self) -> String {
        self.name.replace('_', "-")
    }

    /// Its values in the rows of a section; `None` where the section does not have it.
    pub fn values(&self, table: &Table) -> Option<Vec<f64>> {
        let mut columns = self.columns.iter().map(|name| table.numbers(name)).collect::<Option<Vec<_>>>()?.into_iter();
        let first = columns.next()?;
        Some(match columns.next() {
            Some(second) => first.into_iter().zip(second).map(|(a, b)| a.hypot(b)).collect(),
            None => first,
        })
    }
}

impl Section {
    /// Reads it; of a long one some rows.
    ///
    /// # Errors
    /// A table that cannot be read.
    pub fn read(file: &SectionFile) -> Result<Self, ResultsError> {
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

    /// Where its rows lie, along its way.
    pub fn along(&self) -> Option<Vec<f64>> {
        self.table.numbers(self.way.column())
    }

    /// The pieces between holes.
    pub fn pieces(&self, quantity: &Quantity, wish: &CurveSettings) -> Vec<Vec<(f64, f64)>> {
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
    /// The column that tells where a point lies on it.
    pub fn column(self) -> &'static str {
        match self {
            Way::Horizontal(_) => "x1",
            Way::Vertical(_) => "x2",
            Way::Round => "theta",
            Way::Other => "s",
        }
    }

    /// As along an axis.
    pub fn axis(self, unit: &str) -> String {
        match self {
            Way::Horizontal(_) => format!("x₁ ({unit})"),
            Way::Vertical(_) => format!("x₂ ({unit})"),
            Way::Round => "angle θ from the direction of x₁ (radians)".to_owned(),
            Way::Other => format!("distance along the section ({unit})"),
        }
    }

    /// What changes along it.
    pub fn variable(self) -> &'static str {
        match self {
            Way::Horizontal(_) => "x₁",
            Way::Vertical(_) => "x₂",
            Way::Round => "the angle",
            Way::Other => "their length",
        }
    }

    /// Where it runs.
    pub fn place(self) -> String {
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

/// The names of the cuts that are wanted.
///
/// # Errors
/// [`ResultsError::Option`]: a name that no folder has.
pub fn chosen<'a>(source: &Source<'a>) -> Result<Vec<&'a str>, ResultsError> {
    let Source { runs, wish, .. } = *source;
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
    Ok(names)
}

/// Why a quantity cannot be shown that no section has.
pub fn unknown(quantity: &Quantity, mut columns: Vec<String>) -> ResultsError {
    columns.sort_unstable();
    columns.dedup();
    let known = Scalar::all().map(|scalar| scalar.part.name).collect::<Vec<_>>().join(", ");
    ResultsError::Option {
        option: "--quantity",
        value: quantity.name.clone(),
        rule: "none of the sections has it".to_owned(),
        hint: format!("the quantities are {known}, and the columns {}", columns.join(", ")),
    }
}

/// Unit of lengths: radii where a disc of radius 1 is in the domain.
pub fn unit(runs: &[&Results]) -> String {
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
