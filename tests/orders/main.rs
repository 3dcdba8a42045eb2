//! Observed orders of convergence: a least-squares slope over three meshes, with the table printed.

mod common;
mod curved;
mod incompressible;
mod slip;
mod space;
mod time;

/// Least-squares slope of `log error` over `log h`.
pub fn slope(table: &[(f64, f64)]) -> f64 {
    let n = table.len() as f64;
    let points: Vec<(f64, f64)> = table.iter().map(|(h, e)| (h.ln(), e.ln())).collect();
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let covariance: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    covariance / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>()
}
