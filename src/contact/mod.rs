//! Contact of rigid bodies with each other and with walls: inelastic, or gluey by the lubrication of a vanishing film.
//!
//! The gap `D` of a pair is the signed distance of its shapes and `G` its gradient with position and angle. From
//! predicted velocities V* a step takes `W = argmin ½|W − V*|²_M` over `D + Δt G·W ≥ η` \[L3\], then `x ← x + Δt W`. In
//! gluey contact the multiplier λ may be negative down to `γ/(R Δt)`: a bond holds until it has been pulled as much as
//! it was pressed, and what a pull has in excess parts the pair within the same step. So one convex projection treats
//! any number of bonds that break at once.
//!
//! A row of discs falls to the floor, and the floor carries their weight:
//!
//! ```
//! use monolayer::contact::particles::{Dynamics, Particle, Particles};
//! use monolayer::contact::{Settings, Solver, Wall};
//! use monolayer::mesh::Point;
//! use monolayer::shape::{Disc, Pose, Twist};
//!
//! let disc = |k: usize| {
//!     let position = Point::new(0.01 * k as f64, 0.3 + 0.25 * k as f64);
//!     Particle::new(format!("disc-{k}"), Disc { radius: 0.1 }.into(), Pose { position, angle: 0.0 })
//! };
//! let floor = Wall::Segment([Point::new(-2.0, 0.0), Point::new(2.0, 0.0)]);
//! let solver = Solver::new(&[floor], Settings::default())?;
//! let bodies: Vec<Particle> = (0..3).map(disc).collect();
//! let mass = bodies[0].mass;
//! let mut particles = Particles::new(bodies, Dynamics::Inertial { drag: 1.0 }, solver)?;
//! let weight = move |_: usize, _: f64, _: &Pose, _: &Twist| [0.0, -mass, 0.0];
//! let mut last = particles.step(0.01, &weight)?;
//! for _ in 0..2000 {
//!     last = particles.step(0.01, &weight)?;
//! }
//! assert!(last.overlap() < 1e-9 && last.kinetic_energy < 1e-6, "{last:?}");
//! assert!((last.wall_force.y + 3.0 * mass).abs() < 1e-3 * mass, "{}", last.wall_force);
//! # Ok::<(), monolayer::contact::ContactError>(())
//! ```

mod bonds;
mod caught;
mod error;
pub mod gap;
mod gradients;
pub mod in_flow;
mod islands;
mod leaps;
pub mod mobility;
mod mover;
mod newton;
mod outcome;
pub mod pairs;
pub mod particles;
pub mod projection;
mod repair;
mod rough;
mod smooth;
mod solver;
mod step;
mod swing;
mod walls;

pub use bonds::{Bond, Bonds, Key};
pub use error::ContactError;
pub use mover::{Freedom, Mover};
pub use projection::Method;
pub use solver::{Effort, MOST_FRICTION, Metric, Projected, Settings, Solver};
pub use walls::Walls;

use crate::body::leaving::Remaining;
use crate::mesh::Point;

/// What bodies cannot enter and that never moves; obstacles that move are bodies on a given path.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wall {
    /// Bodies stay on the left of the directed segment, or touch its ends.
    Segment([Point; 2]),
    /// Bodies stay outside.
    Disc {
        /// Its middle.
        centre: Point,
        /// Bodies keep this far from the middle.
        radius: f64,
    },
    /// Bodies stay inside.
    Hollow {
        /// Its middle.
        centre: Point,
        /// Bodies stay within this distance of the middle.
        radius: f64,
    },
}

/// How bodies that meet part again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// `G·V ≥ 0` where they touch.
    Inelastic,
    /// They stay together until they have been pulled as much as they were pressed [L4, L5]; `γ ≥ γ_min`, the threshold
    /// of roughness, `−∞` for smooth bodies.
    Gluey {
        /// At most 0.
        gamma_min: f64,
    },
}

/// What a body touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Partner {
    /// Another body, by its number.
    Body(usize),
    /// A wall, by its number.
    Wall(usize),
}

/// A pair that is close or touches, after a step.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Contact {
    /// The first body, of the lower index.
    pub body: usize,
    /// What it touches.
    pub partner: Partner,
    /// Gap `D` after the step.
    pub gap: f64,
    /// Multiplier λ, the normal force: positive repels, negative holds.
    pub force: f64,
    /// λ_t, the force of friction on the partner along `n^⊥`, and its opposite on the first body; 0 without friction.
    pub friction: f64,
    /// `γ ≤ 0`; 0 in inelastic contact.
    pub gamma: f64,
    /// Where the pair is nearest, midway.
    pub point: Point,
    /// Unit normal from the first body to its partner.
    pub normal: Point,
}

impl Partner {
    /// Its number among the bodies that are left; `None` of one that has gone. Walls stay.
    pub fn of(self, remaining: &Remaining) -> Option<Self> {
        match self {
            Partner::Body(other) => remaining.number(other).map(Partner::Body),
            Partner::Wall(_) => Some(self),
        }
    }
}

/// Contacts between bodies that are left, and of these with walls.
pub fn among(contacts: &[Contact], remaining: &Remaining) -> Vec<Contact> {
    let of = |contact: &Contact| {
        let (body, partner) = (remaining.number(contact.body)?, contact.partner.of(remaining)?);
        Some(Contact { body, partner, ..*contact })
    };
    contacts.iter().filter_map(of).collect()
}
