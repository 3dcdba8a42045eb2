//! Numbers of rigid bodies and their contacts.

use crate::contact::{Contact, Partner};
use crate::mesh::Point;
use crate::shape::{Pose, Twist, perpendicular};

/// What acts on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Of all contacts together.
    pub force: Point,
    /// About the body's centre.
    pub torque: f64,
}

impl Load {
    /// Nothing.
    pub const ZERO: Load = Load { force: Point::new(0.0, 0.0), torque: 0.0 };
}

/// `½ Σ m|V|² + ½ Σ I ω²` of masses `m` and moments of inertia `I`.
///
/// # Panics
/// When the lists differ in length.
pub fn kinetic_energy(masses: &[f64], inertias: &[f64], twists: &[Twist]) -> f64 {
    assert!(masses.len() == twists.len() && inertias.len() == twists.len(), "masses of other bodies");
    let one =
        |((m, i), twist): ((&f64, &f64), &Twist)| 0.5 * (m * twist.velocity.norm_squared() + i * twist.spin.powi(2));
    masses.iter().zip(inertias).zip(twists).map(one).sum()
}

/// The smallest gap `min D`, negative in an overlap; `None` where no pair is near.
pub fn smallest_gap(contacts: &[Contact]) -> Option<f64> {
    contacts.iter().map(|contact| contact.gap).reduce(f64::min)
}

/// The deepest overlap `max(0, −D)`.
pub fn overlap(contacts: &[Contact]) -> f64 {
    contacts.iter().map(|contact| -contact.gap).fold(0.0, f64::max)
}

/// Number of pairs that press or hold each other, λ ≠ 0.
pub fn touching(contacts: &[Contact]) -> usize {
    contacts.iter().filter(|contact| contact.force != 0.0).count()
}

/// The force of all bodies on all walls, `Σ λn` over their contacts.
pub fn wall_force(contacts: &[Contact]) -> Point {
    let on_wall = contacts.iter().filter(|contact| match contact.partner {
        Partner::Wall(_) => true,
        Partner::Body(_) => false,
    });
    on_wall.map(|contact| contact.force * contact.normal).fold(Point::zeros(), |sum, f| sum + f)
}

/// The force and torque of all contacts on every body, `Σ λG`: `−λn` on the first body of a pair and `λn` on the
/// second, in the point where they are nearest.
///
/// # Panics
/// When a contact names a body that there is not.
pub fn loads(poses: &[Pose], contacts: &[Contact]) -> Vec<Load> {
    let mut loads = vec![Load::ZERO; poses.len()];
    let mut push = |body: usize, force: Point, at: Point| {
        loads[body].force += force;
        loads[body].torque += perpendicular(at - poses[body].position).dot(&force);
    };
    for contact in contacts {
        let force = contact.force * contact.normal;
        push(contact.body, -force, contact.point);
        match contact.partner {
            Partner::Body(other) => push(other, force, contact.point),
            Partner::Wall(_) => {}
        }
    }
    loads
}
