//! Numbers of time stepping: BDF weights, the A-BDF of the density, step control, and schedules that steps land on.

pub mod abdf;
pub mod adaptive;
pub mod bdf;
pub mod control;
pub mod schedule;

pub use control::{Control, ControlSettings};
pub use schedule::Schedule;
