//! The integration loops over cells and faces; nothing else in the crate has any.
//!
//! Sums do not depend on the number of threads: every cell and face gives its own, and these are added in a fixed
//! order. Quadrature is exact on affine cells for the degree that a term states; on curved cells, where integrands are
//! not polynomial, the degree is raised by twice the geometry's.

use std::ops::BitOr;
use std::sync::Arc;

use nalgebra::Matrix2;
use rayon::prelude::*;

use super::bilinear::MAX_SLOTS;
use super::kernel::{Basis, add_vector};
use super::linear::{self, Linear};
use super::restrict::Restriction;
use super::side::SidePoint;
use super::words::Jet;
use crate::cut::{Cover, MeshPart};
use crate::element::quadrature::{self, MAX_INTERVAL_DEGREE, MAX_TRIANGLE_DEGREE};
use crate::element::tables::Tables;
use crate::element::{basis, tables};
use crate::mesh::{CellMap, Face, Mesh, Point, geometry};
use crate::space::field::Site;
use crate::space::{Continuity, Space};

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
    ///
    /// # Panics
    /// For a tag of [`Self::MAX_TAGS`] or above: a mesh has no more.
    pub fn tag(tag: usize) -> Self {
        assert!(tag < Self::MAX_TAGS);
        Faces(1 << tag)
    }

    /// Whether the set holds the interior faces.
    pub fn has_interior(self) -> bool {
        self.0 & Faces::INTERIOR.0 != 0
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
    /// Cell, place and tabulated values.
    pub site: Site<'t>,
    /// Quadrature weight times `det J`.
    pub weight: f64,
}

/// A quadrature point of a face.
pub struct FacePoint<'t> {
    /// On the side that the normal leaves.
    pub minus: Site<'t>,
    /// On the side to which the normal points; none on the boundary.
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
    /// Place along the face, 0 to 1 as the minus side runs; NaN where a body cuts the face.
    pub along: f64,
}

/// The integration loops on one mesh, or on a part of it.
///
/// On a part outside or inside of bodies ([`Integrator::outside`], [`Integrator::inside`]) cells and faces visit the
/// points of their cut, those that lie elsewhere none; every form and every method then means the integral over the
/// part. `ϖ_S` stays that of whole cells.
#[derive(Debug, Clone)]
pub struct Integrator {
    /// What is integrated over.
    pub mesh: Arc<Mesh>,
    /// `|∂K|/|K|` of every cell.
    ratios: Arc<[f64]>,
    /// The part of the mesh; `None` for all of it.
    restriction: Option<Restriction>,
}

impl Integrator {
    /// Prepares the loops on `mesh`.
    pub fn new(mesh: &Arc<Mesh>) -> Self {
        let mut this = Self { mesh: mesh.clone(), ratios: Arc::new([]), restriction: None };
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

    /// The loops outside of all bodies.
    pub fn outside(&self, cover: &Arc<Cover>) -> Self {
        self.restricted(cover, MeshPart::Outside)
    }

    /// The loops inside one body, or inside all of them.
    pub fn inside(&self, cover: &Arc<Cover>, body: Option<usize>) -> Self {
        self.restricted(cover, MeshPart::Inside(body))
    }

    fn restricted(&self, cover: &Arc<Cover>, part: MeshPart) -> Self {
        assert!(Arc::ptr_eq(&self.mesh, cover.mesh()), "bodies and loops are on one mesh");
        Self { restriction: Some(Restriction { cover: cover.clone(), part }), ..self.clone() }
    }

    /// Whether `cell` has quadrature points: always on the whole mesh, on a part of it in the cells that it meets.
    pub fn visits(&self, cell: usize) -> bool {
        self.restriction.as_ref().is_none_or(|r| r.visits(cell))
    }

    /// `|∂K|/|K|` of a cell.
    pub fn ratio(&self, cell: usize) -> f64 {
        self.ratios[cell]
    }

    /// Calls `visit` at every quadrature point of `cell`.
    pub fn each_cell_point(&self, cell: usize, degree: usize, visit: &mut dyn FnMut(&CellPoint)) {
        match &self.restriction {
            None => self.each_point_of_whole_cell(cell, degree, visit),
            Some(restriction) => restriction.each_cell_point(self, cell, degree, visit),
        }
    }

    pub(super) fn each_point_of_whole_cell(&self, cell: usize, degree: usize, visit: &mut dyn FnMut(&CellPoint)) {
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
                    let (x, jacobian) =
                        geometry::combine(&nodes.positions, shape.values(q), [shape.slopes(q, 0), shape.slopes(q, 1)]);
                    let (det, inverse_transposed) = inverse_transposed(&jacobian);
                    visit(&CellPoint { site: Site { cell, tables, q, x, inverse_transposed }, weight: w * det });
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
        match &self.restriction {
            None => self.each_point_of_whole_face(index, degree, visit),
            Some(restriction) => restriction.each_face_point(self, index, degree, visit),
        }
    }

    /// With a rule of exactly this degree.
    pub(super) fn each_point_of_whole_face(&self, index: usize, degree: usize, visit: &mut dyn FnMut(&FacePoint)) {
        let face = &self.mesh.faces[index];
        let minus = tables::face(degree, face.minus.face, false);
        let plus = face.plus.map(|s| tables::face(degree, s.face, true));
        let rule = quadrature::interval(degree);
        self.each_point_on_face(index, (&rule.points, &rule.weights), (minus, plus), visit);
    }

    /// At points of a face that are tabulated on both sides; their places along it are known on whole faces.
    pub(super) fn each_point_on_face(
        &self,
        index: usize,
        (along, weights): (&[f64], &[f64]),
        tables: (&Tables, Option<&Tables>),
        visit: &mut dyn FnMut(&FacePoint),
    ) {
        let face = &self.mesh.faces[index];
        let ratio = |cell: usize| self.ratios.get(cell).copied().unwrap_or(0.0);
        let varpi = face.plus.map_or(0.0, |s| ratio(s.cell)).max(ratio(face.minus.cell));
        let curve = face.curve.map(|c| &self.mesh.curves[c]);
        for (q, w) in weights.iter().enumerate() {
            let (minus, jacobian) = self.site(face.minus.cell, tables.0, q);
            let plus = face.plus.zip(tables.1).map(|(s, tables)| self.site(s.cell, tables, q).0);
            let tangent = jacobian * basis::face_tangent(face.minus.face);
            let length = tangent.norm();
            let n = Point::new(tangent.y, -tangent.x) / length;
            let exact_n = curve.map_or(n, |c| c.normal(minus.x, n));
            let along = along.get(q).copied().unwrap_or(f64::NAN);
            visit(&FacePoint { minus, plus, face: index, n, exact_n, weight: w * length, varpi, along });
        }
    }

    /// Point `q` of some tables on a cell, and the Jacobian there.
    pub(super) fn site<'t>(&self, cell: usize, tables: &'t Tables, q: usize) -> (Site<'t>, Matrix2<f64>) {
        let (x, jacobian) = match self.mesh.map(cell) {
            CellMap::Affine { origin, jacobian } => (origin + jacobian * tables.points[q], jacobian),
            CellMap::Isoparametric(nodes) => {
                let shape = tables.degree(nodes.degree);
                geometry::combine(&nodes.positions, shape.values(q), [shape.slopes(q, 0), shape.slopes(q, 1)])
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

    /// The vector of a linear form, by dof of `test`.
    ///
    /// # Panics
    /// For a space whose functions have not as many components as the form's.
    pub fn vector<V: Jet>(&self, form: &Linear<V>, test: &Space) -> Vec<f64> {
        let rows = block_size::<V>(test);
        assert_eq!(rows, test.cell_dof_count(), "test jets and space have different numbers of components");
        let mut local = vec![0.0; self.mesh.cells.len() * rows];
        local.par_chunks_mut(rows).enumerate().for_each_init(
            || (Basis::new(test), [0.0; MAX_SLOTS]),
            |(chi, weights), (cell, block)| {
                for (k, term) in form.cell_terms.iter().enumerate() {
                    let alike = |other: &&linear::CellTerm| other.degree == term.degree;
                    if form.cell_terms[..k].iter().any(|earlier| alike(&earlier)) {
                        continue;
                    }
                    self.each_cell_point(cell, term.degree, &mut |x| {
                        chi.evaluate(&x.site);
                        for term in form.cell_terms[k..].iter().filter(alike) {
                            (term.integrand)(x, weights);
                            add_vector(block, weights, 0, chi, x.weight * term.scale);
                        }
                    });
                }
            },
        );
        self.add_face_terms(form, test, &mut local);
        if test.continuity == Continuity::Discontinuous {
            return local;
        }
        let mut global = vec![0.0; test.dof_count()];
        for (cell, block) in local.chunks(rows).enumerate() {
            for (k, value) in block.iter().enumerate() {
                global[test.dof(cell, k / test.n, k % test.n)] += value;
            }
        }
        global
    }

    /// Faces at work in parallel, each with room of its own; gathered in the order of the faces.
    fn add_face_terms<V: Jet>(&self, form: &Linear<V>, test: &Space, local: &mut [f64]) {
        let concerns = |face: &Face| {
            (face.plus.is_some() && !form.side_terms.is_empty()) || form.face_terms.iter().any(|t| t.faces.holds(face))
        };
        let faces: Vec<usize> = (0..self.mesh.faces.len()).filter(|&f| concerns(&self.mesh.faces[f])).collect();
        let rows = block_size::<V>(test);
        let mut parts = vec![0.0; 2 * faces.len() * rows];
        parts.par_chunks_mut(2 * rows).zip(&faces).for_each_init(
            || (Basis::new(test), [0.0; MAX_SLOTS]),
            |(chi, weights), (part, &index)| {
                let holds = form.face_terms.iter().filter(|t| t.faces.holds(&self.mesh.faces[index]));
                for term in holds {
                    self.each_face_point(index, term.degree, &mut |s| {
                        (term.integrand)(s, weights);
                        let sides = std::iter::once(&s.minus).chain(&s.plus).zip(part.chunks_exact_mut(rows));
                        for (side, (site, part)) in sides.enumerate() {
                            chi.evaluate(site);
                            add_vector(part, weights, side * V::SLOTS, chi, s.weight * term.scale);
                        }
                    });
                }
                for term in form.side_terms.iter().filter(|_| self.mesh.faces[index].plus.is_some()) {
                    self.each_face_point(index, term.degree, &mut |s| {
                        for (is_plus, part) in [false, true].into_iter().zip(part.chunks_exact_mut(rows)) {
                            let side = SidePoint { s, is_plus };
                            term.at(&side, weights);
                            chi.evaluate(side.own());
                            add_vector(part, weights, 0, chi, s.weight * term.scale);
                        }
                    });
                }
            },
        );
        for (part, &index) in parts.chunks_exact(2 * rows).zip(&faces) {
            let face = &self.mesh.faces[index];
            for (side, part) in std::iter::once(face.minus).chain(face.plus).zip(part.chunks_exact(rows)) {
                let block = &mut local[side.cell * rows..(side.cell + 1) * rows];
                block.iter_mut().zip(part).for_each(|(b, p)| *b += p);
            }
        }
    }
}

/// Dofs of one cell that a jet kind sees: a scalar jet on a vector space acts on each component alike.
pub(super) fn block_size<J: Jet>(space: &Space) -> usize {
    space.n * J::SLOTS / 3
}

fn inverse_transposed(j: &Matrix2<f64>) -> (f64, Matrix2<f64>) {
    let det = j.determinant();
    (det, Matrix2::new(j.m22, -j.m21, -j.m12, j.m11) / det)
}
