//! Observed orders of convergence: the same problem on a sequence of meshes and steps, against exact fields.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::expected::Promise;
use super::file::{OrderStudy, Variant};
use super::{StudyError, table};
use crate::measure::errors::{History, Norm};
use crate::model::Exact;
use crate::model::fields::{self, FieldId, Role};
use crate::output::console;
use crate::output::lock::{self, Room};
use crate::output::progress::{Progress, Status, Verbosity};
use crate::run::RunError;
use crate::run::stepper::{Halt, Limits, Plan, Purpose, Stepper, Wanted};
use crate::run::summary::Unknowns;
use crate::run::unsaved::UnsavedWork;
use crate::time::Counts;

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
    /// Unknowns of the flow, and of what is carried.
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
    let compared = scene.compared().expect("the study was checked for exact fields");
    let (begin, before) = (Instant::now(), crate::solve::sparse::counts()[0]);
    let wanted = Wanted { saved: None, file: Path::new("checkpoint.bin"), purpose: Purpose::Solve(interrupt) };
    let (mut level, mut readied) = (None, Ok(()));
    scene
        .stage(&wanted, &mut |plan, ground, stepper| {
            readied = ready();
            if readied.is_err() {
                return Ok(());
            }
            let _unsaved = UnsavedWork::new();
            let ground = ground.expect("what has exact fields has a mesh");
            let Found { errors, counts, failure } = march(plan, compared.exact, stepper, verbosity, interrupt)?;
            level = Some(Level {
                n,
                h: ground.quality.h_max,
                dt: compared.longest,
                cells: ground.mesh.cells.len(),
                unknowns: unknowns(&plan.unknowns),
                errors,
                counts,
                factorisations: crate::solve::sparse::counts()[0] - before,
                seconds: begin.elapsed().as_secs_f64(),
                promise: Promise::of(&compared, &ground.mesh),
                failure,
            });
            Ok(())
        })
        .map_err(in_level)?;
    readied.map(|()| level.expect("what is ready is solved"))
}

/// Of the flow, and of what is carried.
fn unknowns(unknowns: &Unknowns) -> usize {
    let is_carried = |name: &str| fields::named(name).is_some_and(|field| field.role == Role::Carried);
    let carried = unknowns.fields.iter().filter(|(name, _)| is_carried(name)).map(|(_, count)| count);
    unknowns.stokes_system + carried.sum::<usize>()
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

/// What a level found.
struct Found {
    errors: History,
    counts: Counts,
    /// Why it did not get to its end.
    failure: Option<String>,
}

/// Moves to the end of the scene and sums up the errors after each step.
fn march(
    plan: &Plan,
    exact: &Exact,
    stepper: &mut dyn Stepper,
    verbosity: Verbosity,
    interrupt: &AtomicBool,
) -> Result<Found, RunError> {
    let (mut errors, mut counts, mut failure) = (History::default(), Counts::default(), None);
    let Limits { end, max_steps, .. } = plan.limits;
    let mut t = 0.0;
    stepper.look(&mut |view| {
        t = view.t;
        Ok(())
    })?;
    let mut progress = Progress::new(verbosity, t);
    while failure.is_none() && t < end * (1.0 - 1e-12) && max_steps.is_none_or(|most| counts.steps < most) {
        match stepper.advance(t, end) {
            Ok(stride) => {
                counts.steps += 1;
                counts.nonlinear_iterations += stride.iterations;
                counts.rejected += stride.rejected;
                counts = stepper.counts().unwrap_or(counts);
                t = stride.t;
                stepper.look(&mut |view| {
                    errors.add(&view.errors(exact).expect("what has exact fields is solved for"), stride.dt);
                    Ok(())
                })?;
                let (step, dt, iterations) = (counts.steps, stride.dt, stride.iterations);
                progress.show(&Status { step, t, end, dt, iterations, residual: None });
            }
            Err(Halt::Interrupted) => failure = Some(format!("stopped from outside at t = {t}")),
            Err(Halt::Failed { reason, .. }) => failure = Some(reason),
        }
        if failure.is_none() && interrupt.load(Ordering::Relaxed) {
            failure = Some(format!("stopped from outside at t = {t}"));
        }
    }
    progress.finish();
    if failure.is_none() && t < end * (1.0 - 1e-12) {
        failure = Some(format!("`time.max_steps` was reached at t = {t}, before the end {end}"));
    }
    Ok(Found { errors, counts, failure })
}
