//! One thread's part of the assembly of a bilinear form.

use super::bilinear::{Bilinear, Stencil};
use super::integrate::Integrator;
use super::kernel::{Basis, Block};
use super::words::Jet;
use crate::space::Space;

/// What one thread needs to compute blocks of a bilinear form.
pub(super) struct Worker<'s> {
    trial: &'s Space,
    test: &'s Space,
    /// Both sides' trial functions, then the test functions of the side at work.
    phi: [Basis; 2],
    chi: Basis,
    stencil: Stencil,
    own: Block,
    other: Block,
}

impl<'s> Worker<'s> {
    pub fn new<U: Jet, V: Jet>(trial: &'s Space, test: &'s Space) -> Self {
        let components = (V::SLOTS / 3, U::SLOTS / 3);
        Self {
            trial,
            test,
            phi: [Basis::new(trial), Basis::new(trial)],
            chi: Basis::new(test),
            stencil: Stencil::zero(),
            own: Block::new(test, trial, components),
            other: Block::new(test, trial, components),
        }
    }

    /// Whether trial and test functions are the same, so that one evaluation serves both.
    fn is_square(&self) -> bool {
        self.trial.degree == self.test.degree
    }

    /// Adds the cell terms of one cell to its dense block.
    pub fn add_cell<U: Jet, V: Jet>(
        &mut self,
        loops: &Integrator,
        form: &Bilinear<U, V>,
        cell: usize,
        out: &mut [f64],
    ) {
        let square = self.is_square();
        self.own.clear();
        for term in &form.cell_terms {
            loops.each_cell_point(cell, term.degree, &mut |x| {
                self.phi[0].evaluate(&x.site);
                (term.integrand)(x, &mut self.stencil);
                let weight = x.weight * term.scale;
                if square {
                    self.own.add(&self.stencil, (0, 0), &self.phi[0], &self.phi[0], weight);
                } else {
                    self.chi.evaluate(&x.site);
                    self.own.add(&self.stencil, (0, 0), &self.chi, &self.phi[0], weight);
                }
            });
        }
        self.own.add_to(out);
    }

    /// Rows of the test functions on `side` (0 minus, 1 plus) of a face: the block of trial functions on the same side is
    /// added to `own`, that of the other side to `other`.
    pub fn add_face_row<U: Jet, V: Jet>(
        &mut self,
        loops: &Integrator,
        form: &Bilinear<U, V>,
        index: usize,
        side: usize,
        own: &mut [f64],
        other: &mut [f64],
    ) {
        let square = self.is_square();
        self.own.clear();
        self.other.clear();
        for term in form.face_terms.iter().filter(|t| t.faces.holds(&loops.mesh.faces[index])) {
            loops.each_face_point(index, term.degree, &mut |s| {
                for (phi, site) in self.phi.iter_mut().zip(std::iter::once(&s.minus).chain(&s.plus)) {
                    phi.evaluate(site);
                }
                (term.integrand)(s, side * V::SLOTS..(side + 1) * V::SLOTS, &mut self.stencil);
                let weight = s.weight * term.scale;
                if !square {
                    self.chi.evaluate(if side == 0 { &s.minus } else { s.plus.as_ref().expect("an interior face") });
                }
                let chi = if square { &self.phi[side] } else { &self.chi };
                let row = side * V::SLOTS;
                self.own.add(&self.stencil, (row, side * U::SLOTS), chi, &self.phi[side], weight);
                if s.plus.is_some() {
                    self.other.add(&self.stencil, (row, (1 - side) * U::SLOTS), chi, &self.phi[1 - side], weight);
                }
            });
        }
        self.own.add_to(own);
        self.other.add_to(other);
    }
}
