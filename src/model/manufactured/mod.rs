//! Exact fields that are given as formulas, and the sources that make them a solution: of the incompressible sheet
//! [5.47–5.48], of the compressible one, or of a Stokes flow, which has no polarity.
//!
//! ```text
//! f_v = −div(σᵀ) + C_F v − T_a p,   div(σᵀ)_i = ∂_j σ_ji        −div(ρσᵀ) + C_F v − T_a p
//! f_p = Pe p□ + (|p|²−1) p − κ²Δp                               Pe ρ p□ + [ρ|p|² − (ρ−ρ_min)] p − κ² div(ρ∇p)
//!                                                         f_ρ = ∂_tρ + div(ρv)
//! ```
//! Every derivative in space comes from Taylor series about the point, so nothing is differentiated by hand or by
//! differences; `∂_t p` and `∂_t ρ` are differentiated as formulas.

mod series;

use nalgebra::Matrix2;

use super::numbers::Numbers;
use super::terms::{MASS, MOLECULAR, POLARITY, Strong, Term};
use crate::expression::{Expression, ExpressionError};
use crate::form::words::{self, Jet};
use crate::mesh::Point;
pub use series::{Matrix, Series};
use series::{value, values, vector};

/// An exact solution, each field a formula of `x`, `y`, `t`: `v`, `Π`, `p` of the incompressible sheet, `v`, `ρ`, `p`
/// of the compressible one, or `v`, `Π` of a Stokes flow. Whether `div v = 0` where there is a `Π`, and `ρ ≥ 0`, is
/// the caller's to check.
#[derive(Debug, Clone, PartialEq)]
pub struct Exact {
    velocity: [Expression; 2],
    volume: Volume,
    /// That of a tissue.
    polar: Option<Polar>,
}

/// A polarity.
#[derive(Debug, Clone, PartialEq)]
struct Polar {
    /// `p`
    value: [Expression; 2],
    /// `∂_t p`
    rate: [Expression; 2],
}

/// What resists a change of volume.
#[derive(Debug, Clone, PartialEq)]
pub enum Volume {
    /// `Π` of the incompressible sheet.
    Pressure(Expression),
    /// `ρ` of the compressible one, and `∂_t ρ`.
    Density {
        /// ρ
        value: Expression,
        /// `∂_t ρ`
        rate: Expression,
    },
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

    /// The fields `v`, `Π` of a Stokes flow as formulas of `x`, `y`, `t`.
    pub fn stokes(velocity: [Expression; 2], pressure: Expression) -> Self {
        Self { velocity, volume: Volume::Pressure(pressure), polar: None }
    }

    fn of(velocity: [Expression; 2], volume: Volume, polarity: [Expression; 2]) -> Result<Self, ExpressionError> {
        let rate = [polarity[0].diff("t")?, polarity[1].diff("t")?];
        Ok(Self { velocity, volume, polar: Some(Polar { value: polarity, rate }) })
    }

    /// The same fields for use at the time `t` alone: what depends on the time only is computed now, once. The methods
    /// of the result ignore their `t`.
    #[must_use]
    pub fn at_time(&self, t: f64) -> Self {
        let vector = |formulas: &[Expression; 2]| formulas.each_ref().map(|formula| formula.at_time(t));
        let polar = |polar: &Polar| Polar { value: vector(&polar.value), rate: vector(&polar.rate) };
        Self { velocity: vector(&self.velocity), volume: self.volume.at_time(t), polar: self.polar.as_ref().map(polar) }
    }

    /// The formulas of the fields.
    pub fn formulas(&self) -> impl Iterator<Item = &Expression> {
        self.vectors().flatten().chain([self.volume.formula()])
    }

    /// The formulas of the vectors: `v`, and `p` where there is one.
    pub fn vectors(&self) -> impl Iterator<Item = &[Expression; 2]> {
        std::iter::once(&self.velocity).chain(self.polar.as_ref().map(|polar| &polar.value))
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
    ///
    /// # Panics
    /// Of a Stokes flow, whose equations do not ask.
    pub fn polarity(&self) -> &[Expression; 2] {
        &self.polar().value
    }

    /// Whether there is a polarity: a Stokes flow has none.
    pub fn has_polarity(&self) -> bool {
        self.polar.is_some()
    }

    fn polar(&self) -> &Polar {
        self.polar.as_ref().expect("the exact fields of a tissue have a polarity")
    }

    /// `v` and `∇v`, `∂_jv_i` in `(i, j)`, at the point `x`.
    pub fn flow(&self, x: Point, t: f64) -> words::Vector {
        let [first, second] = vector(&self.velocity, x, t);
        let (a, b) = (first.gradient(), second.gradient());
        let value = Point::new(first.value(), second.value());
        words::Vector { value, grad: Matrix2::new(a.x, a.y, b.x, b.y) }
    }

    /// `v`, `Π` or `ρ`, `p` and `Δp` or `div(ρ∇p)` at the point `x`.
    ///
    /// # Panics
    /// Of a Stokes flow, as [`Exact::polarity`].
    pub fn at(&self, x: Point, t: f64) -> ExactValues {
        let polarity = vector(self.polarity(), x, t);
        let (volume, polarity_laplacian) = match &self.volume {
            Volume::Pressure(pressure) => (pressure.eval(x, t), value(&polarity.map(|p| p.laplacian()))),
            Volume::Density { value: density, .. } => {
                let density = density.taylor(x, t);
                (density.value(), value(&series::diffusion(density, &polarity)))
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
        let [first, second] = vector(&self.velocity, x, t);
        first.gradient().x + second.gradient().y
    }

    /// `|∂₁v₁| + |∂₂v₂|`: what rounding in [`Exact::divergence`] is measured against.
    pub fn stretching(&self, x: Point, t: f64) -> f64 {
        let [first, second] = vector(&self.velocity, x, t);
        first.gradient().x.abs() + second.gradient().y.abs()
    }

    /// The stress, `stress[i][j]` the value of `σ_ij` [5.48], or of `ρσ_ij`, at `x` and its derivatives: the sum of
    /// those of the terms.
    ///
    /// Here and below, exact fields with a density take `numbers` with a density law, and those without a polarity the
    /// ones of a Stokes flow.
    pub fn stress<'a>(&self, numbers: impl Into<Numbers<'a>>, x: Point, t: f64) -> Matrix {
        self.series(numbers.into(), x, t).stress()
    }

    /// `f_v`: what the terms of the momentum balance leave, `−div(σᵀ) + C_F v − T_a p` with `div(σᵀ)_i = ∂_j σ_ji`, in
    /// the compressible sheet with `ρσ`.
    pub fn force<'a>(&self, numbers: impl Into<Numbers<'a>>, x: Point, t: f64) -> Point {
        self.series(numbers.into(), x, t).force()
    }

    /// `f_p`: what the terms of the polarity's equation leave, `Pe p□ + (|p|²−1) p − κ²Δp` with
    /// `p□ = ∂_t p + (v·∇)p − W(v)p − a D(v)p`; in the compressible sheet
    /// `Pe ρ p□ + [ρ|p|² − (ρ−ρ_min)] p − κ² div(ρ∇p)`.
    pub fn polarity_source<'a>(&self, numbers: impl Into<Numbers<'a>>, x: Point, t: f64) -> Point {
        self.series(numbers.into(), x, t).polarity_source()
    }

    /// `f_ρ = ∂_tρ + div(ρv)`, 0 in the incompressible sheet.
    pub fn density_source<'a>(&self, numbers: impl Into<Numbers<'a>>, x: Point, t: f64) -> f64 {
        self.series(numbers.into(), x, t).density_source()
    }

    /// `f_v`, `f_ρ` and `f_p` together; dearer than one, cheaper than all.
    pub fn sources<'a>(&self, numbers: impl Into<Numbers<'a>>, x: Point, t: f64) -> Sources {
        let series = self.series(numbers.into(), x, t);
        Sources { force: series.force(), density: series.density_source(), polarity: series.polarity_source() }
    }

    /// `(n·σ)_j = n_i σ_ij`, in the compressible sheet of `ρσ`: the traction on a face with the outward unit normal
    /// `n`.
    pub fn traction<'a>(&self, numbers: impl Into<Numbers<'a>>, x: Point, t: f64, n: Point) -> Point {
        let sigma = self.stress(numbers, x, t);
        let along = |j: usize| n.x * sigma[0][j][0] + n.y * sigma[1][j][0];
        Point::new(along(0), along(1))
    }

    /// `∂p/∂n`, the derivative of the polarity along `n`.
    pub fn polarity_slope(&self, x: Point, t: f64, n: Point) -> Point {
        let [first, second] = vector(self.polarity(), x, t);
        Point::new(first.gradient().dot(&n), second.gradient().dot(&n))
    }

    /// The fields about the point `x`.
    pub fn series<'e>(&'e self, numbers: impl Into<Numbers<'e>>, x: Point, t: f64) -> Series<'e> {
        Series::new(self, numbers.into(), x, t)
    }
}

impl Series<'_> {
    /// The strong forms of the terms of a list that are on, with their factors.
    fn strong<V: Jet>(&self, list: &'static [Term<V>]) -> impl Iterator<Item = (f64, &'static Strong)> {
        let on = list.iter().filter(|term| term.is_on(self.numbers));
        on.map(|term| (term.factor(self.numbers), &term.strong))
    }

    fn stress(&self) -> Matrix {
        let mut sigma = [[[0.0; 3]; 2]; 2];
        for (factor, strong) in self.strong(self.numbers.momentum()) {
            if let Strong::Stress(stress) = strong {
                let part = stress(self);
                let both = sigma.as_flattened_mut().as_flattened_mut().iter_mut();
                both.zip(part.as_flattened().as_flattened()).for_each(|(sum, part)| *sum += factor * part);
            }
        }
        sigma
    }

    /// What is no stress.
    fn vectors<V: Jet>(&self, list: &'static [Term<V>]) -> Point {
        self.strong(list).fold(Point::zeros(), |sum, (factor, strong)| match strong {
            Strong::Vector(of) => sum + factor * of(self),
            Strong::Scalar(_) | Strong::Stress(_) | Strong::Frame => sum,
        })
    }

    fn force(&self) -> Point {
        let sigma = self.stress();
        let divergence = |i: usize| sigma[0][i][1] + sigma[1][i][2];
        self.vectors(self.numbers.momentum()) - Point::new(divergence(0), divergence(1))
    }

    fn polarity_source(&self) -> Point {
        self.vectors(POLARITY) + self.vectors(MOLECULAR)
    }

    fn density_source(&self) -> f64 {
        self.strong(MASS).fold(0.0, |sum, (factor, strong)| match strong {
            Strong::Scalar(of) => sum + factor * of(self),
            Strong::Vector(_) | Strong::Stress(_) | Strong::Frame => sum,
        })
    }
}
