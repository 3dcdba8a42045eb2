//! Rigid bodies as geometry: shapes by distance and outline, poses, twists.

pub mod distance;
pub mod outline;
mod pose;
mod primitives;

pub use distance::ShapeError;
pub use outline::Placed;
pub use pose::{Pose, Twist, Wrench, perpendicular, rigid_motion, turned};
pub use primitives::{Shape, edges};
