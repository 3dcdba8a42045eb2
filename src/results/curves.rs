//! Curves from tables: sections, measures over time, Lissajous figures, measures over a study's parameters.

use std::path::Path;

use super::{Results, ResultsError, ResultsKind, body_curves, history, label, sections, study};
use crate::output::plot::{Plot, PlotError};

/// A kind of curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// Fields along the cuts.
    Sections,
    /// Free energy over time.
    Energy,
    /// `dF/dt` over `F`.
    Lissajous,
    /// Stationary residuals over time.
    Residual,
    /// Overshoots over time.
    Overshoot,
    /// Asymmetries over time.
    Asymmetry,
    /// Terms of the energy law over time.
    Budget,
    /// Length of the steps.
    Step,
    /// Iterations of a step.
    Iterations,
    /// Paths, speeds and angles of rigid bodies.
    Bodies,
    /// Every other measure over time.
    Measures,
    /// Measures of a study over what it varies.
    Study,
}

/// What is to be drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CurveSettings {
    /// Kinds of curves; all that the folders have if empty.
    pub what: Vec<What>,
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
    /// Which curves these are.
    pub what: What,
    /// The picture, to be drawn.
    pub plot: Plot,
}

/// The pictures, and what could not be drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawn {
    /// Those that there was something to show of.
    pub pictures: Vec<Picture>,
    /// What could not be drawn, and why.
    pub notes: Vec<String>,
}

/// Most runs whose curves are drawn into one picture.
pub const MOST_RUNS: usize = 24;

impl What {
    /// Every kind, in the order in which they are drawn.
    pub const ALL: [What; 12] = [
        What::Sections,
        What::Energy,
        What::Lissajous,
        What::Residual,
        What::Overshoot,
        What::Asymmetry,
        What::Budget,
        What::Step,
        What::Iterations,
        What::Bodies,
        What::Measures,
        What::Study,
    ];

    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            What::Sections => "sections",
            What::Energy => "energy",
            What::Lissajous => "lissajous",
            What::Residual => "residual",
            What::Overshoot => "overshoot",
            What::Asymmetry => "asymmetry",
            What::Budget => "budget",
            What::Step => "step",
            What::Iterations => "iterations",
            What::Bodies => "bodies",
            What::Measures => "measures",
            What::Study => "study",
        }
    }

    /// The kind of a name.
    ///
    /// # Errors
    /// [`ResultsError::Option`]: there is none.
    pub fn parse(name: &str) -> Result<Self, ResultsError> {
        Self::ALL.into_iter().find(|what| what.name() == name).ok_or_else(|| ResultsError::Option {
            option: "--what",
            value: name.to_owned(),
            rule: "there are no such curves".to_owned(),
            hint: format!("the kinds are {}", Self::ALL.map(Self::name).join(", ")),
        })
    }

    /// Where nobody asked for them by name.
    fn is_usual(self) -> bool {
        match self {
            What::Sections | What::Energy | What::Lissajous | What::Residual | What::Overshoot => true,
            What::Asymmetry | What::Budget | What::Measures | What::Step | What::Study => true,
            What::Bodies => true,
            What::Iterations => false,
        }
    }

    /// What a folder must have for them.
    fn needs(self) -> &'static str {
        match self {
            What::Sections => "`cuts` in an [[output]] of the scene",
            What::Energy | What::Lissajous => "the measure `free_energy` with `every` in the scene",
            What::Residual => "`time.stop.residual`, [steady] or any measure with `every` in the scene",
            What::Overshoot => "the measure `overshoot` with `every` in the scene",
            What::Asymmetry => "the measure `asymmetry` with `every` in the scene",
            What::Budget => "the measure `energy_budget` with `every` in the scene",
            What::Step | What::Iterations => "a history.csv of two or more steps",
            What::Bodies => "`bodies = true` with `every` in an [[output]] of the scene",
            What::Measures => "measures with `every` in the scene",
            What::Study => "a study with a number that varies and measures",
        }
    }
}

impl CurveSettings {
    /// Whether these curves are drawn, and whether somebody named them.
    pub(super) fn wants(&self, what: What) -> bool {
        if self.what.is_empty() { what.is_usual() } else { self.what.contains(&what) }
    }

    pub(super) fn names(&self, what: What) -> bool {
        self.what.contains(&what)
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
    history::draw(shown, &labels, wish, &mut drawn);
    if wish.wants(What::Sections) {
        sections::draw(shown, &labels, wish, &mut drawn)?;
    }
    if wish.wants(What::Bodies) {
        body_curves::draw(shown, &labels, wish, &mut drawn)?;
    }
    if wish.wants(What::Study) {
        folders.iter().filter(|f| f.kind == ResultsKind::Sweep).for_each(|folder| study::draw(folder, &mut drawn));
    }
    for &what in &wish.what {
        if !drawn.pictures.iter().any(|picture| picture.what == what) {
            return Err(ResultsError::Option {
                option: "--what",
                value: what.name().to_owned(),
                rule: match drawn.notes.first() {
                    Some(note) => format!("there is nothing to draw ({note})"),
                    None => "there is nothing to draw in these folders".to_owned(),
                },
                hint: format!("they need {}", what.needs()),
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
        self.pictures.iter().try_for_each(|picture| picture.plot.write(&folder.join(&picture.name)))
    }
}
