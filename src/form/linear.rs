//! Linear forms: right-hand sides and residuals.

use std::marker::PhantomData;
use std::ops::{Add, Mul, Neg, Sub};

use super::bilinear::{MAX_SLOTS, unit_trace};
use super::integrate::{CellPoint, FacePoint, Faces};
use super::side::LinearSide;
use super::words::{Jet, Trace, Vector};
use crate::mesh::{Face, Point};

/// Coefficients of a linear integrand at one point.
pub type Weights = [f64; MAX_SLOTS];

type CellIntegrand<'a> = Box<dyn Fn(&CellPoint, &mut Weights) + Sync + 'a>;
type FaceIntegrand<'a> = Box<dyn Fn(&FacePoint, &mut Weights) + Sync + 'a>;

pub(super) struct CellTerm<'a> {
    pub scale: f64,
    pub degree: usize,
    pub integrand: CellIntegrand<'a>,
}

pub(super) struct FaceTerm<'a> {
    pub scale: f64,
    pub degree: usize,
    pub faces: Faces,
    pub integrand: FaceIntegrand<'a>,
}

/// A linear form with test jets `V`.
pub struct Linear<'a, V: Jet> {
    pub(super) cell_terms: Vec<CellTerm<'a>>,
    pub(super) face_terms: Vec<FaceTerm<'a>>,
    pub(super) side_terms: Vec<LinearSide<'a>>,
    kinds: PhantomData<fn(V)>,
}

impl<'a, V: Jet> Linear<'a, V> {
    /// The form without terms.
    pub fn zero() -> Self {
        Self { cell_terms: Vec::new(), face_terms: Vec::new(), side_terms: Vec::new(), kinds: PhantomData }
    }

    /// Whether there is no term at all.
    pub fn is_zero(&self) -> bool {
        self.cell_terms.is_empty() && self.face_terms.is_empty() && self.side_terms.is_empty()
    }

    /// `∫_Ω integrand(χ)`, of polynomial degree `degree`.
    pub fn cells<F, G>(degree: usize, at: F) -> Self
    where
        F: Fn(&CellPoint) -> G + Sync + 'a,
        G: Fn(V) -> f64,
    {
        let integrand = move |x: &CellPoint, weights: &mut Weights| {
            let integrand = at(x);
            for (t, entry) in weights.iter_mut().enumerate().take(V::SLOTS) {
                *entry = integrand(V::unit(t));
            }
        };
        let term = CellTerm { scale: 1.0, degree, integrand: Box::new(integrand) };
        Self { cell_terms: vec![term], ..Self::zero() }
    }

    /// `∫_Ω integrand(χ)` by the coefficients of the integrand.
    pub(super) fn weighted(degree: usize, integrand: impl Fn(&CellPoint, &mut Weights) + Sync + 'a) -> Self {
        let term = CellTerm { scale: 1.0, degree, integrand: Box::new(integrand) };
        Self { cell_terms: vec![term], ..Self::zero() }
    }

    /// The largest degree of an integral over cells.
    pub fn cell_degree(&self) -> usize {
        self.cell_terms.iter().map(|term| term.degree).max().unwrap_or(0)
    }

    /// Adds `∫_faces integrand(χ)` over a set of faces.
    pub fn faces<F, G>(mut self, faces: Faces, degree: usize, at: F) -> Self
    where
        F: Fn(&FacePoint) -> G + Sync + 'a,
        G: Fn(Trace<V>) -> f64,
    {
        let integrand = move |s: &FacePoint, weights: &mut Weights| {
            let integrand = at(s);
            let boundary = s.plus.is_none();
            let sides = if boundary { 1 } else { 2 };
            for (t, entry) in weights.iter_mut().enumerate().take(sides * V::SLOTS) {
                *entry = integrand(unit_trace(t, boundary));
            }
        };
        self.face_terms.push(FaceTerm { scale: 1.0, degree, faces, integrand: Box::new(integrand) });
        self
    }
}

impl Linear<'_, Vector> {
    /// The traction on the boundary of a form `∫ σ:∇w + f·w + ∫_Γ g·w`, `σn + g`: what it has there, and what it leaves
    /// there when it is integrated by parts.
    pub fn traction(&self, s: &FacePoint, face: &Face) -> Point {
        let (x, mut sum, mut weights) =
            (CellPoint { site: s.minus, weight: s.weight }, Point::zeros(), [0.0; MAX_SLOTS]);
        for term in &self.cell_terms {
            (term.integrand)(&x, &mut weights);
            sum += term.scale * Point::new(along(&weights, 0, s.n), along(&weights, 3, s.n));
        }
        for term in self.face_terms.iter().filter(|term| term.faces.holds(face)) {
            (term.integrand)(s, &mut weights);
            sum += term.scale * Point::new(weights[0], weights[3]);
        }
        sum
    }
}

/// What the derivatives of a component are weighed with, along n; `slot` is that of its value.
fn along(weights: &Weights, slot: usize, n: Point) -> f64 {
    weights[slot + 1] * n.x + weights[slot + 2] * n.y
}

impl<V: Jet> Add for Linear<'_, V> {
    type Output = Self;

    fn add(mut self, other: Self) -> Self {
        self.cell_terms.extend(other.cell_terms);
        self.face_terms.extend(other.face_terms);
        self.side_terms.extend(other.side_terms);
        self
    }
}

impl<'a, V: Jet> Mul<Linear<'a, V>> for f64 {
    type Output = Linear<'a, V>;

    fn mul(self, mut form: Linear<'a, V>) -> Linear<'a, V> {
        form.cell_terms.iter_mut().for_each(|t| t.scale *= self);
        form.face_terms.iter_mut().for_each(|t| t.scale *= self);
        form.side_terms.iter_mut().for_each(|t| t.scale *= self);
        form
    }
}

impl<V: Jet> Neg for Linear<'_, V> {
    type Output = Self;

    fn neg(self) -> Self {
        -1.0 * self
    }
}

impl<V: Jet> Sub for Linear<'_, V> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}
