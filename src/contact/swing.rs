//! Bodies with inertia that swing in forces of their place: a step of the classical method of Runge and Kutta for
//!
//! ```text
//! X' = V      m V' = F(t, X) − γ_d m V
//! ```
//! so that many periods of a stiff spring keep their phase. A step that took the force at its beginning would be late
//! by half of itself.

use super::particles::{Drive, Motion, Particle};
use crate::mesh::Point;
use crate::shape::{Pose, Twist, perpendicular, turned};

/// A step with more drag than this, `γ_d Δt`, is no swing.
const MOST_DRAG: f64 = 1.0;

/// Displacements along x and y, and turn; or their rates.
type Triple = [f64; 3];

/// A step of one body without contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Swing {
    /// Twist that leads to the pose at the end of the step.
    pub mean: Twist,
    /// At the end of the step.
    pub last: Twist,
}

/// A body that may swing.
pub(super) struct Swinging<'a> {
    pub body: &'a Particle,
    /// Its number.
    pub index: usize,
    /// γ_d
    pub drag: f64,
    pub drive: &'a dyn Drive,
}

impl Swinging<'_> {
    /// The step from `t`; `None` for bodies whose motion is given, with too much drag, and where a force is not finite.
    pub fn step(&self, t: f64, dt: f64) -> Option<Swing> {
        if self.drag * dt > MOST_DRAG {
            return None;
        }
        let start = match self.body.motion {
            Motion::Free => [self.body.twist.velocity.x, self.body.twist.velocity.y, self.body.twist.spin],
            Motion::Pinned(_) => [0.0, 0.0, self.body.twist.spin],
            Motion::Fixed | Motion::Held | Motion::Path => return None,
        };
        let rate = |share: f64, way: Triple, speed: Triple| self.rate((t, dt), share, way, speed);
        let a = rate(0.0, [0.0; 3], start);
        let second = plus(start, 0.5 * dt, a);
        let b = rate(0.5, plus([0.0; 3], 0.5 * dt, start), second);
        let third = plus(start, 0.5 * dt, b);
        let c = rate(0.5, plus([0.0; 3], 0.5 * dt, second), third);
        let fourth = plus(start, dt, c);
        let d = rate(1.0, plus([0.0; 3], dt, third), fourth);
        let sixth = dt / 6.0;
        let mean = plus(plus(plus(start, sixth, a), sixth, b), sixth, c);
        let last = plus(plus(mean, sixth, b), sixth, plus(c, 1.0, d));
        let finite = mean.iter().chain(&last).all(|v| v.is_finite());
        finite.then(|| Swing { mean: self.twist(0.0, mean), last: self.twist(dt * mean[2], last) })
    }

    /// `F/m − γ_d V` and the same for the spin, after a way.
    fn rate(&self, step: (f64, f64), share: f64, way: Triple, speed: Triple) -> Triple {
        let Particle { mass, inertia, motion, pose, .. } = self.body;
        let angle = pose.angle + way[2];
        let arm = |angle: f64| self.arm(angle);
        // a pinned body moves about its pivot
        let position = pose.position + Point::new(way[0], way[1]) + arm(angle) - arm(pose.angle);
        let twist = self.twist(way[2], speed);
        let [x, y, torque] = self.drive.load_within(self.index, step, share, &Pose { position, angle }, &twist);
        let force = match motion {
            Motion::Pinned(pivot) => {
                let about = inertia + mass * pivot.norm_squared();
                [0.0, 0.0, (torque + perpendicular(arm(angle)).dot(&Point::new(x, y))) / about]
            }
            Motion::Free | Motion::Fixed | Motion::Held | Motion::Path => [x / mass, y / mass, torque / inertia],
        };
        plus(force, -self.drag, speed)
    }

    /// From the pivot of a pinned body to its centre.
    fn arm(&self, angle: f64) -> Point {
        match self.body.motion {
            Motion::Pinned(pivot) => -turned(pivot, angle),
            Motion::Free | Motion::Fixed | Motion::Held | Motion::Path => Point::zeros(),
        }
    }

    /// The twist of the whole body after a turn.
    fn twist(&self, turn: f64, [x, y, spin]: Triple) -> Twist {
        let about = spin * perpendicular(self.arm(self.body.pose.angle + turn));
        Twist { velocity: Point::new(x, y) + about, spin }
    }
}

/// `a + s b`
fn plus(a: Triple, s: f64, b: Triple) -> Triple {
    std::array::from_fn(|i| a[i] + s * b[i])
}
