//! Steps of a Stokes flow and its bodies.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::body::motion::Motion;
use crate::body::stiffness::{DECAY, Stiffness, Stride as Stretch};
use crate::contact::{Bonds, Contact, ContactError, Metric, Mover as Moving, Settings, Solver, Wall};
use crate::measure::fields::FlowFields;
use crate::measure::list::Bodies;
use crate::mesh::Mesh;
use crate::model::formulas::check_formulas;
use crate::model::immersed::FlowWithBodies;
use crate::model::immersed::flow::{self, Flow};
use crate::model::mobility::Mobility;
use crate::model::momentum::{MomentumError, outer_force};
use crate::model::{Fluid, Sources};
use crate::run::RunError;
use crate::run::resolution::Resolution;
use crate::run::stepper::{Halt, Stepper, Stride, shortened};
use crate::run::view::{FlowNow, View};
use crate::scene::StokesScene;
use crate::scene::kinds::particles::MotionTime;
use crate::scheme::adaptive::{AdaptedStep, AdaptiveStep, EASY, Refusal};
use crate::shape::Twist;

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

/// A flow with its bodies, and the last good state.
pub struct FlowStepper {
    flow: Flow,
    solver: Option<Solver>,
    fluid: Fluid,
    sources: Sources,
    time: MotionTime,
    stiffness: Stiffness,
    /// The flow at the current time.
    carried: FlowWithBodies,
    /// What a checkpoint holds.
    good: Checkpoint,
    resolution: Resolution,
}

/// Overlap that a step accepts at its beginning, relative to the smaller body: motions of second order round otherwise
/// than contact does.
const OVERLAP: f64 = 1e-6;

impl FlowStepper {
    pub fn new(
        scene: &StokesScene,
        mesh: &Arc<Mesh>,
        walls: &[Wall],
        resumed: Option<Checkpoint>,
    ) -> Result<Self, RunError> {
        let origin = || scene.source().origin().to_owned();
        let model = |error: MomentumError| RunError::Model { origin: origin(), error: Box::new(error) };
        let contact = |error| RunError::Contact { origin: origin(), error: Box::new(error) };
        let (mut bodies, settings) = match &scene.bodies {
            Some(given) => (given.bodies.clone(), given.rigid),
            None => (Vec::new(), flow::Settings::default()),
        };
        if let Some(resumed) = &resumed {
            bodies.iter_mut().zip(&resumed.motion.poses).for_each(|(body, pose)| body.start = *pose);
        }
        let degrees = (scene.degrees[0], scene.degrees[1]);
        let conditions = scene.conditions(mesh);
        let t = resumed.as_ref().map_or(0.0, |resumed| resumed.t);
        let mut flow = Flow::new(mesh, degrees, &conditions, (scene.fluid.friction, scene.slip), bodies, (settings, t))
            .map_err(model)?;
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
        let (fluid, sources) = (scene.fluid, scene.sources.clone());
        if sources.exact.is_some() {
            let checked = check_formulas(&flow.loops, degrees.0, &flow.conditions, &sources, &fluid, t);
            checked.map_err(|error| RunError::Formula { origin: origin(), error: Box::new(error) })?;
        }
        let carried = solve(&flow, &fluid, &sources).map_err(model)?;
        let good = resumed.unwrap_or_else(|| Checkpoint {
            t,
            motion: flow.motion.clone(),
            bonds: Bonds::default(),
            twists: carried.twists.clone(),
            contacts: Vec::new(),
            step_control: AdaptiveStep::default(),
        });
        let stiffness = Stiffness::new(&flow.guide.bodies).map_err(|error| model(error.into()))?;
        let time = scene.time;
        let mut resolution = Resolution::new(mesh, flow.guide.bodies.len());
        // the run has told of those that are small at its start
        resolution.of_bodies(mesh, &flow.guide.bodies, &flow.motion.poses);
        resolution.of_boundary(mesh, &flow.guide.bodies, &flow.motion.poses);
        Ok(Self { resolution, flow, solver, fluid, sources, time, stiffness, carried, good })
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
            let friction = self.fluid.friction;
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
        let carried = solve(&self.flow, &self.fluid, &self.sources).map_err(text)?;
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
fn solve(flow: &Flow, fluid: &Fluid, sources: &Sources) -> Result<FlowWithBodies, MomentumError> {
    let sources = sources.at_time(flow.t);
    flow.solve(&outer_force(&flow.momentum.velocity, fluid, &flow.conditions, &sources, flow.t))
}

impl Stepper for FlowStepper {
    fn advance(&mut self, t: f64, landing: f64) -> Result<Stride, Halt> {
        let (mut control, settings) = (self.good.step_control.clone(), self.time.bounds);
        let made = control.advance((t, landing), &settings, |t, dt| self.step(t, dt))?;
        self.good.step_control = control;
        let AdaptedStep { t, dt, rejected, why, done: iterations } = made;
        let mut notes: Vec<String> = why.iter().map(|why| shortened(t, dt, why)).collect();
        let (mesh, bodies) = (&self.flow.loops.mesh, &self.flow.guide.bodies);
        notes.extend(self.resolution.of_bodies(mesh, bodies, &self.flow.motion.poses));
        notes.extend(self.resolution.of_boundary(mesh, bodies, &self.flow.motion.poses));
        notes.extend(self.resolution.of_gaps(mesh, bodies, &self.good.contacts));
        Ok(Stride { t, dt, iterations, rejected, coupled: None, notes })
    }

    fn state(&self) -> Vec<u8> {
        postcard::to_stdvec(&self.good).expect("numbers are always written")
    }

    fn look(&mut self, then: &mut dyn FnMut(&View) -> Result<(), RunError>) -> Result<(), RunError> {
        let fields = FlowFields { flow: &self.flow, carried: &self.carried };
        let Checkpoint { t, motion, twists, contacts, .. } = &self.good;
        let holding = || Ok(self.carried.holding.first().copied());
        let (bodies, poses) = (&*self.flow.guide.bodies, &motion.poses[..]);
        let flow = &self.carried.wrenches;
        let bodies = Bodies { bodies, poses, twists, contacts, flow, holding: &holding };
        let bodies = (!bodies.bodies.is_empty()).then_some(bodies);
        let Self { flow, carried, fluid, sources, .. } = &*self;
        let flow = Some(FlowNow { flow, carried, fluid, sources });
        then(&View { t: *t, fields: Some(&fields), bodies, tissue: None, flow })
    }
}
