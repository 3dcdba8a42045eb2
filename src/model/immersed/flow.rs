//! A Stokes flow that carries rigid bodies: solve the flow for the bodies' places, let the caller correct how they
//! move, move them.
//!
//! A disc in a shear flow turns with half of its rate:
//!
//! ```
//! use std::sync::Arc;
//!
//! use monolayer::body::Body;
//! use monolayer::expression::Expression;
//! use monolayer::form::Linear;
//! use monolayer::mesh::{Point, generate::MeshScene};
//! use monolayer::model::Conditions;
//! use monolayer::model::immersed::flow::{Flow, Settings};
//! use monolayer::model::momentum::SlipTreatment;
//! use monolayer::shape::{Disc, Pose};
//!
//! let mesh = Arc::new(MeshScene::of("square").with("n", 20).build()?);
//! let shear = Conditions::flow(["y".parse()?, Expression::constant(0.0)]);
//! let start = Pose { position: Point::new(0.5, 0.5), angle: 0.0 };
//! let disc = Body::new("disc", Disc { radius: 0.15 }.into(), start);
//! let conditions = vec![shear; mesh.tags.len()];
//! let (slip, settings) = (SlipTreatment::default(), Settings::default());
//! let mut flow = Flow::new(&mesh, (2, 1), &conditions, (0.0, slip), vec![disc], (settings, 0.0))?;
//! for _ in 0..3 {
//!     let now = flow.solve(&Linear::zero())?.twists;
//!     let by = flow.predicted(0.1, &now)?;
//!     flow.advance(0.1, &now, &by)?;
//! }
//! let Pose { position, angle } = flow.motion.poses[0];
//! assert!((angle + 0.15).abs() < 0.01 && (position.x - 0.65).abs() < 0.01, "{angle} {position}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::sync::Arc;

use super::FlowWithBodies;
use super::leaving::without_those_outside;
pub use super::penalty::{Penalty, Strength};
use crate::body::Body;
use crate::body::guide::{Guide, Rule};
use crate::body::leaving::Remaining;
use crate::body::motion::Motion;
use crate::expression::ExpressionError;
use crate::form::Integrator;
use crate::form::linear::Linear;
use crate::form::words::Vector;
use crate::mesh::Mesh;
use crate::model::floating::embed;
use crate::model::momentum::{Momentum, MomentumError, SlipTreatment};
use crate::model::terms::FlowTerms;
use crate::model::{Conditions, Fluid};
use crate::shape::{Twist, Wrench};
use crate::space::{Continuity, Space};

/// What a body is to the flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// A fluid that is 1/ε times as viscous [L1.13].
    Penalty(Penalty),
    /// A boundary of the fluid, see [`nitsche`](super::nitsche).
    Nitsche,
}

/// How bodies are put into a flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// What they are to the flow.
    pub method: Method,
    /// Order of the motion in time, 1 or 2.
    pub order: usize,
}

/// ε of the penalty that is small enough for any use.
pub const EPSILON: f64 = 1e-8;

impl Default for Settings {
    /// By Nitsche's method, and the second order.
    fn default() -> Self {
        Self { method: Method::Nitsche, order: 2 }
    }
}

/// A Stokes flow with bodies, at one time.
#[derive(Debug)]
pub struct Flow {
    /// Over the mesh.
    pub loops: Integrator,
    /// The Stokes system with the bodies in it.
    pub momentum: Momentum,
    /// One for each tag.
    pub conditions: Vec<Conditions>,
    /// What the bodies are, and what is prescribed of them.
    pub guide: Guide,
    /// Where they are, and how they have moved.
    pub motion: Motion,
    /// Time.
    pub t: f64,
    method: Method,
}

impl Flow {
    /// Puts the bodies at their starting poses.
    ///
    /// # Errors
    /// As [`Momentum::with_bodies`]; paths that have no derivative.
    pub fn new(
        mesh: &Arc<Mesh>,
        (velocity, pressure): (usize, usize),
        conditions: &[Conditions],
        (friction, slip): (f64, SlipTreatment),
        bodies: Vec<Body>,
        (settings, t): (Settings, f64),
    ) -> Result<Self, MomentumError> {
        let velocity = Arc::new(Space::new(mesh, Continuity::Continuous, velocity, 2));
        let pressure = Arc::new(Space::new(mesh, Continuity::Continuous, pressure, 1));
        let guide = Guide::new(bodies)?;
        let poses = guide.starts(t)?;
        let loops = Integrator::new(mesh);
        let bodies = embed(&loops, &velocity, &guide, &poses, settings.method)?;
        let spaces = (&velocity, &pressure);
        let terms = FlowTerms::of(&Fluid { friction });
        let momentum = Momentum::with_bodies(&loops, spaces, conditions, &terms, slip, bodies)?;
        let motion = Motion::new(poses, settings.order);
        Ok(Self { loops, momentum, conditions: conditions.to_vec(), guide, motion, t, method: settings.method })
    }

    /// The flow now, under an outer force and the bodies' own forces, and how the bodies move in it.
    ///
    /// # Errors
    /// As [`Momentum::carry`]; formulas that are not finite.
    pub fn solve(&self, force: &Linear<Vector>) -> Result<FlowWithBodies, MomentumError> {
        self.solve_pushed(force, &[])
    }

    /// As [`Flow::solve`] with further forces and torques on the bodies, those of contact; none of them where there are
    /// none.
    ///
    /// # Errors
    /// As [`Flow::solve`].
    pub fn solve_pushed(&self, force: &Linear<Vector>, pushes: &[Wrench]) -> Result<FlowWithBodies, MomentumError> {
        let f = self.fluid().vector(force, &self.momentum.velocity);
        let prescribed = self.momentum.frames.prescribed(&self.conditions, self.t)?;
        let (mut loads, rules) = (self.loads()?, self.rules()?);
        loads.iter_mut().zip(pushes).for_each(|(load, push)| *load = *load + *push);
        self.momentum.carry(&f, &prescribed, &loads, &rules)
    }

    /// The loops over what the equations are posed on: all of the mesh by penalty, and by Nitsche's method all that no
    /// body covers.
    pub fn fluid(&self) -> Integrator {
        match (self.method, self.momentum.cover()) {
            (Method::Nitsche, Some(cover)) => self.loops.outside(cover),
            (_, _) => self.loops.clone(),
        }
    }

    /// External forces and torques on the bodies now.
    ///
    /// # Errors
    /// A formula that is not finite.
    pub fn loads(&self) -> Result<Vec<Wrench>, ExpressionError> {
        self.guide.loads(&self.motion.poses, self.t)
    }

    /// What is prescribed of the bodies' motions now.
    ///
    /// # Errors
    /// A formula that is not finite.
    pub fn rules(&self) -> Result<Vec<Rule>, ExpressionError> {
        self.guide.rules(&self.motion.poses, self.t)
    }

    /// The twists by which the bodies would move in a step `dt`: `x ← x + Δt W`. Contact may correct them before
    /// [`Flow::advance`].
    ///
    /// # Errors
    /// A path that is not finite.
    pub fn predicted(&self, dt: f64, now: &[Twist]) -> Result<Vec<Twist>, ExpressionError> {
        self.guide.predicted(&self.motion, self.t, dt, now)
    }

    /// Puts the bodies where they were in an earlier run, which then goes on bit for bit.
    ///
    /// # Errors
    /// As [`Momentum::place_bodies`].
    pub fn resume(&mut self, motion: Motion) -> Result<(), MomentumError> {
        if motion.poses != self.motion.poses {
            self.momentum.place_bodies(&self.loops, &motion.poses)?;
        }
        self.motion = motion;
        Ok(())
    }

    /// Ends a step: moves the bodies by the twists `by` from where they had the twists `now`.
    ///
    /// # Errors
    /// As [`Momentum::place_bodies`].
    pub fn advance(&mut self, dt: f64, now: &[Twist], by: &[Twist]) -> Result<(), MomentumError> {
        self.motion.advance(dt, now, by);
        self.t += dt;
        if dt > 0.0 {
            self.momentum.place_bodies(&self.loops, &self.motion.poses)?;
        }
        Ok(())
    }

    /// The same flow without a body of which nothing is left in the mesh, as [`Flow::advance`] has found, and without
    /// others that lie outside as well: built anew around those that are left, which are told.
    ///
    /// # Errors
    /// As [`Momentum::with_bodies`].
    pub fn without(&self, first: usize) -> Result<(Self, Remaining), MomentumError> {
        without_those_outside(self.guide.bodies.len(), first, |remaining| self.around(remaining))
    }

    /// The same flow with fewer bodies, at their places.
    fn around(&self, remaining: &Remaining) -> Result<Self, MomentumError> {
        let (guide, motion) = (self.guide.of(remaining), self.motion.of(remaining));
        let bodies = embed(&self.loops, &self.momentum.velocity, &guide, &motion.poses, self.method)?;
        let momentum = self.momentum.around(&self.loops, &self.conditions, bodies)?;
        let (loops, conditions) = (self.loops.clone(), self.conditions.clone());
        Ok(Self { loops, momentum, conditions, guide, motion, t: self.t, method: self.method })
    }
}
