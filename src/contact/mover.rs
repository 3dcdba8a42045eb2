//! Bodies as contact sees them: shape, place, predicted motion, and what contact may change.

use super::ContactError;
use super::pairs::Range;
use crate::body::{Body, Hold};
use crate::mesh::Point;
use crate::shape::{Pose, Shape, Twist, perpendicular, turned};

/// What contact can change about the motion of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Freedom {
    /// Everything; mass and moment of inertia, or the resistances to velocity and spin. Both > 0.
    Free {
        /// Or the resistance to translation.
        mass: f64,
        /// Or the resistance to rotation.
        inertia: f64,
    },
    /// The spin about a point given in the body's frame; inertia, or resistance, *about this point*.
    Pinned {
        /// The point that stays, in the body's frame.
        pivot: Point,
        /// About the pivot.
        inertia: f64,
    },
    /// Nothing: it will be at `next`.
    Given {
        /// Where it will be at the end of the step.
        next: Pose,
    },
}

/// A body that takes part in a step.
#[derive(Debug, Clone, Copy)]
pub struct Mover<'a> {
    /// What messages call it.
    pub name: &'a str,
    /// Its outline, in its own frame.
    pub shape: &'a Shape,
    /// Where it is at the beginning of the step.
    pub pose: Pose,
    /// What it would do without contact; of pinned bodies only the spin counts, of given ones nothing.
    pub predicted: Twist,
    /// How contact may change its step.
    pub freedom: Freedom,
    /// What it did before the step; counts where bodies rub or bounce.
    pub last: Twist,
}

impl<'a> Mover<'a> {
    /// A body without inertia in a fluid with friction `C_F`, that would have the motion `predicted` for the time `dt`.
    ///
    /// The projection weighs such bodies by resistances: `4π + C_F|B|` against translation and `4πr²` against rotation,
    /// r the largest radius. The forces of contact are then forces in the units of the fluid.
    pub fn in_fluid(body: &'a Body, pose: Pose, predicted: Twist, dt: f64, friction: f64) -> Self {
        let four_pi = 4.0 * std::f64::consts::PI;
        let mass = four_pi + friction * body.shape.area();
        let inertia = four_pi * body.shape.circumradius().powi(2);
        let freedom = match &body.hold {
            Hold::Free => Freedom::Free { mass, inertia },
            Hold::Pinned(pivot) => Freedom::Pinned { pivot: *pivot, inertia: inertia + mass * pivot.norm_squared() },
            Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => {
                let (position, angle) = (pose.position + predicted.velocity * dt, pose.angle + predicted.spin * dt);
                Freedom::Given { next: Pose { position, angle } }
            }
        };
        Self { name: &body.name, shape: &body.shape, pose, predicted, freedom, last: predicted }
    }
}
/// The square that a body does not leave when none of its points moves farther than `reach`.
pub(super) fn range(mover: &Mover, reach: f64) -> Range {
    let moves = match mover.freedom {
        Freedom::Free { .. } | Freedom::Pinned { .. } => true,
        Freedom::Given { .. } => false,
    };
    Range { centre: mover.pose.position, half: mover.shape.circumradius() + reach, moves }
}

pub(super) fn check_mover(mover: &Mover) -> Result<(), ContactError> {
    let body = || mover.name.to_owned();
    let Pose { position, angle } = mover.pose;
    let Twist { velocity, spin } = mover.predicted;
    let mut values = vec![("position", position.x), ("position", position.y), ("angle", angle)];
    let predicted = [("predicted velocity", velocity.x), ("predicted velocity", velocity.y), ("predicted spin", spin)];
    match mover.freedom {
        Freedom::Given { next } => {
            values.extend([
                ("next position", next.position.x),
                ("next position", next.position.y),
                ("next angle", next.angle),
            ]);
        }
        Freedom::Free { .. } | Freedom::Pinned { .. } => values.extend(predicted),
    }
    if let Some(&(what, value)) = values.iter().find(|v| !v.1.is_finite()) {
        return Err(ContactError::NotFinite { body: body(), what, value, at: String::new() });
    }
    let inertias = match mover.freedom {
        Freedom::Free { mass, inertia } => {
            vec![("mass or resistance", mass), ("inertia or resistance to spin", inertia)]
        }
        Freedom::Pinned { inertia, .. } => vec![("inertia or resistance to spin about the pin", inertia)],
        Freedom::Given { .. } => Vec::new(),
    };
    match inertias.into_iter().find(|(_, m)| !(*m > 0.0 && m.is_finite())) {
        Some((what, value)) => Err(ContactError::Inertia { body: body(), what, value }),
        None => Ok(()),
    }
}

impl Mover<'_> {
    /// Where it is after a step with `twist`.
    pub fn after(&self, twist: &Twist, dt: f64) -> Pose {
        let Pose { position, angle } = self.pose;
        match self.freedom {
            Freedom::Free { .. } => Pose { position: position + dt * twist.velocity, angle: angle + dt * twist.spin },
            Freedom::Pinned { pivot, .. } => {
                let angle = angle + dt * twist.spin;
                Pose { position: self.pose.to_space(pivot) - turned(pivot, angle), angle }
            }
            Freedom::Given { next } => next,
        }
    }

    /// The twist of the body as a whole, whose free part is `twist`.
    pub(super) fn whole(&self, twist: &Twist, dt: f64) -> Twist {
        match self.freedom {
            Freedom::Free { .. } => *twist,
            Freedom::Pinned { pivot, .. } => {
                let arm = -turned(pivot, self.pose.angle);
                Twist { velocity: twist.spin * perpendicular(arm), spin: twist.spin }
            }
            Freedom::Given { next } => {
                Twist { velocity: (next.position - self.pose.position) / dt, spin: (next.angle - self.pose.angle) / dt }
            }
        }
    }

    /// How far its centre moves in a step with `twist`, and a bound of how far its turning carries points of its
    /// boundary beside that.
    pub(super) fn strides(&self, twist: &Twist, dt: f64) -> (Point, f64) {
        let round = if self.shape.is_round() { 0.0 } else { self.shape.circumradius() };
        let after = self.after(twist, dt);
        let turn = (after.angle - self.pose.angle).abs();
        match self.freedom {
            Freedom::Free { .. } | Freedom::Given { .. } => (after.position - self.pose.position, turn * round),
            // its centre moves on a circle about the pin
            Freedom::Pinned { pivot, .. } => (Point::zeros(), turn * (round + pivot.norm())),
        }
    }

    /// A bound of how far a point of it moves in a step with `twist`.
    pub(super) fn travel(&self, twist: &Twist, dt: f64) -> f64 {
        let size = self.shape.circumradius();
        match self.freedom {
            Freedom::Free { .. } => dt * (twist.velocity.norm() + size * twist.spin.abs()),
            Freedom::Pinned { pivot, .. } => dt * twist.spin.abs() * (pivot.norm() + size),
            Freedom::Given { next } => {
                (next.position - self.pose.position).norm() + size * (next.angle - self.pose.angle).abs()
            }
        }
    }
}
