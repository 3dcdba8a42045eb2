//! Whether the cells cover their domain once: no folds, no overlaps, no cuts where nodes were not merged.
//!
//! Around every vertex the angles of its cells add up to 2π at most, so a mesh is locally one sheet. It is one sheet
//! as a whole if its boundary does not cross itself and winds once around the cells along it: the cells that cover a
//! point are as many as the turns of the oriented boundary around it. All of that costs O(n + m log m), m the
//! boundary faces.

use std::f64::consts::TAU;

use rstar::primitives::{GeomWithData, Line};
use rstar::{AABB, RTree};

use super::{CellMap, Mesh, MeshError, Point};
use crate::element::basis;

/// Distance, relative to the shorter of two faces, below which they or their ends lie on one another.
const NEAR: f64 = 1e-6;
/// Deviation of a sum of angles from 2π that rounding may cause.
const ROUND: f64 = 1e-6;
/// Distance, relative to the shorter of two faces of different parts, below which they look as if they should touch.
const CLOSE: f64 = 1e-2;
/// Straight pieces of a curved face.
const PIECES: usize = 8;

/// What to do with faces of the boundary that lie on one another, so that the mesh is cut through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Slits {
    /// Nodes were not merged: a mistake.
    #[default]
    Refused,
    /// Walls without thickness, which are meant.
    Kept,
}

/// Boundary faces that nearly touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearMiss {
    /// Pairs of them.
    pub count: usize,
    /// Where they are nearest.
    pub at: Point,
    /// How far apart the two are.
    pub distance: f64,
    /// Of the shorter of the two faces there.
    pub length: f64,
}

/// A piece of the boundary, the domain on its left.
type Piece = GeomWithData<Line<[f64; 2]>, usize>;

/// Where the boundary comes upon itself.
#[derive(Debug, Default)]
struct Contacts {
    /// Pairs of faces that lie on one another, back to back.
    cuts: Vec<[usize; 2]>,
    /// Vertices of different numbers in one place.
    coincident: Vec<[usize; 2]>,
}

impl Mesh {
    /// Refuses cells that overlap, and cuts unless they are kept. Vertices that lie on one another are counted.
    ///
    /// # Errors
    /// [`MeshError::Overlap`] with a place, [`MeshError::Cut`] with the number of edges and the first one.
    pub fn check_embedding(&mut self, slits: Slits) -> Result<(), MeshError> {
        let boundary: Vec<usize> = (0..self.faces.len()).filter(|&f| self.faces[f].plus.is_none()).collect();
        let pieces: Vec<Piece> = boundary.iter().flat_map(|&face| self.pieces(face)).collect();
        let tree = RTree::bulk_load(pieces.clone());
        let contacts = self.contacts(&pieces, &tree)?;
        for &face in &boundary {
            let cell = self.faces[face].minus.cell;
            let x = self.map(cell).at(Point::repeat(1.0 / 3.0)).0;
            let turns = turns(&tree, x);
            if turns > 1 {
                return Err(MeshError::Overlap { x: x.x, y: x.y, what: format!("{turns} cells cover the same place") });
            }
        }
        if let (Slits::Refused, Some(&[first, second])) = (slits, contacts.cuts.first()) {
            let [p, q] = self.face_vertices(&self.faces[first]).map(|v| self.vertices[v]);
            let name = |face: usize| self.faces[face].tag.map_or(String::new(), |tag| self.tags[tag].clone());
            let (count, ends) = (contacts.cuts.len(), [p.x, p.y, q.x, q.y]);
            let parts = self.parts().count;
            return Err(MeshError::Cut { count, ends, tags: [name(first), name(second)], parts });
        }
        let mut lying: Vec<usize> = contacts.coincident.into_iter().map(|[a, b]| a.max(b)).collect();
        lying.sort_unstable();
        lying.dedup();
        self.coincident = lying;
        Ok(())
    }

    /// A boundary face as straight pieces, in the direction in which its cell runs along it.
    fn pieces(&self, face: usize) -> Vec<Piece> {
        let side = self.faces[face].minus;
        let count = match self.map(side.cell) {
            CellMap::Affine { .. } => 1,
            CellMap::Isoparametric(_) => PIECES,
        };
        let [a, b] = self.face_vertices(&self.faces[face]).map(|v| self.vertices[v]);
        let map = self.map(side.cell);
        let mut points = vec![a];
        points.extend((1..count).map(|k| map.at(basis::face_point(side.face, k as f64 / count as f64)).0));
        points.push(b);
        points.windows(2).map(|w| Piece::new(Line::new(w[0].into(), w[1].into()), face)).collect()
    }

    /// Looks at all pairs of pieces that are near each other.
    fn contacts(&self, pieces: &[Piece], tree: &RTree<Piece>) -> Result<Contacts, MeshError> {
        let mut found = Contacts::default();
        for piece in pieces {
            let one = ends(piece);
            let margin = NEAR * (one[1] - one[0]).norm();
            let (low, high) = (one[0].inf(&one[1]).add_scalar(-margin), one[0].sup(&one[1]).add_scalar(margin));
            for other in tree.locate_in_envelope_intersecting(AABB::from_corners(low.into(), high.into())) {
                let two = ends(other);
                if other.data < piece.data || piece.data == other.data {
                    continue;
                }
                match meeting(one, two) {
                    Meeting::Apart => {}
                    Meeting::Crossing(x) => {
                        let what = "two parts of its boundary cross".to_owned();
                        return Err(MeshError::Overlap { x: x.x, y: x.y, what });
                    }
                    Meeting::SameSide(x) => {
                        let what = "two faces lie on one another with their cells on the same side".to_owned();
                        return Err(MeshError::Overlap { x: x.x, y: x.y, what });
                    }
                    Meeting::BackToBack => found.cuts.push([piece.data, other.data]),
                }
                self.add_coincident(piece.data, other.data, &mut found.coincident);
            }
        }
        found.cuts.sort_unstable();
        found.cuts.dedup();
        Ok(found)
    }

    /// Ends of two faces that are different vertices in one place.
    fn add_coincident(&self, one: usize, two: usize, found: &mut Vec<[usize; 2]>) {
        let [one, two] = [one, two].map(|face| self.face_vertices(&self.faces[face]));
        let length = |ends: [usize; 2]| (self.vertices[ends[1]] - self.vertices[ends[0]]).norm();
        let near = NEAR * length(one).min(length(two));
        for a in one {
            let apart = |b: &usize| *b != a && (self.vertices[*b] - self.vertices[a]).norm() <= near;
            found.extend(two.into_iter().filter(apart).map(|b| [a, b]));
        }
    }

    /// Whether boundary faces come closer to each other than a hundredth of their length, but do not touch: mostly
    /// nodes that should have been one. Faces of one part count where they look at each other and have no vertex in
    /// common.
    pub fn near_miss(&self) -> Option<NearMiss> {
        let parts = self.parts();
        let boundary = (0..self.faces.len()).filter(|&f| self.faces[f].plus.is_none());
        let pieces: Vec<Piece> = boundary.flat_map(|face| self.pieces(face)).collect();
        let tree = RTree::bulk_load(pieces.clone());
        let part = |piece: &Piece| parts.of_cell[self.faces[piece.data].minus.cell];
        let (mut pairs, mut nearest) = (Vec::new(), None::<NearMiss>);
        for piece in &pieces {
            let (one, own) = (ends(piece), self.face_length(piece.data));
            let margin = CLOSE * own;
            let (low, high) = (one[0].inf(&one[1]).add_scalar(-margin), one[0].sup(&one[1]).add_scalar(margin));
            for other in tree.locate_in_envelope_intersecting(AABB::from_corners(low.into(), high.into())) {
                if other.data <= piece.data || (part(other) == part(piece) && !self.is_seam(piece.data, other.data)) {
                    continue;
                }
                let length = own.min(self.face_length(other.data));
                let (distance, at) = nearest_points(one, ends(other));
                // what touches is refused, or told of with the vertices that lie on one another
                if distance <= NEAR * length || distance >= CLOSE * length {
                    continue;
                }
                pairs.push([piece.data, other.data]);
                if nearest.is_none_or(|found| distance < found.distance) {
                    nearest = Some(NearMiss { count: 0, at, distance, length });
                }
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        nearest.map(|found| NearMiss { count: pairs.len(), ..found })
    }

    /// Whether two boundary faces of one part look at each other, as the sides of a cut do.
    fn is_seam(&self, one: usize, two: usize) -> bool {
        let [a, b] = [one, two].map(|face| self.face_vertices(&self.faces[face]));
        let [along, back] = [a, b].map(|[from, to]| (self.vertices[to] - self.vertices[from]).normalize());
        // the tissue lies on the same side of every boundary face in its own direction
        along.dot(&back) < -0.9 && a.iter().all(|vertex| !b.contains(vertex))
    }

    fn face_length(&self, face: usize) -> f64 {
        let [a, b] = self.face_vertices(&self.faces[face]).map(|v| self.vertices[v]);
        (b - a).norm()
    }

    /// Refuses vertices around which the cells do not lie in one sheet.
    pub(super) fn check_fans(&self) -> Result<(), MeshError> {
        let mut angles = vec![0.0; self.vertices.len()];
        let mut borders = vec![0_u8; self.vertices.len()];
        for cell in &self.cells {
            for k in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|j| self.vertices[cell[(k + j) % 3]]);
                angles[cell[k]] += (b - a).perp(&(c - a)).atan2((b - a).dot(&(c - a)));
            }
        }
        for face in self.faces.iter().filter(|face| face.plus.is_none()) {
            self.face_vertices(face).into_iter().for_each(|v| borders[v] = borders[v].saturating_add(1));
        }
        for (vertex, (&angle, &borders)) in angles.iter().zip(&borders).enumerate() {
            let x = self.vertices[vertex];
            if angle > TAU + ROUND || borders == 0 && (angle != 0.0 && angle < TAU - ROUND) {
                let what =
                    format!("the angles of the cells around this vertex add up to {:.1} degrees", angle.to_degrees());
                return Err(MeshError::Overlap { x: x.x, y: x.y, what });
            }
            if borders > 2 {
                return Err(MeshError::Pinched { x: x.x, y: x.y });
            }
        }
        Ok(())
    }

    /// The parts of the mesh that hang together by faces.
    pub fn parts(&self) -> Parts {
        let none = usize::MAX;
        let (mut of_cell, mut count) = (vec![none; self.cells.len()], 0);
        for first in 0..self.cells.len() {
            if of_cell[first] != none {
                continue;
            }
            let mut open = vec![first];
            of_cell[first] = count;
            while let Some(cell) = open.pop() {
                for other in (0..3).filter_map(|face| self.neighbour(cell, face)) {
                    if of_cell[other.cell] == none {
                        of_cell[other.cell] = count;
                        open.push(other.cell);
                    }
                }
            }
            count += 1;
        }
        Parts { of_cell, count }
    }
}

/// The connected parts of a mesh, numbered by their first cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parts {
    /// The part of each cell.
    pub of_cell: Vec<usize>,
    /// How many there are.
    pub count: usize,
}

/// How two pieces of the boundary lie.
enum Meeting {
    /// Apart, or with a point in common.
    Apart,
    Crossing(Point),
    /// One on the other, in the same direction.
    SameSide(Point),
    /// One on the other, in opposite directions.
    BackToBack,
}

fn ends(piece: &Piece) -> [Point; 2] {
    [Point::from(piece.geom().from), Point::from(piece.geom().to)]
}

/// Distance of two pieces that do not cross, and the place on the first where they are nearest.
fn nearest_points([a, b]: [Point; 2], [c, d]: [Point; 2]) -> (f64, Point) {
    let on = |x: Point, [p, q]: [Point; 2]| {
        let u = q - p;
        p + u * ((x - p).dot(&u) / u.norm_squared()).clamp(0.0, 1.0)
    };
    let from_first = [a, b].map(|x| ((on(x, [c, d]) - x).norm(), x));
    let from_second = [c, d].map(|x| (on(x, [a, b]), x)).map(|(at, x)| ((at - x).norm(), at));
    let all = from_first.into_iter().chain(from_second);
    all.min_by(|one, two| one.0.total_cmp(&two.0)).expect("four ends")
}

fn meeting([a, b]: [Point; 2], [c, d]: [Point; 2]) -> Meeting {
    let (u, w) = (b - a, d - c);
    let (length, other) = (u.norm(), w.norm());
    let near = NEAR * length.min(other);
    // where c and d lie along and beside a–b
    let along = [c, d].map(|x| (x - a).dot(&u) / length);
    let beside = [c, d].map(|x| u.perp(&(x - a)) / length);
    let (low, high) = (along[0].min(along[1]).max(0.0), along[0].max(along[1]).min(length));
    if high - low > 2.0 * near {
        // the distance at the ends of the common stretch
        let at = |s: f64| beside[0] + (s - along[0]) / (along[1] - along[0]) * (beside[1] - beside[0]);
        if at(low).abs() <= near && at(high).abs() <= near {
            let x = a + u * (0.5 * (low + high) / length);
            return if u.dot(&w) < 0.0 { Meeting::BackToBack } else { Meeting::SameSide(x) };
        }
    }
    let across = [a, b].map(|x| w.perp(&(x - c)) / other);
    let parted = |[p, q]: [f64; 2]| p.min(q) < -near && p.max(q) > near;
    if parted(beside) && parted(across) {
        return Meeting::Crossing(a + u * (across[0] / (across[0] - across[1])));
    }
    Meeting::Apart
}

/// Turns of the boundary around a point: pieces that a ray to the right meets upwards, less those it meets downwards.
fn turns(tree: &RTree<Piece>, x: Point) -> i64 {
    let reach = tree.root().envelope().upper()[0].max(x.x);
    let ray = AABB::from_corners([x.x, x.y], [reach, x.y]);
    let crossings = tree.locate_in_envelope_intersecting(ray).map(|piece| {
        let [a, b] = ends(piece);
        let right = (b - a).perp(&(x - a));
        match (a.y <= x.y, b.y <= x.y) {
            (true, false) if right > 0.0 => 1,
            (false, true) if right < 0.0 => -1,
            _ => 0,
        }
    });
    crossings.sum()
}
