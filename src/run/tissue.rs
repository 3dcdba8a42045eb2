//! A tissue in which bodies move: what of a scene it cannot have, and its run.
//!
//! Bodies that are all fixed need none of this: their scene runs like any other, search for a steady state included.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::maps::{self, Caption, Source};
use super::motion::easel::Easel;
use super::motion::saved::SavedMotion;
use super::motion::{self, MotionSummary, Mover, Plan, Stride};
use super::resolution::Resolution;
use super::setup::{Setup, describe};
use super::{Options, RunError, writer};
use crate::body::guide::Guide;
use crate::body::{Body, Hold};
use crate::contact::{Bonds, Contact, ContactError, Metric, Mover as Moved, Solver, Wall};
use crate::form::Integrator;
use crate::measure::bodies::Load;
use crate::mesh::{Mesh, Point};
use crate::model::incompressible::{Description, Incompressible};
use crate::model::momentum::MomentumError;
use crate::output::OutputError;
use crate::output::bodies::{Cast, Moment};
use crate::output::vtk::{self, Grid, write_vtu};
use crate::scene::bodies::Bodies;
use crate::scene::{Field, Scene, SceneError, What};
use crate::scheme::pace::Refusal;
use crate::shape::Wrench;
use crate::shape::{Pose, Shape, Twist};
use crate::time::moving::{MovingCheckpoint, MovingError, MovingMarch, NoReferee, Referee};
use crate::time::{Kind, Sheet, StepReport};

/// Whether a scene has bodies that move.
pub fn has_moving_bodies(scene: &Scene) -> bool {
    let rests = |body: &Body| matches!(body.hold, Hold::Fixed);
    scene.bodies.as_ref().is_some_and(|bodies| !bodies.bodies.iter().all(rests))
}

/// Centre and downstream end of the one disc in a scene, where it is a body.
pub fn wake(scene: &Scene) -> Option<(Point, f64)> {
    let [Body { shape: Shape::Disc { radius }, start, .. }] = &scene.bodies.as_ref()?.bodies[..] else { return None };
    Some((start.position, start.position.x + radius))
}

/// The tissue around the bodies of a scene, where they start.
///
/// # Errors
/// As [`Incompressible::around`]; paths without a derivative.
pub fn around(mesh: &Arc<Mesh>, description: &Description, bodies: &Bodies) -> Result<Incompressible, MomentumError> {
    let guide = Arc::new(Guide::new(bodies.bodies.clone())?);
    let poses = guide.starts(0.0)?;
    Incompressible::around(mesh, description, &guide, &poses, bodies.rigid.epsilon)
}

/// Refuses what would read the inside of bodies as tissue, or what does not exist with bodies that move.
///
/// # Errors
/// The first key.
pub fn check(scene: &Scene) -> Result<(), RunError> {
    if scene.bodies.is_none() {
        return Ok(());
    }
    let refuse = |key: String, value: &str, rule: &str, hint: &str| {
        let [value, rule, hint] = [value, rule, hint].map(str::to_owned);
        Err(RunError::from(SceneError::Value { place: scene.source().place(&key), key, value, rule, hint }))
    };
    let moving = has_moving_bodies(scene);
    let energy = scene.parameters.elastic_force == crate::model::ElasticForce::Energy;
    if moving && energy && scene.parameters.elasticity != 0.0 {
        let rule = "this form of the elastic force has no traction on bodies that move";
        let hint = "take elastic_force = \"stress\", or fix the bodies";
        return refuse("model.elastic_force".into(), "\"energy-consistent\"", rule, hint);
    }
    for (at, output) in scene.outputs.iter().enumerate() {
        match &output.what {
            What::Bodies { contacts: true } if !moving => {
                let rule = "bodies that are all fixed have no contacts";
                return refuse(format!("output.{at}.contacts"), "true", rule, "remove it");
            }
            What::Measures(measures) => {
                if let Some(idle) = measures.iter().find(|measure| !moving && measure.needs_motion()) {
                    let (key, name) = (format!("output.{at}.measures"), format!("\"{}\"", idle.name));
                    let rule = "bodies that are all fixed neither move nor touch anything anew";
                    return refuse(key, &name, rule, "take `holding`, the force that holds the first body, or `body`");
                }
                for measure in measures.iter().filter(|measure| measure.is_of_tissue()) {
                    let key = format!("output.{at}.measures");
                    let name = format!("\"{}\"", measure.name);
                    if moving {
                        let rule = "this measure is not taken in a tissue with bodies that move";
                        return refuse(key, &name, rule, "measure the bodies (`body`, `gap`, …), or fix them");
                    }
                    if measure.reads_bodies() {
                        let rule = "this measure would take the inside of bodies for tissue";
                        return refuse(key, &name, rule, "leave it out, or take a mesh with a hole");
                    }
                }
            }
            What::Cuts(_) if moving => {
                let rule = "there are no cuts of a tissue with bodies that move";
                return refuse(format!("output.{at}.cuts"), "(given)", rule, "ask for `fields`");
            }
            What::Maps(_) | What::Cuts(_) | What::Fields(_) | What::Bodies { .. } | What::Checkpoint => {}
        }
    }
    if !moving {
        return Ok(());
    }
    let rest = "bodies that move";
    if scene.steady.is_some() {
        let rule = format!("a tissue with {rest} has no steady state to look for");
        return refuse("steady".into(), "(given)", &rule, "fix the bodies, or march");
    }
    if scene.time.stop_residual.is_some() || scene.time.stop_energy_rate.is_some() {
        let rule = format!("a tissue with {rest} is not tested for rest");
        return refuse("time.stop".into(), "(given)", &rule, "remove it; `time.end` ends the run");
    }
    Ok(())
}

/// The bodies of a run in which all of them are fixed.
#[derive(Debug, Clone)]
pub struct AtRest {
    /// What never changes about the bodies.
    pub cast: Cast,
    poses: Vec<Pose>,
    twists: Vec<Twist>,
    loads: Vec<Load>,
}

impl AtRest {
    /// At a time.
    pub fn moment(&self, time: f64) -> Moment<'_> {
        let Self { cast, poses, twists, loads } = self;
        Moment { cast, time, poses, twists, loads, contacts: &[] }
    }
}

/// The bodies of a scene that are all fixed, if it has some.
pub fn at_rest(scene: &Scene, setup: &Setup) -> Option<AtRest> {
    let bodies = scene.bodies.as_ref()?;
    let Kind::Incompressible(model) = setup.model.kind() else { return None };
    let cast = Cast::new(&bodies.bodies, &bodies.walls_on(&setup.mesh));
    let count = bodies.bodies.len();
    Some(AtRest {
        cast,
        poses: model.poses().to_vec(),
        twists: vec![Twist::ZERO; count],
        loads: vec![Load::ZERO; count],
    })
}

/// The tissue and the bodies that a run has left in its folder, and the walls.
///
/// # Errors
/// A checkpoint that does not belong to the scene.
pub(super) fn finished(
    scene: &Scene,
    saved: &SavedMotion,
    file: &Path,
) -> Result<(Box<dyn Mover>, Vec<Wall>), RunError> {
    // nothing will be solved for, so the memory of a run is not needed
    let setup = Setup::within(scene, None)?;
    let (mesh, p) = (setup.mesh.clone(), setup.initial(scene)?.values);
    drop(setup);
    let bodies = scene.bodies.as_ref().expect("the scene has bodies");
    let model = around(&mesh, &describe(scene, &mesh), bodies);
    let model =
        model.map_err(|error| RunError::Model { origin: scene.source().origin().into(), error: Box::new(error) })?;
    let walls = bodies.walls_on(&mesh);
    let mover = swimmers((scene, bodies, &walls), model, p, Some(saved), file)?;
    Ok((Box::new(mover), walls))
}

/// The bodies at the start of a run, or as its checkpoint in `file` has them.
fn swimmers(
    (scene, bodies, walls): (&Scene, &Bodies, &[Wall]),
    model: Incompressible,
    p: Vec<f64>,
    saved: Option<&SavedMotion>,
    file: &Path,
) -> Result<Swimmers, RunError> {
    let origin = scene.source().origin();
    let failed = |error: MomentumError| RunError::Model { origin: origin.into(), error: Box::new(error) };
    let mut contact = match &bodies.contact {
        None => None,
        Some(settings) => {
            let settings = crate::contact::Settings { overlap: 1e-3, ..settings.settings() };
            let solver = Solver::new(walls, settings);
            let solver = solver.map_err(|error| RunError::Contact { origin: origin.into(), error: Box::new(error) })?;
            let (kept, bodies, friction) = (solver.bonds().clone(), bodies.bodies.clone(), scene.parameters.friction);
            Some(Pushed { bodies, solver, kept, contacts: Vec::new(), friction })
        }
    };
    let mut contacts = Vec::new();
    let march = match saved {
        None => MovingMarch::start(model, scene.march(), p, bodies.rigid.order)
            .map_err(|error| RunError::begin(origin, error))?,
        Some(saved) => {
            let (hint, what) = ("run the scene again", "does not fit its scene".to_owned());
            let unfit = || RunError::Output(OutputError::Malformed { path: file.display().to_string(), what, hint });
            saved.check_mesh(&model.loops.mesh, file)?;
            let (state, found, bonds): (MovingCheckpoint, Vec<Contact>, Option<Bonds>) =
                postcard::from_bytes(&saved.state).map_err(|_| unfit())?;
            contacts = found;
            if let (Some(pushed), Some(bonds)) = (&mut contact, bonds) {
                pushed.kept = bonds;
            }
            MovingMarch::resume(model, scene.march(), state).map_err(failed)?
        }
    };
    let mesh = &march.model().loops.mesh;
    let mut resolution = Resolution::new(mesh, bodies.bodies.len());
    // the run has told of those that are small at its start
    resolution.of_bodies(mesh, &bodies.bodies, march.poses());
    resolution.of_boundary(mesh, &bodies.bodies, march.poses());
    let easel = Easel::new(Caption::of(scene));
    Ok(Swimmers { resolution, march, contact, grid: None, contacts, easel })
}

/// Prepares the bodies of a scene and the flow about them, as a run does before its first step.
///
/// # Errors
/// As those of a run.
pub(super) fn try_start(scene: &Scene, setup: &Setup) -> Result<(), RunError> {
    let bodies = scene.bodies.as_ref().expect("the scene has bodies");
    let p = setup.initial(scene)?.values;
    let model = around(&setup.mesh, &describe(scene, &setup.mesh), bodies)
        .map_err(|error| RunError::Model { origin: scene.source().origin().into(), error: Box::new(error) })?;
    let walls = bodies.walls_on(&setup.mesh);
    swimmers((scene, bodies, walls.as_slice()), model, p, None, Path::new("checkpoint.bin")).map(|_| ())
}

/// Runs a scene with bodies that move to its end and leaves the results in `options.out`.
///
/// # Errors
/// Anything that is wrong before the first step, and results that cannot be written.
pub fn run(scene: &Scene, options: &Options) -> Result<MotionSummary, RunError> {
    let begin = Instant::now();
    let text = scene.resolved_toml();
    let saved = motion::prepare(&text, options)?;
    let setup = Setup::new(scene)?;
    setup.check_disk(scene, &options.out)?;
    let origin = scene.source().origin();
    let bodies = scene.bodies.as_ref().expect("the scene has bodies");
    let p = setup.initial(scene)?.values;
    let remarks = setup.remarks(scene);
    maps::check_all_windows(&scene.outputs, scene.source(), &setup.mesh)?;
    let Setup { mesh, quality, model, .. } = setup;
    let unknowns =
        [model.velocity().dof_count(), model.volume().dof_count(), model.flow_unknowns() + model.carried_len()];
    // the model is needed by value
    drop(model);
    let failed = |error: MomentumError| RunError::Model { origin: origin.into(), error: Box::new(error) };
    let model = around(&mesh, &describe(scene, &mesh), bodies).map_err(failed)?;
    let walls = bodies.walls_on(&mesh);
    let given = (scene, bodies, walls.as_slice());
    let mut mover = swimmers(given, model, p, saved.as_ref(), &options.out.join("checkpoint.bin"))?;
    let plan = Plan {
        title: scene.title.as_deref(),
        origin: scene.source().origin(),
        text,
        end: scene.time.end,
        max_steps: scene.time.max_steps,
        suspect: super::extremes::of_scene(scene),
        outputs: &scene.outputs,
        bodies: &bodies.bodies,
        walls,
        terms: scene.parameters.terms(),
        remarks,
        mesh: Some(quality),
        fingerprint: mesh.fingerprint(),
        unknowns,
        setup_seconds: begin.elapsed().as_secs_f64(),
    };
    motion::run(&plan, &mut mover, options, saved)
}

/// Bodies in a tissue.
struct Swimmers {
    march: MovingMarch,
    contact: Option<Pushed>,
    grid: Option<Grid>,
    contacts: Vec<Contact>,
    easel: Easel,
    resolution: Resolution,
}

/// What contact leaves of the twists that a tissue gives to bodies.
struct Pushed {
    bodies: Vec<Body>,
    solver: Solver,
    /// After the last accepted step.
    kept: Bonds,
    contacts: Vec<Contact>,
    friction: f64,
}

impl Referee for Pushed {
    fn correct(&mut self, poses: &[Pose], predicted: Vec<Twist>, dt: f64) -> Result<Vec<Twist>, Refusal> {
        let both = self.bodies.iter().zip(poses).zip(&predicted);
        let movers: Vec<Moved> =
            both.map(|((body, pose), twist)| Moved::in_fluid(body, *pose, *twist, dt, self.friction)).collect();
        self.solver.restore(self.kept.clone());
        let refused = |error: ContactError| match error.is_cured_by_a_smaller_step() {
            true => Refusal::Contact(error.to_string()),
            false => Refusal::Failure(error.to_string()),
        };
        let found = self.solver.project(&movers, dt, Metric::Resistance).map_err(refused)?;
        self.contacts = found.contacts;
        Ok(found.twists)
    }

    fn accept(&mut self) {
        self.kept = self.solver.bonds().clone();
    }
}

/// No step is given up half-way: the loop ends after it.
static NEVER: AtomicBool = AtomicBool::new(false);

impl Mover for Swimmers {
    fn advance(&mut self, _: f64, landing: f64) -> Result<Stride, String> {
        let referee: &mut dyn Referee = match &mut self.contact {
            Some(pushed) => pushed,
            None => &mut NoReferee,
        };
        let report = self.march.advance(landing, &NEVER, referee).map_err(|error: MovingError| error.to_string())?;
        if let Some(pushed) = &self.contact {
            self.contacts.clone_from(&pushed.contacts);
        }
        let StepReport { t, dt, iterations, rejected, .. } = report;
        let model = self.march.model();
        let (mesh, bodies) = (&model.loops.mesh, model.bodies.as_ref().expect("a tissue with bodies").bodies());
        let mut notes: Vec<String> = Vec::new();
        notes.extend(self.resolution.of_bodies(mesh, bodies, self.march.poses()));
        notes.extend(self.resolution.of_boundary(mesh, bodies, self.march.poses()));
        notes.extend(self.resolution.of_gaps(mesh, bodies, &self.contacts));
        Ok(Stride { t, dt, iterations, rejected, notes })
    }

    fn state(&self) -> Vec<u8> {
        let bonds = self.contact.as_ref().map(|pushed| &pushed.kept);
        postcard::to_stdvec(&(self.march.checkpoint(), &self.contacts, bonds)).expect("numbers are always written")
    }

    fn poses(&self) -> &[Pose] {
        self.march.poses()
    }

    fn twists(&self) -> &[Twist] {
        self.march.twists()
    }

    fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    fn show(&self, then: &mut dyn FnMut(&Easel, Source) -> Result<(), RunError>) -> Result<(), RunError> {
        then(&self.easel, Source::Tissue { model: self.march.model(), state: self.march.state() })
    }

    fn holding(&self) -> Option<Wrench> {
        let t = self.march.time();
        // a flow that was solved for can be solved for again
        self.march.model().holding(self.march.state(), t).ok()?.first().copied()
    }

    fn flow(&self) -> Option<(crate::space::Field, Integrator)> {
        Some((self.march.state().v.clone(), self.march.model().tissue().clone()))
    }

    fn write_fields(&mut self, path: &Path, t: f64, fields: &[Field]) -> Result<(), RunError> {
        let model = self.march.model();
        let degree = model.momentum.velocity.degree.max(model.polarity.space.degree);
        let bent = model.loops.mesh.curved.iter().flatten().map(|nodes| nodes.degree).max().unwrap_or(1);
        let grid = self.grid.get_or_insert_with(|| Grid::new(&model.loops.mesh, degree.max(bent)));
        let named = self.march.with(|march| -> Result<Vec<_>, RunError> {
            fields.iter().map(|field| Ok((*field, of(march, *field)?))).collect()
        })?;
        let at_nodes: Vec<_> =
            named.iter().map(|(field, values)| (*field, writer::nodal(values, grid.degree))).collect();
        let list: Vec<vtk::Field> = at_nodes
            .iter()
            .map(|(field, (components, values))| vtk::Field { name: field.name(), components: *components, values })
            .collect();
        Ok(write_vtu(path, grid, t, &list)?)
    }
}

/// A field at the current state.
fn of(march: &crate::time::March, field: Field) -> Result<crate::space::Field, RunError> {
    let (state, model): (_, &dyn Sheet) = (&march.state, march.model);
    Ok(match field {
        Field::Velocity => state.v.clone(),
        Field::Pressure => model.pressure(state)?,
        Field::Density => state.volume().clone(),
        Field::Polarity => state.p.clone(),
        Field::MolecularField => model.molecular_field(state, march.t),
        Field::StreamFunction => {
            crate::measure::StreamFunction::new(model.loops(), model.velocity())?.of(model.loops(), &state.v)?
        }
        Field::PolarityLaplacian => model.polarity_laplacian(state, march.t),
        Field::TissueVelocity => {
            let speed = model.parameters().traction / model.parameters().friction;
            let mut v = state.v.clone();
            v.values.iter_mut().step_by(2).for_each(|v1| *v1 -= speed);
            v
        }
        Field::ElasticStrain => unreachable!("refused with the scene"),
    })
}
