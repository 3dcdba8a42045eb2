//! Contact of rigid bodies: gaps, projection, gluey bonds, and the stepper of particles.

mod common;
mod gaps;
mod glue;
mod obstacles;
mod particles;
mod piles;
mod projection;
