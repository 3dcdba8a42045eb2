//! Where a rigid body is, how it moves, and what acts on it.

use std::ops::Add;

use crate::mesh::Point;

/// Where a body is.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Pose {
    /// Centre of mass `x_B`.
    pub position: Point,
    /// Angle θ, counterclockwise.
    pub angle: f64,
}

impl Pose {
    /// From the body's frame to space.
    pub fn to_space(&self, local: Point) -> Point {
        self.position + turned(local, self.angle)
    }

    /// From space to the body's frame.
    pub fn to_body(&self, x: Point) -> Point {
        turned(x - self.position, -self.angle)
    }
}

/// How a body moves: `V + ω (x−x_B)^⊥`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Twist {
    /// `V`
    pub velocity: Point,
    /// `ω`
    pub spin: f64,
}

impl Twist {
    /// At rest.
    pub const ZERO: Twist = Twist { velocity: Point::new(0.0, 0.0), spin: 0.0 };

    /// Velocity of the point `x` of a body whose centre is `centre`.
    pub fn at(&self, x: Point, centre: Point) -> Point {
        self.velocity + self.spin * perpendicular(x - centre)
    }
}

/// `y^⊥ = (−y₂, y₁)`
pub fn perpendicular(y: Point) -> Point {
    Point::new(-y.y, y.x)
}

/// `y` turned counterclockwise by an angle.
pub fn turned(y: Point, angle: f64) -> Point {
    let (s, c) = angle.sin_cos();
    Point::new(c * y.x - s * y.y, s * y.x + c * y.y)
}

/// Force and torque about the centre.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Wrench {
    /// Total force.
    pub force: Point,
    /// About the centre, counterclockwise.
    pub torque: f64,
}

impl Wrench {
    /// Nothing acts.
    pub const ZERO: Wrench = Wrench { force: Point::new(0.0, 0.0), torque: 0.0 };

    /// What it gives to a body that moves with a twist, `F·V + τω`.
    pub fn power(&self, twist: &Twist) -> f64 {
        self.force.dot(&twist.velocity) + self.torque * twist.spin
    }
}

impl Add for Wrench {
    type Output = Wrench;

    fn add(self, other: Wrench) -> Wrench {
        Wrench { force: self.force + other.force, torque: self.torque + other.torque }
    }
}

/// The rigid motion `k` (two translations and the rotation about `centre`) at `x`.
pub fn rigid_motion(k: usize, centre: Point, x: Point) -> Point {
    match k {
        0 => Point::x(),
        1 => Point::y(),
        2 => perpendicular(x - centre),
        other => unreachable!("the plane has three rigid motions, not {other}"),
    }
}
