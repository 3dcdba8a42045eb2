//! The unknowns of bodies: as many as hold and walls leave of the three of a free body.

use super::walls::Wall;
use crate::body::guide::Rule;
use crate::body::{Body, Hold};
use crate::mesh::Point;
use crate::model::immersed::penalty::BodyError;
use crate::shape::{Pose, Twist};

/// What decides about a motion, besides walls.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Free,
    /// `V = −ω y^⊥` with the arm y from the centre to the pin.
    Pinned(Point),
    Given,
}

/// The motion of a body: what is given of it, and unknown multiples of `basis`.
#[derive(Debug, Clone)]
struct Motion {
    kind: Kind,
    /// Number of the first unknown.
    first: usize,
    basis: Vec<[f64; 3]>,
    wall: Option<Wall>,
}

/// The unknowns of all bodies at their places.
#[derive(Debug, Clone)]
pub(super) struct Twists {
    motions: Vec<Motion>,
    count: usize,
}

impl Twists {
    /// `walls` are those that the bodies stand in.
    pub fn new(bodies: &[Body], poses: &[Pose], walls: Vec<Option<Wall>>) -> Self {
        let mut count = 0;
        let motion = |((body, pose), wall): ((&Body, &Pose), Option<Wall>)| {
            let kind = match &body.hold {
                Hold::Free => Kind::Free,
                Hold::Pinned(point) => Kind::Pinned(pose.to_space(*point) - pose.position),
                Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => Kind::Given,
            };
            let basis = match (kind, &wall) {
                (Kind::Given, _) => Vec::new(),
                (_, Some(wall)) => wall.free_motions(),
                (Kind::Free, None) => vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                (Kind::Pinned(arm), None) => vec![[arm.y, -arm.x, 1.0]],
            };
            let first = count;
            count += basis.len();
            Motion { kind, first, basis, wall }
        };
        let motions = bodies.iter().zip(poses).zip(walls).map(motion).collect();
        Self { motions, count }
    }

    /// Of all bodies.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Component `k` of a body's motion by the unknowns, with coefficients.
    pub fn of(&self, body: usize, k: usize) -> impl Iterator<Item = (usize, f64)> {
        let Motion { first, basis, .. } = &self.motions[body];
        basis.iter().zip(*first..).map(move |(motion, unknown)| (unknown, motion[k])).filter(|(_, a)| *a != 0.0)
    }

    /// Whether anything besides walls holds a body.
    pub fn is_held(&self, body: usize) -> bool {
        match &self.motions[body] {
            Motion { kind: Kind::Free, .. } => false,
            Motion { kind: Kind::Pinned(_), wall, .. } => wall.is_none(),
            Motion { kind: Kind::Given, .. } => true,
        }
    }

    /// Whether something of a body's motion is unknown.
    pub fn has_unknowns(&self, body: usize) -> bool {
        !self.motions[body].basis.is_empty()
    }

    /// Rules under which what is given stays.
    pub fn rules_of_change(&self, poses: &[Pose]) -> Vec<Rule> {
        let rule = |(motion, pose): (&Motion, &Pose)| match motion.kind {
            Kind::Free => Rule::Free,
            Kind::Pinned(arm) => Rule::Pinned(pose.position + arm),
            Kind::Given => Rule::Held(Twist::ZERO),
        };
        self.motions.iter().zip(poses).map(rule).collect()
    }

    /// What is given of the motions, by rules and by the velocities of walls.
    ///
    /// # Errors
    /// Velocities of walls that a body in them cannot have.
    ///
    /// # Panics
    /// For rules of another kind than the bodies'.
    pub fn given(&self, rules: &[Rule], prescribed: &[f64]) -> Result<Vec<[f64; 3]>, BodyError> {
        let given = |(motion, rule): (&Motion, &Rule)| match (motion.kind, rule) {
            (Kind::Given, Rule::Held(Twist { velocity, spin })) => {
                let given = [velocity.x, velocity.y, *spin];
                motion.wall.iter().try_for_each(|wall| wall.check(given, prescribed))?;
                Ok(given)
            }
            (Kind::Free, Rule::Free) | (Kind::Pinned(_), Rule::Pinned(_)) => {
                motion.wall.as_ref().map_or(Ok([0.0; 3]), |wall| wall.motion(prescribed))
            }
            (kind, rule) => panic!("{rule:?} of a body that is {kind:?}"),
        };
        self.motions.iter().zip(rules).map(given).collect()
    }
}
