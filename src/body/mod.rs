//! Rigid bodies: what they are, how they move, and how a flow carries them.
//!
//! A body B has the velocity `V + ω (x−x_B)^⊥`, `y^⊥ = (−y₂, y₁)`. In a flow it is a region of viscosity larger by 1/ε:
//! `(2/ε) ∫_B D(v):D(w)` is added to the viscous form [L1.13], and velocity and spin are means of the flow over B. Tags
//! `[L…]` are equations of Lefebvre's thesis (2007).

pub mod guide;
pub mod leaving;
pub mod motion;
pub(crate) mod stiffness;

use crate::expression::Expression;
use crate::mesh::Point;
use crate::shape::{Pose, Shape, Twist};

/// What decides about a body's motion.
#[derive(Debug, Clone, PartialEq)]
pub enum Hold {
    /// Forces, the flow and contact.
    Free,
    /// Nothing: it stays where it is.
    Fixed,
    /// It may only turn about a point of it, given in the body's frame.
    Pinned(Point),
    /// Velocity and spin are formulas of t (and of the position and angle, `x`, `y`, `theta`).
    Held {
        /// V, of the centre.
        velocity: [Expression; 2],
        /// ω
        spin: Expression,
    },
    /// Position and angle are formulas of t.
    Path {
        /// Of the centre.
        position: [Expression; 2],
        /// Counterclockwise.
        angle: Expression,
    },
}

/// A rigid body. Everything is dimensionless.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// What tables and messages call it.
    pub name: String,
    /// Its table in the scene, such as `body.0`, for messages; may be empty.
    pub key: String,
    /// Its outline, in its own frame.
    pub shape: Shape,
    /// Who decides about its motion.
    pub hold: Hold,
    /// Mass per area; inertia counts in `particles` only.
    pub density: f64,
    /// Total external force, formulas of `t`, `x`, `y`, `theta` (the body's position and angle).
    pub force: [Expression; 2],
    /// External torque about the centre.
    pub torque: Expression,
    /// Friction with the substrate, per area.
    pub friction: f64,
    /// At t = 0.
    pub start: Pose,
    /// At t = 0; counts in `particles` only.
    pub start_twist: Twist,
}

impl Body {
    /// A free body of density 1, at rest, on which nothing acts.
    pub fn new(name: impl Into<String>, shape: Shape, start: Pose) -> Self {
        Self {
            name: name.into(),
            key: String::new(),
            shape,
            hold: Hold::Free,
            density: 1.0,
            force: [0.0, 0.0].map(Expression::constant),
            torque: Expression::constant(0.0),
            friction: 0.0,
            start,
            start_twist: Twist::ZERO,
        }
    }

    /// Mass `m`.
    pub fn mass(&self) -> f64 {
        self.density * self.shape.area()
    }

    /// One of its formulas, as messages name it.
    pub fn formula(&self, name: &str) -> String {
        match self.key.is_empty() {
            true => format!("the {name} of the body `{}`", self.name),
            false => format!("the {name} of the body `{}` (`{}.{name}`)", self.name, self.key),
        }
    }

    /// Moment of inertia about the centre.
    pub fn inertia(&self) -> f64 {
        self.density * self.shape.second_moment()
    }
}
