//! The integration loops over cells and faces; nothing else in the crate has any.
//!
//! Results do not depend on the number of threads: every cell and face computes its own block, and blocks are gathered
//! in a fixed order. Quadrature is exact on affine cells for the degree that a term states; on curved cells, where
//! integrands are not polynomial, the degree is raised by twice the geometry's.

use std::ops::BitOr;
use std::sync::Arc;

use nalgebra::Matrix2;
use rayon::prelude::*;

use super::bilinear::{Bilinear, Stencil};
use super::linear::{Linear, Weights};
use super::words::Jet;
use crate::element::quadrature::{self, MAX_INTERVAL_DEGREE, MAX_TRIANGLE_DEGREE};
use crate::element::tables;
use crate::mesh::{CellMap, Face, Mesh, Point, geometry};
use crate::space::Space;
use crate::space::field::Site;

/// A set of faces: interior faces, boundary tags, or both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Faces(u64);

impl Faces {
    /// No face.
    pub const NONE: Faces = Faces(0);
    /// All interior faces.
    pub const INTERIOR: Faces = Faces(1 << 63);
    /// All boundary faces.
    pub const BOUNDARY: Faces = Faces((1 << 63) - 1);
    /// Number of boundary tags that a set can tell apart.
    pub const MAX_TAGS: usize = 63;

    /// The boundary faces of one tag.
    pub fn tag(tag: usize) -> Self {
        assert!(tag < Self::MAX_TAGS);
        Faces(1 << tag)
    }

    /// Whether the set holds `face`.
    pub fn holds(self, face: &Face) -> bool {
        let bit = face.tag.map_or(Faces::INTERIOR.0, |tag| 1 << tag);
        self.0 & bit != 0
    }
}

impl BitOr for Faces {
    type Output = Faces;

    fn bitor(self, other: Faces) -> Faces {
        Faces(self.0 | other.0)
    }
}

/// A quadrature point of a cell.
pub struct CellPoint<'t> {
    pub site: Site<'t>,
    /// Quadrature weight times `det J`.
    pub weight: f64,
}

/// A quadrature point of a face.
pub struct FacePoint<'t> {
    pub minus: Site<'t>,
    pub plus: Option<Site<'t>>,
    /// Index of the face in the mesh.
    pub face: usize,
    /// Unit normal of the face as it is meshed, from minus to plus or outwards.
    pub n: Point,
    /// Unit normal of the exact boundary curve; `n` where there is none.
    pub exact_n: Point,
    /// Quadrature weight times arc length.
    pub weight: f64,
    /// `ϖ_S = max(|∂K−|/|K−|, |∂K+|/|K+|)` [6.26].
    pub varpi: f64,
}

/// Blocks of the four combinations of sides of every face, `[test][trial]` in the order −−, −+, +−, ++.
pub struct FaceBlocks {
    /// Rows (test dofs of a cell) of a block.
    pub rows: usize,
    /// Columns (trial dofs of a cell) of a block.
    pub columns: usize,
    pub values: Vec<f64>,
}

impl FaceBlocks {
    /// The block of `face` with test functions on `test` and trial functions on `trial` (0 minus, 1 plus).
    pub fn block(&self, face: usize, test: usize, trial: usize) -> &[f64] {
        let size = self.rows * self.columns;
        let start = (face * 4 + 2 * test + trial) * size;
        &self.values[start..start + size]
    }
}

/// The integration loops on one mesh.
#[derive(Debug, Clone)]
pub struct Integrator {
    pub mesh: Arc<Mesh>,
    /// `|∂K|/|K|` of every cell.
    ratios: Vec<f64>,
}

/// Values and physical gradients of one basis at one point, slot by slot.
struct Basis {
    n: usize,
    rows: [Vec<f64>; 3],
}

impl Basis {
    fn new(space: &Space) -> Self {
        Self { n: space.n, rows: std::array::from_fn(|_| vec![0.0; space.n]) }
    }

    fn evaluate(&mut self, degree: usize, site: &Site) {
        let table = site.table(degree);
        self.rows[0].copy_from_slice(table.values(site.q));
        let m = &site.inverse_transposed;
        let [_, dx, dy] = &mut self.rows;
        for ((dx, dy), d) in dx.iter_mut().zip(dy).zip(table.slopes(site.q)) {
            *dx = m.m11 * d.x + m.m12 * d.y;
            *dy = m.m21 * d.x + m.m22 * d.y;
        }
    }
}

impl Integrator {
    /// Prepares the loops on `mesh`.
    pub fn new(mesh: &Arc<Mesh>) -> Self {
        let mut this = Self { mesh: mesh.clone(), ratios: Vec::new() };
        let mut perimeters = vec![0.0; mesh.cells.len()];
        for index in 0..mesh.faces.len() {
            let mut length = 0.0;
            this.each_face_point(index, 2, &mut |s| length += s.weight);
            let face = &mesh.faces[index];
            for side in std::iter::once(face.minus).chain(face.plus) {
                perimeters[side.cell] += length;
            }
        }
        this.ratios = perimeters.iter().enumerate().map(|(cell, p)| p / mesh.cell_area(cell)).collect();
        this
    }

    /// Calls `visit` at every quadrature point of `cell`.
    pub fn each_cell_point(&self, cell: usize, degree: usize, visit: &mut dyn FnMut(&CellPoint)) {
        match self.mesh.map(cell) {
            CellMap::Affine { origin, jacobian } => {
                let (rule, tables) = (quadrature::triangle(degree), tables::cell(degree.max(1)));
                let (det, inverse_transposed) = inverse_transposed(&jacobian);
                for (q, (xi, w)) in rule.points.iter().zip(&rule.weights).enumerate() {
                    let site = Site { cell, tables, q, x: origin + jacobian * xi, inverse_transposed };
                    visit(&CellPoint { site, weight: w * det });
                }
            }
            CellMap::Isoparametric(nodes) => {
                let degree = (degree.max(1) + 2 * nodes.degree).min(MAX_TRIANGLE_DEGREE);
                let (rule, tables) = (quadrature::triangle(degree), tables::cell(degree));
                let shape = tables.degree(nodes.degree);
                for (q, w) in rule.weights.iter().enumerate() {
                    let (x, jacobian) = geometry::combine(&nodes.positions, shape.values(q), shape.slopes(q));
                    let (det, inverse_transposed) = inverse_transposed(&jacobian);
                    visit(&CellPoint {
                        site: Site { cell, tables, q, x, inverse_transposed },
                        weight: w * det,
                    });
                }
            }
        }
    }

    /// Calls `visit` at every quadrature point of face `index`.
    pub fn each_face_point(&self, index: usize, degree: usize, visit: &mut dyn FnMut(&FacePoint)) {
        let face = &self.mesh.faces[index];
        let curvature = std::iter::once(face.minus)
            .chain(face.plus)
            .filter_map(|s| self.mesh.curved[s.cell].as_ref().map(|n| n.degree))
            .max();
        let degree = (degree + curvature.map_or(0, |m| 2 * m)).min(MAX_INTERVAL_DEGREE);
        let rule = quadrature::interval(degree);
        let ratio = |cell: usize| self.ratios.get(cell).copied().unwrap_or(0.0);
        let varpi = face.plus.map_or(0.0, |s| ratio(s.cell)).max(ratio(face.minus.cell));
        let curve = face.curve.map(|c| &self.mesh.curves[c]);
        for (q, w) in rule.weights.iter().enumerate() {
            let (minus, jacobian) = self.face_site(face.minus.cell, face.minus.face, false, degree, q);
            let plus = face.plus.map(|s| self.face_site(s.cell, s.face, true, degree, q).0);
            let tangent = jacobian * reference_tangent(face.minus.face);
            let length = tangent.norm();
            let n = Point::new(tangent.y, -tangent.x) / length;
            let exact_n = curve.map_or(n, |c| c.normal(minus.x, n));
            visit(&FacePoint { minus, plus, face: index, n, exact_n, weight: w * length, varpi });
        }
    }

    fn face_site(&self, cell: usize, local: usize, reversed: bool, degree: usize, q: usize) -> (Site<'_>, Matrix2<f64>) {
        let tables = tables::face(degree, local, reversed);
        let (x, jacobian) = match self.mesh.map(cell) {
            CellMap::Affine { origin, jacobian } => (origin + jacobian * tables.points[q], jacobian),
            CellMap::Isoparametric(nodes) => {
                let shape = tables.degree(nodes.degree);
                geometry::combine(&nodes.positions, shape.values(q), shape.slopes(q))
            }
        };
        let (_, inverse_transposed) = inverse_transposed(&jacobian);
        (Site { cell, tables, q, x, inverse_transposed }, jacobian)
    }

    /// `∫_Ω f`, `f` of polynomial degree `degree`.
    pub fn sum(&self, degree: usize, f: impl Fn(&CellPoint) -> f64 + Sync) -> f64 {
        let per_cell: Vec<f64> = (0..self.mesh.cells.len())
            .into_par_iter()
            .map(|cell| {
                let mut total = 0.0;
                self.each_cell_point(cell, degree, &mut |x| total += x.weight * f(x));
                total
            })
            .collect();
        per_cell.iter().sum()
    }

    /// `∫_faces f` over a set of faces.
    pub fn sum_faces(&self, faces: Faces, degree: usize, f: impl Fn(&FacePoint) -> f64 + Sync) -> f64 {
        let per_face: Vec<f64> = (0..self.mesh.faces.len())
            .into_par_iter()
            .filter(|&index| faces.holds(&self.mesh.faces[index]))
            .map(|index| {
                let mut total = 0.0;
                self.each_face_point(index, degree, &mut |s| total += s.weight * f(s));
                total
            })
            .collect();
        per_face.iter().sum()
    }

    /// Dense blocks of the cell terms, cell after cell, row-major with test dofs as rows.
    pub fn cell_blocks<U: Jet, V: Jet>(&self, form: &Bilinear<U, V>, trial: &Space, test: &Space) -> Vec<f64> {
        let (rows, columns) = (block_size::<V>(test), block_size::<U>(trial));
        let mut blocks = vec![0.0; self.mesh.cells.len() * rows * columns];
        blocks.par_chunks_mut(rows * columns).enumerate().for_each_init(
            || (Basis::new(trial), Basis::new(test), Stencil::zero()),
            |(phi, chi, stencil), (cell, block)| {
                for term in &form.cell_terms {
                    self.each_cell_point(cell, term.degree, &mut |x| {
                        phi.evaluate(trial.degree, &x.site);
                        chi.evaluate(test.degree, &x.site);
                        (term.integrand)(x, stencil);
                        let size = (V::SLOTS / 3, U::SLOTS / 3);
                        accumulate(block, columns, stencil, (0, 0), size, chi, phi, x.weight * term.scale);
                    });
                }
            },
        );
        blocks
    }

    /// Dense blocks of the face terms.
    pub fn face_blocks<U: Jet, V: Jet>(&self, form: &Bilinear<U, V>, trial: &Space, test: &Space) -> FaceBlocks {
        let (rows, columns) = (block_size::<V>(test), block_size::<U>(trial));
        let size = rows * columns;
        let mut values = vec![0.0; self.mesh.faces.len() * 4 * size];
        values.par_chunks_mut(4 * size).enumerate().for_each_init(
            || ([Basis::new(trial), Basis::new(trial)], [Basis::new(test), Basis::new(test)], Stencil::zero()),
            |(phi, chi, stencil), (index, blocks)| {
                for term in form.face_terms.iter().filter(|t| t.faces.holds(&self.mesh.faces[index])) {
                    self.each_face_point(index, term.degree, &mut |s| {
                        for (side, site) in std::iter::once(&s.minus).chain(&s.plus).enumerate() {
                            phi[side].evaluate(trial.degree, site);
                            chi[side].evaluate(test.degree, site);
                        }
                        (term.integrand)(s, stencil);
                        let sides = if s.plus.is_some() { 2 } else { 1 };
                        let components = (V::SLOTS / 3, U::SLOTS / 3);
                        for t in 0..sides {
                            for u in 0..sides {
                                let block = &mut blocks[(2 * t + u) * size..(2 * t + u + 1) * size];
                                let corner = (t * V::SLOTS, u * U::SLOTS);
                                let weight = s.weight * term.scale;
                                accumulate(block, columns, stencil, corner, components, &chi[t], &phi[u], weight);
                            }
                        }
                    });
                }
            },
        );
        FaceBlocks { rows, columns, values }
    }

    /// The whole matrix as triplets `(row, column, value)`; rows are test dofs. Duplicates are to be added.
    pub fn triplets<U: Jet, V: Jet>(
        &self,
        form: &Bilinear<U, V>,
        trial: &Space,
        test: &Space,
    ) -> Vec<(usize, usize, f64)> {
        let mut triplets = Vec::new();
        let (rows, columns) = (block_size::<V>(test), block_size::<U>(trial));
        if !form.cell_terms.is_empty() {
            let blocks = self.cell_blocks(form, trial, test);
            for (cell, block) in blocks.chunks(rows * columns).enumerate() {
                scatter(&mut triplets, block, (test, cell), (trial, cell));
            }
        }
        if !form.face_terms.is_empty() {
            let blocks = self.face_blocks(form, trial, test);
            for (index, face) in self.mesh.faces.iter().enumerate() {
                if !form.face_terms.iter().any(|t| t.faces.holds(face)) {
                    continue;
                }
                let cells: Vec<usize> = std::iter::once(face.minus).chain(face.plus).map(|s| s.cell).collect();
                for (t, &row_cell) in cells.iter().enumerate() {
                    for (u, &column_cell) in cells.iter().enumerate() {
                        let block = blocks.block(index, t, u);
                        scatter(&mut triplets, block, (test, row_cell), (trial, column_cell));
                    }
                }
            }
        }
        triplets
    }

    /// The vector of a linear form, by dof of `test`.
    pub fn vector<V: Jet>(&self, form: &Linear<V>, test: &Space) -> Vec<f64> {
        let rows = block_size::<V>(test);
        assert_eq!(rows, test.cell_dof_count(), "test jets and space have different numbers of components");
        let mut local = vec![0.0; self.mesh.cells.len() * rows];
        local.par_chunks_mut(rows).enumerate().for_each_init(
            || (Basis::new(test), [0.0; super::bilinear::MAX_SLOTS]),
            |(chi, weights), (cell, block)| {
                for term in &form.cell_terms {
                    self.each_cell_point(cell, term.degree, &mut |x| {
                        chi.evaluate(test.degree, &x.site);
                        (term.integrand)(x, weights);
                        accumulate_vector(block, weights, 0, V::SLOTS / 3, chi, x.weight * term.scale);
                    });
                }
            },
        );
        self.add_face_terms(form, test, &mut local);
        let mut global = vec![0.0; test.dof_count()];
        for (cell, block) in local.chunks(rows).enumerate() {
            for (k, value) in block.iter().enumerate() {
                global[test.dof(cell, k / test.n, k % test.n)] += value;
            }
        }
        global
    }

    fn add_face_terms<V: Jet>(&self, form: &Linear<V>, test: &Space, local: &mut [f64]) {
        let rows = block_size::<V>(test);
        let mut chi = Basis::new(test);
        let mut weights: Weights = [0.0; super::bilinear::MAX_SLOTS];
        for (index, face) in self.mesh.faces.iter().enumerate() {
            for term in form.face_terms.iter().filter(|t| t.faces.holds(face)) {
                self.each_face_point(index, term.degree, &mut |s| {
                    (term.integrand)(s, &mut weights);
                    for (side, site) in std::iter::once(&s.minus).chain(&s.plus).enumerate() {
                        chi.evaluate(test.degree, site);
                        let block = &mut local[site.cell * rows..(site.cell + 1) * rows];
                        let weight = s.weight * term.scale;
                        accumulate_vector(block, &weights, side * V::SLOTS, V::SLOTS / 3, &chi, weight);
                    }
                });
            }
        }
    }
}

/// Dofs of one cell that a jet kind sees: a scalar jet on a vector space acts on each component alike.
fn block_size<J: Jet>(space: &Space) -> usize {
    space.n * J::SLOTS / 3
}

fn inverse_transposed(j: &Matrix2<f64>) -> (f64, Matrix2<f64>) {
    let det = j.determinant();
    (det, Matrix2::new(j.m22, -j.m21, -j.m12, j.m11) / det)
}

/// Direction of local face `f` on the reference triangle, from vertex `f+1` to `f+2`.
fn reference_tangent(face: usize) -> Point {
    [Point::new(-1.0, 1.0), Point::new(0.0, -1.0), Point::new(1.0, 0.0)][face]
}

/// `block[a·n + i][b·m + j] += weight Σ_st B_s,i c[s][t] B_t,j` over components `a`, `b`.
#[allow(clippy::too_many_arguments)]
fn accumulate(
    block: &mut [f64],
    columns: usize,
    stencil: &Stencil,
    corner: (usize, usize),
    components: (usize, usize),
    test: &Basis,
    trial: &Basis,
    weight: f64,
) {
    let mut combined = [0.0; 32];
    let combined = &mut combined[..trial.n];
    for a in 0..components.0 {
        for s in 0..3 {
            let row_of = &stencil.c[corner.0 + 3 * a + s];
            for b in 0..components.1 {
                let from = corner.1 + 3 * b;
                let c: [f64; 3] = std::array::from_fn(|t| weight * row_of[from + t]);
                if c == [0.0; 3] {
                    continue;
                }
                let [v, dx, dy] = &trial.rows;
                for (((out, v), dx), dy) in combined.iter_mut().zip(v).zip(dx).zip(dy) {
                    *out = c[0] * v + c[1] * dx + c[2] * dy;
                }
                for (i, &chi) in test.rows[s].iter().enumerate() {
                    let start = (a * test.n + i) * columns + b * trial.n;
                    for (entry, phi) in block[start..start + trial.n].iter_mut().zip(combined.iter()) {
                        *entry += chi * phi;
                    }
                }
            }
        }
    }
}

fn accumulate_vector(block: &mut [f64], weights: &Weights, from: usize, components: usize, test: &Basis, weight: f64) {
    for a in 0..components {
        for s in 0..3 {
            let c = weight * weights[from + 3 * a + s];
            if c != 0.0 {
                for (entry, chi) in block[a * test.n..(a + 1) * test.n].iter_mut().zip(&test.rows[s]) {
                    *entry += c * chi;
                }
            }
        }
    }
}

fn scatter(triplets: &mut Vec<(usize, usize, f64)>, block: &[f64], test: (&Space, usize), trial: (&Space, usize)) {
    let columns = trial.0.cell_dof_count();
    for (k, &value) in block.iter().enumerate() {
        if value != 0.0 {
            let (i, j) = (k / columns, k % columns);
            let row = test.0.dof(test.1, i / test.0.n, i % test.0.n);
            let column = trial.0.dof(trial.1, j / trial.0.n, j % trial.0.n);
            triplets.push((row, column, value));
        }
    }
}
