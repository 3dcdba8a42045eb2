//! The compressible sheet: its derivative, what it conserves and dissipates, positivity, restarts, and its
//! incompressible limit.

mod common;
mod constant;
mod energy;
mod images;
mod limit;
mod mass;
mod positivity;
mod restart;
mod tangent;
