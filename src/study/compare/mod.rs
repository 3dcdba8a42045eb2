//! Measured velocities averaged on bins, and how far a run is from them [11.1–11.3].

mod derive;
mod file;
mod format;
mod maps;
mod reader;
mod synthesize;
mod table_reading;
mod tracks;
mod velocity;
mod write;

use std::path::Path;

use rayon::prelude::*;

use super::{StudyError, table};
use crate::measure::MeasureError;
use crate::measure::measured::{Averages, Binned, Difference, Flux, overshoot};
use crate::output::lock::{self, Room};
use crate::run::RunError;

pub(super) use file::CompareFile;
pub use file::CompareStudy;
pub use synthesize::{Synthesis, synthesize};
pub use tracks::Tracks;
pub use velocity::RunVelocity;

/// Most parts of the record that are left out in turn for the standard errors.
const BLOCKS: usize = 20;

/// A number with its standard error, NaN where the data say nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Its column.
    pub name: &'static str,
    /// The number.
    pub value: f64,
    /// `((g − 1)/g Σ_k (θ_k − θ̄)²)^½`, `θ_k` the number without the k-th of g successive parts of the record.
    pub error: f64,
}

/// The run's side of a comparison.
#[derive(Debug)]
pub struct Computed {
    /// The run that is compared with.
    pub run: RunVelocity,
    /// Averaged over the bins, filtered and corrected as the data are.
    pub field: Binned,
    /// Part of each bin that lies in the tissue: the weights of the difference.
    pub shares: Vec<f64>,
    /// What it carries through each section.
    pub flux: Option<Flux>,
    /// How far it is from what was measured.
    pub difference: Difference,
}

/// What a comparison found.
#[derive(Debug)]
pub struct Comparison {
    /// What was read.
    pub tracks: Tracks,
    /// Its means in bins.
    pub averages: Averages,
    /// Averaged in time, filtered, corrected.
    pub measured: Binned,
    /// What is carried through each section, where it can be told.
    pub flux: Option<Flux>,
    /// Of a run, where one is named.
    pub computed: Option<Computed>,
    /// What the report shows at its top.
    pub readings: Vec<Reading>,
    /// Number of parts of the record for the standard errors.
    pub blocks: usize,
}

/// Names of what a comparison leaves.
const NAMES: [&str; 7] = ["study.toml", "field.csv", "run.csv", "comparison.csv", "summary.json", "cuts", "plots"];

/// Reads the data, compares them with the run, and leaves the results in `out`.
///
/// # Errors
/// A folder that holds results, data or a run that cannot be read, a window without cells, a run that shares no bin
/// with the data.
pub fn run(study: &CompareStudy, out: &Path) -> Result<Comparison, StudyError> {
    lock::alone(out, Room::Without(&NAMES), || {
        table::refuse_occupied(out)?;
        let comparison = compare(study)?;
        table::write_study(&study.text(), out)?;
        write::write(study, &comparison, out)?;
        Ok(comparison)
    })
}

/// As [`run`], without files.
///
/// # Errors
/// Data or a run that cannot be read, a window without cells, a run that shares no bin with the data.
pub fn compare(study: &CompareStudy) -> Result<Comparison, StudyError> {
    let mut tracks = Tracks::read(study)?;
    let bins = study.bins;
    let closed: Vec<bool> = (0..bins.len()).map(|bin| bins.centre(bin).norm() < study.obstacle).collect();
    let blocks = tracks.frames.min(BLOCKS);
    let parts = Averages::of_blocks(bins, &closed, &tracks.samples, tracks.frames, blocks);
    let averages = Averages::join(&parts, None);
    let raw = averages.mean();
    let run = study.run.as_ref().map(|folder| RunVelocity::read(folder)).transpose()?;
    if let Some(run) = &run {
        let outside = run.count_outside(&tracks.samples);
        let note = tracks.misplaced(
            study,
            ("the mesh of the run", study.source.place("run").to_string()),
            outside,
            run.bounds(),
        )?;
        tracks.notes.extend(note);
    }
    let over_bins = run.as_ref().map(|run| run.average(bins, &raw.weights, study.obstacle));
    let over_bins = over_bins.as_ref().map(|(field, shares)| (field, &shares[..]));
    let at_window = |error: MeasureError| StudyError::Within {
        place: study.source.place("window"),
        part: "`window`".to_owned(),
        error: Box::new(RunError::Measure(error).into()),
    };
    let whole = Outcome::of(study, &raw, over_bins).map_err(at_window)?;
    if over_bins.is_some() && whole.difference().is_none() {
        return Err(no_common_bin(study));
    }
    let without = |k: usize| Outcome::of(study, &Averages::join(&parts, Some(k)).mean(), over_bins).ok();
    let others: Vec<Option<Outcome>> = (0..blocks).into_par_iter().map(without).collect();
    let readings = whole.readings(study).into_iter().enumerate();
    let others: Option<Vec<Vec<f64>>> = others.iter().map(|o| Some(values(&o.as_ref()?.readings(study)))).collect();
    let readings = readings
        .map(|(at, (name, value))| {
            let error = others.as_ref().map_or(f64::NAN, |others| jackknife(others.iter().map(|values| values[at])));
            Reading { name, value, error }
        })
        .collect();
    let shares = over_bins.map(|(_, shares)| shares.to_vec());
    let computed = match (run, whole.computed, shares) {
        (Some(run), Some((field, flux, Some(difference))), Some(shares)) => {
            Some(Computed { run, field, shares, flux, difference })
        }
        (_, _, _) => None,
    };
    Ok(Comparison { tracks, averages, measured: whole.measured, flux: whole.flux, computed, readings, blocks })
}

fn no_common_bin(study: &CompareStudy) -> StudyError {
    let run = study.run.as_ref().map(|folder| folder.display().to_string()).unwrap_or_default();
    StudyError::Data {
        place: study.source.place("run").to_string(),
        what: format!("no bin with cells lies in the domain of the run {run} and in the window"),
        hint: "check `length`, `centre`, `box` and `window`".to_owned(),
    }
}

fn values(readings: &[(&'static str, f64)]) -> Vec<f64> {
    readings.iter().map(|(_, value)| *value).collect()
}

/// Standard error from the values that leave out one part each.
fn jackknife(values: impl ExactSizeIterator<Item = f64> + Clone) -> f64 {
    let g = values.len() as f64;
    let mean = values.clone().sum::<f64>() / g;
    ((g - 1.0) / g * values.map(|value| (value - mean).powi(2)).sum::<f64>()).sqrt()
}

/// What one set of frames gives.
struct Outcome {
    measured: Binned,
    flux: Option<Flux>,
    computed: Option<(Binned, Option<Flux>, Option<Difference>)>,
}

impl Outcome {
    fn of(study: &CompareStudy, raw: &Binned, run: Option<(&Binned, &[f64])>) -> Result<Self, MeasureError> {
        let (measured, flux) = treat(study, raw)?;
        let computed = run
            .map(|(field, shares)| {
                let mut like = field.clone();
                let weights = raw.weights.iter().zip(shares);
                like.weights = weights.map(|(weight, share)| if *share > 0.0 { *weight } else { 0.0 }).collect();
                let (field, flux) = treat(study, &like)?;
                let window = study.window.unwrap_or(f64::INFINITY);
                let difference = Difference::of(&measured, &field, shares, window);
                Ok::<_, MeasureError>((field, flux, difference))
            })
            .transpose()?;
        Ok(Self { measured, flux, computed })
    }

    fn difference(&self) -> Option<&Difference> {
        self.computed.as_ref().and_then(|(_, _, difference)| difference.as_ref())
    }

    /// The same names for any frames; NaN for what these frames do not give.
    fn readings(&self, study: &CompareStudy) -> Vec<(&'static str, f64)> {
        let (from, to) = (study.obstacle, study.window.unwrap_or(study.bins.high.x));
        let over = |field: &Binned| overshoot(field, from, to).map_or(f64::NAN, |(percent, _)| percent);
        let mut all = Vec::new();
        if let Some((field, _, _)) = &self.computed {
            let d = self.difference();
            let of = |f: &dyn Fn(&Difference) -> f64| d.map_or(f64::NAN, f);
            all.extend([
                ("relative", of(&|d| d.relative)),
                ("relative_v1", of(&|d| d.relative_by_component[0])),
                ("relative_v2", of(&|d| d.relative_by_component[1])),
                ("bias_v1", of(&|d| d.bias[0])),
                ("bias_v2", of(&|d| d.bias[1])),
                ("correlation_v1", of(&|d| d.correlation[0])),
                ("correlation_v2", of(&|d| d.correlation[1])),
                ("largest", of(&|d| d.largest)),
            ]);
            if from < to {
                all.push(("overshoot_difference", over(&self.measured) - over(field)));
                all.push(("overshoot_run", over(field)));
            }
        }
        if from < to {
            all.push(("overshoot_measured", over(&self.measured)));
        }
        if study.window.is_some() {
            let flux = |f: &dyn Fn(&Flux) -> f64| self.flux.as_ref().map_or(f64::NAN, f);
            all.extend([("flux_minus", flux(&|f| f.minus)), ("flux_plus", flux(&|f| f.plus))]);
        }
        all
    }
}

/// Filter and correction.
fn treat(study: &CompareStudy, raw: &Binned) -> Result<(Binned, Option<Flux>), MeasureError> {
    let filtered = raw.filtered(study.filter);
    match study.window {
        None => Ok((filtered, None)),
        Some(window) => filtered.flux_kept(window).map(|(field, flux)| (field, Some(flux))),
    }
}

impl std::fmt::Display for Comparison {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let filled = self.averages.frames.iter().filter(|n| **n > 0).count();
        let cells: u64 = self.averages.cells.iter().sum();
        let (rows, bins) = (self.tracks.samples.len(), self.averages.bins.len());
        write!(out, "{cells} of {rows} rows in {filled} of {bins} bins, {} frames", self.tracks.frames)?;
        for note in &self.tracks.notes {
            write!(out, "\nnote: {note}")?;
        }
        if let Some(computed) = &self.computed {
            let d = &computed.difference;
            write!(out, "\n{} bins compared with the run at t = {}", d.bins, computed.run.time)?;
        }
        for Reading { name, value, error } in &self.readings {
            write!(out, "\n{:<22}{value:>10.4}", name.replace('_', " "))?;
            if error.is_finite() {
                write!(out, " ± {error:.4}")?;
            }
        }
        if let Some(computed) = &self.computed {
            let d = &computed.difference;
            write!(out, "\n{:<22}{:>10.4}", "noise", d.noise)?;
            write!(out, "\n{:<22}{:>10.4}", "without noise", d.without_noise())?;
            write!(out, "\nlargest difference at ({:.4}, {:.4})", d.largest_at.x, d.largest_at.y)?;
        }
        Ok(())
    }
}
