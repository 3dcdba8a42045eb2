//! How bodies lie on a mesh, and quadrature on the parts of cells and faces inside and outside of them.
//!
//! On straight cells the part inside a body is convex and bounded by segments and arcs, and its quadrature is exact to
//! rounding for polynomials. The quadrature outside is that of the whole cell less that of the inside: it is exact for
//! polynomials, but some weights are negative, and functions are evaluated at points of the body. A face is cut into
//! intervals, inside and outside, on which the rules of faces hold, so that integrands with a kink such as `|v·n|` are
//! treated as on whole faces.

mod curved;
mod face;
mod parts;
mod region;
mod rule;
pub mod surface;

use std::collections::BTreeMap;
use std::sync::Arc;

use rayon::prelude::*;

use parts::{Cut, CutCell, CutFace, Region};
pub(crate) use parts::{CutFaceRule, CutRule};
pub use surface::Surface;

use crate::element::quadrature::{MAX_INTERVAL_DEGREE, MAX_TRIANGLE_DEGREE};
use crate::mesh::locate::Locator;
use crate::mesh::{Mesh, Point};
use crate::shape::outline::Piece;
use crate::shape::{Placed, Pose, Shape, turned};

/// Where a cell or face lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Outside of all bodies.
    Outside,
    /// In the body of that number.
    Inside(usize),
    /// The boundary of a body cuts it; the number is that of the cut.
    Cut(usize),
}

/// A part of the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshPart {
    /// Outside of all bodies.
    Outside,
    /// In the body of that number, or in any.
    Inside(Option<usize>),
}

/// Placed shapes on a mesh: which cells and faces they cover or cut, and quadrature on the parts.
///
/// The rules of straight cells are exact to rounding. On curved cells the boundary of a body is taken to the reference
/// triangle point by point and integrated by Gauss rules, with 7 points more than polynomials need on pieces of at most
/// a quarter of the cell; `docs/bodies.md` tells how exact that is.
///
/// Bodies may leave the domain; only what lies inside the mesh counts. They should not overlap: what two bodies share
/// is twice inside.
#[derive(Debug, Clone)]
pub struct Cover {
    mesh: Arc<Mesh>,
    locator: Arc<Locator>,
    shapes: Arc<[Shape]>,
    poses: Vec<Pose>,
    cells: Vec<Class>,
    faces: Vec<Class>,
    cut_cells: Vec<Arc<CutCell>>,
    cut_faces: Vec<Arc<CutFace>>,
    /// Cells that a body covers or cuts, ascending.
    touched: Vec<usize>,
}

/// What was found about one cell or face.
enum Found<C> {
    Outside,
    Inside(usize),
    Cut(Arc<C>),
}

impl Cover {
    /// Places the bodies on the mesh. A `locator` of the mesh is built unless there is one to share.
    pub fn new(mesh: &Arc<Mesh>, locator: Option<&Arc<Locator>>, bodies: &[(Shape, Pose)]) -> Self {
        let locator = locator.cloned().unwrap_or_else(|| Arc::new(Locator::new(mesh)));
        let shapes = bodies.iter().map(|(shape, _)| shape.clone()).collect();
        let poses = bodies.iter().map(|(_, pose)| *pose).collect();
        let empty = Self {
            mesh: mesh.clone(),
            locator,
            shapes,
            poses,
            cells: vec![Class::Outside; mesh.cells.len()],
            faces: vec![Class::Outside; mesh.faces.len()],
            cut_cells: Vec::new(),
            cut_faces: Vec::new(),
            touched: Vec::new(),
        };
        empty.placed(&vec![true; bodies.len()])
    }

    /// The same bodies at other places, and the cells whose class or rules differ, ascending.
    ///
    /// # Panics
    /// When the number of poses is not that of the bodies.
    pub fn moved(&self, poses: &[Pose]) -> (Cover, Vec<usize>) {
        assert_eq!(poses.len(), self.poses.len(), "a pose for every body");
        let moving: Vec<bool> = poses.iter().zip(&self.poses).map(|(new, old)| new != old).collect();
        let cover = Self { poses: poses.to_vec(), ..self.clone() }.placed(&moving);
        let touched = merged(&self.touched, &cover.touched);
        let differs = |&cell: &usize| match (self.cells[cell], cover.cells[cell]) {
            (Class::Cut(old), Class::Cut(new)) => !Arc::ptr_eq(&self.cut_cells[old], &cover.cut_cells[new]),
            (old, new) => old != new,
        };
        let changed = touched.into_iter().filter(differs).collect();
        (cover, changed)
    }

    /// Classifies anew what the bodies touch; cuts of bodies that are not `moving` are kept.
    fn placed(mut self, moving: &[bool]) -> Self {
        let old = (self.cut_cells.clone(), self.cut_faces.clone());
        let near = self.near();
        let cells: Vec<(usize, &Vec<usize>)> = near.iter().map(|(cell, bodies)| (*cell, bodies)).collect();
        let found: Vec<Found<CutCell>> = cells
            .par_iter()
            .map(|(cell, bodies)| self.examine(*cell, bodies).or_kept(self.cells[*cell], &old.0, moving))
            .collect();
        let mut around: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (cell, bodies) in &cells {
            for &face in &self.mesh.cell_faces[*cell] {
                let known = around.entry(face).or_default();
                known.extend(bodies.iter().filter(|b| !known.contains(b)).collect::<Vec<_>>());
            }
        }
        let around: Vec<(usize, Vec<usize>)> = around.into_iter().collect();
        let found_faces: Vec<Found<CutFace>> = around
            .par_iter()
            .map(|(face, bodies)| self.examine_face(*face, bodies).or_kept(self.faces[*face], &old.1, moving))
            .collect();
        let indices: Vec<usize> = cells.iter().map(|c| c.0).collect();
        (self.cells, self.cut_cells) = classes(self.mesh.cells.len(), &indices, found);
        self.touched = indices.into_iter().filter(|&cell| self.cells[cell] != Class::Outside).collect();
        let indices: Vec<usize> = around.iter().map(|f| f.0).collect();
        (self.faces, self.cut_faces) = classes(self.mesh.faces.len(), &indices, found_faces);
        self
    }

    /// The bodies near each cell, by bounding boxes.
    fn near(&self) -> BTreeMap<usize, Vec<usize>> {
        let mut near: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (body, placed) in self.bodies().enumerate() {
            let [low, high] = placed.bounds();
            let margin = Point::repeat(1e-12 * (high - low).max());
            self.locator.visit_box(low - margin, high + margin, |cell| near.entry(cell).or_default().push(body));
        }
        near
    }

    fn examine(&self, cell: usize, bodies: &[usize]) -> Found<CutCell> {
        let corners = self.mesh.corners(cell);
        let centre = self.mesh.centroid(cell);
        let reach = self.extent(cell, centre);
        let mut parts = Vec::new();
        for &body in bodies {
            let placed = self.body(body);
            let distance = placed.signed_distance(centre).0;
            if distance > reach {
                continue;
            }
            if distance < -reach {
                return Found::Inside(body);
            }
            if self.mesh.curved[cell].is_some() {
                match curved::covered(&self.mesh, cell, placed) {
                    curved::Covered::Nothing => {}
                    curved::Covered::All => return Found::Inside(body),
                    curved::Covered::Part(sides) => parts.push((body, Region::Curved(sides))),
                }
                continue;
            }
            if corners.iter().all(|&x| placed.contains(x)) {
                return Found::Inside(body);
            }
            let region = self.region(cell, placed);
            let share = 2.0 * region::area(&region);
            if share > 1.0 - region::NOTHING {
                return Found::Inside(body);
            }
            if share > region::NOTHING {
                parts.push((body, Region::Straight(region)));
            }
        }
        if parts.is_empty() { Found::Outside } else { Found::Cut(Arc::new(Cut::new(parts))) }
    }

    /// No point of a cell is farther from its `centre`.
    fn extent(&self, cell: usize, centre: Point) -> f64 {
        match &self.mesh.curved[cell] {
            None => farthest(&self.mesh.corners(cell), centre),
            // the Lebesgue constant of the nodes
            Some(nodes) => 2.3 * farthest(&nodes.positions, centre),
        }
    }

    /// The part of a straight cell that a body covers, in reference coordinates.
    fn region(&self, cell: usize, placed: Placed) -> Vec<Piece> {
        let [a, b, c] = self.mesh.corners(cell);
        let (origin, jacobian) = (a, nalgebra::Matrix2::from_columns(&[b - a, c - a]));
        let inverse = jacobian.try_inverse().expect("the mesh has no flat cells");
        let (pose, place) = (placed.pose, inverse * (placed.pose.position - origin));
        let turn = |y: Point| inverse * turned(y, pose.angle);
        let boundary: Vec<Piece> =
            placed.shape.boundary().iter().map(|piece| piece.mapped(|y| place + turn(y), turn)).collect();
        region::in_triangle(&boundary)
    }

    fn examine_face(&self, face: usize, bodies: &[usize]) -> Found<CutFace> {
        let side = self.mesh.faces[face].minus;
        let mut parts = Vec::new();
        for &body in bodies {
            let spans = curved::along_face(&self.mesh, side.cell, side.face, self.body(body));
            if spans == [[0.0, 1.0]] {
                return Found::Inside(body);
            }
            parts.extend(spans.into_iter().map(|span| (body, span)));
        }
        parts.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
        if parts.is_empty() { Found::Outside } else { Found::Cut(Arc::new(Cut::new(parts))) }
    }

    /// The mesh.
    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    /// The body of a number, at its place.
    pub fn body(&self, body: usize) -> Placed<'_> {
        self.shapes[body].at(self.poses[body])
    }

    /// All bodies, at their places.
    pub fn bodies(&self) -> impl Iterator<Item = Placed<'_>> {
        self.shapes.iter().zip(&self.poses).map(|(shape, pose)| shape.at(*pose))
    }

    /// Where a cell lies.
    pub fn cell(&self, cell: usize) -> Class {
        self.cells[cell]
    }

    /// Where a face lies.
    pub fn face(&self, face: usize) -> Class {
        self.faces[face]
    }

    /// Whether a part of a face lies outside of all bodies.
    pub fn is_wet(&self, face: usize) -> bool {
        match self.faces[face] {
            Class::Outside => true,
            Class::Inside(_) => false,
            Class::Cut(k) => self.cut_faces[k].has(MeshPart::Outside),
        }
    }

    /// The bodies that cover or cut a cell.
    pub fn bodies_of_cell(&self, cell: usize) -> Vec<usize> {
        match self.cells[cell] {
            Class::Outside => Vec::new(),
            Class::Inside(body) => vec![body],
            Class::Cut(k) => self.cut_cells[k].parts.iter().map(|(body, _)| *body).collect(),
        }
    }

    /// The cells that bodies cover or cut, ascending.
    pub fn touched(&self) -> &[usize] {
        &self.touched
    }

    /// The rule on a part of the cut cell `cut`, which is cell `cell` of the mesh, exact for the degree `degree` in
    /// reference coordinates.
    pub(crate) fn cell_rule(&self, cut: usize, cell: usize, part: MeshPart, degree: usize) -> Arc<CutRule> {
        let class = degree.max(1).next_multiple_of(2).min(MAX_TRIANGLE_DEGREE);
        self.cut_cells[cut].rule((&self.mesh, cell), part, class)
    }

    /// The rule on a part of the cut face `cut`, which is face `face` of the mesh, exact for the degree `degree` along
    /// it.
    pub(crate) fn face_rule(&self, cut: usize, face: usize, part: MeshPart, degree: usize) -> Arc<CutFaceRule> {
        let face = &self.mesh.faces[face];
        let class = (degree | 1).min(MAX_INTERVAL_DEGREE);
        self.cut_faces[cut].rule(part, class, (face.minus.face, face.plus.map(|s| s.face)))
    }
}

impl<P, R> Found<Cut<P, R>> {
    /// What there was, with its rules, if the same bodies cut it as before and none of them moves.
    fn or_kept(self, before: Class, cuts: &[Arc<Cut<P, R>>], moving: &[bool]) -> Self {
        let (Found::Cut(new), Class::Cut(k)) = (&self, before) else { return self };
        let alike = new.parts.len() == cuts[k].parts.len()
            && new.parts.iter().zip(&cuts[k].parts).all(|((a, _), (b, _))| a == b && !moving[*a]);
        if alike { Found::Cut(cuts[k].clone()) } else { self }
    }
}

fn classes<C>(count: usize, indices: &[usize], found: Vec<Found<C>>) -> (Vec<Class>, Vec<Arc<C>>) {
    let (mut classes, mut cuts) = (vec![Class::Outside; count], Vec::new());
    for (&index, found) in indices.iter().zip(found) {
        classes[index] = match found {
            Found::Outside => Class::Outside,
            Found::Inside(body) => Class::Inside(body),
            Found::Cut(cut) => {
                cuts.push(cut);
                Class::Cut(cuts.len() - 1)
            }
        };
    }
    (classes, cuts)
}

fn farthest(points: &[Point], centre: Point) -> f64 {
    points.iter().map(|x| (x - centre).norm()).fold(0.0, f64::max)
}

/// The union of two ascending lists.
fn merged(a: &[usize], b: &[usize]) -> Vec<usize> {
    let mut all: Vec<usize> = a.iter().chain(b).copied().collect();
    all.sort_unstable();
    all.dedup();
    all
}
