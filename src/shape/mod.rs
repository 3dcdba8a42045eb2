//! Rigid bodies as geometry: shapes by distance and outline, poses, twists.

pub(crate) mod distance;
mod kinds;
pub mod outline;
mod pose;

pub use distance::ShapeError;
pub use kinds::{Shape, edges};
pub use outline::Placed;
pub use pose::{Pose, Twist, Wrench, perpendicular, rigid_motion, turned};
