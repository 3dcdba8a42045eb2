//! Rigid bodies without a flow: forces, drag, holds and contact.
//!
//! ```text
//! m V' = F − γ_d m V + Σ λ G       inertial: drag γ_d ≥ 0, implicit Euler for the drag
//! γ_d m V = F + Σ λ G              overdamped: γ_d > 0
//! ```
//! and the same for spin, moment of inertia and torque. A step takes the forces at its beginning, projects the
//! velocities that they give, and moves with the projected ones. Inertial bodies whose forces vary with their place,
//! and that nothing touches in a step, follow them within the step instead.

mod report;

pub use report::StepReport;
use serde::{Deserialize, Serialize};

use super::swing::{Swing, Swinging};
use super::{Bonds, Contact, ContactError, Freedom, Metric, Mover, Partner, Projected, Solver};
use crate::body::stiffness::{DECAY, Response, Stiffness, Strain, Stride};
use crate::mesh::Point;
use crate::shape::Wrench;
use crate::shape::{Pose, Shape, Twist, perpendicular, turned};

/// What the equation of motion has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dynamics {
    /// Inertia, and drag per mass (at least 0).
    Inertial {
        /// γ_d, at least 0.
        drag: f64,
    },
    /// No inertia: drag per mass (> 0) balances the forces.
    Overdamped {
        /// γ_d, greater than 0.
        drag: f64,
    },
}

/// What decides about a body's motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// Forces and contact.
    Free,
    /// It stays where it is.
    Fixed,
    /// It may only turn about a point of it, given in the body's frame.
    Pinned(Point),
    /// Its twist is [`Drive::twist`].
    Held,
    /// Its pose is [`Drive::pose`].
    Path,
}

/// What acts on bodies from outside; bodies are numbered as in [`Particles`]. Values that are not finite end a step
/// with an error.
pub trait Drive {
    /// Total force and torque about the centre: `(F_x, F_y, τ)`.
    fn load(&self, body: usize, t: f64, pose: &Pose, twist: &Twist) -> [f64; 3];

    /// [`Drive::load`] at a share of the step from `t` to `t + dt`.
    fn load_within(&self, body: usize, (t, dt): (f64, f64), share: f64, pose: &Pose, twist: &Twist) -> [f64; 3] {
        self.load(body, t + share * dt, pose, twist)
    }

    /// Twist of a held body.
    fn twist(&self, _body: usize, _t: f64, _pose: &Pose) -> Twist {
        Twist::ZERO
    }

    /// Pose of a body on a path; `now` is where it is.
    fn pose(&self, _body: usize, _t: f64, now: &Pose) -> Pose {
        *now
    }
}

impl<F: Fn(usize, f64, &Pose, &Twist) -> [f64; 3]> Drive for F {
    fn load(&self, body: usize, t: f64, pose: &Pose, twist: &Twist) -> [f64; 3] {
        self(body, t, pose, twist)
    }
}

/// A body and its state.
#[derive(Debug, Clone, PartialEq)]
pub struct Particle {
    /// What messages call it.
    pub name: String,
    /// Its outline, in its own frame.
    pub shape: Shape,
    /// Mass, > 0.
    pub mass: f64,
    /// Moment of inertia about the centre, > 0.
    pub inertia: f64,
    /// Who decides about its motion.
    pub motion: Motion,
    /// Where it is.
    pub pose: Pose,
    /// How it moves.
    pub twist: Twist,
}

impl Particle {
    /// A free body at rest, of density 1.
    pub fn new(name: impl Into<String>, shape: Shape, pose: Pose) -> Self {
        let (mass, inertia) = (shape.area(), shape.second_moment());
        Self { name: name.into(), shape, mass, inertia, motion: Motion::Free, pose, twist: Twist::ZERO }
    }

    /// `½ m |V|² + ½ I ω²`
    pub fn kinetic_energy(&self) -> f64 {
        0.5 * self.mass * self.twist.velocity.norm_squared() + 0.5 * self.inertia * self.twist.spin.powi(2)
    }
}

/// All that changes: with it the same bodies go on to the bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParticleState {
    /// t
    pub time: f64,
    /// Where the bodies are.
    pub poses: Vec<Pose>,
    /// How they move.
    pub twists: Vec<Twist>,
    /// Of gluey contact: how much each pair was pressed.
    pub bonds: Bonds,
}

/// Bodies under forces and contact.
#[derive(Debug, Clone)]
pub struct Particles {
    bodies: Vec<Particle>,
    dynamics: Dynamics,
    solver: Solver,
    time: f64,
}

impl Particles {
    /// Bodies at time 0.
    ///
    /// # Errors
    /// Bodies that overlap each other or a wall; drag out of its range.
    pub fn new(bodies: Vec<Particle>, dynamics: Dynamics, solver: Solver) -> Result<Self, ContactError> {
        let (drag, good, rule) = match dynamics {
            Dynamics::Inertial { drag } => (drag, drag >= 0.0, "must be finite and at least 0"),
            Dynamics::Overdamped { drag } => (drag, drag > 0.0, "must be finite and greater than 0 without inertia"),
        };
        if !good || !drag.is_finite() {
            return Err(ContactError::Setting { key: "drag", value: drag, rule, hint: "1 is a good start" });
        }
        let particles = Self { bodies, dynamics, solver, time: 0.0 };
        particles.solver.check(&particles.movers(&particles.resting()))?;
        Ok(particles)
    }

    /// The bodies with their states.
    pub fn bodies(&self) -> &[Particle] {
        &self.bodies
    }

    /// Time of the state.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// What solves contact, with its walls and settings.
    pub fn solver(&self) -> &Solver {
        &self.solver
    }

    /// `½ Σ m|V|² + ½ Σ Iω²`
    pub fn kinetic_energy(&self) -> f64 {
        self.bodies.iter().map(Particle::kinetic_energy).sum()
    }

    /// All that changes.
    pub fn state(&self) -> ParticleState {
        ParticleState {
            time: self.time,
            poses: self.bodies.iter().map(|b| b.pose).collect(),
            twists: self.bodies.iter().map(|b| b.twist).collect(),
            bonds: self.solver.bonds().clone(),
        }
    }

    /// Goes on from a state of the same bodies.
    ///
    /// # Panics
    /// When the number of bodies differs.
    pub fn restore(&mut self, state: ParticleState) {
        assert_eq!(state.poses.len(), self.bodies.len(), "a state belongs to its bodies");
        self.time = state.time;
        for ((body, pose), twist) in self.bodies.iter_mut().zip(state.poses).zip(state.twists) {
            (body.pose, body.twist) = (pose, twist);
        }
        self.solver.restore(state.bonds);
    }

    /// One step, with the forces at its beginning.
    ///
    /// # Errors
    /// Empty steps; forces that are not finite; bodies that cannot move without overlap. The state is that before the
    /// step.
    pub fn step(&mut self, dt: f64, drive: &dyn Drive) -> Result<StepReport, ContactError> {
        self.step_along(&Stiffness::default(), dt, drive)
    }

    /// One step. Bodies with inertia whose forces vary with their place follow them within the step, where contact lets
    /// them.
    ///
    /// # Errors
    /// Empty steps; forces that are not finite; bodies that cannot move without overlap. The state is that before the
    /// step.
    pub fn step_along(
        &mut self,
        stiffness: &Stiffness,
        dt: f64,
        drive: &dyn Drive,
    ) -> Result<StepReport, ContactError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(ContactError::Step { dt });
        }
        let plans: Vec<Plan> =
            (0..self.bodies.len()).map(|k| self.plan(k, dt, drive)).collect::<Result<_, ContactError>>()?;
        let mut swings: Vec<Option<Swing>> =
            (0..self.bodies.len()).map(|k| self.swing(k, dt, stiffness, drive)).collect();
        let bonds = swings.iter().any(Option::is_some).then(|| self.solver.bonds().clone());
        let projected = loop {
            let along = |(plan, swing): (&Plan, &Option<Swing>)| swing.map_or(*plan, |swing| plan.with(&swing));
            let projected = self.project(&plans.iter().zip(&swings).map(along).collect::<Vec<_>>(), dt)?;
            match &bonds {
                Some(bonds) if give_up(&mut swings, &projected.contacts) => self.solver.restore(bonds.clone()),
                Some(_) | None => break projected,
            }
        };
        let Projected { twists, poses, forces, contacts, wall_force, gap, effort } = projected;
        for (((body, pose), twist), swing) in self.bodies.iter_mut().zip(poses).zip(twists).zip(swings) {
            (body.pose, body.twist) = (pose, swing.map_or(twist, |swing| swing.last));
        }
        self.time += dt;
        let kinetic_energy = self.kinetic_energy();
        Ok(StepReport { time: self.time, contacts, forces, wall_force, gap, kinetic_energy, effort })
    }

    /// What contact leaves of plans; it changes the solver only when it succeeds.
    fn project(&mut self, plans: &[Plan], dt: f64) -> Result<Projected, ContactError> {
        let metric = match self.dynamics {
            Dynamics::Inertial { .. } => Metric::Mass,
            Dynamics::Overdamped { .. } => Metric::Resistance,
        };
        let mut solver = std::mem::replace(&mut self.solver, Solver::empty());
        let projected = solver.project(&self.movers(plans), dt, metric);
        self.solver = solver;
        projected
    }

    /// The swing of body `k`, where its forces make it swing.
    fn swing(&self, k: usize, dt: f64, stiffness: &Stiffness, drive: &dyn Drive) -> Option<Swing> {
        let Dynamics::Inertial { drag } = self.dynamics else { return None };
        let swinging = Swinging { body: &self.bodies[k], index: k, drag, drive };
        stiffness.has_varying_force(k).then(|| swinging.step(self.time, dt)).flatten()
    }

    /// How hard a step from `t` is to follow, for bodies whose forces or velocities vary with their place.
    ///
    /// # Errors
    /// Forces that are not finite.
    pub fn strain(
        &self,
        stiffness: &Stiffness,
        (t, dt): (f64, f64),
        tolerance: f64,
        drive: &dyn Drive,
    ) -> Result<Option<Strain>, ContactError> {
        if stiffness.is_idle() {
            return Ok(None);
        }
        let plans: Vec<Plan> =
            (0..self.bodies.len()).map(|k| self.plan(k, dt, drive)).collect::<Result<_, ContactError>>()?;
        let movers = self.movers(&plans);
        let by: Vec<Twist> = movers.iter().zip(&plans).map(|(mover, plan)| mover.whole(&plan.predicted, dt)).collect();
        let poses: Vec<Pose> = self.bodies.iter().map(|body| body.pose).collect();
        let bound = match self.dynamics {
            // undamped swings keep their period to the tolerance
            Dynamics::Inertial { drag } => tolerance + DECAY * drag * dt / (1.0 + drag * dt),
            Dynamics::Overdamped { .. } => DECAY,
        };
        let stride = Stride { poses: &poses, by: &by, t, dt, tolerance, bound };
        let Ok(strain) = stiffness.strain(stride, &Mobility { particles: self, dt });
        Ok(strain)
    }

    /// Plans in which nothing moves.
    fn resting(&self) -> Vec<Plan> {
        let freedom = |b: &Particle| match b.motion {
            Motion::Free | Motion::Pinned(_) => Freedom::Free { mass: b.mass, inertia: b.inertia },
            Motion::Fixed | Motion::Held | Motion::Path => Freedom::Given { next: b.pose },
        };
        self.bodies.iter().map(|b| Plan { predicted: Twist::ZERO, freedom: freedom(b) }).collect()
    }

    fn movers<'a>(&'a self, plans: &[Plan]) -> Vec<Mover<'a>> {
        let mover = |(body, plan): (&'a Particle, &Plan)| Mover {
            name: &body.name,
            shape: &body.shape,
            pose: body.pose,
            predicted: plan.predicted,
            freedom: plan.freedom,
            last: body.twist,
        };
        self.bodies.iter().zip(plans).map(mover).collect()
    }

    /// What body `k` does without contact.
    fn plan(&self, k: usize, dt: f64, drive: &dyn Drive) -> Result<Plan, ContactError> {
        let Particle { name, mass, inertia, motion, pose, twist, .. } = &self.bodies[k];
        let finite = |what, values: &[f64]| match values.iter().find(|v| !v.is_finite()) {
            Some(&value) => {
                Err(ContactError::NotFinite { body: name.clone(), what, value, at: format!(" at t = {}", self.time) })
            }
            None => Ok(()),
        };
        let given = |next| Ok(Plan { predicted: Twist::ZERO, freedom: Freedom::Given { next } });
        match motion {
            Motion::Fixed => given(*pose),
            Motion::Held => {
                let held = drive.twist(k, self.time, pose);
                finite("motion.held", &[held.velocity.x, held.velocity.y, held.spin])?;
                given(Pose { position: pose.position + dt * held.velocity, angle: pose.angle + dt * held.spin })
            }
            Motion::Path => {
                let next = drive.pose(k, self.time + dt, pose);
                finite("motion.path", &[next.position.x, next.position.y, next.angle])?;
                given(next)
            }
            Motion::Free => {
                let load = drive.load(k, self.time, pose, twist);
                finite("force", &load[..2])?;
                finite("torque", &load[2..])?;
                let velocity = self.advance(twist.velocity, Point::new(load[0], load[1]) / *mass, dt);
                let spin = self.advance(twist.spin, load[2] / inertia, dt);
                let (mass, inertia) = (self.weight(*mass, dt), self.weight(*inertia, dt));
                Ok(Plan { predicted: Twist { velocity, spin }, freedom: Freedom::Free { mass, inertia } })
            }
            Motion::Pinned(pivot) => {
                let load = drive.load(k, self.time, pose, twist);
                finite("force", &load[..2])?;
                finite("torque", &load[2..])?;
                let arm = -turned(*pivot, pose.angle);
                let about = inertia + mass * pivot.norm_squared();
                let torque = load[2] + perpendicular(arm).dot(&Point::new(load[0], load[1]));
                let spin = self.advance(twist.spin, torque / about, dt);
                let freedom = Freedom::Pinned { pivot: *pivot, inertia: self.weight(about, dt) };
                Ok(Plan { predicted: Twist { spin, ..Twist::ZERO }, freedom })
            }
        }
    }

    /// The velocity after a step under an acceleration.
    fn advance<V>(&self, velocity: V, acceleration: V, dt: f64) -> V
    where
        V: std::ops::Add<Output = V> + std::ops::Mul<f64, Output = V> + std::ops::Div<f64, Output = V>,
    {
        match self.dynamics {
            Dynamics::Inertial { drag } => (velocity + acceleration * dt) / (1.0 + drag * dt),
            Dynamics::Overdamped { drag } => acceleration / drag,
        }
    }

    /// The velocity that an acceleration gives in a step.
    fn gained<V>(&self, acceleration: V, dt: f64) -> V
    where
        V: std::ops::Mul<f64, Output = V> + std::ops::Div<f64, Output = V>,
    {
        match self.dynamics {
            Dynamics::Inertial { drag } => acceleration * dt / (1.0 + drag * dt),
            Dynamics::Overdamped { drag } => acceleration / drag,
        }
    }

    /// The metric of a mass or moment of inertia.
    fn weight(&self, inertia: f64, dt: f64) -> f64 {
        match self.dynamics {
            Dynamics::Inertial { drag } => inertia * (1.0 + drag * dt),
            Dynamics::Overdamped { drag } => inertia * drag,
        }
    }
}

/// What a body would do in a step without contact.
#[derive(Clone, Copy)]
struct Plan {
    predicted: Twist,
    freedom: Freedom,
}

impl Plan {
    fn with(self, swing: &Swing) -> Self {
        Self { predicted: swing.mean, ..self }
    }
}

/// Takes the swings from bodies that contact acts on: these take the forces at the beginning, as contact does. Whether
/// there was one.
fn give_up(swings: &mut [Option<Swing>], contacts: &[Contact]) -> bool {
    let mut found = false;
    for contact in contacts.iter().filter(|contact| contact.force != 0.0) {
        found |= swings[contact.body].take().is_some();
        if let Partner::Body(other) = contact.partner {
            found |= swings[other].take().is_some();
        }
    }
    found
}

/// What forces change of the velocities of a step.
struct Mobility<'a> {
    particles: &'a Particles,
    dt: f64,
}

impl Response for Mobility<'_> {
    type Error = std::convert::Infallible;

    fn twists(&self, wrenches: &[Wrench]) -> Result<Vec<Twist>, Self::Error> {
        let Self { particles, dt } = self;
        let one = |(body, wrench): (&Particle, &Wrench)| match body.motion {
            Motion::Free => Twist {
                velocity: particles.gained(wrench.force / body.mass, *dt),
                spin: particles.gained(wrench.torque / body.inertia, *dt),
            },
            Motion::Pinned(pivot) => {
                let arm = perpendicular(-turned(pivot, body.pose.angle));
                let about = body.inertia + body.mass * pivot.norm_squared();
                let spin = particles.gained((wrench.torque + arm.dot(&wrench.force)) / about, *dt);
                Twist { velocity: spin * arm, spin }
            }
            Motion::Fixed | Motion::Held | Motion::Path => Twist::ZERO,
        };
        Ok(particles.bodies.iter().zip(wrenches).map(one).collect())
    }
}
