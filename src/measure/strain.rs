//! The elastic strain that a flow carries along.

use std::sync::Arc;

use nalgebra::Matrix2;

use crate::element::basis;
use crate::form::words::{Scalar, Trace};
use crate::form::{Faces, Integrator, Linear, mass, upwind};
use crate::mesh::{Mesh, Point};
use crate::solve::blocks::{NONE, Neighbours, neighbours};
use crate::solve::dissection::{Group, LEAF, dissect};
use crate::solve::multifrontal::Multifrontal;
use crate::solve::symbolic::{Element, Symbolic};
use crate::solve::{DIRECT_TOLERANCE, SolveError, axpy, norm};
use crate::space::{Continuity, Field, Space};

/// Components of a symmetric tensor: 11, 12, 22.
const COMPONENTS: usize = 3;

/// A symmetric tensor field, `ε_11`, `ε_12`, `ε_22`.
#[derive(Debug, Clone)]
pub struct Tensor {
    /// `e_11`, `e_12`, `e_22`
    pub components: [Field; COMPONENTS],
}

/// A number with its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extreme {
    /// The value.
    pub value: f64,
    /// Where it is taken.
    pub x: Point,
}

/// The stationary equation of the strain in a given flow, by upwind fluxes between discontinuous components:
///
/// `(v·∇)ε − (∇v)ε − ε(∇v)ᵀ + ε/We = 2D(v)`   [12.3]
#[derive(Debug)]
pub struct Strain {
    /// Of one component.
    pub space: Arc<Space>,
    /// `We`
    pub weissenberg: f64,
    open: Faces,
    neighbours: Neighbours,
    symbolic: Arc<Symbolic>,
}

/// The matrix of the equation in one flow.
struct System {
    n: usize,
    neighbours: Neighbours,
    /// `3n × 3n` per cell.
    own: Vec<f64>,
    /// `n × n` per cell and local face, alike for every component.
    off: Vec<f64>,
}

impl Strain {
    /// Prepares the equation; tissue comes in through `open` faces only: on a curved wall the discrete `v·n` is not
    /// exactly zero.
    ///
    /// # Errors
    /// A structure that contradicts itself.
    pub fn new(mesh: &Arc<Mesh>, degree: usize, weissenberg: f64, open: Faces) -> Result<Self, SolveError> {
        let space = Arc::new(Space::new(mesh, Continuity::Discontinuous, degree, 1));
        let neighbours = neighbours(mesh);
        let (cells, m) = (mesh.cells.len(), COMPONENTS * space.n);
        let group = |cell: usize| Group {
            unknowns: (cell * m..(cell + 1) * m).map(|u| u as u32).collect(),
            position: mesh.centroid(cell).into(),
        };
        let groups: Vec<Group> = (0..cells).map(group).collect();
        let next = |cell: usize| neighbours[cell].iter().filter(|&&c| c != NONE).map(|&c| c as u32).collect();
        let adjacency: Vec<Vec<u32>> = (0..cells).map(next).collect();
        let tree = dissect(&groups, &adjacency, &[], &[], LEAF);
        let pattern = |cell: usize, element: &mut Element| unknowns(&neighbours, m, cell, element);
        let symbolic = Arc::new(Symbolic::new("elastic strain", cells * m, &tree, cells, pattern)?);
        Ok(Self { space, weissenberg, open, neighbours, symbolic })
    }

    /// Unknowns of the equation.
    pub fn unknowns(&self) -> usize {
        self.symbolic.unknowns()
    }

    /// Bytes of the factors, and those that making them on so many threads takes at most besides.
    pub fn bytes(&self, threads: usize) -> usize {
        let n = self.space.n;
        let blocks = self.neighbours.len() * n * n * (COMPONENTS * COMPONENTS + 3 + 5);
        8 * (self.symbolic.factor_entries()
            + self.symbolic.stack_entries(threads)
            + self.symbolic.waiting_entries()
            + blocks)
    }

    /// The strain in the flow `v`; what comes in has the strain `inflow(x)` (11, 12, 22).
    ///
    /// # Errors
    /// A matrix that is singular; a solution that is not finite or inaccurate.
    pub fn of(
        &self,
        loops: &Integrator,
        v: &Field,
        inflow: impl Fn(Point) -> [f64; 3] + Sync,
    ) -> Result<Tensor, SolveError> {
        let system = self.assemble(loops, v);
        let right = self.right_side(loops, v, inflow);
        let factors = Multifrontal::<f64>::new(self.symbolic.clone(), |cell, element| system.fill(cell, element))?;
        let mut solution = vec![0.0; right.len()];
        let mut rest = right.clone();
        // one correction takes away what the growth of the factors has cost
        for _ in 0..2 {
            factors.solve_in_place(&mut rest);
            axpy(1.0, &rest, &mut solution);
            rest.copy_from_slice(&right);
            system.subtract(&solution, &mut rest);
        }
        let hint = "the strain has no bound in this flow; take a smaller `strain.weissenberg`";
        let named = || ("elastic strain".to_owned(), hint.to_owned());
        if solution.iter().any(|x| !x.is_finite()) {
            let (system, hint) = named();
            return Err(SolveError::NotFinite { system, hint });
        }
        let (residual, scale) = (norm(&rest), norm(&right));
        if residual > DIRECT_TOLERANCE * scale {
            let (system, hint) = named();
            return Err(SolveError::Inaccurate { system, residual: residual / scale, hint });
        }
        Ok(self.tensor(&solution))
    }

    fn assemble(&self, loops: &Integrator, v: &Field) -> System {
        let (space, n, k) = (&*self.space, self.space.n, v.space.degree);
        let cells = space.mesh.cells.len();
        let (mut alike, mut off) = (vec![0.0; cells * n * n], vec![0.0; 3 * cells * n * n]);
        let carried = upwind::a_upw(space, v, self.open) + (1.0 / self.weissenberg) * mass::mass(space);
        loops.add_rows(&carried, (space, space), &mut alike, &mut off);
        let weighted = |i: usize, j: usize| {
            let form = mass::weighted_mass(space, k - 1, move |x| v.vector_gradient(&x.site)[(i, j)]);
            loops.cell_blocks(&form, space, space)
        };
        let g = [[weighted(0, 0), weighted(0, 1)], [weighted(1, 0), weighted(1, 1)]];
        let m = COMPONENTS * n;
        let mut own = vec![0.0; cells * m * m];
        for cell in 0..cells {
            for i in 0..n {
                for j in 0..n {
                    let at = (cell * n + i) * n + j;
                    let (a, [[g11, g12], [g21, g22]]) =
                        (alike[at], g.each_ref().map(|row| row.each_ref().map(|g| g[at])));
                    // (∇v ε + ε ∇vᵀ) of 11, 12, 22 by ε_11, ε_12, ε_22
                    let rows = [
                        [a - 2.0 * g11, -2.0 * g12, 0.0],
                        [-g21, a - g11 - g22, -g12],
                        [0.0, -2.0 * g21, a - 2.0 * g22],
                    ];
                    for (c, row) in rows.iter().enumerate() {
                        for (d, value) in row.iter().enumerate() {
                            own[cell * m * m + (c * n + i) * m + d * n + j] = *value;
                        }
                    }
                }
            }
        }
        System { n, neighbours: self.neighbours.clone(), own, off }
    }

    /// `(2D(v)|χ) + ∫_open (v·n)⊖ g χ`, cell by cell, component by component.
    fn right_side(&self, loops: &Integrator, v: &Field, inflow: impl Fn(Point) -> [f64; 3] + Sync) -> Vec<f64> {
        let (space, n, k) = (&*self.space, self.space.n, v.space.degree);
        let carrier = upwind::Carrier::from(v);
        let mut right = vec![0.0; self.unknowns()];
        for c in 0..COMPONENTS {
            let inflow = &inflow;
            let form = Linear::cells(space.degree + k - 1, move |x| {
                let g = v.vector_gradient(&x.site);
                let source = [2.0 * g.m11, g.m12 + g.m21, 2.0 * g.m22][c];
                move |chi: Scalar| source * chi.value
            })
            .faces(self.open, 2 * space.degree + k, move |s| {
                let brought = carrier.entering(s) * inflow(s.minus.x)[c];
                move |chi: Trace<Scalar>| brought * chi.minus.value
            });
            let part = loops.vector(&form, space);
            for (cell, part) in part.chunks_exact(n).enumerate() {
                right[(cell * COMPONENTS + c) * n..][..n].copy_from_slice(part);
            }
        }
        right
    }

    fn tensor(&self, solution: &[f64]) -> Tensor {
        let n = self.space.n;
        let of = |c: usize| solution.chunks_exact(n).skip(c).step_by(COMPONENTS).flatten().copied().collect();
        Tensor { components: [0, 1, 2].map(|c| Field::new(&self.space, of(c))) }
    }

    /// `2 We λ`, λ the largest real part of an eigenvalue of ∇v, where it is largest among the points that the flow
    /// leaves more slowly than it stretches, `|v| ≤ λ h`, h the size of the cell: stagnation points. From 1 on the
    /// stationary strain has no bound there.
    pub fn growth(&self, loops: &Integrator, v: &Field) -> Option<Extreme> {
        let mut most: Option<Extreme> = None;
        for cell in 0..loops.mesh.cells.len() {
            let size = loops.mesh.cell_area(cell).sqrt();
            loops.each_cell_point(cell, 2 * v.space.degree, &mut |x| {
                let rate = fastest(&v.vector_gradient(&x.site));
                let value = 2.0 * self.weissenberg * rate;
                if v.vector(&x.site).norm() <= rate * size && most.is_none_or(|m| m.value < value) {
                    most = Some(Extreme { value, x: x.site.x });
                }
            });
        }
        most
    }
}

/// Largest real part of an eigenvalue.
fn fastest(g: &Matrix2<f64>) -> f64 {
    let half = 0.5 * g.trace();
    half + (half * half - g.determinant()).max(0.0).sqrt()
}

/// Own unknowns as rows, own ones and the neighbours' as columns.
fn unknowns(neighbours: &Neighbours, m: usize, cell: usize, element: &mut Element) {
    let of = |cell: usize| (cell * m..(cell + 1) * m).map(|u| u as u32);
    element.rows.clear();
    element.rows.extend(of(cell));
    element.columns.clear();
    let around = neighbours[cell].into_iter().filter(|&other| other != NONE);
    element.columns.extend(std::iter::once(cell).chain(around).flat_map(of));
}

impl System {
    fn fill(&self, cell: usize, element: &mut Element) {
        let (n, m) = (self.n, COMPONENTS * self.n);
        unknowns(&self.neighbours, m, cell, element);
        let width = element.columns.len();
        element.values.clear();
        element.values.resize(m * width, 0.0);
        for (i, row) in self.own[cell * m * m..(cell + 1) * m * m].chunks_exact(m).enumerate() {
            element.values[i * width..][..m].copy_from_slice(row);
        }
        for (k, (_, block)) in self.blocks_of(cell).enumerate() {
            for c in 0..COMPONENTS {
                for (i, row) in block.chunks_exact(n).enumerate() {
                    element.values[(c * n + i) * width + (k + 1) * m + c * n..][..n].copy_from_slice(row);
                }
            }
        }
    }

    /// The neighbours of a cell and the blocks towards them.
    fn blocks_of(&self, cell: usize) -> impl Iterator<Item = (usize, &[f64])> {
        let size = self.n * self.n;
        let blocks = self.off[3 * cell * size..3 * (cell + 1) * size].chunks_exact(size);
        self.neighbours[cell].into_iter().zip(blocks).filter(|(other, _)| *other != NONE)
    }

    /// `y −= A x`.
    fn subtract(&self, x: &[f64], y: &mut [f64]) {
        let (n, m) = (self.n, COMPONENTS * self.n);
        let product = |row: &[f64], x: &[f64]| row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        for (cell, y) in y.chunks_exact_mut(m).enumerate() {
            let here = &x[cell * m..(cell + 1) * m];
            for (y, row) in y.iter_mut().zip(self.own[cell * m * m..].chunks_exact(m)) {
                *y -= product(row, here);
            }
            for (other, block) in self.blocks_of(cell) {
                for (c, y) in y.chunks_exact_mut(n).enumerate() {
                    let there = &x[other * m + c * n..][..n];
                    for (y, row) in y.iter_mut().zip(block.chunks_exact(n)) {
                        *y -= product(row, there);
                    }
                }
            }
        }
    }
}

impl Tensor {
    /// The same as one field of three components.
    pub fn field(&self) -> Field {
        let of = &self.components[0].space;
        let space = Arc::new(Space::new(&of.mesh, Continuity::Discontinuous, of.degree, COMPONENTS));
        let cells = (0..of.mesh.cells.len()).map(|cell| cell * of.n..(cell + 1) * of.n);
        let values =
            cells.flat_map(|cell| self.components.iter().flat_map(move |one| one.values[cell.clone()].to_vec()));
        Field::new(&space, values.collect())
    }

    /// Largest eigenvalue of ε at any node, and where.
    pub fn largest(&self) -> Extreme {
        self.extreme(|mean, radius| mean + radius)
    }

    /// Smallest eigenvalue of `I + ε` at any node, and where. `A = I + ε` obeys `A▽ = (I − A)/We`, and stays positive
    /// definite.
    pub fn least_stretch(&self) -> Extreme {
        let least = self.extreme(|mean, radius| radius - mean);
        Extreme { value: 1.0 - least.value, x: least.x }
    }

    /// The largest value of a function of mean and radius of the eigenvalues.
    fn extreme(&self, of: impl Fn(f64, f64) -> f64) -> Extreme {
        let space = &self.components[0].space;
        let nodes = basis::nodes(space.degree);
        let mut most = (f64::NEG_INFINITY, 0);
        for k in 0..space.dof_count() {
            let [a, b, c] = self.components.each_ref().map(|field| field.values[k]);
            let value = of(0.5 * (a + c), (0.5 * (a - c)).hypot(b));
            if value > most.0 {
                most = (value, k);
            }
        }
        let (cell, node) = (most.1 / space.n, most.1 % space.n);
        Extreme { value: most.0, x: space.mesh.map(cell).at(nodes[node]).0 }
    }
}
