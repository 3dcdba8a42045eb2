//! Curves from tables: sections, measures over time, Lissajous figures, measures over a study's parameters.

use std::cell::OnceCell;
use std::path::Path;

use super::history::Histories;
use super::plots::{ALL, PlotKind, When};
use super::{Results, ResultsError, label};
use crate::output::plot::grid::Grid;
use crate::output::plot::{Plot, PlotError};

/// What is to be drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CurveSettings {
    /// The plots; all that the folders have if empty.
    pub what: Vec<&'static PlotKind>,
    /// Quantities of sections, such as `velocity_1`, or columns of their tables; the usual ones if empty.
    pub quantities: Vec<String>,
    /// Names of cuts; all if empty.
    pub axes: Vec<String>,
    /// Names of rigid bodies; the first ones that move if empty.
    pub bodies: Vec<String>,
    /// The part of the horizontal axis that is shown.
    pub window: Option<[f64; 2]>,
    /// Legend entries of the runs, in their order; those that are missing follow from what differs.
    pub labels: Vec<String>,
}

/// A picture and the name of its files.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Without ending.
    pub name: String,
    /// Which plot it belongs to.
    pub kind: &'static PlotKind,
    /// The picture, to be drawn.
    pub image: Image,
}

/// What a picture shows.
#[derive(Debug, Clone, PartialEq)]
pub enum Image {
    /// Curves and points.
    Curves(Plot),
    /// Colours over two axes.
    Colours(Grid),
}

impl Image {
    /// Its title line.
    pub fn title(&self) -> &str {
        match self {
            Image::Curves(plot) => &plot.title,
            Image::Colours(grid) => &grid.title,
        }
    }

    /// Its curves, if it has some.
    pub fn curves(&self) -> Option<&Plot> {
        match self {
            Image::Curves(plot) => Some(plot),
            Image::Colours(_) => None,
        }
    }

    /// Draws it as an SVG document.
    ///
    /// # Errors
    /// As [`Plot::svg`] and [`Grid::draw`].
    pub fn svg(&self) -> Result<String, PlotError> {
        match self {
            Image::Curves(plot) => plot.svg(),
            Image::Colours(grid) => Ok(grid.draw()?.svg()),
        }
    }

    /// Draws it as the bytes of a PNG file.
    ///
    /// # Errors
    /// As [`Plot::png`] and [`Grid::draw`].
    pub fn png(&self) -> Result<Vec<u8>, PlotError> {
        match self {
            Image::Curves(plot) => plot.png(),
            Image::Colours(grid) => grid.draw()?.png(),
        }
    }

    /// Writes `<path>.svg` and `<path>.png`.
    ///
    /// # Errors
    /// As [`Plot::write`] and [`Grid::draw`].
    pub fn write(&self, path_without_extension: &Path) -> Result<(), PlotError> {
        match self {
            Image::Curves(plot) => plot.write(path_without_extension),
            Image::Colours(grid) => grid.draw()?.write(path_without_extension),
        }
    }
}

/// The pictures, and what could not be drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawn {
    /// Those that there was something to show of.
    pub pictures: Vec<Picture>,
    /// What could not be drawn, and why.
    pub notes: Vec<String>,
}

/// What plots are drawn of.
pub struct Source<'a> {
    /// The folders that were named.
    pub folders: &'a [&'a Results],
    /// The runs in them that a picture shows.
    pub runs: &'a [&'a Results],
    /// Their entries in a legend.
    pub labels: &'a [String],
    /// What is to be drawn.
    pub wish: &'a CurveSettings,
    histories: OnceCell<Histories<'a>>,
}

impl<'a> Source<'a> {
    /// The histories of the runs, read when they are first needed; what cannot be read is a note.
    pub fn histories(&self, drawn: &mut Drawn) -> &Histories<'a> {
        self.histories.get_or_init(|| Histories::read(self.runs, self.labels, self.wish, drawn))
    }
}

/// Most runs whose curves are drawn into one picture.
pub const MOST_RUNS: usize = 24;

impl CurveSettings {
    /// Whether a plot is drawn.
    fn wants(&self, kind: &PlotKind) -> bool {
        if self.what.is_empty() { kind.when != When::Named } else { self.names(kind) }
    }

    /// Whether somebody named it.
    pub(super) fn names(&self, kind: &PlotKind) -> bool {
        self.what.iter().any(|what| **what == *kind)
    }

    /// The points inside the window.
    pub(super) fn inside(&self, points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
        let Some([lo, hi]) = self.window else { return points };
        points.into_iter().filter(|(x, _)| (lo..=hi).contains(x)).collect()
    }

    fn check(&self, runs: usize) -> Result<(), ResultsError> {
        if let Some([lo, hi]) = self.window
            && lo.partial_cmp(&hi) != Some(std::cmp::Ordering::Less)
        {
            return Err(ResultsError::Option {
                option: "--window",
                value: format!("{lo},{hi}"),
                rule: "the first number must be below the second".to_owned(),
                hint: "write `--window -5,5`, in units of the horizontal axis".to_owned(),
            });
        }
        if self.labels.len() > runs {
            return Err(ResultsError::Option {
                option: "--label",
                value: self.labels[runs].clone(),
                rule: format!("there are {} labels for {runs} runs", self.labels.len()),
                hint: "give at most one for each run, in the order of the folders".to_owned(),
            });
        }
        Ok(())
    }
}

/// Draws what the folders have, several runs in one picture. The runs of a study count as runs; a study of its own has
/// the curves of its table beside.
///
/// # Errors
/// [`ResultsError::Option`]: a wish that makes no sense, or that no folder can meet. What one of several folders lacks
/// is a note.
pub fn curves(folders: &[&Results], wish: &CurveSettings) -> Result<Drawn, ResultsError> {
    let runs: Vec<&Results> = folders.iter().flat_map(|folder| folder.runs()).collect();
    wish.check(runs.len())?;
    let mut drawn = Drawn::default();
    let shown = &runs[..runs.len().min(MOST_RUNS)];
    if shown.len() < runs.len() {
        let left_out = runs.len() - shown.len();
        drawn.notes.push(format!("{left_out} of {} runs are left out: a picture shows {MOST_RUNS}", runs.len()));
    }
    let labels = label::labels(shown, &wish.labels);
    let source = Source { folders, runs: shown, labels: &labels, wish, histories: OnceCell::new() };
    ALL.iter().filter(|kind| wish.wants(kind)).try_for_each(|kind| kind.draw(&source, &mut drawn))?;
    for &what in &wish.what {
        if !drawn.pictures.iter().any(|picture| picture.kind == what) {
            return Err(ResultsError::Option {
                option: "--what",
                value: what.name.to_owned(),
                rule: match drawn.notes.first() {
                    Some(note) => format!("there is nothing to draw ({note})"),
                    None => "there is nothing to draw in these folders".to_owned(),
                },
                hint: format!("they need {}", what.needs),
            });
        }
    }
    Ok(drawn)
}

/// Draws the curves of a run into its `plots/` and says what could not be drawn; without measures or cuts nothing is
/// written.
pub fn write_usual(folder: &Path) -> Vec<String> {
    let told = |what: String| format!("note: curves: {what}");
    let drawn = Results::read(folder).and_then(|results| curves(&[&results], &CurveSettings::default()));
    match drawn {
        Ok(drawn) => {
            let written = drawn.write(&folder.join("plots"));
            drawn.notes.into_iter().chain(written.err().map(|e| e.to_string())).map(told).collect()
        }
        Err(error) => vec![told(error.to_string())],
    }
}

impl Drawn {
    /// Writes `NAME.svg` and `NAME.png` of every picture; the folder is made when there is one.
    ///
    /// # Errors
    /// A picture that cannot be drawn or written, or that would replace a file that is not ours.
    pub fn write(&self, folder: &Path) -> Result<(), PlotError> {
        if self.pictures.is_empty() {
            return Ok(());
        }
        std::fs::create_dir_all(folder).map_err(|source| PlotError::Write { path: folder.to_owned(), source })?;
        self.pictures.iter().try_for_each(|picture| picture.image.write(&folder.join(&picture.name)))
    }
}
