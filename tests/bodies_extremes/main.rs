//! Scenes of rigid bodies at their extremes: what must be refused, what must end clearly, and what must be right all
//! the same.

mod common;
mod endings;
mod flow;
mod particles;
mod refused;
mod tissue;
mod units;
