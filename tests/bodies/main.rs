//! Rigid bodies in a Stokes flow, by the usual method and by penalty.

mod common;
mod extremes;
mod factors;
mod flow;
mod mesh;
mod motion;
