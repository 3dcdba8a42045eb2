//! The velocity of nodes where faces of several boundary tags meet.
//!
//! Every tag keeps its normal component: `v·n_A = v_A·n_A`, `v·n_B = v_B·n_B`, on slip walls `v·n = 0`. So a corner
//! of an inlet has the velocity of what flows in along the wall, and a corner of a moving lid rests. Where the tags
//! lie in one line there is one normal component for both: that of the wall which lets nothing through, and the
//! tangential one of the wall that moves.
//!
//! On Dirichlet faces `n` is the mean of the normals that the node's shape function φ sees, `∫ φ n ds`, so that
//! no wall at rest leaks (M. S. Engelman, R. L. Sani, P. M. Gresho, The implementation of normal and/or tangential
//! boundary conditions in finite element codes for incompressible fluid flow, Int. J. Numer. Meth. Fluids 2, 1982,
//! doi:10.1002/fld.1650020302).

use super::super::boundary::Conditions;
use super::CORNER;
use crate::expression::ExpressionError;
use crate::mesh::Point;

/// A velocity keeps a normal component that differs by this share of its length: rounding.
const ROUNDING: f64 = 1e-12;
/// Walls whose normals differ by less than this angle lie in one line.
const ALIGNED: f64 = 1e-6;

/// A boundary face at a node.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub tag: usize,
    /// Outwards.
    pub normal: Point,
    /// Length of the face.
    pub length: f64,
}

/// A wall at the corner: its normal, and the velocity along it that it asks for.
struct Wall {
    normal: Point,
    through: f64,
    scale: f64,
}

impl Wall {
    fn is_closed(&self) -> bool {
        self.through.abs() <= ROUNDING * self.scale
    }

    fn is_kept_by(&self, v: Point) -> bool {
        (v.dot(&self.normal) - self.through).abs() <= ROUNDING * (v.norm() + self.scale)
    }
}

/// The velocity at time `t` of a node at `x` where `pieces` meet, at least one of them Dirichlet.
///
/// # Errors
/// A Dirichlet formula that is not finite there.
pub(super) fn velocity(
    pieces: &[Piece],
    conditions: &[Conditions],
    x: Point,
    t: f64,
) -> Result<Point, ExpressionError> {
    let (mut walls, mut given) = (Vec::new(), Vec::new());
    for (at, piece) in pieces.iter().enumerate() {
        let condition = &conditions[piece.tag].velocity;
        if let Some([first, second]) = condition.value() {
            let v = Point::new(first.try_eval(x, t)?, second.try_eval(x, t)?);
            walls.push(Wall { normal: piece.normal, through: v.dot(&piece.normal), scale: v.norm() });
            // a tag that passes the node has two faces there, and one value
            if !pieces[..at].iter().any(|earlier| earlier.tag == piece.tag) {
                given.push(v);
            }
        } else if condition.is_impermeable() {
            walls.push(Wall { normal: piece.normal, through: 0.0, scale: 0.0 });
        }
    }
    Ok(joined(&walls, &given))
}

/// The velocity that keeps the normal components of `walls`, of the velocities `given` on some of them.
fn joined(walls: &[Wall], given: &[Point]) -> Point {
    let keeping: Vec<Point> = given.iter().copied().filter(|v| walls.iter().all(|wall| wall.is_kept_by(*v))).collect();
    if let Some(v) = mean_of_moving(&keeping) {
        return v;
    }
    let (closed, open): (Vec<&Wall>, Vec<&Wall>) = walls.iter().partition(|wall| wall.is_closed());
    let Some(first) = closed.first() else { return through_both(&open, given) };
    if closed.iter().any(|wall| wall.normal.perp(&first.normal).abs() > ALIGNED) {
        return Point::zeros();
    }
    let along = Point::new(-first.normal.y, first.normal.x);
    let steep = open.iter().max_by(|a, b| along.dot(&a.normal).abs().total_cmp(&along.dot(&b.normal).abs()));
    match steep {
        Some(wall) if along.dot(&wall.normal).abs() > CORNER.sin() => {
            clean(along * (wall.through / along.dot(&wall.normal)))
        }
        Some(_) | None => {
            let moving: Vec<Point> = given.iter().map(|v| along * along.dot(v)).collect();
            mean_of_moving(&moving).map_or(Point::zeros(), clean)
        }
    }
}

/// The velocity with the normal components of two walls that something passes, if they meet at an angle; else the
/// mean of the given ones.
fn through_both(open: &[&Wall], given: &[Point]) -> Point {
    let first = open[0];
    let second = open.iter().max_by(|a, b| {
        let turn = |wall: &Wall| first.normal.perp(&wall.normal).abs();
        turn(a).total_cmp(&turn(b))
    });
    match second {
        Some(second) if first.normal.perp(&second.normal).abs() > CORNER.sin() => {
            let ([a, b], det) = ([first.normal, second.normal], first.normal.perp(&second.normal));
            let (p, q) = (first.through, second.through);
            clean(Point::new(p * b.y - q * a.y, q * a.x - p * b.x) / det)
        }
        Some(_) | None => mean_of_moving(given).unwrap_or_default(),
    }
}

/// The mean of those that are not zero; zero if there are others alone.
fn mean_of_moving(all: &[Point]) -> Option<Point> {
    let moving: Vec<&Point> = all.iter().filter(|v| v.amax() > 0.0).collect();
    match (all.is_empty(), moving.len()) {
        (true, _) => None,
        (false, 0) => Some(Point::zeros()),
        (false, count) => Some(moving.into_iter().sum::<Point>() / count as f64),
    }
}

/// Without the sign of zeros.
fn clean(v: Point) -> Point {
    v.map(|c| c + 0.0)
}
