//! Advection: a density that a given velocity carries, by upwind fluxes, A-BDF and the limiter of the tissue's density.

use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;

use crate::expression::{Expression, ExpressionError};
use crate::form::transport::{a_mass, l_mass, transport};
use crate::form::{FacePoint, Faces, Integrator};
use crate::measure::MeasureError;
use crate::measure::fields::Fields;
use crate::mesh::generate::MeshScene;
use crate::mesh::{Mesh, Point};
use crate::model::compressible::Density;
use crate::model::fields::{DENSITY, VELOCITY};
use crate::model::polarity::downstream_order;
use crate::model::{FieldId, TermStatus, start};
use crate::run::available::available;
use crate::run::kinds::{self, Amounts, Kind};
use crate::run::maps::Caption;
use crate::run::memory::MIB;
use crate::run::report::{MeshReport, head, indent, refusals};
use crate::run::stepper::{Ground, Halt, Limits, Plan, Stage, Stepper, Stride, Wanted, shortened};
use crate::run::summary::Unknowns;
use crate::run::view::View;
use crate::run::{RunError, disk, domain, maps};
use crate::scene::kinds::advection::AdvectionScene;
use crate::scene::{Output, SceneSource, measured};
use crate::scheme::abdf::Formula;
use crate::scheme::adaptive::{AdaptedStep, AdaptiveStep, Refusal};
use crate::solve::axpy;
use crate::solve::blocks::{Neighbours, neighbours};
use crate::solve::rows::Rows;
use crate::space::project::interpolate_vector;
use crate::space::{Continuity, Field, Space};

impl Kind for AdvectionScene {
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
        let cells =
            self.mesh.expected().or_else(|| Some(domain::mesh_of(&self.mesh, self.source()).ok()?.cells.len() as f64));
        cells.map(|cells| bytes(self, cells))
    }

    fn report(&self) -> Result<Box<dyn kinds::Report>, RunError> {
        Ok(Box::new(AdvectionReport::new(self)?))
    }

    fn stage(&self, wanted: &Wanted, then: &mut Stage) -> Result<(), RunError> {
        let begin = Instant::now();
        if wanted.purpose.interrupt().is_some() {
            check_memory(self)?;
        }
        let mesh = Arc::new(domain::mesh_of(&self.mesh, self.source())?);
        if let Some(options) = wanted.purpose.options() {
            disk::check(self.source(), written(self, mesh.cells.len() as f64), &options.out)?;
        }
        wanted.check_mesh(&mesh)?;
        let stepper = CarriedDensity::new(self, &mesh)?;
        let mut stepper = match wanted.unpack::<State>()? {
            Some(state) if state.past.iter().all(|(_, y)| y.len() == stepper.rho.values.len()) => {
                stepper.resumed(state)
            }
            Some(_) => return Err(wanted.unfit("space")),
            None => stepper,
        };
        let plan = Plan {
            title: self.title.as_deref(),
            source: self.source(),
            text: self.resolved_toml(),
            limits: Limits::at(self.end, self.max_steps),
            suspect: self.suspect(),
            outputs: &self.outputs,
            bodies: &[],
            walls: Vec::new(),
            tells_of_bodies: false,
            terms: terms(self),
            remarks: remarks(self, &mesh),
            said_of_start: None,
            exact: None,
            tissue: None,
            caption: Caption::default(),
            unknowns: Unknowns { fields: [(DENSITY.name, stepper.rho.values.len())].into(), ..Unknowns::default() },
            setup_seconds: begin.elapsed().as_secs_f64(),
        };
        then(&plan, Some(&Ground::new(&mesh, &self.mesh)), &mut stepper)
    }
}

fn terms(scene: &AdvectionScene) -> Vec<TermStatus> {
    let [v1, v2] = scene.velocity.each_ref().map(Expression::text);
    let reason = format!("velocity = [{v1}, {v2}]");
    vec![TermStatus { name: "transport", formula: "a_mass(ρ,z;v)", on: true, reason }]
}

fn remarks(scene: &AdvectionScene, mesh: &Mesh) -> Vec<String> {
    scene.source().notes().iter().cloned().chain(domain::mesh_remarks(mesh)).collect()
}

/// Numbers of a cell: of each of three matrices its own block and those of its neighbours, and the levels in time.
fn bytes(scene: &AdvectionScene, cells: f64) -> f64 {
    let n = ((scene.degree + 1) * (scene.degree + 2) / 2) as f64;
    8.0 * cells * (3.0 * 4.0 * n * n + (scene.order + 40) as f64 * n + 200.0)
}

fn check_memory(scene: &AdvectionScene) -> Result<(), RunError> {
    let needed = scene.bytes().unwrap_or(0.0);
    match available()?.filter(|available| needed > *available) {
        None => Ok(()),
        Some(available) => Err(RunError::Memory {
            origin: scene.source().origin().into(),
            needed: needed / MIB,
            available: available / MIB,
            hint: "take a coarser mesh or a lower degree `space.k`".into(),
        }),
    }
}

/// Bytes that a run writes.
fn written(scene: &AdvectionScene, cells: f64) -> f64 {
    let n = ((scene.degree + 1) * (scene.degree + 2) / 2) as f64;
    let sizes = disk::Sizes {
        cells,
        degree: (scene.degree + 1).max(scene.mesh.get("curved").unwrap_or(1)),
        bodies: 0,
        checkpoint: (scene.order + 1) as f64 * n * cells,
        columns: measured(&scene.outputs).len(),
        steps: disk::steps(scene.bounds.step, scene.end, scene.max_steps),
        end: scene.end,
    };
    disk::bytes(&scene.outputs, &sizes)
}

/// What `check` says of advection.
#[derive(Debug, Clone, Serialize)]
struct AdvectionReport {
    title: Option<String>,
    terms: Vec<TermStatus>,
    mesh: MeshReport,
    density_unknowns: usize,
    steps: f64,
    memory_mib: f64,
    disk_mib: f64,
    remarks: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    refused: Vec<String>,
}

impl AdvectionReport {
    fn new(scene: &AdvectionScene) -> Result<Self, RunError> {
        let lacking = check_memory(scene);
        let mesh = Arc::new(domain::mesh_of(&scene.mesh, scene.source())?);
        let cells = mesh.cells.len() as f64;
        maps::check_all_windows(&scene.outputs, scene.source(), &mesh)?;
        let disk_bytes = written(scene, cells);
        let density_unknowns = match &lacking {
            Ok(()) => CarriedDensity::new(scene, &mesh)?.rho.values.len(),
            Err(_) => Space::new(&mesh, Continuity::Discontinuous, scene.degree, 1).dof_count(),
        };
        Ok(Self {
            title: scene.title.clone(),
            terms: terms(scene),
            density_unknowns,
            steps: disk::steps(scene.bounds.step, scene.end, scene.max_steps),
            memory_mib: bytes(scene, cells) / MIB,
            disk_mib: disk_bytes / MIB,
            remarks: remarks(scene, &mesh),
            refused: refusals([lacking, disk::check(scene.source(), disk_bytes, Path::new("."))]),
            mesh: MeshReport::Built(mesh.quality()),
        })
    }
}

impl fmt::Display for AdvectionReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        head(out, self.title.as_deref(), &self.terms)?;
        writeln!(out, "\nmesh\n{}", indent(&self.mesh.to_string()))?;
        writeln!(out, "\nunknowns\n  {:<14} {}", "density", self.density_unknowns)?;
        writeln!(out, "\nsteps   {} of the full length", self.steps)?;
        write!(out, "\nmemory  about {:.0} MiB\ndisk    about {}", self.memory_mib, disk::shown(self.disk_mib))?;
        self.remarks.iter().try_for_each(|remark| write!(out, "\n\nnote: {remark}"))
    }
}

impl kinds::Report for AdvectionReport {
    fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self)
    }

    fn refused(&self) -> &[String] {
        &self.refused
    }

    fn amounts(&self) -> Amounts {
        let (steps, memory_mib, disk_mib) = (self.steps, self.memory_mib, self.disk_mib);
        Amounts { cells: self.mesh.cells(), steps, memory_mib, disk_mib }
    }
}

/// What a checkpoint holds: times and densities, newest first, and the control of the steps.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct State {
    past: Vec<(f64, Vec<f64>)>,
    step_control: AdaptiveStep,
}

/// A density on its way.
struct CarriedDensity<'s> {
    scene: &'s AdvectionScene,
    loops: Integrator,
    neighbours: Neighbours,
    density: Density,
    inflow: Vec<Expression>,
    /// Of the newest level.
    rho: Field,
    v: Field,
    state: State,
}

/// A velocity at a time.
///
/// # Errors
/// A formula that is not finite.
fn velocity_at(scene: &AdvectionScene, space: &Arc<Space>, t: f64) -> Result<Field, ExpressionError> {
    let [v1, v2] = scene.velocity.each_ref().map(|formula| formula.at_time(t));
    let finite = |x: Point| v1.try_eval(x, t).and_then(|_| v2.try_eval(x, t)).map(drop);
    space.node_positions().into_iter().try_for_each(finite)?;
    Ok(interpolate_vector(space, |x| Point::new(v1.eval(x, t), v2.eval(x, t))))
}

impl<'s> CarriedDensity<'s> {
    fn new(scene: &'s AdvectionScene, mesh: &Arc<Mesh>) -> Result<Self, RunError> {
        let inflow = scene.inflow(&mesh.tags)?;
        let formula = |error| RunError::Formula { origin: scene.source().origin().into(), error: Box::new(error) };
        let loops = Integrator::new(mesh);
        let space = Arc::new(Space::new(mesh, Continuity::Discontinuous, scene.degree, 1));
        let (order, rank) = downstream_order(mesh);
        let density = Density::new(&loops, &space, Faces::BOUNDARY, (&order, &rank))?;
        let rho = start::density(&density.limiter, &scene.initial, 0.0).map_err(formula)?;
        let flow = Arc::new(Space::new(mesh, Continuity::Continuous, scene.degree + 1, 2));
        let v = velocity_at(scene, &flow, 0.0).map_err(formula)?;
        let state = State { past: vec![(0.0, rho.values.clone())], step_control: AdaptiveStep::default() };
        Ok(Self { scene, neighbours: neighbours(mesh), loops, density, inflow, rho, v, state })
    }

    fn resumed(self, state: State) -> Self {
        let (t, rho) = state.past[0].clone();
        let (rho, space) = (Field::new(&self.density.space, rho), self.v.space.clone());
        // it was finite when the run came by
        let v = velocity_at(self.scene, &space, t).unwrap_or(self.v);
        Self { rho, v, state, ..self }
    }

    /// The density of what flows in at a time.
    fn brought(&self, t: f64) -> impl Fn(&FacePoint) -> f64 + Sync + '_ {
        let tag = |s: &FacePoint| self.loops.mesh.faces[s.face].tag;
        move |s| tag(s).map_or(0.0, |tag| self.inflow[tag].eval(s.minus.x, t))
    }

    /// A bound on `|λ|` of the transport by a velocity, per time.
    fn stiffness(&self, v: &Field) -> f64 {
        let k = (self.scene.degree + 1) as f64;
        let fastest = |cell: usize| {
            let both = v.coefficients(cell, 0).zip(v.coefficients(cell, 1));
            both.fold(0.0_f64, |most, (x, y)| most.max(x.hypot(y)))
        };
        let of_cell = |cell: usize| 0.75 * k * k * self.loops.ratio(cell) * fastest(cell);
        (0..self.loops.mesh.cells.len()).map(of_cell).fold(0.0, f64::max)
    }

    /// The matrix of the transport by a velocity.
    fn rows(&self, v: &Field) -> Rows {
        let space = &*self.density.space;
        let mut rows = Rows::zero(&self.neighbours, (space.n, space.n), true);
        let form = a_mass(space, v, Faces::BOUNDARY);
        self.loops.add_rows(&form, (space, space), &mut rows.own, &mut rows.off);
        rows
    }

    /// One step by A-BDF: `w M ρ^n + T^n ρ^n = w M (Σ α̃_i ρ^{n−i} + Δt β̃_1 ρ̇^{n−1}) + l^n`, `w = 1/(Δt β̃_0)`.
    fn step(&self, t: f64, dt: f64) -> Result<(Field, Field, usize), Refusal> {
        let (space, next) = (&self.density.space, t + dt);
        let failed = |error: String| Refusal::Failure(error);
        let v = velocity_at(self.scene, &self.v.space, next).map_err(|error| failed(error.to_string()))?;
        let times: Vec<f64> = std::iter::once(next).chain(self.state.past.iter().map(|(t, _)| *t)).collect();
        let formula = Formula::choose(&times, self.scene.order, self.stiffness(&v) * dt, false);
        let mut history = vec![0.0; self.rho.values.len()];
        for (alpha, (_, rho)) in formula.alpha.iter().zip(&self.state.past) {
            axpy(*alpha, rho, &mut history);
        }
        if formula.beta[1] != 0.0 {
            let leaving = transport(&self.rho, &self.v, Faces::BOUNDARY, self.brought(t));
            let rate = self.density.mass_solve(&self.loops.vector(&leaving, space));
            axpy(-dt * formula.beta[1], &rate, &mut history);
        }
        let w = 1.0 / (dt * formula.beta[0]);
        let mut right: Vec<f64> = self.density.mass_times(&history).iter().map(|h| w * h).collect();
        axpy(1.0, &self.loops.vector(&l_mass(space, &v, Faces::BOUNDARY, self.brought(next)), space), &mut right);
        if !right.iter().all(|b| b.is_finite()) {
            let what = format!("a density of what flows in is not finite at t = {next}; hint: look at [boundary]");
            return Err(failed(what));
        }
        let rows = self.rows(&v);
        let mut rho = self.rho.clone();
        let products =
            self.density.solve(w, &rows, &right, &mut rho).map_err(|error| Refusal::Force(error.to_string()))?;
        let limited = self.density.limiter.limit(&rho).map_err(|error| Refusal::Force(error.to_string()))?;
        Ok((limited.rho, v, products))
    }
}

impl Stepper for CarriedDensity<'_> {
    fn advance(&mut self, t: f64, landing: f64) -> Result<Stride, Halt> {
        let mut control = self.state.step_control.clone();
        let made = control.advance((t, landing), &self.scene.bounds, |t, dt| Ok((self.step(t, dt)?, true)))?;
        let AdaptedStep { t, dt, rejected, why, done: (rho, v, iterations) } = made;
        self.state.step_control = control;
        self.state.past.insert(0, (t, rho.values.clone()));
        self.state.past.truncate(self.scene.order);
        (self.rho, self.v) = (rho, v);
        let notes = why.iter().map(|why| shortened(t, dt, why)).collect();
        Ok(Stride { t, dt, iterations, rejected, coupled: None, notes, left: Vec::new() })
    }

    fn state(&self) -> Vec<u8> {
        postcard::to_stdvec(&self.state).expect("numbers are always written")
    }

    fn look(&mut self, then: &mut dyn FnMut(&View) -> Result<(), RunError>) -> Result<(), RunError> {
        let t = self.state.past[0].0;
        let fields = Shown { loops: &self.loops, v: &self.v, rho: &self.rho };
        then(&View { t, fields: Some(&fields), bodies: None, tissue: None, flow: None })
    }
}

struct Shown<'a> {
    loops: &'a Integrator,
    v: &'a Field,
    rho: &'a Field,
}

impl Fields for Shown<'_> {
    fn loops(&self) -> &Integrator {
        self.loops
    }

    fn flowing(&self) -> Integrator {
        self.loops.clone()
    }

    fn field(&self, id: FieldId) -> Result<Option<Field>, MeasureError> {
        Ok(match id {
            id if *id == *VELOCITY => Some(self.v.clone()),
            id if *id == *DENSITY => Some(self.rho.clone()),
            _ => None,
        })
    }

    fn degree(&self) -> usize {
        self.v.space.degree
    }
}
