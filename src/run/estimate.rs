//! Estimates of a run's discretisation errors: the whole problem is solved again, on two coarser meshes and, where it
//! was marched to a time, with steps that are longer in the same ratio.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Instant;

use serde::Serialize;

use super::domain::build_mesh;
use super::summary::{Ending, Summary};
use super::{Options, Record, RunError, run_recorded};
use crate::measure::list;
use crate::mesh::generate::MeshScene;
use crate::output::progress::{Progress, Verbosity};
use crate::output::{OutputError, console, write_whole};
use crate::scene::{Scene, SceneError, SceneSource, measured};

/// Cells of the coarser runs are longer by these factors.
const RATIOS: [f64; 2] = [std::f64::consts::SQRT_2, 2.0];
/// Folder of the coarser runs, in the folder of the run.
const FOLDER: &str = "estimate";
const NAMES: [&str; 2] = ["coarse", "coarser"];
/// Least order that is believed of a discretisation in space.
const LEAST_ORDER: f64 = 2.0;
/// Most order that is believed, whatever the degrees: a higher one is mostly that of a value about to turn.
const MOST_ORDER: f64 = 4.0;
/// So much above the least order lies the one that is taken where none is seen.
const UNSEEN: f64 = 0.5;

/// How the estimates of a summary were made.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimated {
    /// What the errors come from.
    pub contains: &'static str,
    /// Of the run, and of the coarser ones.
    pub cells: Vec<usize>,
    /// Longest steps of the three runs, where they were marched to a time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<f64>,
    /// Order that each estimate takes.
    pub orders: BTreeMap<&'static str, f64>,
    /// Bounds on these orders.
    pub bounds: [f64; 2],
    /// Wall seconds of both coarser runs.
    pub seconds: f64,
}

/// Error of the finest of three values `q` that belong to the sizes `h`, both finest first, and the order p that it
/// takes: `|e| = max(|q₁−q₂|, |q₂−q₃|/s(b)) / ((h₂/h₁)^p − 1)` with `s(p) = (h₃^p − h₂^p)/(h₂^p − h₁^p)`.
///
/// p solves `s(p) = (q₃−q₂)/(q₂−q₁)` within the bounds [a, b], and is a + ½ where the differences have two signs, as
/// then no order is seen. The far difference keeps a quantity from looking exact that happens to be alike on the two
/// finer meshes.
pub fn estimate(q: [f64; 3], h: [f64; 3], [low, high]: [f64; 2]) -> (f64, f64) {
    let (near, far) = (q[1] - q[0], q[2] - q[1]);
    let spread = |p: f64| (h[2].powf(p) - h[1].powf(p)) / (h[1].powf(p) - h[0].powf(p));
    let order = if near * far < 0.0 { (low + UNSEEN).min(high) } else { solve(spread, (far / near).abs(), low, high) };
    let difference = near.abs().max(far.abs() / spread(high));
    (difference / ((h[1] / h[0]).powf(order) - 1.0), order)
}

/// Where the rising function reaches `value`, or the nearest bound.
fn solve(f: impl Fn(f64) -> f64, value: f64, low: f64, high: f64) -> f64 {
    let (mut a, mut b) = (low, high);
    // without a difference between the finer two the value is not a number, and the far one decides with the high order
    if value.is_nan() || value >= f(high) {
        return high;
    }
    if value <= f(low) {
        return low;
    }
    while b - a > 1e-6 {
        let middle = 0.5 * (a + b);
        if f(middle) < value { a = middle } else { b = middle }
    }
    0.5 * (a + b)
}

/// Whether the scene asks for estimates.
pub fn is_asked_for(scene: &Scene) -> bool {
    scene.outputs.iter().any(|output| output.estimate)
}

/// Whether a run with this ending still lacks its estimates when it is written first; one without an end has them made
/// when it is resumed.
pub(super) fn is_pending(scene: &Scene, ending: &Ending) -> bool {
    is_asked_for(scene) && (at_rest(ending).is_ok() || *ending == Ending::Interrupted)
}

/// Solves the coarser problems and puts the estimates into `summary`, or the reason why there are none: the run itself
/// is not lost by whatever fails here. What is interrupted stays pending: the run, resumed, makes its estimates then.
pub(super) fn add(scene: &Scene, options: &Options, summary: &mut Summary, record: &mut Record) {
    let progress = Progress::new(options.verbosity, 0.0);
    let found = estimates(scene, options, summary);
    let interrupted = found.is_err() && summary.estimates_pending && options.interrupt.load(Ordering::Relaxed);
    summary.estimates_pending = interrupted;
    match found {
        Err(_) if interrupted => {
            if options.verbosity > Verbosity::Quiet {
                console::note(
                    "note: interrupted before the errors of the measures were estimated: `--resume` estimates them",
                );
            }
        }
        Ok((values, how)) => {
            summary.estimates = Some(values);
            summary.estimated = Some(how);
        }
        Err(reason) => {
            progress.say(&no_estimates(&reason));
            summary.not_estimated = Some(reason);
        }
    }
    summary.said.extend(progress.said());
    record.said.extend(progress.said());
}

/// Says in the summary of a run whose process ended while it made its estimates that there are none, and why.
///
/// # Errors
/// A summary that cannot be read or written.
pub fn give_up(folder: &Path, reason: &str) -> Result<(), OutputError> {
    let path = folder.join("summary.json");
    let failed = |error: std::io::Error| OutputError::io(&path, &error);
    let text = std::fs::read(&path).map_err(failed)?;
    let mut summary: serde_json::Map<String, serde_json::Value> =
        serde_json::from_slice(&text).map_err(|error| failed(error.into()))?;
    summary.remove("estimates_pending");
    summary.insert("not_estimated".to_owned(), reason.into());
    if let Some(serde_json::Value::Array(said)) = summary.get_mut("said") {
        said.push(no_estimates(reason).into());
    }
    write_whole(&path, |file| {
        serde_json::to_writer_pretty(&mut *file, &summary)?;
        writeln!(file)
    })
}

fn no_estimates(reason: &str) -> String {
    format!("note: the errors of the measures were not estimated: {reason}")
}

type Estimates = (BTreeMap<&'static str, f64>, Estimated);

fn estimates(scene: &Scene, options: &Options, summary: &Summary) -> Result<Estimates, String> {
    let begin = Instant::now();
    let rest = at_rest(&summary.ending)?;
    let folder = options.out.join(FOLDER);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(|e| OutputError::io(&folder, &e).to_string())?;
    }
    let mut runs: Vec<(Summary, f64)> = Vec::new();
    for (ratio, name) in RATIOS.into_iter().zip(NAMES) {
        let coarse = coarser(scene, &options.out, ratio, (!rest).then_some(summary)).map_err(|e| e.to_string())?;
        if options.verbosity > Verbosity::Quiet {
            console::note(&format!("estimating errors: the same with cells {ratio:.2} times as long"));
        }
        let out = folder.join(name);
        let quiet =
            Options { out: out.clone(), resume: false, verbosity: Verbosity::Quiet, interrupt: options.interrupt };
        let run = run_recorded(&coarse, &quiet, &mut Record::default()).map_err(|e| format!("the {name} run: {e}"))?;
        if run.ending != summary.ending {
            let (found, wanted) = (run.ending.name(), summary.ending.name());
            return Err(format!("the {name} run ended as `{found}`, not as `{wanted}`; see {}", out.display()));
        }
        runs.push((run, coarse.time.control.step));
    }
    let cells: Vec<usize> =
        std::iter::once(summary).chain(runs.iter().map(|(run, _)| run)).map(|s| s.mesh.cells()).collect();
    if cells.windows(2).any(|pair| pair[0] <= pair[1]) {
        return Err(format!(
            "the mesh of {} cells has no two coarser ones, {} and {} cells",
            cells[0], cells[1], cells[2]
        ));
    }
    let steps = std::iter::once(scene.time.control.step).chain(runs.iter().map(|(_, step)| *step));
    let steps = if rest { Vec::new() } else { steps.collect() };
    let sizes = [0, 1, 2].map(|k| (cells[k] as f64).powf(-0.5));
    let bounds = bounds(scene, rest);
    let (mut values, mut orders) = (BTreeMap::new(), BTreeMap::new());
    for (&name, &fine) in &summary.measures {
        let others = [0, 1].map(|k| runs[k].0.measures.get(name).copied());
        // a count of cells has no limit
        let counts_cells = list::column(name).is_some_and(|column| column.counts_cells);
        if let ([Some(coarse), Some(coarser)], false) = (others, counts_cells) {
            let (error, order) = estimate([fine, coarse, coarser], sizes, bounds);
            if error.is_finite() {
                values.insert(name, error);
                orders.insert(name, (order * 1e3).round() / 1e3);
            }
        }
    }
    let contains = if rest { "mesh" } else { "mesh and time step" };
    Ok((values, Estimated { contains, cells, steps, orders, bounds, seconds: begin.elapsed().as_secs_f64() }))
}

/// Whether the state is one that does not depend on time steps.
fn at_rest(ending: &Ending) -> Result<bool, String> {
    match ending {
        Ending::Steady | Ending::Stationary | Ending::EnergyAtRest => Ok(true),
        Ending::EndTime | Ending::MaxSteps => Ok(false),
        Ending::Oscillating => Err("the flow oscillates, and its measures are those of one moment".into()),
        Ending::Interrupted => Err("the run was interrupted".into()),
        Ending::Failed { .. } => Err("the run failed".into()),
    }
}

/// The order of the worst and of the best part of the discretisation.
fn bounds(scene: &Scene, rest: bool) -> [f64; 2] {
    let high = MOST_ORDER.min((scene.space.polarity.max(scene.space.velocity) + 1) as f64);
    let low = if rest { LEAST_ORDER } else { LEAST_ORDER.min(scene.time.order as f64) };
    [low, high.max(low)]
}

/// The scene with cells longer by `ratio`; marched to the time of `to`, if there is one, by so much longer steps, and
/// begun from the state in the folder `out` else.
fn coarser(scene: &Scene, out: &Path, ratio: f64, to: Option<&Summary>) -> Result<Scene, RunError> {
    let mut source = SceneSource::parse(&scene.resolved_toml(), &out.join("scene.toml"))?;
    set_mesh(&mut source, &scene.mesh, ratio)?;
    source.set("output", &format!("[{{ measures = [{}] }}]", measures(scene)))?;
    match to {
        Some(summary) => {
            let (end, step) = (summary.time, scene.time.control.step);
            // what the mesh has become, as a square has whole numbers of cells
            let cells = build_mesh(&Scene::check(source.clone())?)?.cells.len();
            let ratio = (summary.mesh.cells() as f64 / cells as f64).sqrt();
            // whole steps, as in a run whose steps fit its end
            let count = (end / (step * ratio)).round().max(1.0);
            for (key, value) in [("time.end", end), ("time.step", end / count)] {
                source.set(key, &format!("{value:?}"))?;
            }
            ["time.max_steps", "time.stop", "time.step_min"].iter().try_for_each(|key| source.set(key, ""))?;
        }
        None => {
            let file = std::path::absolute(out.join("checkpoint.bin")).map_err(|e| OutputError::io(out, &e))?;
            let start = toml::Value::from(BTreeMap::from([("file", file.to_string_lossy().into_owned())])).to_string();
            source.set("initial.polarity", &start)?;
            if scene.initial_density.is_some() {
                source.set("initial.density", &start)?;
            }
            if scene.steady.is_some() {
                source.set("steady.want", "any")?;
                source.set("steady.eigenvalues", "0")?;
            }
        }
    }
    Ok(Scene::check(source)?)
}

/// The measures that the scene names, as a list of TOML.
fn measures(scene: &Scene) -> String {
    let named = measured(&scene.outputs).into_iter();
    let mut names: Vec<String> = named.map(|asked| asked.to_string()).collect();
    names.sort();
    names.join(", ")
}

fn set_mesh(source: &mut SceneSource, mesh: &MeshScene, ratio: f64) -> Result<(), SceneError> {
    mesh.longer_edges(ratio)
        .into_iter()
        .try_for_each(|(key, value)| source.set(&format!("mesh.{}", key.name), &value.to_string()))
}

#[cfg(test)]
mod tests {
    use super::estimate;

    const BOUNDS: [f64; 2] = [2.0, 4.0];

    #[test]
    fn a_power_of_the_cell_size_is_estimated_exactly() {
        for p in [2.0, 2.7, 4.0] {
            for h in [[0.1, 0.15, 0.2], [0.1, 0.1 * std::f64::consts::SQRT_2, 0.2]] {
                let q = h.map(|h: f64| 3.0 - 0.7 * h.powf(p));
                let (error, order) = estimate(q, h, BOUNDS);
                assert!((error / (0.7 * 0.1_f64.powf(p)) - 1.0).abs() < 1e-4, "{error} {order} for {p}");
                assert!((order - p).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn orders_stay_within_their_bounds() {
        let h = [0.1, 0.15, 0.2];
        for (p, taken) in [(0.5, 2.0), (7.0, 4.0)] {
            let (_, order) = estimate(h.map(|h: f64| h.powf(p)), h, BOUNDS);
            assert!((order - taken).abs() < 1e-9);
        }
    }

    #[test]
    fn a_value_that_passes_its_limit_does_not_look_exact() {
        // from one side to the other, by chance to the same value on the two finer meshes
        let h = [1.0, 2.0_f64.sqrt(), 2.0];
        let (same, order) = estimate([1.0, 1.0, 1.4], h, BOUNDS);
        assert!(order == 4.0 && (same - 0.4 / 4.0 / 3.0).abs() < 1e-9, "{same}");
        let (turned, order) = estimate([1.0, 1.1, 0.9], h, BOUNDS);
        assert!(order == 2.5 && (turned - 0.1 / (2.0_f64.powf(1.25) - 1.0)).abs() < 1e-9, "{turned}");
        assert!(turned > same);
        // nothing changes at all: nothing is left to estimate
        assert_eq!(estimate([1.0; 3], h, BOUNDS).0, 0.0);
    }
}
