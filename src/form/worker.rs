//! One thread's part of the assembly of a bilinear form. Integrands that share their quadrature are summed at its
//! points, so that a form of many terms costs little more than one of a single term.

use super::bilinear::{Bilinear, CellTerm, FaceTerm, Stencil};
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
    /// Of one integrand among several.
    single: Stencil,
    own: Block,
    other: Block,
}

/// One side of a face of the mesh: 0 minus, 1 plus.
#[derive(Clone, Copy)]
pub(super) struct FaceSide {
    pub face: usize,
    pub side: usize,
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
            single: Stencil::zero(),
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
        for (k, term) in form.cell_terms.iter().enumerate() {
            let alike = |other: &&CellTerm| other.degree == term.degree;
            if form.cell_terms[..k].iter().any(|earlier| alike(&earlier)) {
                continue;
            }
            let others = || form.cell_terms[k + 1..].iter().filter(alike);
            let alone = others().next().is_none();
            loops.each_cell_point(cell, term.degree, &mut |x| {
                self.phi[0].evaluate(&x.site);
                (term.integrand)(x, &mut self.stencil);
                let mut weight = x.weight;
                if alone {
                    weight *= term.scale;
                } else {
                    self.stencil.scale(0..V::SLOTS, U::SLOTS, term.scale);
                    for other in others() {
                        (other.integrand)(x, &mut self.single);
                        self.stencil.add(0..V::SLOTS, U::SLOTS, other.scale, &self.single);
                    }
                }
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

    /// Rows of the test functions on one side of a face: the block of trial functions on the same side
    /// is added to `own`, that of the other side to `other`.
    pub fn add_face_row<U: Jet, V: Jet>(
        &mut self,
        loops: &Integrator,
        form: &Bilinear<U, V>,
        FaceSide { face: index, side }: FaceSide,
        own: &mut [f64],
        other: &mut [f64],
    ) {
        let square = self.is_square();
        self.own.clear();
        self.other.clear();
        let face = &loops.mesh.faces[index];
        let (rows, columns) = (side * V::SLOTS..(side + 1) * V::SLOTS, face.plus.map_or(1, |_| 2) * U::SLOTS);
        for (k, term) in form.face_terms.iter().enumerate().filter(|(_, t)| t.faces.holds(face)) {
            let alike = |other: &&FaceTerm| other.degree == term.degree && other.faces.holds(face);
            if form.face_terms[..k].iter().any(|earlier| alike(&earlier)) {
                continue;
            }
            let others = || form.face_terms[k + 1..].iter().filter(alike);
            let alone = others().next().is_none();
            loops.each_face_point(index, term.degree, &mut |s| {
                for (phi, site) in self.phi.iter_mut().zip(std::iter::once(&s.minus).chain(&s.plus)) {
                    phi.evaluate(site);
                }
                (term.integrand)(s, rows.clone(), &mut self.stencil);
                let mut weight = s.weight;
                if alone {
                    weight *= term.scale;
                } else {
                    self.stencil.scale(rows.clone(), columns, term.scale);
                    for other in others() {
                        (other.integrand)(s, rows.clone(), &mut self.single);
                        self.stencil.add(rows.clone(), columns, other.scale, &self.single);
                    }
                }
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
