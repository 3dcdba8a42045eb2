//! Bilinear forms as sums of integrands over cells and faces.

use std::marker::PhantomData;
use std::ops::{Add, Mul, Neg, Range, Sub};

use super::integrate::{CellPoint, FacePoint, Faces};
use super::linear::Linear;
use super::side::BilinearSide;
use super::words::{Jet, Trace};
use crate::space::Field;

/// Most slots that one side of an integrand has: two traces of a vector jet.
pub const MAX_SLOTS: usize = 12;

/// Coefficients of an integrand at one point: `integrand = Σ c[test][trial] · test · trial`.
#[derive(Debug, Clone)]
pub struct Stencil {
    /// By test and trial slot; those of the plus side follow those of the minus side.
    pub c: [[f64; MAX_SLOTS]; MAX_SLOTS],
}

impl Stencil {
    /// All zero.
    pub fn zero() -> Self {
        Self { c: [[0.0; MAX_SLOTS]; MAX_SLOTS] }
    }

    /// Multiplies some rows, up to a column, by a number.
    pub(super) fn scale(&mut self, rows: Range<usize>, columns: usize, scale: f64) {
        self.c[rows].iter_mut().flat_map(|row| &mut row[..columns]).for_each(|c| *c *= scale);
    }

    /// Adds some rows of another stencil, up to a column, times a number.
    pub(super) fn add(&mut self, rows: Range<usize>, columns: usize, scale: f64, other: &Self) {
        for (row, other) in self.c[rows.clone()].iter_mut().zip(&other.c[rows]) {
            row[..columns].iter_mut().zip(&other[..columns]).for_each(|(c, other)| *c += scale * other);
        }
    }
}

type CellIntegrand<'a> = Box<dyn Fn(&CellPoint, &mut Stencil) + Sync + 'a>;
/// Fills the rows of the given test slots.
type FaceIntegrand<'a> = Box<dyn Fn(&FacePoint, Range<usize>, &mut Stencil) + Sync + 'a>;

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

/// A bilinear form with trial jets `U` and test jets `V`. Degrees are those of the integrand on affine cells: the
/// quadrature is exact for them.
pub struct Bilinear<'a, U: Jet, V: Jet> {
    pub(super) cell_terms: Vec<CellTerm<'a>>,
    pub(super) face_terms: Vec<FaceTerm<'a>>,
    pub(super) side_terms: Vec<BilinearSide<'a>>,
    kinds: PhantomData<fn(U, V)>,
}

impl<'a, U: Jet, V: Jet> Bilinear<'a, U, V> {
    /// The form without terms.
    pub fn zero() -> Self {
        Self { cell_terms: Vec::new(), face_terms: Vec::new(), side_terms: Vec::new(), kinds: PhantomData }
    }

    /// Whether there are integrals over faces.
    pub fn has_faces(&self) -> bool {
        !self.face_terms.is_empty() || !self.side_terms.is_empty()
    }

    /// Whether there are integrals over faces that two cells share.
    pub fn couples_cells(&self) -> bool {
        self.face_terms.iter().any(|term| term.faces.has_interior())
    }

    /// `∫_Ω integrand(φ, χ)`, of polynomial degree `degree`. `at` computes what depends on the point alone and returns
    /// the integrand, which must be linear in both arguments.
    pub fn cells<F, G>(degree: usize, at: F) -> Self
    where
        F: Fn(&CellPoint) -> G + Sync + 'a,
        G: Fn(U, V) -> f64,
    {
        let integrand = move |x: &CellPoint, stencil: &mut Stencil| {
            let integrand = at(x);
            for (t, row) in stencil.c.iter_mut().enumerate().take(V::SLOTS) {
                for (u, entry) in row.iter_mut().enumerate().take(U::SLOTS) {
                    *entry = integrand(U::unit(u), V::unit(t));
                }
            }
        };
        let term = CellTerm { scale: 1.0, degree, integrand: Box::new(integrand) };
        Self { cell_terms: vec![term], ..Self::zero() }
    }

    /// Adds `∫_faces integrand(φ, χ)` over a set of faces.
    pub fn faces<F, G>(mut self, faces: Faces, degree: usize, at: F) -> Self
    where
        F: Fn(&FacePoint) -> G + Sync + 'a,
        G: Fn(Trace<U>, Trace<V>) -> f64,
    {
        let integrand = move |s: &FacePoint, tests: Range<usize>, stencil: &mut Stencil| {
            let integrand = at(s);
            let boundary = s.plus.is_none();
            let sides = if boundary { 1 } else { 2 };
            for t in tests {
                let row = &mut stencil.c[t];
                for (u, entry) in row.iter_mut().enumerate().take(sides * U::SLOTS) {
                    *entry = integrand(unit_trace(u, boundary), unit_trace(t, boundary));
                }
            }
        };
        self.face_terms.push(FaceTerm { scale: 1.0, degree, faces, integrand: Box::new(integrand) });
        self
    }
}

impl<'a, U: Jet, V: Jet> Bilinear<'a, U, V> {
    /// The form of χ at a given φ, `∫_Ω integrand(φ, χ)`.
    ///
    /// # Panics
    /// Where there are integrals over faces.
    pub fn at(self, phi: &'a Field) -> Linear<'a, V> {
        assert!(!self.has_faces(), "a form of cells alone");
        self.cell_terms.into_iter().fold(Linear::zero(), |sum, CellTerm { scale, degree, integrand }| {
            let term = Linear::weighted(degree, move |x, weights| {
                let (mut stencil, jet) = (Stencil::zero(), U::slots(phi, &x.site));
                integrand(x, &mut stencil);
                for (weight, row) in weights.iter_mut().zip(&stencil.c[..V::SLOTS]) {
                    *weight = row[..U::SLOTS].iter().zip(&jet).map(|(c, slot)| c * slot).sum();
                }
            });
            sum + scale * term
        })
    }
}

/// The trace that is one in one slot; slots of the plus side follow those of the minus side.
pub(super) fn unit_trace<J: Jet>(slot: usize, boundary: bool) -> Trace<J> {
    if slot < J::SLOTS {
        Trace { minus: J::unit(slot), plus: J::zero(), boundary }
    } else {
        Trace { minus: J::zero(), plus: J::unit(slot - J::SLOTS), boundary }
    }
}

impl<U: Jet, V: Jet> Add for Bilinear<'_, U, V> {
    type Output = Self;

    fn add(mut self, other: Self) -> Self {
        self.cell_terms.extend(other.cell_terms);
        self.face_terms.extend(other.face_terms);
        self.side_terms.extend(other.side_terms);
        self
    }
}

impl<'a, U: Jet, V: Jet> Mul<Bilinear<'a, U, V>> for f64 {
    type Output = Bilinear<'a, U, V>;

    fn mul(self, mut form: Bilinear<'a, U, V>) -> Bilinear<'a, U, V> {
        form.cell_terms.iter_mut().for_each(|t| t.scale *= self);
        form.face_terms.iter_mut().for_each(|t| t.scale *= self);
        form.side_terms.iter_mut().for_each(|t| t.scale *= self);
        form
    }
}

impl<U: Jet, V: Jet> Neg for Bilinear<'_, U, V> {
    type Output = Self;

    fn neg(self) -> Self {
        -1.0 * self
    }
}

impl<U: Jet, V: Jet> Sub for Bilinear<'_, U, V> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}
