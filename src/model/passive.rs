//! The polarity around rigid bodies: unknowns that the tissue determines in part, or not at all.
//!
//! The tissue fills `Ω∖B`. Every form of the polarity is integrated over `Ω∖B` and over the parts of faces in it, which
//! makes `∂p/∂n = 0` on ∂B natural. The space stays that of the whole mesh, so that bodies may move without changing
//! it:
//!
//! ```text
//! K ∩ B = ∅         as without bodies
//! K cut by ∂B       forms over K∖B  +  κ²γ Σ_S g_S(p,q) over the faces S of cut cells that have tissue on both sides
//! K ⊂ B             δ a_swip(p,q) + γ Σ_S g_S(p,q) = 0 over the faces S to cut cells, S seen from K alone
//! ```
//! with the ghost penalty `g_S` of [`crate::form::ghost`]. Rows of the tissue never see a cell inside of a body: there
//! p is a continuation of the tissue's polarity, smooth where it leaves ∂B, harmonic further in, and it only matters as
//! the history of what a body uncovers.
//!
//! The mass in `Pe ∂_t p` and in the definition of `L_h` is that of `K∖B`, and α times that of `K ∩ B` in cut cells:
//!
//! ```text
//! (p|q)_α = ∫_{Ω∖B} p·q + α Σ_{K cut} ∫_{K∩B} p·q
//! ```
//! It is block diagonal and regular for every cut. As both take the same mass, the semi-discrete energy law holds as
//! without bodies, with `F_h + ½κ²Bγ Σ_S g_S(p,p)` for the free energy.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::polarity::invert_block;
use crate::cut::{Class, Cover};
use crate::form::{Density, Faces, Integrator, ghost, mass, swip};
use crate::mesh::Face;
use crate::solve::SolveError;
use crate::solve::blocks::ScalarBlocks;
use crate::space::{Field, Space};

/// What a cell belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellPlace {
    /// Outside of all bodies.
    Tissue,
    /// On the edge of one.
    Cut,
    /// Inside of one.
    Body,
}

/// Weights of the continuation of the polarity into bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Continuation {
    /// γ of the ghost penalty.
    pub ghost: f64,
    /// α of the mass in cut cells.
    pub mass: f64,
    /// δ of the diffusion inside of bodies.
    pub inner: f64,
}

impl Default for Continuation {
    fn default() -> Self {
        Self { ghost: 0.1, mass: 1e-3, inner: 1e-2 }
    }
}

/// Where the tissue is.
#[derive(Debug, Clone)]
pub struct Passive {
    /// Of every cell.
    pub parts: Arc<Vec<CellPlace>>,
    /// Loops over the whole mesh.
    pub whole: Integrator,
    /// How strong the continuation is.
    pub weights: Continuation,
}

/// Bodies in a tissue, at one time.
#[derive(Debug)]
pub struct Covered {
    /// The cells that bodies cover.
    pub passive: Passive,
    /// How the bodies lie on the mesh.
    pub cover: Arc<Cover>,
    /// Loops over `Ω∖B`.
    pub tissue: Integrator,
}

impl Covered {
    /// What `cover` leaves of the mesh of the loops `whole`.
    pub fn new(whole: &Integrator, cover: &Arc<Cover>, weights: Continuation) -> Self {
        let part = |cell: usize| match cover.cell(cell) {
            Class::Outside => CellPlace::Tissue,
            Class::Inside(_) => CellPlace::Body,
            Class::Cut(_) => CellPlace::Cut,
        };
        let parts = Arc::new((0..whole.mesh.cells.len()).map(part).collect());
        let passive = Passive { parts, whole: whole.clone(), weights };
        Self { passive, cover: cover.clone(), tissue: whole.outside(cover) }
    }
}

impl Passive {
    /// Faces with a ghost penalty: those of cut cells that have no side inside of a body.
    fn ghost_faces(&self) -> impl Iterator<Item = &Face> {
        self.whole.mesh.faces.iter().filter(|face| {
            let Some(plus) = face.plus else { return false };
            let sides = [face.minus, plus].map(|side| self.parts[side.cell]);
            sides.contains(&CellPlace::Cut) && !sides.contains(&CellPlace::Body)
        })
    }

    /// Adds the ghost penalty to the diffusion of the tissue, and makes the rows of the cells inside of bodies.
    pub(super) fn add_to(&self, space: &Space, dirichlet: Faces, kappa2: f64, diffusion: &mut ScalarBlocks) {
        for face in self.ghost_faces() {
            let matrix = ghost::matrix(space, face) * (kappa2 * self.weights.ghost);
            for side in 0..2 {
                add_rows(diffusion, face, side, &matrix);
            }
        }
        let mut inner = ScalarBlocks::zero(&diffusion.neighbours, space.n);
        let form = self.weights.inner * swip::a_swip(space, dirichlet, Density::One);
        self.whole.add_rows(&form, (space, space), &mut inner.diagonal, &mut inner.off);
        for face in &self.whole.mesh.faces {
            let Some(plus) = face.plus else { continue };
            let sides = [face.minus, plus].map(|side| self.parts[side.cell]);
            if let Some(side) = sides.iter().position(|part| *part == CellPlace::Body)
                && sides[1 - side] == CellPlace::Cut
            {
                add_rows(&mut inner, face, side, &(ghost::matrix(space, face) * self.weights.ghost));
            }
        }
        let size = space.n * space.n;
        for cell in (0..self.parts.len()).filter(|&cell| self.parts[cell] == CellPlace::Body) {
            let (own, off) = (cell * size..(cell + 1) * size, 3 * cell * size..3 * (cell + 1) * size);
            diffusion.diagonal[own.clone()].copy_from_slice(&inner.diagonal[own]);
            diffusion.off[off.clone()].copy_from_slice(&inner.off[off]);
        }
    }
}

/// Adds the rows of one side of a face's matrix.
fn add_rows(to: &mut ScalarBlocks, face: &Face, side: usize, matrix: &DMatrix<f64>) {
    let n = to.n;
    let plus = face.plus.expect("an interior face");
    let own = [face.minus, plus][side];
    for i in 0..n {
        for j in 0..n {
            to.diagonal[(own.cell * n + i) * n + j] += matrix[(side * n + i, side * n + j)];
            to.off[((3 * own.cell + own.face) * n + i) * n + j] += matrix[(side * n + i, (1 - side) * n + j)];
        }
    }
}

/// What bodies change in the polarity equation, besides the diffusion.
#[derive(Debug)]
pub(super) struct Around {
    passive: Passive,
    /// `(φ|χ)_α`, zero inside of bodies.
    pub inertia: Vec<f64>,
    /// Its inverse, zero inside of bodies.
    pub projection: Vec<f64>,
}

impl Around {
    /// With the mass of whole cells, and loops over the tissue.
    pub fn new(tissue: &Integrator, space: &Space, passive: &Passive, mass: &[f64]) -> Result<Self, SolveError> {
        let size = space.n * space.n;
        let mut inertia = tissue.cell_blocks(&mass::mass(space), space, space);
        let mut projection = Vec::with_capacity(inertia.len());
        let blocks = inertia.chunks_exact_mut(size).zip(mass.chunks_exact(size));
        for (cell, (block, whole)) in blocks.enumerate() {
            match passive.parts[cell] {
                CellPlace::Body => {
                    block.fill(0.0);
                    projection.extend_from_slice(block);
                    continue;
                }
                CellPlace::Cut => {
                    block.iter_mut().zip(whole).for_each(|(out, whole)| *out += passive.weights.mass * (whole - *out));
                }
                CellPlace::Tissue => block.copy_from_slice(whole),
            }
            projection.extend(invert_block(cell, block, space.n)?.iter());
        }
        Ok(Self { passive: passive.clone(), inertia, projection })
    }

    /// `½ γ Σ g_S(p,p)`
    pub fn ghost_energy(&self, p: &Field) -> f64 {
        0.5 * self.passive.weights.ghost * self.passive.ghost_faces().map(|face| ghost::energy(p, face)).sum::<f64>()
    }
}
