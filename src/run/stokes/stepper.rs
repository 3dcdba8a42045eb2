//! Steps of a Stokes flow and its bodies.

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::body::motion::Motion;
use crate::body::stiffness::{DECAY, Stiffness, Stride as Stretch};
use crate::contact::{Bonds, Contact, ContactError, Metric, Mover as Moving, Settings, Solver, Wall};
use crate::form::Integrator;
use crate::mesh::Mesh;
use crate::model::immersed::FlowWithBodies;
use crate::model::immersed::flow::{self, Flow};
use crate::model::mobility::Mobility;
use crate::model::momentum::{MomentumError, outer_force};
use crate::model::{Parameters, Sources};
use crate::output::OutputError;
use crate::output::vtk::{self, Grid, write_vtu};
use crate::run::RunError;
use crate::run::maps::{Caption, Source};
use crate::run::motion::map_tools::MapTools;
use crate::run::motion::{Mover, Stride, shortened};
use crate::run::resolution::Resolution;
use crate::run::writer::nodal;
use crate::scene::particles::MotionTime;
use crate::scene::{Field, StokesScene};
use crate::scheme::adaptive::{AdaptedStep, AdaptiveStep, EASY, Refusal};
use crate::shape::Wrench;
use crate::shape::{Pose, Twist};
use crate::space;

/// What a restart needs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Checkpoint {
    t: f64,
    motion: Motion,
    bonds: Bonds,
    /// As they are shown.
    twists: Vec<Twist>,
    contacts: Vec<Contact>,
    step_control: AdaptiveStep,
}

impl Checkpoint {
    /// Unpacks what [`Mover::state`] has packed.
    ///
    /// # Errors
    /// Bytes that are something else.
    pub fn read(bytes: &[u8], file: &Path) -> Result<Self, RunError> {
        postcard::from_bytes(bytes).map_err(|error| {
            let (path, what) = (file.display().to_string(), format!("cannot be read ({error})"));
            RunError::Output(OutputError::Malformed { path, what, hint: "run the scene again" })
        })
    }
}

/// A flow with its bodies, and the last good state.
pub struct Stepper {
    flow: Flow,
    solver: Option<Solver>,
    parameters: Parameters,
    sources: Sources,
    time: MotionTime,
    stiffness: Stiffness,
    /// The flow at the current time.
    carried: FlowWithBodies,
    /// What a checkpoint holds.
    good: Checkpoint,
    grid: Option<Grid>,
    map_tools: MapTools,
    resolution: Resolution,
}

/// Overlap that a step accepts at its beginning, relative to the smaller body: motions of second order round otherwise
/// than contact does.
const OVERLAP: f64 = 1e-6;

impl Stepper {
    pub fn new(
        scene: &StokesScene,
        mesh: &Arc<Mesh>,
        walls: &[Wall],
        resumed: Option<Checkpoint>,
    ) -> Result<Self, RunError> {
        let origin = || scene.source().origin().to_owned();
        let model = |error: MomentumError| RunError::Model { origin: origin(), error: Box::new(error) };
        let contact = |error| RunError::Contact { origin: origin(), error: Box::new(error) };
        let (mut bodies, rigid) = match &scene.bodies {
            Some(given) => (given.bodies.clone(), given.rigid),
            None => (Vec::new(), crate::scene::bodies::Rigid { epsilon: 0.5, order: 1 }),
        };
        if let Some(resumed) = &resumed {
            bodies.iter_mut().zip(&resumed.motion.poses).for_each(|(body, pose)| body.start = *pose);
        }
        let settings = flow::Settings { epsilon: rigid.epsilon, order: rigid.order };
        let degrees = (scene.degrees[0], scene.degrees[1]);
        let conditions = scene.conditions(mesh);
        let t = resumed.as_ref().map_or(0.0, |resumed| resumed.t);
        let mut flow =
            Flow::new(mesh, degrees, &conditions, (scene.friction, scene.slip), bodies, settings, t).map_err(model)?;
        let mut solver = None;
        if let Some(contacts) = scene.bodies.as_ref().and_then(|bodies| bodies.contact) {
            let settings = Settings { overlap: OVERLAP, ..contacts.settings() };
            let mut made = Solver::new(walls, settings).map_err(contact)?;
            if let Some(resumed) = &resumed {
                made.restore(resumed.bonds.clone());
            }
            solver = Some(made);
        }
        if let Some(resumed) = &resumed {
            flow.resume(resumed.motion.clone()).map_err(model)?;
        }
        let sources = Sources { force: scene.force.clone(), ..Sources::default() };
        let parameters = parameters(scene.friction);
        let carried = solve(&flow, &parameters, &sources).map_err(model)?;
        let good = resumed.unwrap_or_else(|| Checkpoint {
            t,
            motion: flow.motion.clone(),
            bonds: Bonds::default(),
            twists: carried.twists.clone(),
            contacts: Vec::new(),
            step_control: AdaptiveStep::default(),
        });
        let map_tools = MapTools::new(Caption::of_flow(scene));
        let stiffness = Stiffness::new(&flow.guide.bodies).map_err(|error| model(error.into()))?;
        let time = scene.time;
        let mut resolution = Resolution::new(mesh, flow.guide.bodies.len());
        // the run has told of those that are small at its start
        resolution.of_bodies(mesh, &flow.guide.bodies, &flow.motion.poses);
        resolution.of_boundary(mesh, &flow.guide.bodies, &flow.motion.poses);
        Ok(Self {
            resolution,
            flow,
            solver,
            parameters,
            sources,
            time,
            stiffness,
            carried,
            good,
            grid: None,
            map_tools,
        })
    }

    /// Whether the step is easy to follow.
    fn followed(&self, t: f64, dt: f64, by: &[Twist]) -> Result<bool, Refusal> {
        let rules = self.flow.guide.rules_of_change(&self.flow.motion.poses);
        let response = Mobility { momentum: &self.flow.momentum, rules };
        let (poses, tolerance) = (&self.flow.motion.poses[..], self.time.tolerance);
        let stride = Stretch { poses, by, t, dt, tolerance, bound: DECAY };
        match self.stiffness.strain(stride, &response).map_err(|error| Refusal::Failure(error.to_string()))? {
            Some(strain) if strain.load > 1.0 => Err(Refusal::Force(strain.to_string())),
            Some(strain) => Ok(strain.load <= EASY),
            None => Ok(true),
        }
    }

    /// One step; `Err` leaves the flow broken, and the last good state as it was.
    fn step(&mut self, t: f64, dt: f64) -> Result<(usize, bool), Refusal> {
        let text = |error: MomentumError| Refusal::Failure(error.to_string());
        // the loop's time is free of the rounding of many sums
        self.flow.t = t;
        let now = self.carried.twists.clone();
        let mut by = self.flow.predicted(dt, &now).map_err(|error| Refusal::Failure(error.to_string()))?;
        let easy = self.followed(t, dt, &by)?;
        let (mut contacts, mut iterations) = (Vec::new(), 0);
        let mut bonds = Bonds::default();
        if let Some(solver) = &mut self.solver {
            let friction = self.parameters.friction;
            let movers: Vec<Moving> = self
                .flow
                .guide
                .bodies
                .iter()
                .zip(&self.flow.motion.poses)
                .zip(&by)
                .map(|((body, pose), twist)| Moving::in_fluid(body, *pose, *twist, dt, friction))
                .collect();
            let refused = |error: ContactError| match error.is_cured_by_a_smaller_step() {
                true => Refusal::Contact(error.to_string()),
                false => Refusal::Failure(error.to_string()),
            };
            let projected = solver.project(&movers, dt, Metric::Resistance).map_err(refused)?;
            (by, contacts, iterations) = (projected.twists, projected.contacts, projected.effort.iterations);
            bonds = solver.bonds().clone();
        }
        self.flow.advance(dt, &now, &by).map_err(text)?;
        self.flow.t = t + dt;
        let carried = solve(&self.flow, &self.parameters, &self.sources).map_err(text)?;
        let mut twists = carried.twists.clone();
        // what contact holds back moves as contact lets it, whatever the flow would do
        for contact in contacts.iter().filter(|contact| contact.force != 0.0) {
            twists[contact.body] = by[contact.body];
            if let crate::contact::Partner::Body(other) = contact.partner {
                twists[other] = by[other];
            }
        }
        self.carried = carried;
        let step_control = self.good.step_control.clone();
        self.good = Checkpoint { t: t + dt, motion: self.flow.motion.clone(), bonds, twists, contacts, step_control };
        Ok((iterations, easy))
    }
}

/// The flow at the current time and places.
fn solve(flow: &Flow, parameters: &Parameters, sources: &Sources) -> Result<FlowWithBodies, MomentumError> {
    flow.solve(&outer_force(&flow.momentum.velocity, parameters, &flow.conditions, sources, flow.t))
}

/// What the forms of a tissue ask for, of a fluid that has friction alone.
fn parameters(friction: f64) -> Parameters {
    Parameters { friction, traction: 0.0, ..Parameters::default() }
}

impl Mover for Stepper {
    fn advance(&mut self, t: f64, landing: f64) -> Result<Stride, String> {
        let (mut step_control, settings) = (self.good.step_control.clone(), self.time.bounds);
        let made = step_control.advance((t, landing), &settings, |t, dt| self.step(t, dt))?;
        self.good.step_control = step_control;
        let AdaptedStep { t, dt, rejected, why, done: iterations } = made;
        let mut notes: Vec<String> = why.iter().map(|why| shortened(t, dt, why)).collect();
        let (mesh, bodies) = (&self.flow.loops.mesh, &self.flow.guide.bodies);
        notes.extend(self.resolution.of_bodies(mesh, bodies, &self.flow.motion.poses));
        notes.extend(self.resolution.of_boundary(mesh, bodies, &self.flow.motion.poses));
        notes.extend(self.resolution.of_gaps(mesh, bodies, &self.good.contacts));
        Ok(Stride { t, dt, iterations, rejected, notes })
    }

    fn state(&self) -> Vec<u8> {
        postcard::to_stdvec(&self.good).expect("numbers are always written")
    }

    fn poses(&self) -> &[Pose] {
        &self.good.motion.poses
    }

    fn twists(&self) -> &[Twist] {
        &self.good.twists
    }

    fn contacts(&self) -> &[Contact] {
        &self.good.contacts
    }

    fn holding(&self) -> Option<Wrench> {
        self.carried.holding.first().copied()
    }

    fn flow(&self) -> Option<(space::Field, Integrator)> {
        let (momentum, loops) = (&self.flow.momentum, &self.flow.loops);
        let v = space::Field::new(&momentum.velocity, self.carried.v.clone());
        let outside = momentum.bodies().map(|bodies| loops.outside(&bodies.immersion.cover));
        Some((v, outside.unwrap_or_else(|| loops.clone())))
    }

    fn write_fields(&mut self, path: &Path, t: f64, fields: &[Field]) -> Result<(), RunError> {
        let momentum = &self.flow.momentum;
        let mesh = &momentum.velocity.mesh;
        let bent = mesh.curved.iter().flatten().map(|nodes| nodes.degree);
        let degree = bent.chain([momentum.velocity.degree]).max().unwrap_or(1);
        let grid = self.grid.get_or_insert_with(|| Grid::new(mesh, degree));
        let at_nodes: Vec<(usize, Vec<f64>)> = fields
            .iter()
            .map(|field| match field {
                Field::Velocity => nodal(&space::Field::new(&momentum.velocity, self.carried.v.clone()), degree),
                Field::Pressure => nodal(&space::Field::new(&momentum.pressure, self.carried.pi.clone()), degree),
                Field::Density | Field::Polarity | Field::MolecularField | Field::StreamFunction => {
                    unreachable!("refused")
                }
                Field::TissueVelocity | Field::PolarityLaplacian | Field::ElasticStrain => unreachable!("refused"),
            })
            .collect();
        let named = fields.iter().zip(&at_nodes);
        let list: Vec<vtk::Field> = named
            .map(|(field, (components, values))| vtk::Field { name: field.name(), components: *components, values })
            .collect();
        Ok(write_vtu(path, grid, t, &list)?)
    }

    fn show(&self, then: &mut dyn FnMut(&MapTools, Source) -> Result<(), RunError>) -> Result<(), RunError> {
        let momentum = &self.flow.momentum;
        let v = space::Field::new(&momentum.velocity, self.carried.v.clone());
        let pi = space::Field::new(&momentum.pressure, self.carried.pi.clone());
        then(&self.map_tools, Source::Flow { loops: &self.flow.loops, v: &v, pi: &pi })
    }
}
