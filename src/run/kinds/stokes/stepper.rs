//! Steps of a Stokes flow and its bodies.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::body::Body;
use crate::body::leaving::{Departure, Exits};
use crate::body::motion::Motion;
use crate::body::stiffness::{DECAY, Stiffness, Stride as Stretch};
use crate::contact::in_flow::{Acting, FlowContact, FlowCoupling, Moment, Stepped};
use crate::contact::{Bonds, Contact, Partner, Settings, Wall};
use crate::measure::fields::FlowFields;
use crate::measure::list::Bodies;
use crate::mesh::Mesh;
use crate::model::formulas::check_formulas;
use crate::model::immersed::flow::{self, Flow};
use crate::model::immersed::{FlowWithBodies, leaving};
use crate::model::mobility::{Columns, Mobility};
use crate::model::momentum::{MomentumError, outer_force};
use crate::model::{Fluid, Sources};
use crate::run::RunError;
use crate::run::resolution::Resolution;
use crate::run::stepper::{Halt, Stepper, Stride, shortened};
use crate::run::view::{FlowNow, View};
use crate::scene::StokesScene;
use crate::scene::kinds::particles::MotionTime;
use crate::scheme::adaptive::{AdaptedStep, AdaptiveStep, EASY, Refusal};
use crate::shape::{Twist, Wrench};
use crate::time::coupling::StepFailure;

/// What a restart needs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Checkpoint {
    t: f64,
    /// Names of the bodies that are left, of which all below has one entry each.
    present: Vec<String>,
    motion: Motion,
    bonds: Bonds,
    /// Forces of contact on the bodies; empty where nothing is pushed.
    pushes: Vec<Wrench>,
    /// As they are shown.
    twists: Vec<Twist>,
    contacts: Vec<Contact>,
    step_control: AdaptiveStep,
}

/// A flow with its bodies, and the last good state.
pub struct FlowStepper {
    flow: Flow,
    contact: Option<FlowContact>,
    fluid: Fluid,
    sources: Sources,
    time: MotionTime,
    stiffness: Stiffness,
    /// The flow at the current time, with the forces of contact.
    carried: FlowWithBodies,
    /// Twists of the flow without them.
    unpushed: Vec<Twist>,
    columns: Columns,
    /// What a checkpoint holds.
    good: Checkpoint,
    /// The bodies of the good state.
    bodies: Arc<[Body]>,
    exits: Exits,
    /// Those that left in the last step.
    left: Vec<Departure>,
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
        let settings = scene.bodies.as_ref().map_or_else(flow::Settings::default, |bodies| bodies.rigid);
        let bodies = bodies_of(scene, resumed.as_ref());
        let degrees = (scene.degrees[0], scene.degrees[1]);
        let conditions = scene.conditions(mesh);
        let t = resumed.as_ref().map_or(0.0, |resumed| resumed.t);
        let mut flow = Flow::new(mesh, degrees, &conditions, (scene.fluid.friction, scene.slip), bodies, (settings, t))
            .map_err(model)?;
        let mut contact = contact_of(scene, &flow, walls)?;
        if let Some(resumed) = &resumed {
            flow.resume(resumed.motion.clone()).map_err(model)?;
            contact.iter_mut().for_each(|contact| contact.restore(resumed.bonds.clone()));
        }
        let (fluid, sources) = (scene.fluid, scene.sources.clone());
        if sources.exact.is_some() {
            let checked = check_formulas(&flow.loops, degrees.0, &flow.conditions, &sources, &fluid, t);
            checked.map_err(|error| RunError::Formula { origin: origin(), error: Box::new(error) })?;
        }
        let carried = solve(&flow, &fluid, &sources, &[]).map_err(model)?;
        let unpushed = carried.twists.clone();
        let stiffness = Stiffness::new(&flow.guide.bodies).map_err(|error| model(error.into()))?;
        let time = scene.time;
        let exits = scene.bodies.as_ref().map_or_else(Exits::default, |bodies| bodies.exits(mesh));
        let mut resolution = Resolution::new(mesh, exits.clone());
        // the run has told of those that are small at its start
        resolution.of_bodies(mesh, &flow.guide.bodies, &flow.motion.poses);
        resolution.of_boundary(mesh, &flow.guide.bodies, &flow.motion.poses);
        let (columns, is_new) = (Columns::default(), resumed.is_none());
        let good = resumed.unwrap_or_else(|| Checkpoint::start(&flow, &carried));
        let (bodies, left) = (flow.guide.bodies.clone(), Vec::new());
        let mut this = Self {
            flow,
            contact,
            fluid,
            sources,
            time,
            stiffness,
            carried,
            unpushed,
            columns,
            good,
            bodies,
            exits,
            left,
            resolution,
        };
        this.set_out(is_new, &origin())?;
        Ok(this)
    }

    /// Makes the flow that of the forces of contact: those of a checkpoint, or those at the start.
    fn set_out(&mut self, is_new: bool, origin: &str) -> Result<(), RunError> {
        if is_new {
            let begin = |refusal: Refusal| RunError::begin(origin, StepFailure::Bodies(refusal.to_string()));
            let acting = self.act(&self.good.bonds).map_err(begin)?;
            (self.good.pushes, self.good.contacts) = (acting.wrenches, acting.contacts);
        }
        if !is_new {
            // the run has told of the gaps that are narrow now
            self.resolution.of_gaps(&self.flow.loops.mesh, &self.bodies, &self.good.contacts);
        }
        if !self.good.pushes.is_empty() {
            let carried = solve(&self.flow, &self.fluid, &self.sources, &self.good.pushes);
            let model = |error| RunError::Model { origin: origin.to_owned(), error: Box::new(error) };
            self.carried = carried.map_err(model)?;
        }
        if is_new {
            self.good.twists.clone_from(&self.carried.twists);
        }
        Ok(())
    }

    /// The moment at which the flow is.
    fn moment<'a>(&'a self, mobility: &'a Mobility<'a>) -> Moment<'a> {
        let Flow { guide, motion, t, .. } = &self.flow;
        Moment { guide, motion, t: *t, unpushed: &self.unpushed, flow: mobility }
    }

    fn mobility(&self) -> Mobility<'_> {
        let rules = self.flow.guide.rules_of_change(&self.flow.motion.poses);
        Mobility { momentum: &self.flow.momentum, rules, columns: &self.columns }
    }

    /// What contact does to the flow at its time, after a step that left `bonds`.
    fn act(&self, bonds: &Bonds) -> Result<Acting, Refusal> {
        let Some(contact) = &self.contact else { return Ok(Acting::default()) };
        let mut contact = contact.clone();
        contact.restore(bonds.clone());
        let mobility = self.mobility();
        contact.act(&self.moment(&mobility), self.good.step_control.length(&self.time.bounds))
    }

    /// Whether the step is easy to follow.
    fn followed(&self, t: f64, dt: f64, by: &[Twist]) -> Result<bool, Refusal> {
        let response = self.mobility();
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
        // the loop's time is free of the rounding of many sums
        self.flow.t = t;
        let mobility = self.mobility();
        let moment = self.moment(&mobility);
        let easy = self.followed(t, dt, &Stepped::free(&moment, dt)?.by)?;
        let made = match &self.contact {
            None => Stepped::free(&moment, dt)?,
            Some(contact) => contact.step(&moment, dt)?,
        };
        drop(mobility);
        let (made, before) = self.move_bodies((t, dt), made)?;
        let iterations = made.iterations;
        if let Err(refusal) = self.settle(t + dt, made) {
            // the good state has the bodies that have left now
            before.into_iter().for_each(|flow| self.flow = flow);
            return Err(refusal);
        }
        Ok((iterations, easy))
    }

    /// Moves the bodies to the end of a step from `t`. Where nothing is left in the mesh of some of them they are taken
    /// out: then what is returned is the step of the others, and the flow with all.
    fn move_bodies(&mut self, (t, dt): (f64, f64), made: Stepped) -> Result<(Stepped, Option<Flow>), Refusal> {
        let text = |error: MomentumError| Refusal::Failure(error.to_string());
        self.left.clear();
        let moved = self.flow.advance(dt, &made.now, &made.by);
        self.flow.t = t + dt;
        let Some(first) = moved.as_ref().err().and_then(leaving::outside) else {
            return moved.map(|()| (made, None)).map_err(text);
        };
        let (flow, remaining) = self.flow.without(first).map_err(text)?;
        let places = (&*self.flow.guide.bodies, &self.flow.motion.poses[..]);
        let gone = leaving::departures(&self.exits, places, &remaining, t + dt);
        self.left = gone.map_err(|error| text(error.into()))?;
        self.stiffness = Stiffness::new(&flow.guide.bodies).map_err(|error| text(error.into()))?;
        self.contact.iter_mut().for_each(|contact| contact.keep(&remaining));
        Ok((made.of(&remaining), Some(std::mem::replace(&mut self.flow, flow))))
    }

    /// After the bodies were moved: solves for the flow, with the forces of contact at the new places.
    fn settle(&mut self, t: f64, made: Stepped) -> Result<(), Refusal> {
        let text = |error: MomentumError| Refusal::Failure(error.to_string());
        let Stepped { by, contacts, bonds, .. } = made;
        self.columns.clear();
        self.carried = solve(&self.flow, &self.fluid, &self.sources, &[]).map_err(text)?;
        self.unpushed.clone_from(&self.carried.twists);
        let acting = self.act(&bonds)?;
        let (motion, step_control) = (self.flow.motion.clone(), self.good.step_control.clone());
        let (present, pushes, bodies) = (names(&self.flow), acting.wrenches, self.flow.guide.bodies.clone());
        if !pushes.is_empty() {
            self.carried = solve(&self.flow, &self.fluid, &self.sources, &pushes).map_err(text)?;
        }
        let twists = self.carried.twists.clone();
        self.bodies = bodies;
        self.good = Checkpoint { t, present, motion, bonds, pushes, twists, contacts: acting.contacts, step_control };
        if let Some(contact) = &mut self.contact {
            contact.restore(self.good.bonds.clone());
            if contact.coupling == FlowCoupling::Split {
                self.good.show_split(contacts, &by);
            }
        }
        Ok(())
    }
}

/// Of the bodies in a flow.
fn names(flow: &Flow) -> Vec<String> {
    flow.guide.bodies.iter().map(|body| body.name.clone()).collect()
}

/// The bodies of a scene, or those of them that are left in a checkpoint, where they are then.
fn bodies_of(scene: &StokesScene, resumed: Option<&Checkpoint>) -> Vec<Body> {
    let mut bodies = scene.bodies.as_ref().map_or_else(Vec::new, |given| given.bodies.clone());
    if let Some(resumed) = resumed {
        bodies.retain(|body| resumed.present.contains(&body.name));
        bodies.iter_mut().zip(&resumed.motion.poses).for_each(|(body, pose)| body.start = *pose);
    }
    bodies
}

/// What can touch in a scene.
fn contact_of(scene: &StokesScene, flow: &Flow, walls: &[Wall]) -> Result<Option<FlowContact>, RunError> {
    let Some(asked) = scene.bodies.as_ref().and_then(|bodies| bodies.contact) else { return Ok(None) };
    let settings = Settings { overlap: OVERLAP, ..asked.settings() };
    let fluid = (&flow.guide.bodies[..], scene.fluid.friction);
    let made = FlowContact::new(fluid, walls, settings, asked.flow);
    let refused = |error| RunError::Contact { origin: scene.source().origin().to_owned(), error: Box::new(error) };
    made.map(Some).map_err(refused)
}

impl Checkpoint {
    /// At the start of a run.
    fn start(flow: &Flow, carried: &FlowWithBodies) -> Self {
        Self {
            t: flow.t,
            present: names(flow),
            motion: flow.motion.clone(),
            bonds: Bonds::default(),
            pushes: Vec::new(),
            twists: carried.twists.clone(),
            contacts: Vec::new(),
            step_control: AdaptiveStep::default(),
        }
    }

    /// What contact holds back moves as contact lets it, whatever the flow would do.
    fn show_split(&mut self, contacts: Vec<Contact>, by: &[Twist]) {
        for contact in contacts.iter().filter(|contact| contact.force != 0.0) {
            self.twists[contact.body] = by[contact.body];
            if let Partner::Body(other) = contact.partner {
                self.twists[other] = by[other];
            }
        }
        self.contacts = contacts;
    }
}

/// The flow at the current time and places, with forces of contact.
fn solve(flow: &Flow, fluid: &Fluid, sources: &Sources, pushes: &[Wrench]) -> Result<FlowWithBodies, MomentumError> {
    let sources = sources.at_time(flow.t);
    let force = outer_force(&flow.momentum.velocity, fluid, &flow.conditions, &sources, flow.t);
    flow.solve_pushed(&force, pushes)
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
        let mut left = std::mem::take(&mut self.left);
        // without the rounding of the sum
        left.iter_mut().for_each(|gone| gone.time = t);
        Ok(Stride { t, dt, iterations, rejected, coupled: None, notes, left })
    }

    fn state(&self) -> Vec<u8> {
        postcard::to_stdvec(&self.good).expect("numbers are always written")
    }

    fn look(&mut self, then: &mut dyn FnMut(&View) -> Result<(), RunError>) -> Result<(), RunError> {
        let fields = FlowFields { flow: &self.flow, carried: &self.carried };
        let Checkpoint { t, motion, twists, contacts, .. } = &self.good;
        let (bodies, poses) = (&*self.bodies, &motion.poses[..]);
        let flow = &self.carried.wrenches;
        let bodies = Bodies { bodies, poses, twists, contacts, flow };
        let bodies = (!bodies.bodies.is_empty()).then_some(bodies);
        let Self { flow, carried, fluid, sources, .. } = &*self;
        let flow = Some(FlowNow { flow, carried, fluid, sources });
        then(&View { t: *t, fields: Some(&fields), bodies, tissue: None, flow })
    }
}
