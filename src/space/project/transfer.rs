//! A field of one mesh on another.

use std::sync::Arc;

use super::breaks::{Piece, WHOLE, fan, quarters};
use super::cell_by_cell;
use super::moments::{Cell, Masses, Moments};
use crate::mesh::locate::{Locator, straight_inverse};
use crate::mesh::{CellMap, Mesh, Point};
use crate::space::{Field, Space};

/// A point of the new mesh counts as covered if it misses a cell of the old one by this share: boundaries are meshed
/// differently.
const SLACK: f64 = 0.05;
/// Cells that the old ones cover up to this share are cut along them.
const COVERED: f64 = 1e-9;
/// Other cells, those at curved boundaries, are divided in four so often.
const HALVINGS: u32 = 3;

/// A point that the mesh of the field does not cover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NotCovered(pub Point);

/// The L² projection of a field of another mesh on a discontinuous space.
///
/// Cells that straight cells of the other mesh cover are cut along those, and the field is integrated exactly: where
/// two meshes of straight cells cover the same domain, the integral of the field is kept to rounding. Cells at curved
/// boundaries are integrated by a fine rule. On the same mesh nothing is lost, and the same space gives the same bits.
///
/// # Errors
/// A point that the other mesh does not cover.
pub fn transfer(space: &Arc<Space>, field: &Field) -> Result<Field, NotCovered> {
    match space.components {
        1 => components::<1>(space, field),
        _ => components::<2>(space, field),
    }
}

fn components<const C: usize>(space: &Arc<Space>, field: &Field) -> Result<Field, NotCovered> {
    let (here, there) = (&space.mesh, &field.space.mesh);
    let same = Arc::ptr_eq(here, there) || here.fingerprint() == there.fingerprint();
    if same && (space.degree, space.continuity) == (field.space.degree, field.space.continuity) {
        return Ok(Field::new(space, field.values.clone()));
    }
    let masses = Masses::new(space.degree);
    let degree = space.degree + field.space.degree;
    let locator = Locator::new(there);
    cell_by_cell(space, |index| {
        let cell = Cell::new(here, index, &masses);
        let value = |from: usize, xi: Point| -> [f64; C] { std::array::from_fn(|c| field.component_at(from, xi, c)) };
        if same {
            return cell.solve(&cell.moments(&WHOLE, degree, [0.0; C], &|xi, _| Ok(value(index, xi)))?);
        }
        let near = |x: Point| locator.locate_near(there, x, SLACK).ok_or(NotCovered(x));
        let (from, xi) = near(cell.map.at(Point::repeat(1.0 / 3.0)).0)?;
        let mut sum = Moments::none(value(from, xi));
        match overlaps(here, index, there, &locator) {
            Some(parts) => {
                for (from, piece) in parts {
                    let inside = |x: Point| straight_inverse(there, from, x).expect("the cell was cut along");
                    sum.add(&cell.moments(&piece, degree, sum.offset(), &|_, x| Ok(value(from, inside(x))))?);
                }
            }
            None => {
                let located = |_, x: Point| near(x).map(|(from, xi)| value(from, xi));
                for piece in divided() {
                    sum.add(&cell.moments(&piece, degree, sum.offset(), &located)?);
                }
            }
        }
        cell.solve(&sum)
    })
}

/// The reference cell in equal pieces.
fn divided() -> Vec<Piece> {
    (0..HALVINGS).fold(vec![WHOLE], |pieces, _| pieces.into_iter().flat_map(quarters).collect())
}

/// The parts of a straight cell in the straight cells of another mesh, in reference coordinates; `None` where these do
/// not cover it.
fn overlaps(here: &Mesh, cell: usize, there: &Mesh, locator: &Locator) -> Option<Vec<(usize, Piece)>> {
    let CellMap::Affine { origin, jacobian } = here.map(cell) else { return None };
    let corners = here.corners(cell);
    let [a, b, c] = corners;
    let inverse = jacobian.try_inverse()?;
    let mut candidates = Vec::new();
    locator.visit_box(a.inf(&b).inf(&c), a.sup(&b).sup(&c), |from| candidates.push(from));
    candidates.sort_unstable();
    let mut parts = Vec::new();
    let mut covered = 0.0;
    for from in candidates.into_iter().filter(|&from| there.curved[from].is_none()) {
        let other = there.corners(from).map(|x| inverse * (x - origin));
        let polygon = (0..3).fold(WHOLE.to_vec(), |polygon, k| left_of(&polygon, other[k], other[(k + 1) % 3]));
        for piece in fan(&polygon) {
            covered += super::breaks::twice_area(&piece);
            parts.push((from, piece));
        }
    }
    ((covered - 1.0).abs() <= COVERED).then_some(parts)
}

/// The part of a convex polygon to the left of the line from `a` to `b`.
fn left_of(polygon: &[Point], a: Point, b: Point) -> Vec<Point> {
    let height = |x: &Point| (b - a).perp(&(x - a));
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (k, x) in polygon.iter().enumerate() {
        let next = &polygon[(k + 1) % polygon.len()];
        let (here, there) = (height(x), height(next));
        if here >= 0.0 {
            kept.push(*x);
        }
        if here * there < 0.0 {
            kept.push(x + (next - x) * (here / (here - there)));
        }
    }
    kept
}
