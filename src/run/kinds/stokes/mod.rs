//! A Stokes flow and the bodies that it carries: report and run.

mod stepper;

use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;

use crate::mesh::Mesh;
use crate::mesh::generate::MeshScene;
use crate::model::closed::ClosedParts;
use crate::model::fields::{PRESSURE, VELOCITY};
use crate::model::frames::Frames;
use crate::model::momentum::check_held;
use crate::model::{TermStatus, rotation};
use crate::run::available::available;
use crate::run::bodies::{BodiesReport, body_terms};
use crate::run::exact::Claim;
use crate::run::forecast::{COUNTED, Count, Samples, smaller};
use crate::run::kinds::{self, Amounts, Compared, Kind};
use crate::run::maps::Caption;
use crate::run::report::{Expected, MeshReport, head};
use crate::run::stepper::{Ground, Limits, Plan, Stage, Wanted};
use crate::run::summary::Unknowns;
use crate::run::{Options, RunError, disk, domain, maps, memory, resolution};
use crate::scene::{Output, SceneSource, StokesScene, measured};
use crate::solve::DIRECT_TOLERANCE;
use crate::space::{Continuity, Space};
use stepper::FlowStepper;

/// What will be solved, and with how much.
#[derive(Debug, Clone, Serialize)]
pub struct StokesReport {
    /// One line for reports.
    pub title: Option<String>,
    /// The terms of the equations, on and off.
    pub terms: Vec<TermStatus>,
    /// Size and quality.
    pub mesh: MeshReport,
    /// How many there are.
    pub bodies: usize,
    /// How they are and meet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<BodiesReport>,
    /// Of v.
    pub velocity_unknowns: usize,
    /// Of Π.
    pub pressure_unknowns: usize,
    /// Of the linear system of the flow.
    pub flow_unknowns: usize,
    /// Of the full length.
    pub steps: f64,
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
}

/// Mesh and sizes of a scene, before anything is assembled.
struct Sizes {
    mesh: Arc<Mesh>,
    count: Count,
}

/// Velocity, pressure, and the frames of the velocity.
fn spaces(scene: &StokesScene, mesh: &Arc<Mesh>) -> (Space, Space, Frames) {
    let velocity = Space::new(mesh, Continuity::Continuous, scene.degrees[0], 2);
    let pressure = Space::new(mesh, Continuity::Continuous, scene.degrees[1], 1);
    let frames = Frames::new(&velocity, &scene.conditions(mesh), scene.slip.points());
    (velocity, pressure, frames)
}

/// What a scene has on a mesh.
fn count(scene: &StokesScene, mesh: &Arc<Mesh>) -> Count {
    let (velocity, pressure, frames) = spaces(scene, mesh);
    let closed = ClosedParts::new(&pressure, &scene.conditions(mesh));
    memory::count_flow(&velocity, &pressure, &frames, &closed)
}

/// As [`memory::samples`].
fn samples(scene: &StokesScene, cells: f64) -> Option<Samples> {
    Samples::new((&scene.mesh, cells), scene.source(), |_, mesh| Some(count(&scene.on(&mesh.tags), &mesh)))
}

/// What a scene takes, by the number of cells that its mesh will have; a mesh from a file is read.
///
/// # Errors
/// A mesh that cannot be built or that does not fit.
pub fn forecast(scene: &StokesScene) -> Result<Count, RunError> {
    match scene.mesh.expected().filter(|cells| *cells > COUNTED).and_then(|cells| Some((cells, samples(scene, cells)?)))
    {
        Some((cells, samples)) => Ok(samples.at(cells)),
        None => sizes(scene).map(|sizes| sizes.count),
    }
}

fn sizes(scene: &StokesScene) -> Result<Sizes, RunError> {
    let mesh = Arc::new(domain::mesh_of(&scene.mesh, scene.source())?);
    scene.check_mesh(&mesh)?;
    if let Some(exact) = &scene.sources.exact {
        let (source, boundary, end) = (scene.source(), &scene.boundary, scene.time.end);
        Claim { exact, source, boundary, end }.check(&mesh)?;
    }
    if scene.fluid.friction == 0.0 {
        let velocity = Space::new(&mesh, Continuity::Continuous, scene.degrees[0], 2);
        check_held(&velocity, &scene.conditions(&mesh)).map_err(|error| {
            let origin = scene.source().place("model.friction").to_string();
            RunError::Model { origin, error: Box::new(error) }
        })?;
    }
    maps::check_all_windows(&scene.outputs, scene.source(), &mesh)?;
    let cells = mesh.cells.len() as f64;
    let large = (cells > COUNTED).then(|| samples(scene, cells)).flatten();
    let count = match large {
        None => count(scene, &mesh),
        Some(samples) => {
            let (velocity, pressure, frames) = spaces(scene, &mesh);
            Count { unknowns: memory::unknowns_of_flow(&velocity, &pressure, &frames), ..samples.at(cells) }
        }
    };
    Ok(Sizes { mesh, count })
}

/// Refuses a run that does not fit.
fn check_memory(scene: &StokesScene, bytes: f64, available: Option<f64>) -> Result<(), RunError> {
    match available.filter(|available| bytes > *available) {
        None => Ok(()),
        Some(available) => Err(RunError::Memory {
            origin: scene.source().origin().into(),
            needed: bytes / memory::MIB,
            available: available / memory::MIB,
            hint: "take a coarser mesh or a lower degree `space.k`; MONOLAYER_MEMORY (MiB) sets what is available"
                .into(),
        }),
    }
}

/// A run that takes no more bytes than this is begun by `check`, but for its first step.
const QUICK: f64 = 200.0 * memory::MIB;
/// Cells of the mesh on which a larger one is checked.
const TRIED: f64 = 700.0;

/// Bytes that a run writes.
fn written(scene: &StokesScene, count: &Count) -> f64 {
    let sizes = disk::Sizes {
        cells: count.cells,
        degree: scene.degrees[0].max(scene.mesh.get("curved").unwrap_or(1)),
        bodies: scene.bodies.as_ref().map_or(0, |bodies| bodies.bodies.len()),
        checkpoint: 0.0,
        columns: measured(&scene.outputs).len(),
        steps: disk::steps(scene.time.bounds.step, scene.time.end, scene.time.max_steps),
        end: scene.time.end,
    };
    disk::bytes(&scene.outputs, &sizes)
}

/// Says what a scene is and takes; solves nothing.
///
/// # Errors
/// All that a run could say before its first step, besides what its folder holds.
pub fn report(scene: &StokesScene) -> Result<StokesReport, RunError> {
    let available = available()?;
    let mut said = Vec::new();
    let large = scene.mesh.expected().filter(|cells| *cells > scene.mesh.quickly_built());
    let (mesh, count) = match large.and_then(|cells| samples(scene, cells).map(|samples| samples.at(cells))) {
        Some(count) => {
            if let Some((_, mesh)) = smaller(&scene.mesh, (count.cells / TRIED).sqrt(), scene.source()) {
                scene.check_mesh(&mesh)?;
                maps::check_all_windows(&scene.outputs, scene.source(), &mesh)?;
            }
            (MeshReport::Expected(Expected::new(&count)), count)
        }
        None => {
            let Sizes { mesh, count } = sizes(scene)?;
            if count.bytes <= QUICK && available.is_none_or(|available| count.bytes <= available) {
                let walls = scene.bodies.as_ref().map_or_else(Vec::new, |bodies| bodies.walls_on(&mesh));
                FlowStepper::new(scene, &mesh, &walls, None)?;
            }
            said = remarks(scene, &mesh);
            (MeshReport::Built(mesh.quality()), count)
        }
    };
    let bytes = written(scene, &count);
    let lacking = [check_memory(scene, count.bytes, available), disk::check(scene.source(), bytes, Path::new("."))];
    let bodies = scene.bodies.as_ref();
    Ok(StokesReport {
        title: scene.title.clone(),
        terms: terms(scene),
        bodies: bodies.map_or(0, |bodies| bodies.bodies.len()),
        body: bodies.map(BodiesReport::new),
        velocity_unknowns: count.unknowns[0] as usize,
        pressure_unknowns: count.unknowns[1] as usize,
        flow_unknowns: count.unknowns[3] as usize,
        steps: disk::steps(scene.time.bounds.step, scene.time.end, scene.time.max_steps),
        memory_mib: count.bytes / memory::MIB,
        available_mib: available.map(|bytes| bytes / memory::MIB),
        disk_mib: bytes / memory::MIB,
        remarks: said,
        refused: crate::run::report::refusals(lacking),
        mesh,
    })
}

/// What is worth knowing of a flow on its mesh and no error.
fn remarks(scene: &StokesScene, mesh: &Arc<Mesh>) -> Vec<String> {
    let mut remarks = scene.source().notes().to_vec();
    remarks.extend(domain::mesh_remarks(mesh));
    let velocity = Space::new(mesh, Continuity::Continuous, scene.degrees[0], 2);
    remarks.extend(rotation::remark(mesh, &velocity, &scene.conditions(mesh), scene.fluid.friction, scene.slip));
    remarks.extend(scene.bodies.as_ref().and_then(|bodies| resolution::at_start(mesh, &bodies.bodies)));
    remarks
}

/// The terms of the flow and of its bodies, on and off.
fn terms(scene: &StokesScene) -> Vec<TermStatus> {
    scene.terms().into_iter().chain(body_terms(scene.bodies.as_ref())).collect()
}

impl fmt::Display for StokesReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        head(out, self.title.as_deref(), &self.terms)?;
        writeln!(out, "\nmesh\n{}", crate::run::report::indent(&self.mesh.to_string()))?;
        if let Some(body) = &self.body {
            writeln!(out, "\n{body}")?;
        }
        writeln!(out, "\nunknowns")?;
        for (name, count) in [
            ("velocity", self.velocity_unknowns),
            ("pressure", self.pressure_unknowns),
            ("flow system", self.flow_unknowns),
        ] {
            writeln!(out, "  {name:<14} {count}")?;
        }
        writeln!(out, "\nsteps   {} of the full length", self.steps)?;
        write!(out, "\nmemory  about {:.0} MiB\ndisk    about {}", self.memory_mib, disk::shown(self.disk_mib))?;
        self.remarks.iter().try_for_each(|remark| write!(out, "\n\nnote: {remark}"))
    }
}

impl Kind for StokesScene {
    fn title(&self) -> Option<&str> {
        self.title.as_deref()
    }

    fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    fn source(&self) -> &SceneSource {
        self.source()
    }

    fn resolved_toml(&self) -> String {
        self.resolved_toml()
    }

    fn mesh(&self) -> Option<&MeshScene> {
        Some(&self.mesh)
    }

    fn bytes(&self) -> Option<f64> {
        forecast(self).ok().map(|count| count.bytes)
    }

    fn report(&self) -> Result<Box<dyn kinds::Report>, RunError> {
        Ok(Box::new(report(self)?))
    }

    fn stage(&self, wanted: &Wanted, then: &mut Stage) -> Result<(), RunError> {
        stage(self, wanted, then)
    }

    /// With velocities of degree q and pressures r: `v` min(q+1, r+2), `Π` min(q, r+1); there is no error in time.
    fn compared(&self) -> Option<Compared<'_>> {
        let exact = self.sources.exact.as_deref()?;
        let [q, r] = self.degrees;
        let orders = vec![(VELOCITY, (q + 1).min(r + 2)), (PRESSURE, q.min(r + 1))];
        let (step, end) = (self.time.bounds.step, self.time.end);
        Some(Compared { exact, step, longest: step, end, orders, order_in_time: None, tolerance: DIRECT_TOLERANCE })
    }
}

impl kinds::Report for StokesReport {
    fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self)
    }

    fn refused(&self) -> &[String] {
        &self.refused
    }

    fn amounts(&self) -> Amounts {
        Amounts { cells: self.mesh.cells(), steps: self.steps, memory_mib: self.memory_mib, disk_mib: self.disk_mib }
    }
}

/// Prepares a Stokes flow and its bodies, at the start or where a checkpoint has them.
///
/// # Errors
/// Anything that is wrong before the first step.
fn stage(scene: &StokesScene, wanted: &Wanted, then: &mut Stage) -> Result<(), RunError> {
    let begin = Instant::now();
    let available = if wanted.purpose.interrupt().is_some() { available()? } else { None };
    if available.is_some() && scene.mesh.expected().is_some_and(|cells| cells > COUNTED) {
        // before the mesh is made, which takes its time and memory, too
        check_memory(scene, forecast(scene)?.bytes, available)?;
    }
    let Sizes { mesh, count } = sizes(scene)?;
    check_memory(scene, count.bytes, available)?;
    let writes = |options: &Options| disk::check(scene.source(), written(scene, &count), &options.out);
    wanted.purpose.options().map_or(Ok(()), writes)?;
    wanted.check_mesh(&mesh)?;
    let walls = scene.bodies.as_ref().map_or_else(Vec::new, |bodies| bodies.walls_on(&mesh));
    let mut stepper = FlowStepper::new(scene, &mesh, &walls, wanted.unpack()?)?;
    let [velocity, pressure, stokes_system] = [0, 1, 3].map(|k| count.unknowns[k] as usize);
    let plan = Plan {
        title: scene.title.as_deref(),
        source: scene.source(),
        text: scene.resolved_toml(),
        limits: Limits::at(scene.time.end, scene.time.max_steps),
        suspect: crate::run::extremes::of_source(scene.source()),
        outputs: &scene.outputs,
        bodies: scene.bodies.as_ref().map_or(&[], |bodies| &bodies.bodies),
        walls,
        tells_of_bodies: true,
        terms: terms(scene),
        remarks: remarks(scene, &mesh),
        said_of_start: None,
        exact: scene.sources.exact.clone(),
        tissue: None,
        caption: Caption::of_flow(scene),
        unknowns: Unknowns {
            fields: [(VELOCITY.name, velocity), (PRESSURE.name, pressure)].into(),
            stokes_system,
            ..Unknowns::default()
        },
        setup_seconds: begin.elapsed().as_secs_f64(),
    };
    then(&plan, Some(&Ground::new(&mesh, &scene.mesh)), &mut stepper)
}
