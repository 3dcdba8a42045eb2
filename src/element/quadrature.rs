//! Quadrature on the reference triangle (Xiao and Gimbutas 2010) and on the unit interval (Gauss–Legendre).

use std::sync::OnceLock;

use nalgebra::Vector2;
use quadraturerules::{Domain, QuadratureRule, single_integral_quadrature};

/// Highest degree that a triangle rule integrates exactly.
pub const MAX_TRIANGLE_DEGREE: usize = 30;
/// Highest degree that an interval rule integrates exactly.
pub const MAX_INTERVAL_DEGREE: usize = 39;

/// A quadrature rule: `∫ f ≈ Σ_q w_q f(x_q)`, exact for polynomials up to `degree`.
#[derive(Debug, Clone)]
pub struct Rule<P> {
    /// Polynomials up to this degree are integrated exactly.
    pub degree: usize,
    /// In the reference element.
    pub points: Vec<P>,
    /// One for each point; they sum up to the size of the reference element.
    pub weights: Vec<f64>,
}

/// The rule on the reference triangle (area ½) that is exact for polynomials of total degree `degree`.
///
/// # Panics
/// Above [`MAX_TRIANGLE_DEGREE`]: no form of this crate with elements of degree at most 5 asks for more.
pub fn triangle(degree: usize) -> &'static Rule<Vector2<f64>> {
    static RULES: [OnceLock<Rule<Vector2<f64>>>; MAX_TRIANGLE_DEGREE + 1] =
        [const { OnceLock::new() }; MAX_TRIANGLE_DEGREE + 1];
    let degree = degree.max(1);
    RULES[degree].get_or_init(|| {
        let (points, weights) = single_integral_quadrature(QuadratureRule::XiaoGimbutas, Domain::Triangle, degree)
            .expect("Xiao–Gimbutas rules exist for every degree up to 30");
        let total: f64 = weights.iter().sum();
        let width = points.len() / weights.len();
        let points = points.chunks(width).map(|p| Vector2::new(p[width - 2], p[width - 1])).collect();
        let weights = weights.iter().map(|w| 0.5 * w / total).collect();
        Rule { degree, points, weights }
    })
}

/// The rule on `[0, 1]` that is exact for polynomials of degree `degree`.
///
/// # Panics
/// Above [`MAX_INTERVAL_DEGREE`].
pub fn interval(degree: usize) -> &'static Rule<f64> {
    static RULES: [OnceLock<Rule<f64>>; MAX_INTERVAL_DEGREE / 2 + 1] =
        [const { OnceLock::new() }; MAX_INTERVAL_DEGREE / 2 + 1];
    let count = degree / 2 + 1;
    RULES[count - 1].get_or_init(|| {
        let (points, weights) = single_integral_quadrature(QuadratureRule::GaussLegendre, Domain::Interval, count)
            .expect("Gauss–Legendre rules exist for up to 20 points");
        let points = points.chunks(2).map(|p| p[1]).collect();
        Rule { degree: 2 * count - 1, points, weights }
    })
}
