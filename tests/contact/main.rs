//! Contact of rigid bodies: gaps, projection, gluey bonds, and the stepper of particles.

mod gaps;
mod glue;
mod common;
mod particles;
mod projection;
