//! Marching an incompressible tissue with rigid bodies that move in it.
//!
//! ```text
//! 1.  W from the twists of the flow so far, of first or second order (`body::motion`), as contact leaves it
//! 2.  x ← x + Δt W,  θ ← θ + Δt Ω
//! 3.  the model around the bodies there, with the forces of contact so far as loads; a step of its own gives v, Π, p
//! 4.  the forces of contact there, and the flow with them
//! ```
//! Where the forces of contact change, as they do when bodies meet, the polarity of that step has been carried by the
//! flow without the change: of first order in Δt, like contact itself.
//!
//! A step that fails is tried again from where the bodies were, with half Δt. Bodies that did not move keep the factors
//! of Newton's method.

use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::coupling::StepFailure;
use super::march::{Checkpoint, March, MarchError, MarchSettings, Parked, StepReport};
use crate::body::Body;
use crate::body::leaving::{Departure, Exits, Remaining};
use crate::body::motion::Motion;
use crate::body::stiffness::{DECAY, Response, Stiffness, Stride};
use crate::contact::in_flow::{Acting, FlowContact, FlowCoupling, Moment, Stepped};
use crate::contact::{Bonds, Contact, among};
use crate::expression::ExpressionError;
use crate::model::State;
use crate::model::fields::{PRESSURE, VELOCITY};
use crate::model::immersed::leaving;
use crate::model::incompressible::Incompressible;
use crate::model::mobility::{Columns, Mobility};
use crate::model::momentum::MomentumError;
use crate::scheme::adaptive::Refusal;
use crate::shape::{Pose, Twist, Wrench};

/// What forces that vary with a body's place may change of its way in a step, relative to its size.
const TOLERANCE: f64 = 1e-3;

/// All that a restart needs, to continue bit for bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MovingCheckpoint {
    /// Of the tissue.
    pub march: Checkpoint,
    /// Names of the bodies that are left, of which all below has one entry each.
    pub present: Vec<String>,
    /// Of the bodies.
    pub motion: Motion,
    /// How they move.
    pub twists: Vec<Twist>,
    /// How they would move without contact.
    pub unpushed: Vec<Twist>,
    /// Forces of contact on the bodies; empty where nothing is pushed.
    pub pushes: Vec<Wrench>,
    /// What contact remembers.
    pub bonds: Bonds,
    /// Pairs that are close or touch.
    pub contacts: Vec<Contact>,
}

/// Why bodies and tissue cannot go on.
#[derive(Debug, Clone, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum MovingError {
    #[error(transparent)]
    March(#[from] MarchError),
    #[error("the bodies cannot be moved at t = {t}: {reason}")]
    Contact { t: f64, reason: String },
    #[error("the bodies cannot be put back at t = {t}: {error}")]
    Lost { t: f64, error: Box<MomentumError> },
}

/// A march of a tissue with bodies in it.
#[derive(Debug)]
pub struct MovingMarch {
    /// Around the bodies where they are now.
    model: Incompressible,
    motion: Motion,
    /// Of the flow now.
    twists: Vec<Twist>,
    /// Of the flow now, if there were no contact.
    unpushed: Vec<Twist>,
    contact: Option<FlowContact>,
    contacts: Vec<Contact>,
    columns: Columns,
    stiffness: Stiffness,
    parked: Option<Parked>,
    exits: Exits,
    /// Those that left in the last step.
    left: Vec<Departure>,
}

/// A step of the bodies that was taken with the tissue.
struct Moved {
    made: Stepped,
    motion: Motion,
    report: StepReport,
    /// Where some have left: which bodies go on, and what is told of the others.
    left: Option<(Remaining, Vec<Departure>)>,
}

impl MovingMarch {
    /// Starts at `t = 0` from a polarity; `order` is that of the motion. No body may leave before
    /// [`MovingMarch::let_leave`].
    ///
    /// # Errors
    /// A flow that cannot be solved for; a formula without derivative; bodies that overlap.
    pub fn start(
        model: Incompressible,
        settings: MarchSettings,
        p: Vec<f64>,
        (order, contact): (usize, Option<FlowContact>),
    ) -> Result<Self, StepFailure> {
        let parked = March::start(&model, settings, p)?.park();
        let motion = Motion::new(model.poses().to_vec(), order);
        let twists = model.twists(&parked.state, parked.time())?;
        let stiffness = stiffness_of(&model)?;
        let (unpushed, contacts, columns) = (twists.clone(), Vec::new(), Columns::default());
        let (parked, exits, left) = (Some(parked), Exits::default(), Vec::new());
        let mut this =
            Self { model, motion, twists, unpushed, contact, contacts, columns, stiffness, parked, exits, left };
        this.push().map_err(|refusal| StepFailure::Bodies(refusal.to_string()))?;
        Ok(this)
    }

    /// Continues from a checkpoint of the same problem, with the bodies anywhere.
    ///
    /// # Errors
    /// Bodies that the mesh or the flow cannot take where they are; a flow whose matrix is singular.
    pub fn resume(
        mut model: Incompressible,
        settings: MarchSettings,
        from: MovingCheckpoint,
        mut contact: Option<FlowContact>,
    ) -> Result<Self, MomentumError> {
        let bodies = model.bodies.as_ref().expect("a tissue with bodies").bodies();
        let remaining = Remaining::named(bodies, &from.present);
        if remaining.count() < bodies.len() {
            model = model.with_fewer(&remaining, &from.motion.poses)?;
            contact.iter_mut().for_each(|contact| contact.keep(&remaining));
        }
        if model.poses() != from.motion.poses {
            model.place_bodies(&from.motion.poses)?;
        }
        model.push_bodies(from.pushes);
        let parked = Some(March::resume(&model, settings, from.march).park());
        let stiffness = stiffness_of(&model)?;
        if let Some(contact) = &mut contact {
            contact.restore(from.bonds);
        }
        let MovingCheckpoint { motion, twists, unpushed, contacts, .. } = from;
        let (columns, exits, left) = (Columns::default(), Exits::default(), Vec::new());
        Ok(Self { model, motion, twists, unpushed, contact, contacts, columns, stiffness, parked, exits, left })
    }

    /// Lets bodies leave through parts of the boundary from now on.
    pub fn let_leave(&mut self, exits: Exits) {
        self.exits = exits;
    }

    /// The bodies that left in the last step.
    pub fn left(&self) -> &[Departure] {
        &self.left
    }

    /// Those that are left.
    pub fn bodies(&self) -> &[Body] {
        self.model.bodies.as_ref().expect("a tissue with bodies").bodies()
    }

    /// The current state.
    pub fn checkpoint(&self) -> MovingCheckpoint {
        let march = self.parked.as_ref().expect("a march is parked between steps").checkpoint().clone();
        MovingCheckpoint {
            march,
            present: self.bodies().iter().map(|body| body.name.clone()).collect(),
            motion: self.motion.clone(),
            twists: self.twists.clone(),
            unpushed: self.unpushed.clone(),
            pushes: self.model.pushes().to_vec(),
            bonds: self.contact.as_ref().map_or_else(Bonds::default, |contact| contact.bonds().clone()),
            contacts: self.contacts.clone(),
        }
    }

    /// Around the bodies where they are now.
    pub fn model(&self) -> &Incompressible {
        &self.model
    }

    /// One for each body.
    pub fn poses(&self) -> &[Pose] {
        &self.motion.poses
    }

    /// One for each body.
    pub fn twists(&self) -> &[Twist] {
        &self.twists
    }

    /// Pairs of bodies that are close or touch.
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    /// As it is now.
    pub fn state(&self) -> &State {
        &self.parked.as_ref().expect("a march is parked between steps").state
    }

    /// Of the state.
    pub fn time(&self) -> f64 {
        self.parked.as_ref().expect("a march is parked between steps").time()
    }

    /// The march as it stands.
    pub fn with<T>(&mut self, visit: impl FnOnce(&mut March) -> T) -> T {
        let parked = self.parked.take().expect("a march is parked between steps");
        let mut march = March::unpark(&self.model, parked, false);
        let result = visit(&mut march);
        self.parked = Some(march.park());
        result
    }

    /// Takes one step, trimmed to land on `landing`: moves the bodies, then solves.
    ///
    /// # Errors
    /// Δt below its minimum, a failure that no smaller step can cure, or bodies that contact does not let move. The state
    /// is then the last good one.
    pub fn advance(&mut self, landing: f64, interrupt: &AtomicBool) -> Result<StepReport, MovingError> {
        let (mut rejected, mut cap) = (0, f64::INFINITY);
        let entry = self.with(|march| march.entry());
        loop {
            let (now, (t, dt)) = self.with(|march| (march.t, march.aim(cap, landing)));
            let stop = |reason: String| MovingError::Contact { t: now, reason };
            let moved = match self.step(now, dt) {
                Ok(made) => self.move_all(made, (t, dt), rejected, interrupt),
                Err(Refusal::Failure(reason)) => return Err(stop(reason)),
                Err(Refusal::Force(reason) | Refusal::Contact(reason)) => Err(StepFailure::Bodies(reason)),
            };
            match moved {
                Ok(moved) => {
                    let report = moved.report.clone();
                    self.settle(moved).map_err(|refusal| MovingError::Contact { t, reason: refusal.to_string() })?;
                    return Ok(report);
                }
                Err(cause) => {
                    if self.model.poses() != self.motion.poses {
                        let back = self.model.place_bodies(&self.motion.poses);
                        back.map_err(|error| MovingError::Lost { t: now, error: Box::new(error) })?;
                    }
                    let step = self.with(|march| march.counts.steps + 1);
                    cap = self.with(|march| march.after_failure(cause, (step, dt), &mut rejected, &entry))?;
                }
            }
        }
    }

    /// The step of the bodies from the time `t`, as forces and contact let it be.
    fn step(&self, t: f64, dt: f64) -> Result<Stepped, Refusal> {
        let mobility = self.mobility();
        let moment = self.moment(&mobility, t);
        let free = Stepped::free(&moment, dt)?;
        self.followed((t, dt), &free.by, &mobility)?;
        match &self.contact {
            None => Ok(free),
            Some(contact) => contact.step(&moment, dt),
        }
    }

    fn mobility(&self) -> Mobility<'_> {
        let guide = &self.model.bodies.as_ref().expect("a tissue with bodies").guide;
        let rules = guide.rules_of_change(&self.motion.poses);
        Mobility { momentum: &self.model.momentum, rules, columns: &self.columns }
    }

    fn moment<'a>(&'a self, mobility: &'a Mobility<'a>, t: f64) -> Moment<'a> {
        let guide = &*self.model.bodies.as_ref().expect("a tissue with bodies").guide;
        Moment { guide, motion: &self.motion, t, unpushed: &self.unpushed, flow: mobility }
    }

    /// Moves the bodies and takes one try of a step with them; those of which nothing is left in the mesh then are
    /// taken out. What fails leaves the model as it was, or with its bodies elsewhere.
    fn move_all(
        &mut self,
        made: Stepped,
        (t, dt): (f64, f64),
        rejected: usize,
        interrupt: &AtomicBool,
    ) -> Result<Moved, StepFailure> {
        let mut motion = self.motion.clone();
        motion.advance(dt, &made.now, &made.by);
        let moves = motion.poses != self.model.poses();
        let placed = if moves { self.model.place_bodies(&motion.poses) } else { Ok(()) };
        let Some(first) = placed.as_ref().err().and_then(leaving::outside) else {
            placed?;
            let report = self.attempt(moves, (t, dt), rejected, interrupt)?;
            return Ok(Moved { made, motion, report, left: None });
        };
        let (fewer, remaining) = self.model.without(first, &motion.poses)?;
        let gone = leaving::departures(&self.exits, (self.bodies(), &motion.poses[..]), &remaining, t);
        let gone = gone.map_err(MomentumError::from)?;
        let before = std::mem::replace(&mut self.model, fewer);
        let (made, motion) = (made.of(&remaining), motion.of(&remaining));
        match self.attempt(true, (t, dt), rejected, interrupt) {
            Ok(report) => Ok(Moved { made, motion, report, left: Some((remaining, gone)) }),
            Err(failure) => {
                self.model = before;
                Err(failure)
            }
        }
    }

    /// After a step of the tissue: the forces of contact at the new places, and the flow with them.
    fn settle(&mut self, Moved { made, motion, left, .. }: Moved) -> Result<(), Refusal> {
        self.motion = motion;
        self.left.clear();
        if let Some((remaining, gone)) = left {
            self.contact.iter_mut().for_each(|contact| contact.keep(&remaining));
            // so that what is shown fits together, whatever fails below
            (self.twists, self.unpushed) = (remaining.of(&self.twists), remaining.of(&self.unpushed));
            self.contacts = among(&self.contacts, &remaining);
            self.stiffness = stiffness_of(&self.model).map_err(|error| failure(error.into()))?;
            self.left = gone;
        }
        self.columns.clear();
        self.twists = self.model.twists(self.state(), self.time()).map_err(failure)?;
        let pushes = self.model.pushes();
        let caused = match pushes.is_empty() {
            true => vec![Twist::ZERO; self.twists.len()],
            false => self.mobility().twists(pushes).map_err(failure)?,
        };
        let less =
            |(twist, by): (&Twist, Twist)| Twist { velocity: twist.velocity - by.velocity, spin: twist.spin - by.spin };
        self.unpushed = self.twists.iter().zip(caused).map(less).collect();
        let Some(contact) = &mut self.contact else { return Ok(()) };
        contact.restore(made.bonds);
        match contact.coupling {
            FlowCoupling::Loads => self.push(),
            FlowCoupling::Split => {
                self.contacts = made.contacts;
                Ok(())
            }
        }
    }

    /// Makes the flow that of the forces of contact where the bodies are.
    fn push(&mut self) -> Result<(), Refusal> {
        let (t, dt) = self.with(|march| (march.t, march.nominal_step()));
        let Some(contact) = &self.contact else { return Ok(()) };
        let mobility = self.mobility();
        let Acting { wrenches, contacts } = contact.act(&self.moment(&mobility, t), dt)?;
        let change = difference(&wrenches, self.model.pushes());
        if change.iter().any(|wrench| *wrench != Wrench::ZERO) {
            let rest = vec![0.0; self.model.momentum.velocity.dof_count()];
            let carried = self.model.momentum.carry(&rest, &rest, &change, &mobility.rules).map_err(failure)?;
            self.with(|march| {
                march.state.add(VELOCITY, &carried.v);
                march.state.add(PRESSURE, &carried.pi);
            });
            for (twist, by) in self.twists.iter_mut().zip(carried.twists) {
                twist.velocity += by.velocity;
                twist.spin += by.spin;
            }
        }
        self.contacts = contacts;
        self.model.push_bodies(wrenches);
        Ok(())
    }

    /// Whether a step is short enough for forces that vary with the place of a body.
    fn followed(&self, (t, dt): (f64, f64), by: &[Twist], response: &Mobility) -> Result<(), Refusal> {
        let poses = &self.motion.poses[..];
        let stride = Stride { poses, by, t, dt, tolerance: TOLERANCE, bound: DECAY };
        match self.stiffness.strain(stride, response).map_err(failure)? {
            Some(strain) if strain.load > 1.0 => Err(Refusal::Force(strain.to_string())),
            Some(_) | None => Ok(()),
        }
    }

    /// One try of a step to `t` with the bodies where the model has them.
    fn attempt(
        &mut self,
        moved: bool,
        (t, dt): (f64, f64),
        rejected: usize,
        interrupt: &AtomicBool,
    ) -> Result<StepReport, StepFailure> {
        let parked = self.parked.take().expect("a march is parked between steps");
        let mut march = March::unpark(&self.model, parked, moved);
        march.interrupt = interrupt;
        let outcome = march.attempt(t, dt, rejected);
        self.parked = Some(march.park());
        outcome
    }
}

fn stiffness_of(model: &Incompressible) -> Result<Stiffness, ExpressionError> {
    model.bodies.as_ref().map_or_else(|| Ok(Stiffness::default()), |floating| Stiffness::new(floating.bodies()))
}

fn failure(error: MomentumError) -> Refusal {
    Refusal::Failure(error.to_string())
}

/// `a − b`, where no wrenches are as many zeros.
fn difference(a: &[Wrench], b: &[Wrench]) -> Vec<Wrench> {
    let at = |of: &[Wrench], k: usize| of.get(k).copied().unwrap_or(Wrench::ZERO);
    let one = |k: usize| {
        let (a, b) = (at(a, k), at(b, k));
        Wrench { force: a.force - b.force, torque: a.torque - b.torque }
    };
    (0..a.len().max(b.len())).map(one).collect()
}
