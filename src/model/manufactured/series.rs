//! Exact fields about one point: what the strong forms of the terms start from.

use std::cell::OnceCell;

use super::Exact;
use super::Volume;
use crate::expression::{Expression, Taylor};
use crate::mesh::Point;
use crate::model::numbers::Numbers;
use crate::model::parameters::{DensityLaw, Parameters};

/// Two components.
pub type Vector = [Taylor; 2];
/// `σ_ij` in `[i][j]`: its value, and its derivatives along both coordinates.
pub type Matrix = [[[f64; 3]; 2]; 2];

/// Taylor series of the fields about one point at one time.
pub struct Series<'e> {
    /// The numbers of the model.
    pub numbers: Numbers<'e>,
    /// The velocity.
    pub v: Vector,
    polarity: Option<Vector>,
    volume: SeriesVolume<'e>,
    exact: &'e Exact,
    /// `ℓ`, once a term asks.
    molecular: OnceCell<Vector>,
    x: Point,
    t: f64,
}

/// The pressure enters the stress alone, and has no series before.
enum SeriesVolume<'e> {
    Pressure(&'e Expression),
    Density(Taylor),
}

impl<'e> Series<'e> {
    #[inline(always)]
    pub(super) fn new(exact: &'e Exact, numbers: Numbers<'e>, x: Point, t: f64) -> Self {
        let volume = match &exact.volume {
            Volume::Pressure(pressure) => SeriesVolume::Pressure(pressure),
            Volume::Density { value, .. } => SeriesVolume::Density(value.taylor(x, t)),
        };
        let polarity = exact.polar.as_ref().map(|polar| vector(&polar.value, x, t));
        let v = vector(&exact.velocity, x, t);
        Self { numbers, v, polarity, volume, exact, molecular: OnceCell::new(), x, t }
    }

    /// The numbers of a sheet.
    ///
    /// # Panics
    /// In a Stokes flow, whose terms do not ask.
    #[inline(always)]
    pub fn parameters(&self) -> &'e Parameters {
        self.numbers.sheet().expect("the terms of a sheet have its parameters")
    }

    /// The polarity.
    ///
    /// # Panics
    /// In a Stokes flow, whose terms do not ask.
    #[inline(always)]
    pub fn p(&self) -> &Vector {
        self.polarity.as_ref().expect("the terms of a sheet have a polarity")
    }

    /// `c_0`, `γ`, `ρ_min` and `S_a'` of a sheet with a density.
    ///
    /// # Panics
    /// In the incompressible sheet, whose terms do not ask.
    pub fn law(&self) -> DensityLaw {
        self.parameters().density.expect("a sheet whose density is given has a density law")
    }

    /// `ρ_min`, 0 in the incompressible sheet.
    pub fn critical(&self) -> f64 {
        self.parameters().density.map_or(0.0, |law| law.critical)
    }

    /// ρ, 1 in the incompressible sheet.
    pub fn rho(&self) -> Taylor {
        match self.volume {
            SeriesVolume::Pressure(_) => Taylor::constant(1.0),
            SeriesVolume::Density(rho) => rho,
        }
    }

    /// ρ times a series.
    #[inline(always)]
    pub fn weighed(&self, series: Taylor) -> Taylor {
        match self.volume {
            SeriesVolume::Pressure(_) => series,
            SeriesVolume::Density(rho) => rho * series,
        }
    }

    /// Π
    ///
    /// # Panics
    /// In a sheet with a density.
    pub fn pressure(&self) -> Taylor {
        match self.volume {
            SeriesVolume::Pressure(pressure) => pressure.taylor(self.x, self.t),
            SeriesVolume::Density(_) => panic!("the pressure of a compressible sheet follows from its density"),
        }
    }

    /// The value of v.
    pub fn velocity(&self) -> Point {
        value(&self.v)
    }

    /// The value of p.
    pub fn polarity(&self) -> Point {
        value(self.p())
    }

    /// `∂_t p`
    pub fn polarity_rate(&self) -> Point {
        values(&self.exact.polar().rate, self.x, self.t)
    }

    /// `∂_t ρ`, 0 in the incompressible sheet.
    pub fn density_rate(&self) -> f64 {
        match &self.exact.volume {
            Volume::Pressure(_) => 0.0,
            Volume::Density { rate, .. } => rate.eval(self.x, self.t),
        }
    }

    /// `|p|²`
    #[inline(always)]
    pub fn square(&self) -> Taylor {
        let [first, second] = self.p();
        *first * *first + *second * *second
    }

    /// `∂_ip·∂_jp`, up to degree 1.
    #[inline(always)]
    pub fn slopes(&self, i: usize, j: usize) -> Taylor {
        let slope = |c: usize, k: usize| derivative(&self.p()[c], k).linear();
        (slope(0, i) * slope(0, j) + slope(1, i) * slope(1, j)).linear()
    }

    /// `div(ρ∇p)`, up to degree 1.
    #[inline(always)]
    pub fn diffusion(&self) -> Vector {
        match self.volume {
            SeriesVolume::Pressure(_) => self.p().map(|p| p.laplacian().linear()),
            SeriesVolume::Density(rho) => diffusion(rho, self.p()),
        }
    }

    /// `ℓ = B{[ρ|p|² − (ρ−ρ_min)] p − κ² div(ρ∇p)}`, up to degree 1.
    pub fn molecular(&self) -> &Vector {
        self.molecular.get_or_init(|| {
            let (b, kappa2) = (self.parameters().elasticity, self.parameters().coherence.powi(2));
            let excess = self.weighed(self.square() - 1.0) + self.critical();
            let (relaxation, spread) = (excess.linear(), self.diffusion());
            [0, 1].map(|c| (b * (relaxation * self.p()[c] - kappa2 * spread[c])).linear())
        })
    }

    /// `s I`, up to degree 1.
    #[inline(always)]
    pub fn isotropic(&self, s: Taylor) -> Matrix {
        let s = first(s);
        [[s, [0.0; 3]], [[0.0; 3], s]]
    }

    /// A stress by its entries, up to degree 1.
    #[inline(always)]
    pub fn stress_of(&self, entry: impl Fn(usize, usize) -> Taylor) -> Matrix {
        // written out, because a loop would keep whole products in memory
        [[first(entry(0, 0)), first(entry(0, 1))], [first(entry(1, 0)), first(entry(1, 1))]]
    }

    /// `2 D_ij(v)`
    #[inline(always)]
    pub fn stretching(&self, i: usize, j: usize) -> Taylor {
        derivative(&self.v[i], j) + derivative(&self.v[j], i)
    }

    /// `div v`
    #[inline(always)]
    pub fn divergence(&self) -> Taylor {
        self.v[0].dx() + self.v[1].dy()
    }
}

/// `div(ρ∇p)`, up to degree 1.
#[inline(always)]
pub(super) fn diffusion(density: Taylor, p: &Vector) -> Vector {
    p.map(|p| ((density * p.dx()).dx() + (density * p.dy()).dy()).linear())
}

/// The series up to degree 1.
#[inline(always)]
fn first(series: Taylor) -> [f64; 3] {
    let slope = series.gradient();
    [series.value(), slope.x, slope.y]
}

#[inline(always)]
fn derivative(series: &Taylor, along: usize) -> Taylor {
    match along {
        0 => series.dx(),
        _ => series.dy(),
    }
}

pub(super) fn vector(formulas: &[Expression; 2], x: Point, t: f64) -> Vector {
    formulas.each_ref().map(|formula| formula.taylor(x, t))
}

pub(super) fn values([first, second]: &[Expression; 2], x: Point, t: f64) -> Point {
    Point::new(first.eval(x, t), second.eval(x, t))
}

pub(super) fn value([first, second]: &Vector) -> Point {
    Point::new(first.value(), second.value())
}
