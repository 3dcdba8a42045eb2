//! Contact of rigid bodies: gaps, projection, gluey bonds, and the stepper of particles.

mod common;
mod factors;
mod gaps;
mod glue;
#[path = "../listed/mod.rs"]
mod listed;
mod obstacles;
mod particles;
mod piles;
mod projection;
mod rough;
