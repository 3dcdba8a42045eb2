//! The compressible sheet: its derivative, what it conserves and dissipates, positivity, restarts, and its incompressible limit.

mod common;
mod energy;
mod mass;
mod tangent;
