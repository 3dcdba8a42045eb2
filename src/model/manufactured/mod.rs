//! Exact fields that are given as formulas, and the sources that make them a solution: of the incompressible sheet
//! [5.47–5.48], or of the compressible one.
//!
//! ```text
//! f_v = −div(σᵀ) + C_F v − T_a p,   div(σᵀ)_i = ∂_j σ_ji        −div(ρσᵀ) + C_F v − T_a p
//! f_p = Pe p□ + (|p|²−1) p − κ²Δp                               Pe ρ p□ + [ρ|p|² − (ρ−ρ_min)] p − κ² div(ρ∇p)
//!                                                         f_ρ = ∂_tρ + div(ρv)
//! ```
//! Every derivative in space comes from Taylor series about the point, so nothing is differentiated by hand or by
//! differences; `∂_t p` and `∂_t ρ` are differentiated as formulas.

mod compressible;
mod incompressible;

use super::expression::{Expression, ExpressionError, Taylor};
use super::parameters::{DensityLaw, Parameters};
use crate::mesh::Point;

/// An exact solution, each field a formula of `x`, `y`, `t`: `v`, `Π`, `p` of the incompressible sheet or `v`, `ρ`, `p` of the
/// compressible one. Whether `div v = 0` in the former and `ρ ≥ 0` in the latter is the caller's to check.
#[derive(Debug, Clone, PartialEq)]
pub struct Exact {
    velocity: [Expression; 2],
    volume: Volume,
    polarity: [Expression; 2],
    /// `∂_t p`
    rate: [Expression; 2],
}

/// What resists a change of volume.
#[derive(Debug, Clone, PartialEq)]
pub enum Volume {
    /// `Π` of the incompressible sheet.
    Pressure(Expression),
    /// `ρ` of the compressible one, and `∂_t ρ`.
    Density { value: Expression, rate: Expression },
}

impl Volume {
    /// `ρ`, the formula; `None` in the incompressible sheet.
    pub fn density(&self) -> Option<&Expression> {
        match self {
            Volume::Pressure(_) => None,
            Volume::Density { value, .. } => Some(value),
        }
    }

    /// `Π` or `ρ`, the formula.
    pub fn formula(&self) -> &Expression {
        match self {
            Volume::Pressure(formula) | Volume::Density { value: formula, .. } => formula,
        }
    }

    fn at_time(&self, t: f64) -> Self {
        match self {
            Volume::Pressure(formula) => Volume::Pressure(formula.at_time(t)),
            Volume::Density { value, rate } => Volume::Density { value: value.at_time(t), rate: rate.at_time(t) },
        }
    }
}

/// Values of the exact fields at one point and time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactValues {
    /// `v`
    pub velocity: Point,
    /// `Π` or `ρ`, see [`Volume`]
    pub volume: f64,
    /// `p`
    pub polarity: Point,
    /// `Δp`, in the compressible sheet `div(ρ∇p)`
    pub polarity_laplacian: Point,
}

/// The sources at one point and time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sources {
    /// `f_v`
    pub force: Point,
    /// `f_ρ`, 0 in the incompressible sheet
    pub density: f64,
    /// `f_p`
    pub polarity: Point,
}

type Vector = [Taylor; 2];
type Matrix = [[Taylor; 2]; 2];

/// The fields about one point: what the formulas below start from.
struct Series<'e> {
    v: Vector,
    p: Vector,
    volume: SeriesVolume<'e>,
    x: Point,
    t: f64,
}

/// The pressure enters the stress alone, and has no series before.
enum SeriesVolume<'e> {
    Pressure(&'e Expression),
    Density(Taylor, &'e DensityLaw),
}

impl Exact {
    /// The fields `v`, `Π`, `p` of the incompressible sheet as formulas of `x`, `y`, `t`.
    ///
    /// # Errors
    /// A polarity without a derivative in time.
    pub fn new(
        velocity: [Expression; 2],
        pressure: Expression,
        polarity: [Expression; 2],
    ) -> Result<Self, ExpressionError> {
        Self::of(velocity, Volume::Pressure(pressure), polarity)
    }

    /// The fields `v`, `ρ`, `p` of the compressible sheet as formulas of `x`, `y`, `t`.
    ///
    /// # Errors
    /// A density or a polarity without a derivative in time.
    pub fn compressible(
        velocity: [Expression; 2],
        density: Expression,
        polarity: [Expression; 2],
    ) -> Result<Self, ExpressionError> {
        let rate = density.diff("t")?;
        Self::of(velocity, Volume::Density { value: density, rate }, polarity)
    }

    fn of(velocity: [Expression; 2], volume: Volume, polarity: [Expression; 2]) -> Result<Self, ExpressionError> {
        let rate = [polarity[0].diff("t")?, polarity[1].diff("t")?];
        Ok(Self { velocity, volume, polarity, rate })
    }

    /// The same fields for use at the time `t` alone: what depends on the time only is computed now, once. The methods
    /// of the result ignore their `t`.
    #[must_use]
    pub fn at_time(&self, t: f64) -> Self {
        let vector = |formulas: &[Expression; 2]| formulas.each_ref().map(|formula| formula.at_time(t));
        Self {
            velocity: vector(&self.velocity),
            volume: self.volume.at_time(t),
            polarity: vector(&self.polarity),
            rate: vector(&self.rate),
        }
    }

    /// The formulas of the fields.
    pub fn formulas(&self) -> impl Iterator<Item = &Expression> {
        self.velocity.iter().chain(&self.polarity).chain([self.volume.formula()])
    }

    /// `v`, the two formulas.
    pub fn velocity(&self) -> &[Expression; 2] {
        &self.velocity
    }

    /// `Π` or `ρ`, the formula.
    pub fn volume(&self) -> &Volume {
        &self.volume
    }

    /// `p`, the two formulas.
    pub fn polarity(&self) -> &[Expression; 2] {
        &self.polarity
    }

    /// `v`, `Π` or `ρ`, `p` and `Δp` or `div(ρ∇p)` at the point `x`.
    pub fn at(&self, x: Point, t: f64) -> ExactValues {
        let polarity = series(&self.polarity, x, t);
        let (volume, polarity_laplacian) = match &self.volume {
            Volume::Pressure(pressure) => (pressure.eval(x, t), value(&polarity.map(|p| p.laplacian()))),
            Volume::Density { value: density, .. } => {
                let density = density.taylor(x, t);
                (density.value(), value(&compressible::diffusion(density, &polarity)))
            }
        };
        ExactValues { velocity: values(&self.velocity, x, t), volume, polarity: value(&polarity), polarity_laplacian }
    }

    /// `ρ`, 1 in the incompressible sheet.
    pub fn density(&self, x: Point, t: f64) -> f64 {
        self.volume.density().map_or(1.0, |density| density.eval(x, t))
    }

    /// `div v`, zero if the fields are a solution of the incompressible sheet.
    pub fn divergence(&self, x: Point, t: f64) -> f64 {
        let [first, second] = series(&self.velocity, x, t);
        first.gradient().x + second.gradient().y
    }

    /// `|∂₁v₁| + |∂₂v₂|`: what rounding in [`Exact::divergence`] is measured against.
    pub fn stretching(&self, x: Point, t: f64) -> f64 {
        let [first, second] = series(&self.velocity, x, t);
        first.gradient().x.abs() + second.gradient().y.abs()
    }

    /// The stress, `stress[i][j]` the series of `σ_ij` [5.48], or of `ρσ_ij`, about `x` up to degree 1:
    ///
    /// `σ = −Π I + 2D(v) + (a+1)/2 p⊗ℓ + (a−1)/2 ℓ⊗p − κ²B ∇pᵀ·∇p − S_a p⊗p`,
    /// `ρσ = −ρΠ I + 2ρ[D(v) + (div v) I] + (a+1)/2 p⊗ℓ + (a−1)/2 ℓ⊗p − κ²Bρ ∇pᵀ·∇p − ρ[S_a p⊗p + S_a'|p|² I]`.
    ///
    /// Here and below, exact fields with a density take `parameters` with a density law.
    pub fn stress(&self, parameters: &Parameters, x: Point, t: f64) -> [[Taylor; 2]; 2] {
        self.series(parameters, x, t).stress(parameters)
    }

    /// `f_v = −div(σᵀ) + C_F v − T_a p` with `div(σᵀ)_i = ∂_j σ_ji`, in the compressible sheet with `ρσ`.
    pub fn force(&self, parameters: &Parameters, x: Point, t: f64) -> Point {
        self.series(parameters, x, t).force(parameters)
    }

    /// `f_p = Pe p□ + (|p|²−1) p − κ²Δp` with `p□ = ∂_t p + (v·∇)p − W(v)p − a D(v)p`; in the compressible sheet
    /// `f_p = Pe ρ p□ + [ρ|p|² − (ρ−ρ_min)] p − κ² div(ρ∇p)`.
    pub fn polarity_source(&self, parameters: &Parameters, x: Point, t: f64) -> Point {
        self.series(parameters, x, t).polarity_source(parameters, values(&self.rate, x, t))
    }

    /// `f_ρ = ∂_tρ + div(ρv)`, 0 in the incompressible sheet.
    pub fn density_source(&self, x: Point, t: f64) -> f64 {
        match &self.volume {
            Volume::Pressure(_) => 0.0,
            Volume::Density { value: density, rate } => {
                compressible::density_source(&series(&self.velocity, x, t), &density.taylor(x, t), rate.eval(x, t))
            }
        }
    }

    /// `f_v`, `f_ρ` and `f_p` together; dearer than one, cheaper than all.
    pub fn sources(&self, parameters: &Parameters, x: Point, t: f64) -> Sources {
        let series = self.series(parameters, x, t);
        Sources {
            force: series.force(parameters),
            density: match (&self.volume, &series.volume) {
                (Volume::Density { rate, .. }, SeriesVolume::Density(density, _)) => {
                    compressible::density_source(&series.v, density, rate.eval(x, t))
                }
                (Volume::Pressure(_), _) | (_, SeriesVolume::Pressure(_)) => 0.0,
            },
            polarity: series.polarity_source(parameters, values(&self.rate, x, t)),
        }
    }

    /// `(n·σ)_j = n_i σ_ij`, in the compressible sheet of `ρσ`: the traction on a face with the outward unit normal `n`.
    pub fn traction(&self, parameters: &Parameters, x: Point, t: f64, n: Point) -> Point {
        let [first, second] = self.stress(parameters, x, t);
        n.x * value(&first) + n.y * value(&second)
    }

    /// `∂p/∂n`, the derivative of the polarity along `n`.
    pub fn polarity_slope(&self, x: Point, t: f64, n: Point) -> Point {
        let [first, second] = series(&self.polarity, x, t);
        Point::new(first.gradient().dot(&n), second.gradient().dot(&n))
    }

    #[inline(always)]
    fn series<'e>(&'e self, parameters: &'e Parameters, x: Point, t: f64) -> Series<'e> {
        let (v, p) = (series(&self.velocity, x, t), series(&self.polarity, x, t));
        let volume = match &self.volume {
            Volume::Pressure(pressure) => SeriesVolume::Pressure(pressure),
            Volume::Density { value, .. } => {
                let law = parameters.density.as_ref().expect("a sheet whose density is given has a density law");
                SeriesVolume::Density(value.taylor(x, t), law)
            }
        };
        Series { v, p, volume, x, t }
    }
}

impl Series<'_> {
    #[inline(always)]
    fn stress(&self, parameters: &Parameters) -> Matrix {
        match self.volume {
            SeriesVolume::Pressure(pressure) => {
                incompressible::stress(parameters, &self.v, pressure.taylor(self.x, self.t), &self.p)
            }
            SeriesVolume::Density(density, law) => compressible::stress(parameters, law, &self.v, density, &self.p),
        }
    }

    fn force(&self, parameters: &Parameters) -> Point {
        let sigma = self.stress(parameters);
        let divergence = |i: usize| sigma[0][i].gradient().x + sigma[1][i].gradient().y;
        parameters.friction * value(&self.v)
            - parameters.traction * value(&self.p)
            - Point::new(divergence(0), divergence(1))
    }

    fn polarity_source(&self, parameters: &Parameters, rate: Point) -> Point {
        let objective = objective(&self.v, &self.p, rate, parameters.alignment);
        let (p, square) = (value(&self.p), parameters.coherence * parameters.coherence);
        match self.volume {
            SeriesVolume::Pressure(_) => {
                let laplacian = value(&self.p.map(|p| p.laplacian()));
                parameters.peclet * objective + (p.norm_squared() - 1.0) * p - square * laplacian
            }
            SeriesVolume::Density(density, law) => {
                let (rho, diffusion) = (density.value(), value(&compressible::diffusion(density, &self.p)));
                let relaxation = rho * p.norm_squared() - (rho - law.critical);
                parameters.peclet * rho * objective + relaxation * p - square * diffusion
            }
        }
    }
}

/// `p□ = ∂_t p + (v·∇)p − W(v)p − a D(v)p`
fn objective(v: &Vector, p: &Vector, rate: Point, alignment: f64) -> Point {
    // (∇v)_ij = ∂_j v_i
    let slope = v.map(|v| v.gradient());
    let spin = 0.5 * (slope[0].y - slope[1].x);
    let shear = 0.5 * (slope[0].y + slope[1].x);
    let (velocity, polarity) = (value(v), value(p));
    let advection = Point::new(p[0].gradient().dot(&velocity), p[1].gradient().dot(&velocity));
    let rotation = Point::new(spin * polarity.y, -spin * polarity.x);
    let stretching =
        Point::new(slope[0].x * polarity.x + shear * polarity.y, shear * polarity.x + slope[1].y * polarity.y);
    rate + advection - rotation - alignment * stretching
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

#[inline(always)]
fn add_entries(sigma: &mut Matrix, entry: impl Fn(usize, usize) -> Taylor) {
    // written out, because a loop would keep whole products in memory
    sigma[0][0] = sigma[0][0] + entry(0, 0);
    sigma[0][1] = sigma[0][1] + entry(0, 1);
    sigma[1][0] = sigma[1][0] + entry(1, 0);
    sigma[1][1] = sigma[1][1] + entry(1, 1);
}

/// What the elastic stress of both sheets consists of.
struct Elastic {
    /// `(a+1)/2`, `(a−1)/2`
    factors: [f64; 2],
    p: Vector,
    /// The molecular field `ℓ`, up to degree 1.
    l: Vector,
    /// `∂_1p`, `∂_2p`, up to degree 1.
    slopes: Matrix,
}

impl Elastic {
    #[inline(always)]
    fn new(alignment: f64, p: &Vector, l: Vector) -> Self {
        let slopes = [[p[0].dx().linear(), p[1].dx().linear()], [p[0].dy().linear(), p[1].dy().linear()]];
        Self { factors: [0.5 * (alignment + 1.0), 0.5 * (alignment - 1.0)], p: *p, l, slopes }
    }

    /// `(a+1)/2 p_i ℓ_j + (a−1)/2 ℓ_i p_j`
    #[inline(always)]
    fn torque(&self, i: usize, j: usize) -> Taylor {
        let ([plus, minus], p, l) = (self.factors, &self.p, &self.l);
        plus * (p[i] * l[j]) + minus * (l[i] * p[j])
    }

    /// `∂_ip·∂_jp`
    #[inline(always)]
    fn squares(&self, i: usize, j: usize) -> Taylor {
        self.slopes[i][0] * self.slopes[j][0] + self.slopes[i][1] * self.slopes[j][1]
    }
}
