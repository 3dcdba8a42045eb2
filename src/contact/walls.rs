//! Gaps between shapes and walls.

use super::Wall;
use super::gap::{Core, Placed, Touch, touches};
use super::smooth::maxima;
use crate::mesh::Point;
use crate::shape::Shape;

/// Walls, with how their segments follow each other, so that a body slides over the joint of two segments as over one.
#[derive(Debug, Clone)]
pub struct Walls {
    walls: Vec<Wall>,
    /// Of each wall as a shape: segments and discs.
    placed: Vec<Option<Placed>>,
    /// Directions of the segments before and after each segment.
    before: Vec<Option<Point>>,
    after: Vec<Option<Point>>,
}

fn direction(wall: &Wall) -> Option<Point> {
    match wall {
        Wall::Segment([p, q]) => Some((q - p).normalize()),
        Wall::Disc { .. } | Wall::Hollow { .. } => None,
    }
}

impl Walls {
    /// Segments that share an end, to the bit, follow each other.
    pub fn new(walls: &[Wall]) -> Self {
        let bits = |p: Point| (p.x.to_bits(), p.y.to_bits());
        let mut starts = std::collections::BTreeMap::new();
        let mut ends = std::collections::BTreeMap::new();
        for (index, wall) in walls.iter().enumerate() {
            if let Wall::Segment([p, q]) = wall {
                starts.insert(bits(*p), index);
                ends.insert(bits(*q), index);
            }
        }
        let neighbour = |map: &std::collections::BTreeMap<(u64, u64), usize>, p: Point| {
            map.get(&bits(p)).and_then(|index| direction(&walls[*index]))
        };
        let before = walls.iter().map(|wall| match wall {
            Wall::Segment([p, _]) => neighbour(&ends, *p),
            Wall::Disc { .. } | Wall::Hollow { .. } => None,
        });
        let after = walls.iter().map(|wall| match wall {
            Wall::Segment([_, q]) => neighbour(&starts, *q),
            Wall::Disc { .. } | Wall::Hollow { .. } => None,
        });
        let placed = walls.iter().map(|wall| match wall {
            Wall::Segment([p, q]) => {
                Some(Placed { core: Core::Corners(vec![*p, *q]), radius: 0.0, centre: 0.5 * (p + q) })
            }
            Wall::Disc { centre, radius } => {
                Some(Placed { core: Core::Point(*centre), radius: *radius, centre: *centre })
            }
            Wall::Hollow { .. } => None,
        });
        Self { placed: placed.collect(), before: before.collect(), after: after.collect(), walls: walls.to_vec() }
    }

    /// Number of walls.
    pub fn len(&self) -> usize {
        self.walls.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.walls.is_empty()
    }

    /// The walls themselves.
    pub fn all(&self) -> &[Wall] {
        &self.walls
    }

    /// Where `body` is near wall `index`, with places within `reach` of touching.
    pub fn touches(&self, index: usize, body: &Placed, reach: f64, out: &mut Vec<Touch>) {
        let start = out.len();
        match (&self.walls[index], &self.placed[index]) {
            (Wall::Hollow { centre, radius }, _) => hollow(body, *centre, *radius, reach, out),
            (Wall::Segment(_) | Wall::Disc { .. }, Some(wall)) => touches(body, wall, reach, out),
            (Wall::Segment(_) | Wall::Disc { .. }, None) => unreachable!("segments and discs have a shape"),
        }
        if let Wall::Segment(ends) = &self.walls[index] {
            self.drop_joints(index, *ends, start, out);
        }
    }

    /// Drops touches of the end of a segment that the segment beside it takes over: those whose normal lies outside of
    /// the normals that a body can meet at the corner. Between two segments in line none is left.
    fn drop_joints(&self, index: usize, ends: [Point; 2], start: usize, out: &mut Vec<Touch>) {
        let along = (ends[1] - ends[0]).normalize();
        let slack = 1e-9;
        let mut kept = start;
        for k in start..out.len() {
            let touch = out[k];
            let (to_start, to_end) = ((touch.on_second - ends[0]).norm(), (touch.on_second - ends[1]).norm());
            let size = 1e-12 * (ends[1] - ends[0]).norm();
            let towards = -touch.normal;
            let lost = match (self.before[index], self.after[index]) {
                (Some(_), _) if to_start <= size => towards.dot(&along) < -slack,
                (_, Some(next)) if to_end <= size => towards.dot(&along) > slack && towards.dot(&next) > slack,
                _ => false,
            };
            if !lost {
                out[kept] = touch;
                kept += 1;
            }
        }
        out.truncate(kept);
    }
}

/// `R = (1/r + 1/r')²` between a body of radius r and a wall of radius r': infinite of flat ones, negative of hollow
/// ones.
pub(super) fn resistance(radius: f64, wall: &Wall) -> f64 {
    match wall {
        Wall::Segment(_) => 1.0 / (radius * radius),
        Wall::Disc { radius: other, .. } => ((radius + other) / (radius * other)).powi(2),
        Wall::Hollow { radius: other, .. } => ((other - radius) / (radius * other)).powi(2),
    }
}

/// Radius of a shape in the lubrication of its contacts: that of the disc of its area.
pub(super) fn equivalent_radius(shape: &Shape) -> f64 {
    shape.round_radius().unwrap_or_else(|| (shape.area() / std::f64::consts::PI).sqrt())
}

/// The touch with a hollow disc of the point of a core at `p`.
fn inside(slot: u32, p: Point, body: &Placed, centre: Point, radius: f64) -> Touch {
    let distance = (p - centre).norm();
    let normal = if distance > 0.0 { (p - centre) / distance } else { Point::new(1.0, 0.0) };
    Touch {
        slot,
        gap: radius - distance - body.radius,
        normal,
        on_first: p + body.radius * normal,
        on_second: centre + radius * normal,
    }
}

/// `D = R − max_y |y − c| − r`, with every corner, or both ends of an ellipse, that is within `reach` of touching.
fn hollow(body: &Placed, centre: Point, radius: f64, reach: f64, out: &mut Vec<Touch>) {
    let consider = |touch: Touch, out: &mut Vec<Touch>| {
        if touch.gap <= reach {
            out.push(touch);
        }
    };
    match &body.core {
        Core::Point(p) => out.push(inside(0, *p, body, centre, radius)),
        Core::Corners(corners) => {
            for (k, p) in corners.iter().enumerate() {
                consider(inside(1 + k as u32, *p, body, centre, radius), out);
            }
        }
        Core::Ellipse { centre: middle, semi_axes: [a, b], direction } => {
            let other = Point::new(-direction.y, direction.x);
            let at = |t: f64| middle + (a * t.cos()) * direction + (b * t.sin()) * other;
            let tangent = |t: f64| (-a * t.sin()) * direction + (b * t.cos()) * other;
            maxima(
                |t| (at(t) - centre).dot(&tangent(t)),
                |t| {
                    let slot = if t.cos() > 0.0 { 0 } else { 1 };
                    consider(inside(slot, at(t), body, centre, radius), out);
                },
            );
        }
    }
}
