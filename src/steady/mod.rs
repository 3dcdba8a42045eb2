//! Steady states: found by pseudo-transient continuation into Newton's method, judged by the eigenvalues of their
//! linearisation.

pub mod arclength;
pub mod branch;
pub mod find;
mod fork;
pub mod oscillation;
pub mod pseudo;
pub mod spectrum;

pub use find::{Event, Found, Search, SearchSettings, Steady, SteadySettings, Try, Want, Way, find};
pub use oscillation::Oscillation;
pub use pseudo::{PseudoStep, Stall};
pub use spectrum::{Spectrum, Stability};
