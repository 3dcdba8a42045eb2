//! Observed orders of convergence: a least-squares slope over three meshes, with the table printed.

mod common;
mod compressible;
mod curved;
mod forces;
mod incompressible;
mod polar_stress;
mod rotation;
mod self_advection;
mod slip;
mod space;
mod stokes;
mod time;
mod walls;

/// Least-squares slope of `log error` over `log h`, as `monolayer order` fits it.
pub fn slope(table: &[(f64, f64)]) -> f64 {
    let points: Vec<(f64, f64)> = table.iter().map(|(h, e)| (h.ln(), e.ln())).collect();
    monolayer::study::order::slope(&points).expect("at least two levels")
}
