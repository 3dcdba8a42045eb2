//! Tractions on the boundaries of bodies: what a stress in the fluid leaves there when it is integrated by parts.
//!
//! A form that is tested with functions w that do not vanish on ∂B, and with the motions `w_B` of the bodies, has
//!
//! ```text
//! ∫_∂B (σn)·(w − w_B),   σ what multiplies ∇w in the form, n out of the fluid
//! ```
//! beside `−(σ|∇w)`: zero for what moves with the body, and what keeps smooth solutions exact. The stress is read off
//! the form itself, so there is one formula of it.

use nalgebra::Matrix2x6;
use rayon::prelude::*;

use super::bilinear::{MAX_SLOTS, Stencil};
use super::integrate::{CellPoint, Integrator};
use super::kernel::Basis;
use super::words::Vector;
use super::{Bilinear, Linear, OutlinePoint};
use crate::cut::Surface;
use crate::mesh::Point;
use crate::shape::{Pose, rigid_motion};
use crate::space::Space;

/// The boundaries of bodies at their places.
#[derive(Debug, Clone, Copy)]
pub struct Outline<'s> {
    /// By cell.
    pub surface: &'s Surface,
    /// One for each body.
    pub poses: &'s [Pose],
}

/// `∫_∂B (σn)·(w − w_B)` over what of a body's boundary lies in a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Pull {
    /// The cell.
    pub cell: usize,
    /// The body.
    pub body: usize,
    /// Rows of the cell's velocities, component after component, then of the body's two translations and its rotation.
    /// Of a functional one number in each, of a derivative one for each trial function of the cell.
    pub rows: Vec<f64>,
}

impl Outline<'_> {
    /// Cells with a boundary in them, and whose it is.
    fn places(&self) -> Vec<(usize, usize)> {
        let of = |cell: usize| self.surface.bodies_of_cell(cell).into_iter().map(move |body| (cell, body));
        self.surface.cells().flat_map(of).collect()
    }
}

/// The tractions of the stress in a form, test w.
pub fn of_form(loops: &Integrator, form: &Linear<Vector>, velocity: &Space, outline: Outline) -> Vec<Pull> {
    if form.cell_terms.is_empty() {
        return Vec::new();
    }
    let (n, degree) = (velocity.n, form.cell_degree() + 1);
    let pull = |&(cell, body): &(usize, usize)| {
        let (centre, mut chi) = (outline.poses[body].position, Basis::new(velocity));
        let (mut rows, mut weights) = (vec![0.0; 2 * n + 3], [0.0; MAX_SLOTS]);
        loops.each_outline_point(outline.surface, (cell, body), degree, &mut |x| {
            let (site, mut traction) = (CellPoint { site: x.site, weight: x.weight }, Point::zeros());
            for term in &form.cell_terms {
                (term.integrand)(&site, &mut weights);
                let along = |slot: usize| weights[slot + 1] * x.n.x + weights[slot + 2] * x.n.y;
                traction += term.scale * Point::new(along(0), along(3));
            }
            chi.evaluate(&x.site);
            for i in 0..n {
                let chi = x.weight * chi.at(i).0;
                (0..2).for_each(|c| rows[c * n + i] += chi * traction[c]);
            }
            (0..3).for_each(|k| rows[2 * n + k] -= x.weight * traction.dot(&rigid_motion(k, centre, x.site.x)));
        });
        Pull { cell, body, rows }
    };
    outline.places().par_iter().map(pull).collect()
}

/// The tractions of the stress in a form, trial φ, test w: as many columns as a cell has trial functions.
pub fn of_derivative(
    loops: &Integrator,
    form: &Bilinear<Vector, Vector>,
    (trial, velocity): (&Space, &Space),
    outline: Outline,
) -> Vec<Pull> {
    if form.cell_terms.is_empty() {
        return Vec::new();
    }
    let (n, m) = (velocity.n, trial.n);
    let degree = form.cell_terms.iter().map(|term| term.degree).max().unwrap_or(0) + 1;
    let pull = |&(cell, body): &(usize, usize)| {
        let (mut chi, mut phi, mut stencil) = (Basis::new(velocity), Basis::new(trial), Stencil::zero());
        let mut rows = vec![0.0; (2 * n + 3) * 2 * m];
        loops.each_outline_point(outline.surface, (cell, body), degree, &mut |x| {
            let traction = traction_at(form, x, &mut stencil);
            chi.evaluate(&x.site);
            phi.evaluate(&x.site);
            let motions: [Point; 3] =
                std::array::from_fn(|k| rigid_motion(k, outline.poses[body].position, x.site.x) * x.weight);
            for (b, j) in (0..2).flat_map(|b| (0..m).map(move |j| (b, j))) {
                let (value, slope) = phi.at(j);
                let part = traction.fixed_view::<2, 3>(0, 3 * b);
                let pull: Point = part.column(0) * value + part.column(1) * slope.x + part.column(2) * slope.y;
                let column = b * m + j;
                for i in 0..n {
                    let chi = x.weight * chi.at(i).0;
                    (0..2).for_each(|c| rows[(c * n + i) * 2 * m + column] += chi * pull[c]);
                }
                (0..3).for_each(|k| rows[(2 * n + k) * 2 * m + column] -= motions[k].dot(&pull));
            }
        });
        Pull { cell, body, rows }
    };
    outline.places().par_iter().map(pull).collect()
}

/// The traction by the slots of the trial function.
fn traction_at(form: &Bilinear<Vector, Vector>, x: &OutlinePoint, stencil: &mut Stencil) -> Matrix2x6<f64> {
    let (site, mut traction) = (CellPoint { site: x.site, weight: x.weight }, Matrix2x6::zeros());
    for term in &form.cell_terms {
        (term.integrand)(&site, stencil);
        let along = |c: usize, u: usize| stencil.c[3 * c + 1][u] * x.n.x + stencil.c[3 * c + 2][u] * x.n.y;
        traction += Matrix2x6::from_fn(along) * term.scale;
    }
    traction
}
