//! The plots of results, each said once: its name, what it shows, what a folder must have for it, and how it is drawn.
//!
//! A new one is a constant in a file of its own and its name in [`ALL`]. From the list follow what `monolayer plot`
//! takes and tells, the pictures of runs and reports, and a table in `docs/report.md` that a test compares.

mod asymmetry;
mod bodies;
mod budget;
mod energy;
mod iterations;
mod kymograph;
mod lissajous;
mod measures;
mod overshoot;
mod residual;
mod sections;
mod step;
mod study;

use std::fmt;

pub use self::asymmetry::ASYMMETRY;
pub use self::bodies::BODIES;
pub use self::budget::BUDGET;
pub use self::energy::ENERGY;
pub use self::iterations::ITERATIONS;
pub use self::lissajous::LISSAJOUS;
pub use self::measures::MEASURES;
pub use self::overshoot::OVERSHOOT;
pub use self::residual::RESIDUAL;
pub use self::sections::SECTIONS;
pub use self::step::STEP;
pub use self::study::STUDY;
use super::ResultsError;
use super::curves::{Drawn, Source};
use super::history::Group;

/// Every plot, in the order in which they are drawn.
pub const ALL: &[&PlotKind] = &[
    &ENERGY,
    &LISSAJOUS,
    &RESIDUAL,
    &OVERSHOOT,
    &ASYMMETRY,
    &BUDGET,
    &STEP,
    &ITERATIONS,
    &MEASURES,
    &SECTIONS,
    &kymograph::KYMOGRAPH,
    &BODIES,
    &STUDY,
];

/// A plot: one picture or several that are asked for by one name. Two of one name are the same.
pub struct PlotKind {
    /// As on the command line.
    pub name: &'static str,
    /// What it shows, in a line for `docs/report.md`.
    pub help: &'static str,
    /// What a folder must have for it, as a hint.
    pub needs: &'static str,
    /// When it is drawn.
    pub when: When,
    /// How it is drawn.
    pub draw: Draw,
}

/// How a plot is drawn.
#[derive(Clone, Copy)]
pub enum Draw {
    /// Columns of histories over time: each group of a run in a picture, and each column of several runs. As a measure
    /// among others, nobody shows them.
    OverTime(&'static [Group]),
    /// As this does with what the folders have.
    With(fn(&'static PlotKind, &Source<'_>, &mut Drawn) -> Result<(), ResultsError>),
}

/// When a plot is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// Of every folder that has something to show; the runs of a study are compared by it, too.
    Always,
    /// Of every folder that has something to show.
    OfAFolder,
    /// Where somebody names it.
    Named,
}

impl PlotKind {
    /// Draws what the folders have of it.
    ///
    /// # Errors
    /// [`ResultsError::Option`]: a wish that no folder can meet.
    pub fn draw(&'static self, source: &Source, drawn: &mut Drawn) -> Result<(), ResultsError> {
        match self.draw {
            Draw::OverTime(groups) => {
                let histories = source.histories(drawn);
                groups.iter().for_each(|group| histories.group(self, group, drawn));
                Ok(())
            }
            Draw::With(draw) => draw(self, source, drawn),
        }
    }

    /// Groups of columns that are its own.
    pub fn groups(&self) -> &'static [Group] {
        match self.draw {
            Draw::OverTime(groups) => groups,
            Draw::With(_) => &[],
        }
    }

    /// The plot of a name.
    ///
    /// # Errors
    /// [`ResultsError::Option`]: there is none.
    pub fn named(name: &str) -> Result<&'static Self, ResultsError> {
        ALL.iter().copied().find(|kind| kind.name == name).ok_or_else(|| ResultsError::Option {
            option: "--what",
            value: name.to_owned(),
            rule: "there are no such curves".to_owned(),
            hint: format!("the kinds are {}", names()),
        })
    }
}

/// The names of all, for messages of what there is.
pub fn names() -> String {
    ALL.iter().map(|kind| kind.name).collect::<Vec<_>>().join(", ")
}

impl PartialEq for PlotKind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for PlotKind {}

impl fmt::Debug for PlotKind {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.name)
    }
}
