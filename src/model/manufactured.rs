//! Exact fields that are given as formulas, and the sources that make them a solution of [5.47–5.48].
//!
//! ```text
//! f_v = −div(σᵀ) + C_F v − T_a p,   div(σᵀ)_i = ∂_j σ_ji
//! f_p = Pe p□ + (|p|²−1) p − κ²Δp
//! ```
//! Every derivative in space comes from Taylor series about the point, so nothing is differentiated by hand or by
//! differences; `∂_t p` is differentiated as a formula.

use super::expression::{Expression, ExpressionError, Taylor};
use super::parameters::Parameters;
use crate::mesh::Point;

/// An exact solution `v`, `Π`, `p`, each a formula of `x`, `y`, `t`. Whether `div v = 0` is the caller's to check.
#[derive(Debug, Clone, PartialEq)]
pub struct Exact {
    velocity: [Expression; 2],
    pressure: Expression,
    polarity: [Expression; 2],
    /// `∂_t p`
    rate: [Expression; 2],
}

/// Values of the exact fields at one point and time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactValues {
    /// `v`
    pub velocity: Point,
    /// `Π`
    pub pressure: f64,
    /// `p`
    pub polarity: Point,
    /// `Δp`
    pub polarity_laplacian: Point,
}

/// Both sources at one point and time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sources {
    /// `f_v`
    pub force: Point,
    /// `f_p`
    pub polarity: Point,
}

type Vector = [Taylor; 2];
type Matrix = [[Taylor; 2]; 2];

impl Exact {
    /// The fields `v`, `Π`, `p` as formulas of `x`, `y`, `t`.
    ///
    /// # Errors
    /// A polarity without a derivative in time.
    pub fn new(
        velocity: [Expression; 2],
        pressure: Expression,
        polarity: [Expression; 2],
    ) -> Result<Self, ExpressionError> {
        let rate = [polarity[0].diff("t")?, polarity[1].diff("t")?];
        Ok(Self { velocity, pressure, polarity, rate })
    }

    /// The same fields for use at the time `t` alone: what depends on the time only is computed now, once. The methods
    /// of the result ignore their `t`.
    #[must_use]
    pub fn at_time(&self, t: f64) -> Self {
        let vector = |formulas: &[Expression; 2]| formulas.each_ref().map(|formula| formula.at_time(t));
        Self {
            velocity: vector(&self.velocity),
            pressure: self.pressure.at_time(t),
            polarity: vector(&self.polarity),
            rate: vector(&self.rate),
        }
    }

    /// Whether `t` occurs in a field.
    pub fn depends_on_time(&self) -> bool {
        let all = self.velocity.iter().chain(&self.polarity).chain([&self.pressure]);
        all.into_iter().any(Expression::depends_on_time)
    }

    /// `v`, the two formulas.
    pub fn velocity(&self) -> &[Expression; 2] {
        &self.velocity
    }

    /// `Π`, the formula.
    pub fn pressure(&self) -> &Expression {
        &self.pressure
    }

    /// `p`, the two formulas.
    pub fn polarity(&self) -> &[Expression; 2] {
        &self.polarity
    }

    /// `v`, `Π`, `p` and `Δp` at the point `x`.
    pub fn at(&self, x: Point, t: f64) -> ExactValues {
        let polarity = series(&self.polarity, x, t);
        ExactValues {
            velocity: values(&self.velocity, x, t),
            pressure: self.pressure.eval(x, t),
            polarity: value(&polarity),
            polarity_laplacian: value(&polarity.map(|p| p.laplacian())),
        }
    }

    /// `div v`, zero if the fields are a solution.
    pub fn divergence(&self, x: Point, t: f64) -> f64 {
        let [first, second] = series(&self.velocity, x, t);
        first.gradient().x + second.gradient().y
    }

    /// `|∂₁v₁| + |∂₂v₂|`: what rounding in [`Exact::divergence`] is measured against.
    pub fn stretching(&self, x: Point, t: f64) -> f64 {
        let [first, second] = series(&self.velocity, x, t);
        first.gradient().x.abs() + second.gradient().y.abs()
    }

    /// The stress [5.48], `stress[i][j]` the series of `σ_ij` about `x` up to degree 1:
    /// `σ = −Π I + 2D(v) + (a+1)/2 p⊗ℓ + (a−1)/2 ℓ⊗p − κ²B ∇pᵀ·∇p − S_a p⊗p`.
    pub fn stress(&self, parameters: &Parameters, x: Point, t: f64) -> [[Taylor; 2]; 2] {
        let (velocity, polarity) = (series(&self.velocity, x, t), series(&self.polarity, x, t));
        stress(parameters, &velocity, self.pressure.taylor(x, t), &polarity)
    }

    /// `f_v = −div(σᵀ) + C_F v − T_a p` with `div(σᵀ)_i = ∂_j σ_ji`.
    pub fn force(&self, parameters: &Parameters, x: Point, t: f64) -> Point {
        let (velocity, polarity) = (series(&self.velocity, x, t), series(&self.polarity, x, t));
        force(parameters, &velocity, self.pressure.taylor(x, t), &polarity)
    }

    /// `f_p = Pe p□ + (|p|²−1) p − κ²Δp` with `p□ = ∂_t p + (v·∇)p − W(v)p − a D(v)p`.
    pub fn polarity_source(&self, parameters: &Parameters, x: Point, t: f64) -> Point {
        let (velocity, polarity) = (series(&self.velocity, x, t), series(&self.polarity, x, t));
        polarity_source(parameters, &velocity, &polarity, values(&self.rate, x, t))
    }

    /// `f_v` and `f_p` together; dearer than either, cheaper than both.
    pub fn sources(&self, parameters: &Parameters, x: Point, t: f64) -> Sources {
        let (velocity, polarity) = (series(&self.velocity, x, t), series(&self.polarity, x, t));
        Sources {
            force: force(parameters, &velocity, self.pressure.taylor(x, t), &polarity),
            polarity: polarity_source(parameters, &velocity, &polarity, values(&self.rate, x, t)),
        }
    }

    /// `(n·σ)_j = n_i σ_ij`, the traction on a face with the outward unit normal `n`.
    pub fn traction(&self, parameters: &Parameters, x: Point, t: f64, n: Point) -> Point {
        let [first, second] = self.stress(parameters, x, t);
        n.x * value(&first) + n.y * value(&second)
    }

    /// `∂p/∂n`, the derivative of the polarity along `n`.
    pub fn polarity_slope(&self, x: Point, t: f64, n: Point) -> Point {
        let [first, second] = series(&self.polarity, x, t);
        Point::new(first.gradient().dot(&n), second.gradient().dot(&n))
    }
}

fn series(formulas: &[Expression; 2], x: Point, t: f64) -> Vector {
    formulas.each_ref().map(|formula| formula.taylor(x, t))
}

fn values([first, second]: &[Expression; 2], x: Point, t: f64) -> Point {
    Point::new(first.eval(x, t), second.eval(x, t))
}

fn value([first, second]: &Vector) -> Point {
    Point::new(first.value(), second.value())
}

/// `σ` [5.48] up to degree 1. Every product is cut there at once: the compiler leaves out what is then not used.
fn stress(parameters: &Parameters, v: &Vector, pressure: Taylor, p: &Vector) -> Matrix {
    let shear = (v[0].dy() + v[1].dx()).linear();
    let mut sigma = [[(2.0 * v[0].dx() - pressure).linear(), shear], [shear, (2.0 * v[1].dy() - pressure).linear()]];
    if parameters.elasticity != 0.0 {
        let elastic = Elastic::new(parameters, p);
        add_entries(&mut sigma, |i, j| elastic.stress(i, j));
    }
    if parameters.active_stress != 0.0 {
        add_entries(&mut sigma, |i, j| (-parameters.active_stress * (p[i] * p[j])).linear());
    }
    sigma
}

#[inline(always)]
fn add_entries(sigma: &mut Matrix, entry: impl Fn(usize, usize) -> Taylor) {
    // written out, because a loop would keep whole products in memory
    sigma[0][0] = sigma[0][0] + entry(0, 0);
    sigma[0][1] = sigma[0][1] + entry(0, 1);
    sigma[1][0] = sigma[1][0] + entry(1, 0);
    sigma[1][1] = sigma[1][1] + entry(1, 1);
}

/// What the elastic stress consists of.
struct Elastic {
    /// `(a+1)/2`, `(a−1)/2`, `κ²B`
    factors: [f64; 3],
    p: Vector,
    /// `ℓ = B[(|p|²−1) p − κ²Δp]`
    l: Vector,
    /// `∂_1p`, `∂_2p`
    slopes: Matrix,
}

impl Elastic {
    #[inline(always)]
    fn new(parameters: &Parameters, p: &Vector) -> Self {
        let (b, a) = (parameters.elasticity, parameters.slip);
        let square = parameters.coherence * parameters.coherence;
        let excess = (p[0] * p[0] + p[1] * p[1] - 1.0).linear();
        let l = |p: &Taylor| (b * (excess * *p - square * p.laplacian())).linear();
        let slopes = [[p[0].dx().linear(), p[1].dx().linear()], [p[0].dy().linear(), p[1].dy().linear()]];
        Self { factors: [0.5 * (a + 1.0), 0.5 * (a - 1.0), square * b], p: *p, l: [l(&p[0]), l(&p[1])], slopes }
    }

    /// `(a+1)/2 p_i ℓ_j + (a−1)/2 ℓ_i p_j − κ²B ∂_ip·∂_jp`
    #[inline(always)]
    fn stress(&self, i: usize, j: usize) -> Taylor {
        let ([plus, minus, slope], p, l) = (self.factors, &self.p, &self.l);
        let slopes = self.slopes[i][0] * self.slopes[j][0] + self.slopes[i][1] * self.slopes[j][1];
        (plus * (p[i] * l[j]) + minus * (l[i] * p[j]) - slope * slopes).linear()
    }
}

fn force(parameters: &Parameters, v: &Vector, pressure: Taylor, p: &Vector) -> Point {
    let sigma = stress(parameters, v, pressure, p);
    let divergence = |i: usize| sigma[0][i].gradient().x + sigma[1][i].gradient().y;
    parameters.friction * value(v) - parameters.traction * value(p) - Point::new(divergence(0), divergence(1))
}

fn polarity_source(parameters: &Parameters, v: &Vector, p: &Vector, rate: Point) -> Point {
    // (∇v)_ij = ∂_j v_i
    let slope = v.map(|v| v.gradient());
    let spin = 0.5 * (slope[0].y - slope[1].x);
    let shear = 0.5 * (slope[0].y + slope[1].x);
    let (velocity, polarity) = (value(v), value(p));
    let advection = Point::new(p[0].gradient().dot(&velocity), p[1].gradient().dot(&velocity));
    let rotation = Point::new(spin * polarity.y, -spin * polarity.x);
    let stretching =
        Point::new(slope[0].x * polarity.x + shear * polarity.y, shear * polarity.x + slope[1].y * polarity.y);
    let objective = rate + advection - rotation - parameters.slip * stretching;
    let laplacian = value(&p.map(|p| p.laplacian()));
    let square = parameters.coherence * parameters.coherence;
    parameters.peclet * objective + (polarity.norm_squared() - 1.0) * polarity - square * laplacian
}
