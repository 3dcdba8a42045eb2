//! Rigid bodies and their contacts in files: polydata for ParaView, tables, and what a picture of them needs.
//!
//! A [`Solids`] is what never changes about the bodies of a run, a [`Moment`] what is known of them at one time.
//! [`BodyFiles`] writes moments on the way.

mod files;
mod picture;
mod vtp;

use std::collections::HashMap;
use std::path::Path;

pub use files::{BodyFiles, BodyOutputs};
pub use picture::{Colour, Look, overlay, picture, view};
pub use vtp::{write_bodies, write_contacts, write_walls};

use super::{OutputError, write_whole};
use crate::body::{Body, Hold};
use crate::contact::{Contact, Partner, Wall};
use crate::measure::bodies::Load;
use crate::mesh::Point;
use crate::shape::{Pose, Shape, Twist, Wrench};

/// Name of the file in which a run keeps its [`Solids`].
pub const SOLIDS_FILE: &str = "bodies.json";

/// A body as files and pictures know it.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Member {
    /// What tables and pictures call it.
    pub name: String,
    /// Its outline, in its own frame.
    pub shape: Shape,
    /// Whether it never moves; pictures show it like a wall.
    pub fixed: bool,
}

/// The bodies and walls of a run, without what changes in time.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Solids {
    /// In the order of every list of a [`Moment`].
    pub bodies: Vec<Member>,
    /// What bodies cannot enter.
    pub walls: Vec<Wall>,
}

impl Solids {
    /// Of these bodies and walls, in this order.
    pub fn new(bodies: &[Body], walls: &[Wall]) -> Self {
        let member = |body: &Body| Member {
            name: body.name.clone(),
            shape: body.shape.clone(),
            fixed: match body.hold {
                Hold::Fixed => true,
                Hold::Free | Hold::Pinned(_) | Hold::Held { .. } | Hold::Path { .. } => false,
            },
        };
        Self { bodies: bodies.iter().map(member).collect(), walls: walls.to_vec() }
    }

    /// Some of the bodies by their names, in the order of these, and all walls.
    #[must_use]
    pub fn named<'n>(&self, names: impl Iterator<Item = &'n str>) -> Self {
        let by_name: HashMap<&str, &Member> = self.bodies.iter().map(|member| (&*member.name, member)).collect();
        let bodies = names.filter_map(|name| by_name.get(name).copied().cloned()).collect();
        Self { bodies, walls: self.walls.clone() }
    }

    /// Writes a JSON file, whole or not at all.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        write_whole(path, |out| serde_json::to_writer_pretty(out, self).map_err(std::io::Error::other))
    }

    /// Reads a file that [`Solids::write`] wrote.
    ///
    /// # Errors
    /// [`OutputError::Io`] if the file cannot be read; [`OutputError::Malformed`] for a file of another form.
    pub fn read(path: &Path) -> Result<Self, OutputError> {
        let text = std::fs::read_to_string(path).map_err(|e| OutputError::io(path, &e))?;
        serde_json::from_str(&text).map_err(|e| OutputError::Malformed {
            path: path.display().to_string(),
            what: e.to_string(),
            hint: "it is not the list of bodies of a run; run again, or take it from the run's folder",
        })
    }
}

/// The bodies at one time.
#[derive(Debug, Clone, Copy)]
pub struct Moment<'a> {
    /// What never changes.
    pub solids: &'a Solids,
    /// t
    pub time: f64,
    /// One for each body, as of all lists below.
    pub poses: &'a [Pose],
    /// How the bodies move.
    pub twists: &'a [Twist],
    /// Of a Stokes flow; none of other flows.
    pub flow: &'a [Wrench],
    /// Of all contacts together; see [`crate::measure::bodies::loads`].
    pub loads: &'a [Load],
    /// Pairs that are close or touch.
    pub contacts: &'a [Contact],
}

impl Moment<'_> {
    /// Refuses what is not finite before a file is touched.
    ///
    /// # Errors
    /// [`OutputError::NonFiniteBody`] for the first such number, with the body's name.
    ///
    /// # Panics
    /// When the lists differ in length, or a contact names a body or wall that there is not.
    pub fn check(&self, path: &Path) -> Result<(), OutputError> {
        let count = self.solids.bodies.len();
        assert!([self.poses.len(), self.twists.len(), self.loads.len()] == [count; 3], "lists of {count} bodies");
        let refuse = |which: String, numbers: &[(&'static str, f64)]| {
            let wrong = numbers.iter().find(|(_, value)| !value.is_finite());
            wrong.map_or(Ok(()), |&(quantity, value)| {
                let hint =
                    "the computation has broken down: take smaller time steps, or look at the forces of this body";
                Err(OutputError::NonFiniteBody { path: path.display().to_string(), which, quantity, value, hint })
            })
        };
        for (k, member) in self.solids.bodies.iter().enumerate() {
            let (pose, twist, load) = (&self.poses[k], &self.twists[k], &self.loads[k]);
            let numbers = [
                ("the position", pose.position.sum()),
                ("the angle", pose.angle),
                ("the velocity", twist.velocity.sum()),
                ("the spin", twist.spin),
                ("the contact force", load.force.sum()),
                ("the contact torque", load.torque),
            ];
            refuse(format!("body `{}`", member.name), &numbers)?;
            let flow =
                self.flow.get(k).map(|flow| [("the force of the flow", flow.force.sum()), ("its torque", flow.torque)]);
            refuse(format!("body `{}`", member.name), flow.as_ref().map_or(&[], |numbers| &numbers[..]))?;
        }
        for contact in self.contacts {
            let which =
                format!("the contact of `{}` and `{}`", self.solids.bodies[contact.body].name, self.partner(contact));
            let place = contact.point.sum() + contact.normal.sum();
            let numbers = [
                ("the gap", contact.gap),
                ("the multiplier", contact.force),
                ("the friction", contact.friction),
                ("γ", contact.gamma),
                ("the place", place),
            ];
            refuse(which, &numbers)?;
        }
        Ok(())
    }

    /// What a contact's partner is called: the body's name, or `wall-1`, ….
    ///
    /// # Panics
    /// For a body or wall that there is not.
    pub fn partner(&self, contact: &Contact) -> String {
        match contact.partner {
            Partner::Body(other) => self.solids.bodies[other].name.clone(),
            Partner::Wall(wall) => {
                assert!(wall < self.solids.walls.len(), "contact with wall {wall}");
                format!("wall-{}", wall + 1)
            }
        }
    }

    /// The ends of a contact's line: the body's centre, and the partner's centre or the nearest point of the wall.
    pub fn ends(&self, contact: &Contact) -> [Point; 2] {
        let to = match contact.partner {
            Partner::Body(other) => self.poses[other].position,
            Partner::Wall(_) => contact.point + 0.5 * contact.gap * contact.normal,
        };
        [self.poses[contact.body].position, to]
    }

    /// The outline of a body in space; see [`Shape::outline`].
    pub fn outline(&self, body: usize, points: usize) -> Vec<Point> {
        self.solids.bodies[body].shape.at(self.poses[body]).outline(points)
    }

    /// The body in which a point lies.
    pub fn body_at(&self, x: Point) -> Option<usize> {
        let inside = |(member, pose): (&Member, &Pose)| {
            (x - pose.position).norm() <= member.shape.circumradius() && member.shape.contains(pose.to_body(x))
        };
        self.solids.bodies.iter().zip(self.poses).position(inside)
    }
}
