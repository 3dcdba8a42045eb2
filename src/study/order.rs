//! Observed orders of convergence: the same problem on a sequence of meshes and steps, against exact fields.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::expected::Promise;
use super::file::{OrderStudy, Variant};
use super::{StudyError, table};
use crate::measure::errors::{History, Norm, errors};
use crate::model::fields::FieldId;
use crate::output::console;
use crate::output::lock::{self, Room};
use crate::output::progress::{Progress, Status, Verbosity};
use crate::run::unsaved::UnsavedWork;
use crate::run::{RunError, Setup};
use crate::scene::Scene;
use crate::time::{Counts, March, MarchError};

/// One level of one variant.
#[derive(Debug, Clone)]
pub struct Level {
    /// The level n of the study's formulas.
    pub n: f64,
    /// Largest cell diameter.
    pub h: f64,
    /// Longest nominal step.
    pub dt: f64,
    /// Number of cells.
    pub cells: usize,
    /// Unknowns of velocity, pressure and polarity together.
    pub unknowns: usize,
    /// Errors over all steps that were solved.
    pub errors: History,
    /// Totals over its steps.
    pub counts: Counts,
    /// How often a matrix was factorised.
    pub factorisations: usize,
    /// Wall seconds that it took.
    pub seconds: f64,
    /// The orders that its degrees and its scheme promise.
    pub promise: Promise,
    /// Why it did not reach its end.
    pub failure: Option<String>,
}

/// What a variant found.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Its name; empty where there is only one.
    pub variant: String,
    /// From the coarsest on.
    pub levels: Vec<Level>,
    /// Whether somebody stopped it.
    pub interrupted: bool,
}

impl Level {
    /// The size that is refined: h, or Δt where all meshes are alike.
    pub fn size(&self, by_mesh: bool) -> f64 {
        if by_mesh { self.h } else { self.dt }
    }
}

impl Outcome {
    /// Levels that reached their end.
    pub fn complete(&self) -> Vec<&Level> {
        self.levels.iter().filter(|level| level.failure.is_none()).collect()
    }

    /// Whether the mesh changes from level to level; else only the step does.
    pub fn by_mesh(&self) -> bool {
        self.levels.windows(2).any(|pair| (pair[0].h / pair[1].h - 1.0).abs() > 1e-6)
    }

    /// Observed order between two levels: `log(e₀/e₁)/log(h₀/h₁)`.
    pub fn order_between(&self, coarse: &Level, fine: &Level, field: FieldId, norm: Norm) -> f64 {
        let by_mesh = self.by_mesh();
        (coarse.errors.error(field, norm) / fine.errors.error(field, norm)).ln()
            / (coarse.size(by_mesh) / fine.size(by_mesh)).ln()
    }

    /// Least-squares slope of `log e` over `log h` on all complete levels; `None` for fewer than two.
    pub fn fit(&self, field: FieldId, norm: Norm) -> Option<f64> {
        let levels = self.complete();
        let by_mesh = self.by_mesh();
        let points: Vec<(f64, f64)> =
            levels.iter().map(|l| (l.size(by_mesh).ln(), l.errors.error(field, norm).ln())).collect();
        slope(&points)
    }
}

/// Least-squares slope through points; `None` for fewer than two.
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < 2 {
        return None;
    }
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let covariance: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    Some(covariance / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>())
}

/// Runs every level of every variant; tables are written to `out` after each of them. Nothing is written before the
/// first level is set up.
///
/// # Errors
/// A scene that cannot be set up, results that cannot be written or would be overwritten. A step that fails ends its
/// level only.
pub fn run(
    study: &OrderStudy,
    out: &Path,
    verbosity: Verbosity,
    interrupt: &AtomicBool,
) -> Result<Vec<Outcome>, StudyError> {
    let variants = study.variants.iter().map(|variant| variant.name.as_str()).filter(|name| !name.is_empty());
    let names: Vec<&str> = table::NAMES.into_iter().chain(variants).collect();
    lock::alone(out, Room::Without(&names), || run_all(study, out, verbosity, interrupt))
}

fn run_all(
    study: &OrderStudy,
    out: &Path,
    verbosity: Verbosity,
    interrupt: &AtomicBool,
) -> Result<Vec<Outcome>, StudyError> {
    table::refuse_occupied(out)?;
    let mut outcomes: Vec<Outcome> = Vec::new();
    let mut unsaved = None;
    for variant in &study.variants {
        outcomes.push(Outcome { variant: variant.name.clone(), levels: Vec::new(), interrupted: false });
        for &n in &study.levels {
            let first = outcomes.len() == 1 && outcomes[0].levels.is_empty();
            let ready = || if first { table::prepare(study, out) } else { Ok(()) };
            let level = run_level(study, variant, n, verbosity, interrupt, &ready)?;
            if verbosity > Verbosity::Quiet {
                console::note(&told(&variant.name, &level));
            }
            let stopped = interrupt.load(Ordering::Relaxed);
            let last = outcomes.last_mut().expect("just pushed");
            last.interrupted = stopped;
            last.levels.push(level);
            table::write(study, out, &outcomes)?;
            unsaved.get_or_insert_with(UnsavedWork::new);
            if stopped {
                return Ok(outcomes);
            }
        }
    }
    Ok(outcomes)
}

/// `ready` is called when all is set up, before the first step.
fn run_level(
    study: &OrderStudy,
    variant: &Variant,
    n: f64,
    verbosity: Verbosity,
    interrupt: &AtomicBool,
    ready: &dyn Fn() -> Result<(), StudyError>,
) -> Result<Level, StudyError> {
    let in_level = |error: RunError| study.in_level(variant, n, error.into());
    let scene = study.scene_at(variant, n)?;
    let begin = Instant::now();
    let before = crate::solve::sparse::counts()[0];
    let setup = Setup::new(&scene).map_err(in_level)?;
    let mut steps = setup.start(&scene).map_err(in_level)?;
    ready()?;
    let _unsaved = UnsavedWork::new();
    steps.interrupt = interrupt;
    let (errors, failure) = march(&scene, &mut steps, verbosity);
    let model = &setup.model;
    Ok(Level {
        n,
        h: setup.ground.quality.h_max,
        dt: (0..2).map(|k| scene.march().length(scene.time.control.step, k)).fold(0.0, f64::max),
        cells: setup.ground.mesh.cells.len(),
        unknowns: model.flow_unknowns() + model.carried_len(),
        errors,
        counts: steps.counts,
        factorisations: crate::solve::sparse::counts()[0] - before,
        seconds: begin.elapsed().as_secs_f64(),
        promise: Promise::of(&scene, &setup.ground.mesh),
        failure,
    })
}

/// One line about a level.
fn told(variant: &str, level: &Level) -> String {
    let name = if variant.is_empty() { String::new() } else { format!("{variant}: ") };
    let ending = if level.failure.is_some() { "; FAILED" } else { "" };
    format!(
        "{name}n = {}: {} cells, {} unknowns, {} steps, {:.1} iterations a step, {} rejected, {:.1} s{ending}",
        level.n,
        level.cells,
        level.unknowns,
        level.counts.steps,
        level.counts.nonlinear_iterations as f64 / level.counts.steps.max(1) as f64,
        level.counts.rejected,
        level.seconds
    )
}

/// Marches to the end of the scene and sums up the errors after each step; with the reason if it does not get there.
fn march(scene: &Scene, march: &mut March, verbosity: Verbosity) -> (History, Option<String>) {
    let exact = scene.sources.exact.as_ref().expect("the study was checked for exact fields");
    let mut history = History::default();
    let mut progress = Progress::new(verbosity, march.t);
    let end = scene.time.end;
    let mut failure = None;
    while march.t < end * (1.0 - 1e-12) && scene.time.max_steps.is_none_or(|most| march.counts.steps < most) {
        match march.advance(end) {
            Ok(report) => {
                history.add(&errors(march.model, exact, &march.state, march.t), report.dt);
                let (step, t, dt, iterations) = (report.step, march.t, report.dt, report.iterations);
                progress.show(&Status { step, t, end, dt, iterations, residual: None });
            }
            Err(
                error @ (MarchError::Interrupted { .. } | MarchError::StepTooSmall { .. } | MarchError::Failed { .. }),
            ) => {
                failure = Some(error.to_string());
                break;
            }
        }
        if march.interrupt.load(Ordering::Relaxed) {
            failure = Some(format!("stopped from outside at t = {}", march.t));
            break;
        }
    }
    progress.finish();
    if failure.is_none() && march.t < end * (1.0 - 1e-12) {
        failure = Some(format!("`time.max_steps` was reached at t = {}, before the end {end}", march.t));
    }
    (history, failure)
}
