//! A Stokes flow and the bodies that it carries: report and run.

mod stepper;

use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;

use super::available::available;
use super::motion::saved::SavedMotion;
use super::motion::{self, MotionSummary, Mover, Plan};
use super::{Options, RunError, maps, memory, resolution, setup};
use crate::contact::{Law, Wall};
use crate::mesh::Mesh;
use crate::mesh::quality::Quality;
use crate::model::closed::ClosedParts;
use crate::model::frames::Frames;
use crate::model::momentum::check_held;
use crate::model::{Term, rotation};
use crate::scene::StokesScene;
use crate::scene::bodies::Bodies;
use crate::space::{Continuity, Space};
use stepper::{Checkpoint, Stepper};

/// What will be solved, and with how much.
#[derive(Debug, Clone, Serialize)]
pub struct StokesReport {
    pub title: Option<String>,
    pub terms: Vec<Term>,
    pub mesh: Quality,
    pub bodies: usize,
    pub walls: usize,
    pub velocity_unknowns: usize,
    pub pressure_unknowns: usize,
    /// Of the linear system of the flow.
    pub flow_unknowns: usize,
    /// Estimate of the peak memory of a run.
    pub memory_mib: f64,
    /// What the system can give, where it tells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub available_mib: Option<f64>,
    pub remarks: Vec<String>,
}

/// Mesh and sizes of a scene, before anything is assembled.
struct Sizes {
    mesh: Arc<Mesh>,
    velocity: Space,
    pressure: usize,
    system: usize,
    bytes: f64,
}

fn sizes(scene: &StokesScene) -> Result<Sizes, RunError> {
    let mesh = Arc::new(setup::mesh_of(&scene.mesh, scene.source())?);
    scene.check_mesh(&mesh)?;
    let conditions = scene.conditions(&mesh);
    let velocity = Space::new(&mesh, Continuity::Continuous, scene.degrees[0], 2);
    let pressure = Space::new(&mesh, Continuity::Continuous, scene.degrees[1], 1);
    if scene.friction == 0.0 {
        check_held(&velocity, &conditions).map_err(|error| {
            let origin = scene.source().place("model.friction").to_string();
            RunError::Model { origin, error: Box::new(error) }
        })?;
    }
    let frames = Frames::new(&velocity, &conditions, scene.slip.points());
    let bytes = memory::of_flow(&velocity, &pressure, &frames, &ClosedParts::new(&pressure, &conditions));
    let (system, pressure) = (frames.free + pressure.dof_count(), pressure.dof_count());
    Ok(Sizes { mesh, velocity, pressure, system, bytes })
}

/// Estimate of a run's largest memory in bytes; `None` for a scene that will be refused anyway.
pub fn need(scene: &StokesScene) -> Option<f64> {
    sizes(scene).ok().map(|sizes| sizes.bytes)
}

/// Builds the mesh of a scene and counts; solves nothing.
///
/// # Errors
/// As [`setup::mesh_of`] and [`StokesScene::check_mesh`]; a flow that nothing holds.
pub fn report(scene: &StokesScene) -> Result<StokesReport, RunError> {
    let sizes = sizes(scene)?;
    let available = available()?;
    let mut remarks = remarks(scene, &sizes.mesh);
    if available.is_some_and(|available| sizes.bytes > available) {
        remarks.push(
            "the run does not fit into the memory that is available; take a coarser mesh or a lower degree".into(),
        );
    }
    let bodies = scene.bodies.as_ref();
    Ok(StokesReport {
        title: scene.title.clone(),
        terms: terms(scene),
        bodies: bodies.map_or(0, |bodies| bodies.bodies.len()),
        walls: bodies.map_or(0, |bodies| bodies.walls_on(&sizes.mesh).len()),
        velocity_unknowns: sizes.velocity.dof_count(),
        pressure_unknowns: sizes.pressure,
        flow_unknowns: sizes.system,
        memory_mib: sizes.bytes / memory::MIB,
        available_mib: available.map(|bytes| bytes / memory::MIB),
        remarks,
        mesh: sizes.mesh.quality(),
    })
}

fn remarks(scene: &StokesScene, mesh: &Arc<Mesh>) -> Vec<String> {
    let mut remarks = scene.source().notes().to_vec();
    remarks.extend(setup::mesh_remarks(mesh));
    let velocity = Space::new(mesh, Continuity::Continuous, scene.degrees[0], 2);
    remarks.extend(rotation::remark(mesh, &velocity, &scene.conditions(mesh), scene.friction));
    if scene.pressure_is_free() {
        remarks.push(
            "the velocity is Dirichlet or slip on the whole boundary: the pressure is fixed by its zero mean, and the \
             prescribed flow must conserve volume"
                .to_owned(),
        );
    }
    remarks.extend(scene.bodies.as_ref().and_then(|bodies| resolution::at_start(mesh, &bodies.bodies)));
    remarks
}

/// The terms of the flow and of its bodies, on and off.
pub fn terms(scene: &StokesScene) -> Vec<Term> {
    let term = |name, formula, on, reason: String| Term { name, formula, on, reason };
    let always = || "always on".to_owned();
    let force = scene.force.is_some();
    let mut terms = vec![
        term("viscosity", "2(D(v)|D(w))", true, always()),
        term("friction", "C_F (v|w)", scene.friction > 0.0, format!("friction = {}", scene.friction)),
        term("pressure", "b(w,Π), b(v,ξ)", true, always()),
        term("force", "(f_v|w)", force, if force { "given in [source]" } else { "not given" }.to_owned()),
    ];
    match &scene.bodies {
        None => terms.push(term("bodies", "(2/ε) Σ (D(v)|D(w))_B", false, "no [[body]]".to_owned())),
        Some(bodies) => {
            let count = bodies.bodies.len();
            let reason = format!("{count} of them, epsilon = {:e}", bodies.rigid.epsilon);
            terms.push(term("bodies", "(2/ε) Σ (D(v)|D(w))_B", true, reason));
            terms.push(contact_term(bodies));
        }
    }
    terms
}

/// The contact of bodies, on or off.
pub(super) fn contact_term(bodies: &Bodies) -> Term {
    let name = "contact";
    match &bodies.contact {
        None => Term { name, formula: "D ≥ 0", on: false, reason: "nothing can touch".to_owned() },
        Some(contact) => {
            let (formula, law) = match contact.law {
                Law::Inelastic => ("D ≥ 0", "inelastic".to_owned()),
                Law::Gluey { gamma_min } => ("D ≥ 0, γ ≤ 0, Dγ = 0", format!("gluey, gamma_min = {gamma_min}")),
            };
            let margin = if contact.margin > 0.0 { format!(", margin {}", contact.margin) } else { String::new() };
            let walls = bodies.walls.len() + bodies.wall_tags.len();
            Term { name, formula, on: true, reason: format!("{law}, {walls} walls{margin}") }
        }
    }
}

impl fmt::Display for StokesReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        head(out, self.title.as_deref(), &self.terms)?;
        writeln!(out, "\nmesh\n{}", super::report::indent(&self.mesh.to_string()))?;
        writeln!(out, "\nbodies         {}\nwalls          {}", self.bodies, self.walls)?;
        writeln!(out, "\nunknowns")?;
        for (name, count) in [
            ("velocity", self.velocity_unknowns),
            ("pressure", self.pressure_unknowns),
            ("flow system", self.flow_unknowns),
        ] {
            writeln!(out, "  {name:<14} {count}")?;
        }
        write!(out, "\nmemory  about {:.0} MiB", self.memory_mib)?;
        self.remarks.iter().try_for_each(|remark| write!(out, "\n\nnote: {remark}"))
    }
}

/// Title and terms of a report.
pub(super) fn head(out: &mut fmt::Formatter<'_>, title: Option<&str>, terms: &[Term]) -> fmt::Result {
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

/// The flow and the bodies that a run has left in its folder, and the walls.
///
/// # Errors
/// A checkpoint that does not belong to the scene.
pub(super) fn finished(
    scene: &StokesScene,
    saved: &SavedMotion,
    file: &Path,
) -> Result<(Box<dyn Mover>, Vec<Wall>), RunError> {
    let mesh = sizes(scene)?.mesh;
    saved.check_mesh(&mesh, file)?;
    let walls = scene.bodies.as_ref().map_or_else(Vec::new, |bodies| bodies.walls_on(&mesh));
    let stepper = Stepper::new(scene, &mesh, &walls, Some(Checkpoint::read(&saved.state, file)?))?;
    Ok((Box::new(stepper), walls))
}

/// Runs a scene to its end and leaves the results in `options.out`.
///
/// # Errors
/// Anything that is wrong before the first step, and results that cannot be written.
pub fn run(scene: &StokesScene, options: &Options) -> Result<MotionSummary, RunError> {
    let begin = Instant::now();
    let text = scene.resolved_toml();
    let saved = motion::prepare(&text, options)?;
    let Sizes { mesh, velocity, pressure, system, bytes } = sizes(scene)?;
    if let Some(available) = available()?.filter(|available| bytes > *available) {
        return Err(RunError::Memory {
            origin: scene.source().origin().into(),
            needed: bytes / memory::MIB,
            available: available / memory::MIB,
            hint: "take a coarser mesh or a lower degree `space.k`; MONOLAYER_MEMORY (MiB) sets what is available"
                .into(),
        });
    }
    let file = options.out.join("checkpoint.bin");
    saved.iter().try_for_each(|saved| saved.check_mesh(&mesh, &file))?;
    maps::check_all_windows(&scene.outputs, scene.source(), &mesh)?;
    let walls = scene.bodies.as_ref().map_or_else(Vec::new, |bodies| bodies.walls_on(&mesh));
    let resumed = saved.as_ref().map(|saved| Checkpoint::read(&saved.state, &file)).transpose()?;
    let mut stepper = Stepper::new(scene, &mesh, &walls, resumed)?;
    let none = Vec::new();
    let plan = Plan {
        title: scene.title.as_deref(),
        origin: scene.source().origin(),
        text,
        end: scene.time.end,
        max_steps: scene.time.max_steps,
        outputs: &scene.outputs,
        bodies: scene.bodies.as_ref().map_or(&none, |bodies| &bodies.bodies),
        walls,
        terms: terms(scene),
        remarks: remarks(scene, &mesh),
        mesh: Some(mesh.quality()),
        fingerprint: mesh.fingerprint(),
        unknowns: [velocity.dof_count(), pressure, system],
        setup_seconds: begin.elapsed().as_secs_f64(),
    };
    motion::run(&plan, &mut stepper, options, saved)
}
