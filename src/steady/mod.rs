//! Steady states: found by pseudo-transient continuation into Newton's method, judged by the eigenvalues of their linearisation.

pub mod pseudo;
pub mod spectrum;
