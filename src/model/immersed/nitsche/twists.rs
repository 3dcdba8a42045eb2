//! The unknowns of bodies: three of a free body, one of a pinned one, none where the motion is given.

use crate::body::guide::Rule;
use crate::body::{Body, Hold};
use crate::mesh::Point;
use crate::shape::{Pose, Twist};

/// What of a body's motion is unknown, and the number of the first unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Unknown {
    /// `V₁`, `V₂`, ω.
    Free(usize),
    /// ω, and `V = −ω y^⊥` with the arm y from the centre to the pin.
    Pinned(usize, Point),
    /// Nothing.
    Given,
}

/// The unknowns of all bodies at their places.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Twists {
    unknowns: Vec<Unknown>,
    count: usize,
}

impl Twists {
    pub fn new(bodies: &[Body], poses: &[Pose]) -> Self {
        let mut count = 0;
        let mut next = |more: usize| {
            count += more;
            count - more
        };
        let unknown = |(body, pose): (&Body, &Pose)| match &body.hold {
            Hold::Free => Unknown::Free(next(3)),
            Hold::Pinned(point) => Unknown::Pinned(next(1), pose.to_space(*point) - pose.position),
            Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => Unknown::Given,
        };
        let unknowns = bodies.iter().zip(poses).map(unknown).collect();
        Self { unknowns, count }
    }

    /// Of all bodies.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Component `k` of a body's motion by the unknowns, with coefficients.
    pub fn of(&self, body: usize, k: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
        let entry = match (self.unknowns[body], k) {
            (Unknown::Free(first), _) => Some((first + k, 1.0)),
            (Unknown::Pinned(first, arm), 0) => Some((first, arm.y)),
            (Unknown::Pinned(first, arm), 1) => Some((first, -arm.x)),
            (Unknown::Pinned(first, _), _) => Some((first, 1.0)),
            (Unknown::Given, _) => None,
        };
        entry.into_iter()
    }

    /// Whether a body needs no force to move as it does.
    pub fn is_free(&self, body: usize) -> bool {
        matches!(self.unknowns[body], Unknown::Free(_))
    }

    /// Whether something of a body's motion is unknown.
    pub fn has_unknowns(&self, body: usize) -> bool {
        !matches!(self.unknowns[body], Unknown::Given)
    }

    /// Rules under which what is given stays.
    pub fn rules_of_change(&self, poses: &[Pose]) -> Vec<Rule> {
        let rule = |(unknown, pose): (&Unknown, &Pose)| match *unknown {
            Unknown::Free(_) => Rule::Free,
            Unknown::Pinned(_, arm) => Rule::Pinned(pose.position + arm),
            Unknown::Given => Rule::Held(Twist::ZERO),
        };
        self.unknowns.iter().zip(poses).map(rule).collect()
    }

    /// The motions that are given, zero of bodies with unknowns.
    ///
    /// # Panics
    /// For rules of another kind than the bodies'.
    pub fn given(&self, rules: &[Rule]) -> Vec<[f64; 3]> {
        let given = |(unknown, rule): (&Unknown, &Rule)| match (unknown, rule) {
            (Unknown::Given, Rule::Held(Twist { velocity, spin })) => [velocity.x, velocity.y, *spin],
            (Unknown::Free(_), Rule::Free) | (Unknown::Pinned(..), Rule::Pinned(_)) => [0.0; 3],
            (unknown, rule) => panic!("{rule:?} of a body with {unknown:?}"),
        };
        self.unknowns.iter().zip(rules).map(given).collect()
    }
}
