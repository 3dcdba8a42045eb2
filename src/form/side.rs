//! Integrals over the sides of inner faces: what a cell has in common with the values on its faces, and with nobody
//! else. From these are hybrid methods.
//!
//! A side sees the functions of its own cell and those of a [`Skeleton`]. The matrix of a form is then a dense block
//! for every cell, rows and columns first the cell's own functions, then those of its local faces 0, 1, 2.

use rayon::prelude::*;

use super::bilinear::Stencil;
use super::integrate::{FacePoint, Integrator, block_size};
use super::kernel::{Basis, Block};
use super::linear::Weights;
use super::words::{Jet, Scalar};
use super::worker::Worker;
use super::{Bilinear, Linear};
use crate::form::bilinear::MAX_SLOTS;
use crate::mesh::Point;
use crate::space::field::Site;
use crate::space::{Skeleton, Space};

/// A quadrature point of an inner face, seen from one of its sides.
#[derive(Clone, Copy)]
pub struct SidePoint<'s, 't> {
    /// The point.
    pub s: &'s FacePoint<'t>,
    /// Whether this is the side that the normal of the face points to.
    pub is_plus: bool,
}

impl<'s, 't> SidePoint<'s, 't> {
    /// The point in the cell on this side.
    ///
    /// # Panics
    /// On a face of the boundary, which has no plus side.
    pub fn own(&self) -> &'s Site<'t> {
        if self.is_plus { self.s.plus.as_ref().expect("an inner face") } else { &self.s.minus }
    }

    /// The normal out of the cell on this side.
    pub fn n(&self) -> Point {
        if self.is_plus { -self.s.n } else { self.s.n }
    }
}

/// A function as a side sees it: that of the cell, and that of the face, which has no slope.
#[derive(Debug, Clone, Copy)]
pub struct Side<J> {
    /// Of the cell.
    pub inner: J,
    /// Of the face.
    pub trace: J,
}

impl<J: Jet> Side<J> {
    /// One in one slot; those of the face follow those of the cell.
    fn unit(slot: usize) -> Self {
        match slot < J::SLOTS {
            true => Side { inner: J::unit(slot), trace: J::zero() },
            false => Side { inner: J::zero(), trace: J::unit(slot - J::SLOTS) },
        }
    }

    /// The slots that a function can have: those of the cell, and the values on the face.
    fn slots() -> impl Iterator<Item = usize> {
        (0..J::SLOTS).chain((J::SLOTS..2 * J::SLOTS).step_by(3))
    }
}

type BilinearIntegrand<'a> = Box<dyn Fn(&SidePoint, &mut Stencil) + Sync + 'a>;
type LinearIntegrand<'a> = Box<dyn Fn(&SidePoint, &mut Weights) + Sync + 'a>;

pub(super) struct BilinearSide<'a> {
    pub scale: f64,
    pub degree: usize,
    integrand: BilinearIntegrand<'a>,
}

pub(super) struct LinearSide<'a> {
    pub scale: f64,
    pub degree: usize,
    integrand: LinearIntegrand<'a>,
}

impl<'a, U: Jet, V: Jet> Bilinear<'a, U, V> {
    /// Adds the integral of `integrand(φ, χ)` over both sides of every inner face.
    pub fn sides<F, G>(mut self, degree: usize, at: F) -> Self
    where
        F: Fn(&SidePoint) -> G + Sync + 'a,
        G: Fn(Side<U>, Side<V>) -> f64,
    {
        let integrand = move |s: &SidePoint, stencil: &mut Stencil| {
            let integrand = at(s);
            for t in Side::<V>::slots() {
                for u in Side::<U>::slots() {
                    stencil.c[t][u] = integrand(Side::unit(u), Side::unit(t));
                }
            }
        };
        self.side_terms.push(BilinearSide { scale: 1.0, degree, integrand: Box::new(integrand) });
        self
    }
}

impl<'a, V: Jet> Linear<'a, V> {
    /// Adds the integral of `integrand(χ)` over both sides of every inner face.
    pub fn sides<F, G>(mut self, degree: usize, at: F) -> Self
    where
        F: Fn(&SidePoint) -> G + Sync + 'a,
        G: Fn(Side<V>) -> f64,
    {
        let integrand = move |s: &SidePoint, weights: &mut Weights| {
            let integrand = at(s);
            for t in Side::<V>::slots() {
                weights[t] = integrand(Side::unit(t));
            }
        };
        self.side_terms.push(LinearSide { scale: 1.0, degree, integrand: Box::new(integrand) });
        self
    }
}

impl LinearSide<'_> {
    pub fn at(&self, s: &SidePoint, weights: &mut Weights) {
        (self.integrand)(s, weights);
    }
}

/// Numbers of rows and columns of the block of a cell: of its own functions, and of those of one of its faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HybridSize {
    /// Rows and columns of the cell's own functions.
    pub own: (usize, usize),
    /// Rows and columns of one face.
    pub face: (usize, usize),
}

impl HybridSize {
    /// Rows.
    pub fn rows(&self) -> usize {
        self.own.0 + 3 * self.face.0
    }

    /// Columns.
    pub fn columns(&self) -> usize {
        self.own.1 + 3 * self.face.1
    }
}

impl Integrator {
    /// How large the blocks of [`Integrator::add_hybrid`] are; `traces` says whether trial functions live on faces, too.
    pub fn hybrid_size<U: Jet, V: Jet>(trial: &Space, test: &Space, skeleton: &Skeleton, traces: bool) -> HybridSize {
        let face = |slots: usize| skeleton.modes() * slots / 3;
        HybridSize {
            own: (block_size::<V>(test), block_size::<U>(trial)),
            face: (face(V::SLOTS), if traces { face(U::SLOTS) } else { 0 }),
        }
    }

    /// Adds a form to the dense blocks of all cells. Test functions live in the cells and on their faces, trial
    /// functions on faces where `traces` says so.
    ///
    /// # Panics
    /// A form that couples cells by more than the values on their faces.
    pub fn add_hybrid<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        (trial, test): (&Space, &Space),
        (skeleton, traces): (&Skeleton, bool),
        blocks: &mut [f64],
    ) {
        assert!(!form.couples_cells(), "cells that see each other are in no hybrid form");
        let size = Self::hybrid_size::<U, V>(trial, test, skeleton, traces);
        let (rows, columns) = size.own;
        let room = || (Worker::new::<U, V>(trial, test), SideWorker::new::<U, V>(trial, test, skeleton), Vec::new());
        blocks.par_chunks_mut(size.rows() * size.columns()).enumerate().for_each_init(
            room,
            |(worker, sides, own), (cell, block)| {
                own.clear();
                own.resize(rows * columns, 0.0);
                self.add_own_terms(worker, form, cell, own);
                for (block, own) in block.chunks_exact_mut(size.columns()).zip(own.chunks_exact(columns)) {
                    block.iter_mut().zip(own).for_each(|(b, o)| *b += o);
                }
                for local in 0..3 {
                    sides.add(self, form, (cell, local), size, block);
                }
            },
        );
    }

    /// What a linear form gives to the functions on faces.
    pub fn trace_vector<V: Jet>(&self, form: &Linear<V>, skeleton: &Skeleton) -> Vec<f64> {
        let modes = skeleton.modes();
        let mut out = vec![0.0; skeleton.faces.len() * modes * V::SLOTS / 3];
        out.par_chunks_mut(modes * V::SLOTS / 3).zip(&skeleton.faces).for_each(|(out, &face)| {
            let mut weights = [0.0; MAX_SLOTS];
            for term in &form.side_terms {
                self.each_face_point(face as usize, term.degree, &mut |s| {
                    let basis = skeleton.values(s.along);
                    for is_plus in [false, true] {
                        term.at(&SidePoint { s, is_plus }, &mut weights);
                        for (c, out) in out.chunks_exact_mut(modes).enumerate() {
                            let weight = s.weight * term.scale * weights[V::SLOTS + 3 * c];
                            out.iter_mut().zip(&basis).for_each(|(o, b)| *o += weight * b);
                        }
                    }
                });
            }
        });
        out
    }
}

impl Integrator {
    /// What the traces of a face give to its own rows, of one component, row-major, face after face of the inner ones.
    pub fn trace_blocks(&self, form: &Bilinear<Scalar, Scalar>, skeleton: &Skeleton) -> Vec<f64> {
        let modes = skeleton.modes();
        let mut out = vec![0.0; skeleton.faces.len() * modes * modes];
        out.par_chunks_mut(modes * modes).zip(&skeleton.faces).for_each(|(out, &face)| {
            let mut stencil = Stencil::zero();
            for term in &form.side_terms {
                self.each_face_point(face as usize, term.degree, &mut |s| {
                    let basis = &skeleton.values(s.along)[..modes];
                    for is_plus in [false, true] {
                        (term.integrand)(&SidePoint { s, is_plus }, &mut stencil);
                        let weight = s.weight * term.scale * stencil.c[Scalar::SLOTS][Scalar::SLOTS];
                        for (row, a) in out.chunks_exact_mut(modes).zip(basis) {
                            crate::solve::axpy(weight * a, basis, row);
                        }
                    }
                });
            }
        });
        out
    }
}

/// What one thread needs to compute the parts of a block that come from the sides of faces.
struct SideWorker {
    phi: Basis,
    chi: Basis,
    trace: Basis,
    stencil: Stencil,
    /// By rows, then by columns: of the cell, of the face.
    parts: [[Block; 2]; 2],
    is_square: bool,
    slots: (usize, usize),
}

impl SideWorker {
    fn new<U: Jet, V: Jet>(trial: &Space, test: &Space, skeleton: &Skeleton) -> Self {
        let (rows, columns) = ([test.n, skeleton.modes()], [trial.n, skeleton.modes()]);
        let components = (V::SLOTS / 3, U::SLOTS / 3);
        Self {
            phi: Basis::new(trial),
            chi: Basis::new(test),
            trace: Basis::of_trace(skeleton),
            stencil: Stencil::zero(),
            parts: rows.map(|row| columns.map(|column| Block::of(row, column, components))),
            is_square: trial.degree == test.degree,
            slots: (V::SLOTS, U::SLOTS),
        }
    }

    fn add<U: Jet, V: Jet>(
        &mut self,
        loops: &Integrator,
        form: &Bilinear<U, V>,
        (cell, local): (usize, usize),
        size: HybridSize,
        out: &mut [f64],
    ) {
        let index = loops.mesh.cell_faces[cell][local];
        let face = &loops.mesh.faces[index];
        if face.plus.is_none() || form.side_terms.is_empty() {
            return;
        }
        let is_plus = face.minus.cell != cell || face.minus.face != local;
        self.parts.iter_mut().flatten().for_each(Block::clear);
        for term in &form.side_terms {
            loops.each_face_point(index, term.degree, &mut |s| {
                let side = SidePoint { s, is_plus };
                (term.integrand)(&side, &mut self.stencil);
                self.phi.evaluate(side.own());
                if !self.is_square {
                    self.chi.evaluate(side.own());
                }
                self.trace.evaluate_on_face(s.along);
                self.add_point(s.weight * term.scale, size.face.1 > 0);
            });
        }
        let corners = [(0, 0), (size.own.0 + local * size.face.0, size.own.1 + local * size.face.1)];
        for (row, parts) in corners.iter().zip(&self.parts) {
            for (column, part) in corners.iter().zip(parts) {
                if size.face.1 > 0 || column.1 == 0 {
                    part.add_into(out, (row.0, column.1), size.columns());
                }
            }
        }
    }

    fn add_point(&mut self, weight: f64, traces: bool) {
        let Self { phi, chi, trace, stencil, parts: [[own, by_trace], [of_trace, both]], is_square, slots } = self;
        let chi = if *is_square { &*phi } else { &*chi };
        own.add(stencil, (0, 0), chi, phi, weight);
        of_trace.add(stencil, (slots.0, 0), trace, phi, weight);
        if traces {
            by_trace.add(stencil, (0, slots.1), chi, trace, weight);
            both.add(stencil, (slots.0, slots.1), trace, trace, weight);
        }
    }
}
