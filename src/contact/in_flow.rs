//! Contact of bodies that a flow carries: the forces with which it acts on the flow, and how the bodies move in a step.
//!
//! ```text
//! U = U* + Y Gᵀλ,   λ ≥ 0,   D + Δt G·U ≥ η,   λ (D + Δt G·U − η) = 0,   x ← x + Δt U
//! ```
//! U* are the twists of the flow without contact, at the beginning of the step. `Gᵀλ` are loads of that flow, with which
//! it is solved once more, so that its twists, the way of the bodies and the forces on walls are those of one flow. What
//! contact pushes moves by a step of first order, as velocities jump when bodies meet.
//!
//! The source solves the flow as if there were no contact and moves the bodies otherwise (algorithm 3.1 of Lefebvre's
//! thesis); that is [`FlowCoupling::Split`].

use std::sync::Arc;

use super::mobility::{FlowMetric, UnitResponse, response};
use super::solver::Projected;
use super::{Bonds, Contact, ContactError, Metric, Mover, Settings, Solver, Wall, among};
use crate::body::Body;
use crate::body::guide::Guide;
use crate::body::leaving::Remaining;
use crate::body::motion::Motion;
use crate::mesh::Point;
use crate::scheme::adaptive::Refusal;
use crate::shape::{Twist, Wrench};

/// Halves of a step in which contact is looked for before the next one is made.
const HALVES: usize = 60;

/// Whether contact acts on the flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FlowCoupling {
    /// The forces of contact are loads of the flow.
    #[default]
    Loads,
    /// The flow is solved as if there were no contact, and the bodies are moved otherwise.
    Split,
}

/// Bodies in a flow, at the beginning of a step.
#[derive(Debug, Clone, Copy)]
pub struct Moment<'a> {
    /// What the bodies are, and what is prescribed of them.
    pub guide: &'a Guide,
    /// Where they are, and how they have moved.
    pub motion: &'a Motion,
    /// The time.
    pub t: f64,
    /// U*, their twists in the flow without contact.
    pub unpushed: &'a [Twist],
    /// The flow around them.
    pub flow: &'a dyn UnitResponse,
}

/// What contact does to a flow.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Acting {
    /// Force and torque about the centre on every body; empty where nothing is pushed.
    pub wrenches: Vec<Wrench>,
    /// Pairs that are close or touch, with the gaps as they are.
    pub contacts: Vec<Contact>,
}

/// A step that contact allows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Stepped {
    /// `x ← x + Δt W`
    pub by: Vec<Twist>,
    /// The twists of the flow at the beginning, with the forces of contact in this step.
    pub now: Vec<Twist>,
    /// Pairs that are close or touch, with their gaps after the step.
    pub contacts: Vec<Contact>,
    /// What the next step must know, once this one is accepted.
    pub bonds: Bonds,
    /// Linear solves of the projection.
    pub iterations: usize,
}

/// Contact of bodies in a flow.
#[derive(Debug, Clone)]
pub struct FlowContact {
    bodies: Arc<[Body]>,
    /// `C_F` of the fluid.
    friction: f64,
    solver: Solver,
    /// Whether contact acts on the flow.
    pub coupling: FlowCoupling,
}

impl FlowContact {
    /// `friction` is that of the fluid.
    ///
    /// # Errors
    /// A setting that breaks its rule.
    pub fn new(
        (bodies, friction): (&[Body], f64),
        walls: &[Wall],
        settings: Settings,
        coupling: FlowCoupling,
    ) -> Result<Self, ContactError> {
        Ok(Self { bodies: bodies.into(), friction, solver: Solver::new(walls, settings)?, coupling })
    }

    /// What must be kept to go on to the bit.
    pub fn bonds(&self) -> &Bonds {
        self.solver.bonds()
    }

    /// Goes on from [`FlowContact::bonds`], or accepts a step.
    pub fn restore(&mut self, bonds: Bonds) {
        self.solver.restore(bonds);
    }

    /// Forgets the bodies that have gone.
    pub fn keep(&mut self, remaining: &Remaining) {
        self.bodies = remaining.of(&self.bodies).into();
        self.solver.restore(self.solver.bonds().of(remaining));
    }

    /// The forces of contact now, in a step of `dt`, or a shorter one where the bodies could pass through each other.
    ///
    /// # Errors
    /// Bodies that cannot move without overlap; a flow that cannot be solved for.
    pub fn act(&self, moment: &Moment, dt: f64) -> Result<Acting, Refusal> {
        if self.coupling == FlowCoupling::Split {
            return Ok(Acting::default());
        }
        let mut refused = None;
        for halves in 0..HALVES {
            let dt = dt * 0.5_f64.powi(halves as i32);
            let predicted = predicted(moment, dt)?;
            let movers = self.movers(moment, &predicted, dt);
            match self.solver.act(&movers, dt, Metric::Mobility(metric(moment, dt))).map_err(refusal) {
                Ok(Projected { forces, contacts, .. }) => {
                    let acts = forces.iter().flatten().any(|force| *force != 0.0);
                    let wrenches = if acts { forces.into_iter().map(wrench).collect() } else { Vec::new() };
                    return Ok(Acting { wrenches, contacts });
                }
                Err(Refusal::Contact(reason)) => refused = Some(reason),
                Err(other) => return Err(other),
            }
        }
        Err(Refusal::Failure(refused.unwrap_or_default()))
    }

    /// The step that contact allows; [`FlowContact::restore`] with its bonds accepts it.
    ///
    /// # Errors
    /// Bodies that cannot move without overlap; a flow that cannot be solved for.
    pub fn step(&self, moment: &Moment, dt: f64) -> Result<Stepped, Refusal> {
        let predicted = predicted(moment, dt)?;
        let movers = self.movers(moment, &predicted, dt);
        let mut solver = self.solver.clone();
        let metric = match self.coupling {
            FlowCoupling::Loads => Metric::Mobility(metric(moment, dt)),
            FlowCoupling::Split => Metric::Resistance,
        };
        let Projected { twists: by, forces, contacts, effort, .. } =
            solver.project(&movers, dt, metric).map_err(refusal)?;
        let mut now = moment.unpushed.to_vec();
        if self.coupling == FlowCoupling::Loads {
            let wrenches: Vec<Wrench> = forces.into_iter().map(wrench).collect();
            let caused = response(moment.flow, &wrenches).map_err(Refusal::Failure)?;
            for (now, by) in now.iter_mut().zip(caused) {
                now.velocity += by.velocity;
                now.spin += by.spin;
            }
        }
        Ok(Stepped { by, now, contacts, bonds: solver.bonds().clone(), iterations: effort.iterations })
    }

    fn movers<'a>(&'a self, moment: &Moment, predicted: &[Twist], dt: f64) -> Vec<Mover<'a>> {
        let both = self.bodies.iter().zip(&moment.motion.poses).zip(predicted);
        both.map(|((body, pose), twist)| Mover::in_fluid(body, *pose, *twist, dt, self.friction)).collect()
    }
}

impl Stepped {
    /// The same step of the bodies that are left.
    #[must_use]
    pub fn of(&self, remaining: &Remaining) -> Self {
        Self {
            by: remaining.of(&self.by),
            now: remaining.of(&self.now),
            contacts: among(&self.contacts, remaining),
            bonds: self.bonds.of(remaining),
            iterations: self.iterations,
        }
    }

    /// The step of bodies that nothing can touch.
    ///
    /// # Errors
    /// A path that is not finite.
    pub fn free(moment: &Moment, dt: f64) -> Result<Self, Refusal> {
        Ok(Self { by: predicted(moment, dt)?, now: moment.unpushed.to_vec(), ..Self::default() })
    }
}

fn metric<'a>(moment: &Moment<'a>, dt: f64) -> FlowMetric<'a> {
    FlowMetric { mobility: moment.flow, unpushed: moment.unpushed, factor: moment.motion.slope(dt) }
}

fn predicted(Moment { guide, motion, t, unpushed, .. }: &Moment, dt: f64) -> Result<Vec<Twist>, Refusal> {
    guide.predicted(motion, *t, dt, unpushed).map_err(|error| Refusal::Failure(error.to_string()))
}

fn wrench([x, y, torque]: [f64; 3]) -> Wrench {
    Wrench { force: Point::new(x, y), torque }
}

fn refusal(error: ContactError) -> Refusal {
    match error.is_cured_by_a_smaller_step() {
        true => Refusal::Contact(error.to_string()),
        false => Refusal::Failure(error.to_string()),
    }
}
