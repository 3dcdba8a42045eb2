//! What `check` says of a scene before anything is solved.

use std::fmt;
use std::path::Path;

use serde::Serialize;

use super::available::available;
use super::bodies::BodiesReport;
use super::disk::{self, Sizes};
use super::domain::{self, build_mesh};
use super::extremes;
use super::forecast::{self, COUNTED, Count};
use super::measures::{self, Gauges};
use super::memory::{self, Unknowns};
use super::stepper::{Purpose, Wanted};
use super::{RunError, cuts, maps, setup};
use crate::mesh::quality::Quality;
use crate::model::parameters::PolarityForm;
use crate::model::{ModelKind, TermStatus, rotation};
use crate::scene::Scene;
use crate::scene::presets::MEASURED;
use crate::space::{Continuity, Space};

/// A mesh, or what is expected of one that takes long to build.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum MeshReport {
    /// As it is.
    Built(Quality),
    /// As it will be, of a mesh too large to be built for a report.
    Expected(Expected),
}

impl MeshReport {
    /// How many there are, or are expected.
    pub fn cells(&self) -> usize {
        match self {
            Self::Built(quality) => quality.cells,
            Self::Expected(expected) => expected.cells,
        }
    }
}

/// About how large a mesh will be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Expected {
    /// About so many cells.
    pub cells: usize,
    /// About so many vertices.
    pub vertices: usize,
    /// About so many faces.
    pub faces: usize,
    /// Always: the mesh was not built.
    pub expected: bool,
}

impl Expected {
    pub(super) fn new(count: &Count) -> Self {
        let [cells, vertices, faces] = [count.cells, count.vertices, count.faces].map(|n| n as usize);
        Self { cells, vertices, faces, expected: true }
    }
}

impl fmt::Display for MeshReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Built(quality) => quality.fmt(out),
            Self::Expected(Expected { cells, vertices, faces, .. }) => write!(
                out,
                "cells           about {cells}\nvertices        about {vertices}\nfaces           about {faces}\n\
                 (not built, as that takes a while: `monolayer mesh` builds and measures it)"
            ),
        }
    }
}

/// What will be solved, and with how much.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// One line for reports.
    pub title: Option<String>,
    /// The terms of the equations, on and off.
    pub terms: Vec<TermStatus>,
    /// Size and quality.
    pub mesh: MeshReport,
    /// Rigid bodies, where there are some.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bodies: Option<BodiesReport>,
    /// Steps of the full length, where the scene is marched in time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<f64>,
    /// Of v.
    pub velocity_unknowns: usize,
    /// `pressure` or `density`.
    pub volume: &'static str,
    /// Of Π or ρ.
    pub volume_unknowns: usize,
    /// Of p.
    pub polarity_unknowns: usize,
    /// How its cells see one another.
    pub polarity_form: PolarityForm,
    /// Of the linear system of the flow.
    pub flow_unknowns: usize,
    /// Estimate of the peak memory of a run.
    pub memory_mib: f64,
    /// What the system can give, where it tells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub available_mib: Option<f64>,
    /// Estimate of what a run writes.
    pub disk_mib: f64,
    /// What a reader should know.
    pub remarks: Vec<String>,
    /// Why a run is refused here and now, by a lack of memory or disk; the rest of the report is right nonetheless.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub refused: Vec<String>,
    /// What `accuracy` sets, where the scene names one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<PresetReport>,
}

/// What a preset does to a scene, and what it was measured to give.
#[derive(Debug, Clone, Serialize)]
pub struct PresetReport {
    /// As in the scene.
    pub name: &'static str,
    /// Keys that the scene leaves out, and their values.
    pub sets: Vec<(String, String)>,
    /// Case, measure, error and wall seconds.
    pub measured: Vec<(&'static str, &'static str, &'static str, f64)>,
}

impl PresetReport {
    fn new(scene: &Scene) -> Option<Self> {
        let accuracy = scene.accuracy()?;
        let at = accuracy as usize;
        let measured = MEASURED.iter().map(|m| (m.case, m.measure, m.errors[at], m.seconds[at])).collect();
        Some(Self { name: accuracy.name(), sets: scene.preset.clone(), measured })
    }
}

/// Says what a scene is and takes; solves nothing.
///
/// # Errors
/// As [`report_within`] and [`available`].
pub fn report(scene: &Scene) -> Result<Report, RunError> {
    report_within(scene, available()?)
}

/// As [`report`] with so many bytes of memory, where they are known.
///
/// Whatever a run would refuse before its first step is refused here, by the same functions: on the mesh itself
/// where a run would be
/// begun within a second or two, else on a coarser one of the same domain.
///
/// # Errors
/// All that a run could say before its first step, besides what its folder holds; a lack of memory or disk is in the
/// report, as [`Report::refused`].
pub fn report_within(scene: &Scene, available: Option<f64>) -> Result<Report, RunError> {
    judge(scene, available).map_err(|error| error.blaming(|| extremes::of_scene(scene)))
}

fn judge(scene: &Scene, available: Option<f64>) -> Result<Report, RunError> {
    let Judged { mesh, count, counted, said } = mesh_and_count(scene)?;
    let fits = available.is_none_or(|available| count.bytes <= available);
    if counted && count.bytes <= QUICK && fits {
        try_start(scene)?;
    } else {
        try_coarse(scene, count.cells)?;
    }
    let mut remarks = scene.remarks();
    remarks.extend(said);
    let steps = disk::steps(scene.time.control.step, scene.time.end, scene.time.max_steps);
    let bytes = written(scene, &count);
    let lacking = [memory::check(scene, count.bytes, available), disk::check(scene.source(), bytes, Path::new("."))];
    Ok(Report {
        title: scene.title.clone(),
        terms: scene.terms(),
        memory_mib: count.bytes / memory::MIB,
        available_mib: available.map(|bytes| bytes / memory::MIB),
        disk_mib: bytes / memory::MIB,
        steps: scene.steady.is_none().then_some(steps),
        bodies: scene.bodies.as_ref().map(BodiesReport::new),
        velocity_unknowns: count.unknowns[0] as usize,
        volume: match scene.parameters.kind() {
            ModelKind::Incompressible => "pressure",
            ModelKind::Compressible => "density",
        },
        volume_unknowns: count.unknowns[1] as usize,
        polarity_unknowns: count.unknowns[2] as usize,
        polarity_form: scene.parameters.form,
        flow_unknowns: count.unknowns[3] as usize,
        remarks,
        refused: refusals(lacking),
        accuracy: PresetReport::new(scene),
        mesh,
    })
}

/// What went wrong, in words.
pub(in crate::run) fn refusals(checks: impl IntoIterator<Item = Result<(), RunError>>) -> Vec<String> {
    checks.into_iter().filter_map(|check| check.err().map(|error| error.to_string())).collect()
}

/// A mesh, and what there is on it.
struct Judged {
    mesh: MeshReport,
    count: Count,
    /// Whether that was counted there, not judged by smaller meshes.
    counted: bool,
    /// What is worth knowing of the scene on this mesh.
    said: Vec<String>,
}

/// The mesh of a scene, where it is there soon, and what there is on it.
fn mesh_and_count(scene: &Scene) -> Result<Judged, RunError> {
    if let Some(cells) = scene.mesh.expected().filter(|cells| *cells > scene.mesh.quickly_built()) {
        let count = memory::samples(scene, cells).ok_or_else(|| setup::uncounted(scene))?.at(cells);
        let mesh = MeshReport::Expected(Expected::new(&count));
        return Ok(Judged { mesh, count, counted: false, said: Vec::new() });
    }
    let mesh = std::sync::Arc::new(build_mesh(scene)?);
    setup::check_on(scene, &mesh)?;
    let cells = mesh.cells.len() as f64;
    let (count, counted) = match (cells > COUNTED).then(|| memory::samples(scene, cells)).flatten() {
        Some(samples) => {
            let unknowns = Unknowns::new(scene, &mesh, &setup::describe(scene, &mesh)).counts();
            (Count { unknowns, ..samples.at(cells) }, false)
        }
        None => (memory::count(scene, &mesh).ok_or_else(|| setup::uncounted(scene))?, true),
    };
    let (quality, friction) = (mesh.quality(), scene.parameters.friction);
    let velocity = Space::new(&mesh, Continuity::Continuous, scene.space.velocity, 2);
    let turning =
        rotation::remark(&mesh, &velocity, &setup::describe(scene, &mesh).conditions, friction, scene.space.slip);
    let of_mesh = domain::mesh_remarks(&mesh).into_iter().chain(setup::resolution_remarks(scene, &mesh, &quality));
    let said = of_mesh.chain(turning).collect();
    Ok(Judged { mesh: MeshReport::Built(quality), count, counted, said })
}

/// As [`try_start`] on a coarser mesh of the same domain, where there is one; what goes wrong with these cells alone
/// is no error.
fn try_coarse(scene: &Scene, cells: f64) -> Result<(), RunError> {
    let coarse = forecast::smaller(&scene.mesh, (cells / TRIED).sqrt(), scene.source());
    let tried = coarse.map_or(Ok(()), |(table, mesh)| try_start(&scene.on(&table, &mesh.tags)));
    tried.or_else(|error| if is_about_the_scene(&error) { Err(error) } else { Ok(()) })
}

/// A run that takes no more bytes than this is begun by `check`, but for its first step.
const QUICK: f64 = 200.0 * memory::MIB;
/// Cells of the mesh on which a larger one is begun.
const TRIED: f64 = 700.0;

/// Begins a run as far as its first step, and leaves nothing.
fn try_start(scene: &Scene) -> Result<(), RunError> {
    let wanted = Wanted { saved: None, file: Path::new("checkpoint.bin"), purpose: Purpose::Look };
    super::kinds::tissue::stage(scene, &wanted, &mut |plan, ground, _| {
        let ground = ground.expect("a tissue has a mesh");
        maps::check_all_windows(plan.outputs, plan.source, &ground.mesh)?;
        cuts::check(plan.outputs, ground)?;
        Gauges::new(plan, Some(ground)).map(|_| ())
    })
}

/// Whether an error on a coarser mesh is one of the scene itself, not of these cells.
fn is_about_the_scene(error: &RunError) -> bool {
    let of_start = matches!(error, RunError::Formula { .. } | RunError::Start { .. });
    of_start || matches!(error, RunError::Measure(_) | RunError::Map { .. } | RunError::Scene(_))
}

/// Bytes that a run writes.
fn written(scene: &Scene, count: &Count) -> f64 {
    written_on(scene, count.cells, count.unknowns)
}

/// Bytes that a run writes on a mesh of so many cells, with these unknowns of velocity, pressure or density, and
/// polarity.
pub(super) fn written_on(scene: &Scene, cells: f64, unknowns: [f64; 4]) -> f64 {
    let space = scene.space;
    let degree = [space.velocity, space.pressure, space.density, space.polarity, scene.mesh.get("curved").unwrap_or(1)];
    let sizes = Sizes {
        cells,
        degree: degree.into_iter().max().unwrap_or(1),
        bodies: scene.bodies.as_ref().map_or(0, |bodies| bodies.bodies.len()),
        checkpoint: unknowns[0] + (scene.time.order + 2) as f64 * (unknowns[1] + unknowns[2]),
        columns: measures::columns(&scene.outputs, Some(scene)).len(),
        steps: disk::steps(scene.time.control.step, scene.time.end, scene.time.max_steps),
        end: scene.time.end,
    };
    disk::bytes(&scene.outputs, &sizes)
}

impl fmt::Display for Report {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        head(out, self.title.as_deref(), &self.terms)?;
        writeln!(out, "\nmesh\n{}", indent(&self.mesh.to_string()))?;
        if let Some(bodies) = &self.bodies {
            writeln!(out, "\n{bodies}")?;
        }
        writeln!(out, "\nunknowns")?;
        for (name, count) in [
            ("velocity", self.velocity_unknowns),
            (self.volume, self.volume_unknowns),
            ("polarity", self.polarity_unknowns),
            ("flow system", self.flow_unknowns),
        ] {
            writeln!(out, "  {name:<14} {count}")?;
        }
        writeln!(out, "  {:<14} {}", "polarity form", self.polarity_form.name())?;
        if let Some(steps) = self.steps {
            writeln!(out, "\nsteps   {steps} of the full length")?;
        }
        write!(out, "\nmemory  about {:.0} MiB\ndisk    about {}", self.memory_mib, disk::shown(self.disk_mib))?;
        if let Some(preset) = &self.accuracy {
            write!(out, "\n\naccuracy = \"{}\" sets", preset.name)?;
            for (key, value) in &preset.sets {
                write!(out, "\n  {key} = {value}")?;
            }
            if preset.sets.is_empty() {
                write!(out, " nothing: the scene gives every key itself")?;
            }
            write!(out, "\nerrors and wall seconds that it was measured to have (docs/tradeoff.md)")?;
            for (case, measure, error, seconds) in &preset.measured {
                write!(out, "\n  {case:<22} {measure:<34} {error:>12}  {seconds:>6} s")?;
            }
        }
        for remark in &self.remarks {
            write!(out, "\n\nnote: {remark}")?;
        }
        Ok(())
    }
}

/// Title and terms of a report.
pub(in crate::run) fn head(out: &mut fmt::Formatter<'_>, title: Option<&str>, terms: &[TermStatus]) -> fmt::Result {
    if let Some(title) = title {
        writeln!(out, "{title}\n")?;
    }
    writeln!(out, "terms")?;
    for term in terms {
        let mark = if term.on { "on " } else { "off" };
        writeln!(out, "  {mark}  {:<26} {:<44} {}", term.name, term.formula, term.reason)?;
    }
    Ok(())
}

pub(in crate::run) fn indent(text: &str) -> String {
    text.lines().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n")
}
