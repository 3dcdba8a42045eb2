//! Measured velocities: bins, filter, correction, and what is recovered from tables that a run has made.

mod bins;
mod common;
mod formats;
mod recovered;
mod wrong;
