//! Which bodies and walls can meet: a tree of bounding boxes, whatever their sizes, in a time about proportional to
//! their number.

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::{Partner, Wall};
use crate::mesh::Point;

/// A box with an index into bodies, or past them into walls.
type Item = GeomWithData<Rectangle<[f64; 2]>, usize>;

/// Centre and half of the side of a square that a body does not leave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Middle of the box.
    pub centre: Point,
    /// Half the side of the box.
    pub half: f64,
    /// Whether forces and contact move it; two that are not never push each other.
    pub moves: bool,
}

impl Range {
    fn corners(&self) -> ([f64; 2], [f64; 2]) {
        let (c, h) = (self.centre, self.half);
        ([c.x - h, c.y - h], [c.x + h, c.y + h])
    }
}

fn wall_box(wall: &Wall) -> Option<Rectangle<[f64; 2]>> {
    match wall {
        Wall::Segment([p, q]) => Some(Rectangle::from_corners([p.x, p.y], [q.x, q.y])),
        Wall::Disc { centre: c, radius: r } => Some(Rectangle::from_corners([c.x - r, c.y - r], [c.x + r, c.y + r])),
        // a body may be anywhere inside
        Wall::Hollow { .. } => None,
    }
}

/// Whether a square may reach the circle from inside.
fn reaches(range: &Range, centre: Point, radius: f64) -> bool {
    (range.centre - centre).norm() + std::f64::consts::SQRT_2 * range.half >= radius
}

/// A body and what it may touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pair {
    /// The first body, of the lower index.
    pub body: usize,
    /// What it is near to.
    pub partner: Partner,
}

/// Pairs whose ranges meet, in ascending order: every body with its partners of higher index, then with walls.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Pairs {
    /// Of which one at least moves.
    pub pushed: Vec<Pair>,
    /// That nothing parts: the motion of both is given.
    pub given: Vec<Pair>,
}

/// Finds the pairs.
pub fn find(ranges: &[Range], walls: &[Wall]) -> Pairs {
    let n = ranges.len();
    let bodies = ranges.iter().enumerate().map(|(index, range)| {
        let (low, high) = range.corners();
        Item::new(Rectangle::from_corners(low, high), index)
    });
    let fixed = walls.iter().enumerate().filter_map(|(index, wall)| Some(Item::new(wall_box(wall)?, n + index)));
    let tree = RTree::bulk_load(bodies.chain(fixed).collect());
    let hollows: Vec<(usize, Point, f64)> = walls
        .iter()
        .enumerate()
        .filter_map(|(index, wall)| match wall {
            Wall::Hollow { centre, radius } => Some((index, *centre, *radius)),
            Wall::Segment(_) | Wall::Disc { .. } => None,
        })
        .collect();
    let mut pairs = Pairs::default();
    let mut found = Vec::new();
    for (i, range) in ranges.iter().enumerate() {
        let (low, high) = range.corners();
        found.clear();
        for item in tree.locate_in_envelope_intersecting(AABB::from_corners(low, high)) {
            if item.data >= n {
                found.push(Partner::Wall(item.data - n));
            } else if item.data > i {
                found.push(Partner::Body(item.data));
            }
        }
        let near = hollows.iter().filter(|(_, centre, radius)| reaches(range, *centre, *radius));
        found.extend(near.map(|(index, ..)| Partner::Wall(*index)));
        found.sort_unstable();
        for &partner in &found {
            let pushed = range.moves
                || match partner {
                    Partner::Body(other) => ranges[other].moves,
                    Partner::Wall(_) => false,
                };
            let list = if pushed { &mut pairs.pushed } else { &mut pairs.given };
            list.push(Pair { body: i, partner });
        }
    }
    pairs
}
