//! The boundaries of bodies in the cells of a mesh, and quadrature on them.
//!
//! A boundary is cut where it crosses faces, and what lies between two cuts belongs to one cell: every point is there
//! once, whatever rounding does to the cuts. What runs along a face belongs to the cell on the outer side of the body.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use super::rule::{MOST, arc_points, gauss};
use super::{Class, Cover, MeshPart, curved};
use crate::element::basis;
use crate::element::tables::Tables;
use crate::mesh::locate::invert;
use crate::mesh::{Mesh, Point};
use crate::shape::outline::Piece;

/// Cells of which a smaller share lies outside of all bodies have no fluid.
pub const ACTIVE: f64 = 1e-12;
/// How far outside of its body the cell of a portion is looked for, in sizes of cells: first beyond rounding, then as
/// far as cells without fluid reach.
const REACH: [f64; 5] = [1e-10, 1e-8, 1e-6, 1e-4, 1e-2];
/// Of reference points.
const ROUNDING: f64 = 1e-12;
/// How far beyond the ends of a face, in its length, a crossing still cuts a boundary.
const BEYOND: f64 = 1e-9;
/// Digits of the rules on arcs of ellipses, as the logarithm of the error.
const DIGITS: f64 = 37.0;

/// What of a boundary lies in one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Portion {
    body: usize,
    piece: Piece,
}

/// The boundaries of all bodies of a [`Cover`], by cell: those parts that the fluid touches.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    portions: BTreeMap<usize, Vec<Portion>>,
}

/// A quadrature rule on what of a body's boundary lies in a cell.
#[derive(Debug)]
pub(crate) struct SurfaceRule {
    /// Reference points with the bases there.
    pub tables: Tables,
    /// Unit normals out of the fluid, into the body.
    pub normals: Vec<Point>,
    /// They add up to the length.
    pub weights: Vec<f64>,
}

impl Surface {
    /// The cells with a part of a boundary, ascending.
    pub fn cells(&self) -> impl Iterator<Item = usize> {
        self.portions.keys().copied()
    }

    /// The bodies whose boundaries lie in a cell, ascending.
    pub fn bodies_of_cell(&self, cell: usize) -> Vec<usize> {
        let bodies: BTreeSet<usize> = self.portions.get(&cell).into_iter().flatten().map(|p| p.body).collect();
        bodies.into_iter().collect()
    }

    /// The rule on the boundary of a body in a cell, exact for polynomials of degree `degree` in space: on curved cells
    /// of the functions there, as far as [`Cover`] tells.
    pub(crate) fn rule(&self, mesh: &Mesh, (cell, body): (usize, usize), degree: usize) -> SurfaceRule {
        let curved = mesh.curved[cell].is_some();
        let size = mesh.cell_area(cell).sqrt();
        let (mut points, mut normals, mut weights) = (Vec::new(), Vec::new(), Vec::new());
        let own = self.portions.get(&cell).into_iter().flatten().filter(|portion| portion.body == body);
        for Portion { piece, .. } in own {
            let (from, to) = piece.range();
            let needed = |a: f64, b: f64| needed(piece, (a, b), degree, curved.then_some(size));
            each_point((from, to), &needed, &mut |t, w| {
                let slope = piece.slope(t);
                let length = slope.norm();
                points.push(invert(mesh, cell, piece.at(t)).expect("points of a cell have reference points"));
                normals.push(Point::new(-slope.y, slope.x) / length);
                weights.push(w * length);
            });
        }
        SurfaceRule { tables: Tables::new(points), normals, weights }
    }
}

/// Calls `visit` with the parameters and weights of Gauss rules on a range, which is halved where `needed` tells no
/// number of points.
fn each_point((from, to): (f64, f64), needed: &dyn Fn(f64, f64) -> Option<usize>, visit: &mut dyn FnMut(f64, f64)) {
    match needed(from, to) {
        None => {
            let middle = 0.5 * (from + to);
            each_point((from, middle), needed, visit);
            each_point((middle, to), needed, visit);
        }
        Some(points) => {
            let rule = gauss(points);
            for (s, w) in rule.points.iter().zip(&rule.weights) {
                visit(from + s * (to - from), w * (to - from));
            }
        }
    }
}

/// The Gauss points that a part of a piece needs, or `None` if it is too long. `bent` is the size of a curved cell.
fn needed(piece: &Piece, (from, to): (f64, f64), degree: usize, bent: Option<f64>) -> Option<usize> {
    let (turn, length) = match piece {
        Piece::Segment { from: a, to: b } => (0.0, (b - a).norm() * (to - from)),
        Piece::Arc { axes: [a, b], .. } => (to - from, a.norm().max(b.norm()) * (to - from)),
    };
    if bent.is_some_and(|size| 4.0 * length > size || turn > 0.5) {
        return None;
    }
    let more = match piece {
        Piece::Segment { .. } => 0,
        Piece::Arc { axes, .. } => points_for_speed(axes, (from, to))?,
    };
    let points = match (bent, arc_points(degree, turn)) {
        // 7 points more than polynomials need
        (Some(_), _) => degree / 2 + 8,
        (None, (1, points)) => points,
        (None, _) => return None,
    };
    Some(points + more).filter(|points| *points <= MOST)
}

/// Points that the speed `|x′(t)|` needs, a root of which vanishes at `t = kπ ± i asinh(b/√(a²−b²))` from where an
/// ellipse with the semi-axes `a > b` is most bent: a Gauss rule of n points leaves `ρ^−2n`, with ρ the sum of the
/// semi-axes of the largest ellipse about the interval that holds no such point.
fn points_for_speed(axes: &[Point; 2], (from, to): (f64, f64)) -> Option<usize> {
    let [a, b] = axes.map(|axis| axis.norm());
    let (long, short) = (a.max(b), a.min(b));
    if long - short <= 1e-15 * long {
        return Some(0);
    }
    let height = (short / ((long - short) * (long + short)).sqrt()).asinh();
    let bent = if a > b { 0.0 } else { 0.5 * PI };
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let nearest = bent + PI * ((middle - bent) / PI).round() - middle;
    let reach = ((nearest - half).hypot(height) + (nearest + half).hypot(height)) / (2.0 * half);
    if reach < 1.25 {
        return None;
    }
    let rho = reach + ((reach - 1.0) * (reach + 1.0)).sqrt();
    Some((DIGITS / (2.0 * rho.ln())).ceil() as usize)
}

impl Cover {
    /// The share of a cell that lies outside of all bodies.
    pub fn share_outside(&self, cell: usize) -> f64 {
        match self.cell(cell) {
            Class::Outside => 1.0,
            Class::Inside(_) => 0.0,
            Class::Cut(cut) => {
                // the Jacobian of a curved cell is no more than of degree 4
                let rule = self.cell_rule(cut, cell, MeshPart::Outside, 4);
                let map = self.mesh.map(cell);
                let area = |(xi, w): (&Point, &f64)| w * map.at(*xi).1.determinant();
                let area: f64 = rule.tables.points.iter().zip(&rule.weights).map(area).sum();
                area / self.mesh.cell_area(cell)
            }
        }
    }

    /// Whether a cell has fluid: more than rounding of it lies outside of all bodies.
    pub fn is_active(&self, cell: usize) -> bool {
        self.share_outside(cell) > ACTIVE
    }

    /// The boundaries of the bodies, cell by cell. Parts that lie outside of the mesh, in another body, or where no
    /// cell has fluid are left out.
    pub fn surface(&self) -> Surface {
        let mut portions: BTreeMap<usize, Vec<Portion>> = BTreeMap::new();
        for (body, placed) in self.bodies().enumerate() {
            let boundary = placed.boundary();
            for (piece, cuts) in boundary.iter().zip(self.cuts(body, &boundary)) {
                for ends in cuts.windows(2) {
                    if let Some(cell) = self.cell_of(body, piece, [ends[0], ends[1]]) {
                        let piece = piece.part(ends[0], ends[1]);
                        portions.entry(cell).or_default().push(Portion { body, piece });
                    }
                }
            }
        }
        Surface { portions }
    }

    /// The parameters at which the pieces of a boundary begin, cross faces and end, ascending.
    fn cuts(&self, body: usize, boundary: &[Piece]) -> Vec<Vec<f64>> {
        let mesh = &self.mesh;
        let mut cuts: Vec<Vec<f64>> = boundary.iter().map(|piece| vec![piece.range().0, piece.range().1]).collect();
        for face in self.faces_near(body) {
            let side = mesh.faces[face].minus;
            let [a, b] = mesh.face_vertices(&mesh.faces[face]).map(|v| mesh.vertices[v]);
            if curved::is_straight(mesh, side.cell, side.face) {
                let along = (b - a) / (b - a).norm_squared();
                let normal = Point::new(-along.y, along.x);
                for (piece, cuts) in boundary.iter().zip(&mut cuts) {
                    let on_face = |t: &f64| (-BEYOND..1.0 + BEYOND).contains(&along.dot(&(piece.at(*t) - a)));
                    cuts.extend(piece.crossings(normal, -normal.dot(&a)).filter(on_face));
                }
                continue;
            }
            for s in curved::along_face(mesh, side.cell, side.face, self.body(body)).into_iter().flatten() {
                if s > 0.0 && s < 1.0 {
                    let x = mesh.map(side.cell).at(basis::face_point(side.face, s)).0;
                    let at = curved::parameter(boundary, x);
                    let piece = (at.floor() as usize).min(boundary.len() - 1);
                    let (from, to) = boundary[piece].range();
                    cuts[piece].push((from + (at - piece as f64) * (to - from)).min(to));
                }
            }
        }
        for (piece, cuts) in boundary.iter().zip(&mut cuts) {
            let (from, to) = piece.range();
            cuts.sort_by(f64::total_cmp);
            cuts.dedup_by(|b, a| *b - *a <= 1e-15 * (to - from));
        }
        cuts
    }

    /// Faces of the cells that a body may touch.
    fn faces_near(&self, body: usize) -> BTreeSet<usize> {
        let (mesh, placed) = (&self.mesh, self.body(body));
        let [low, high] = placed.bounds();
        let margin = Point::repeat(1e-9 * (high - low).max());
        let mut faces = BTreeSet::new();
        self.locator.visit_box(low - margin, high + margin, |cell| {
            let centre = mesh.centroid(cell);
            if placed.signed_distance(centre).0.abs() <= 1.001 * self.extent(cell, centre) {
                faces.extend(mesh.cell_faces[cell]);
            }
        });
        faces
    }

    /// The cell with fluid in which, or at whose boundary, a part of a piece lies.
    fn cell_of(&self, body: usize, piece: &Piece, [from, to]: [f64; 2]) -> Option<usize> {
        let middle = 0.5 * (from + to);
        let slope = piece.slope(middle);
        if slope.norm() == 0.0 {
            return None;
        }
        let (x, out) = (piece.at(middle), Point::new(slope.y, -slope.x) / slope.norm());
        let mut size = 0.0_f64;
        self.locator.visit_box(x, x, |cell| size = size.max((2.0 * self.mesh.cell_area(cell)).sqrt()));
        REACH.iter().find_map(|reach| {
            let beyond = x + out * (reach * size);
            let cell = self.cell_at(beyond, reach * size)?;
            let covered = |other: usize| other != body && self.body(other).signed_distance(beyond).0 < 0.0;
            let has_fluid = self.is_active(cell) && !self.bodies_of_cell(cell).into_iter().any(covered);
            has_fluid.then_some(cell)
        })
    }

    /// Of the cells that meet at a point the one that holds it best; `margin` is by how much their bounds may miss it.
    fn cell_at(&self, x: Point, margin: f64) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        let margin = Point::repeat(margin);
        self.locator.visit_box(x - margin, x + margin, |cell| {
            let Some(xi) = invert(&self.mesh, cell, x) else { return };
            let depth = xi.x.min(xi.y).min(1.0 - xi.x - xi.y);
            // the lower number if both hold it alike, in whatever order they are visited
            let better = best.is_none_or(|(most, other)| depth > most || (depth == most && cell < other));
            if depth >= -ROUNDING && better {
                best = Some((depth, cell));
            }
        });
        best.map(|(_, cell)| cell)
    }
}
