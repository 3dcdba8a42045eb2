//! Rigid bodies by penalty in a Stokes flow.

mod common;
mod extremes;
mod factors;
mod flow;
mod mesh;
mod motion;
