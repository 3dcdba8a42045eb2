//! Velocities measured at points and times: bins, averages, filter, flux-keeping correction, distance from a computed
//! field
//! [11.1–11.3].
//!
//! Lengths are in disc radii about the disc's centre.

mod bins;
mod difference;
mod field;
mod flux;
mod samples;

pub use bins::Bins;
pub use difference::{Difference, overshoot};
pub use field::Binned;
pub use flux::Flux;
pub use samples::{Averages, Sample};
