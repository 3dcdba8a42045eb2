//! Discs at random without overlap, and what overlaps at the start.

use std::collections::HashMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::body::{Body, Hold};
use crate::contact::gap::{Placed, Touch, touches};
use crate::contact::pairs::{self, Pair, Range};
use crate::contact::{Partner, Wall, Walls};
use crate::mesh::Point;
use crate::shape::outline::Piece;
use crate::shape::{Pose, Shape};

/// Where discs are placed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Region {
    /// Lower left and upper right corner; the discs lie within.
    Box([Point; 2]),
    /// The discs lie within.
    Disc { centre: Point, radius: f64 },
}

impl Region {
    /// Area.
    pub fn area(&self) -> f64 {
        match self {
            Region::Box([low, high]) => (high.x - low.x) * (high.y - low.y),
            Region::Disc { radius, .. } => std::f64::consts::PI * radius * radius,
        }
    }

    /// The largest disc that fits.
    pub fn inradius(&self) -> f64 {
        match self {
            Region::Box([low, high]) => 0.5 * (high.x - low.x).min(high.y - low.y),
            Region::Disc { radius, .. } => *radius,
        }
    }

    /// A uniform centre for a disc of this radius.
    fn draw(&self, radius: f64, random: &mut ChaCha8Rng) -> Point {
        match self {
            Region::Box([low, high]) => {
                let mut along = |a: f64, b: f64| a + radius + (b - a - 2.0 * radius) * random.random::<f64>();
                let x = along(low.x, high.x);
                Point::new(x, along(low.y, high.y))
            }
            Region::Disc { centre, radius: whole } => {
                let r = (whole - radius) * random.random::<f64>().sqrt();
                let (s, c) = (std::f64::consts::TAU * random.random::<f64>()).sin_cos();
                centre + r * Point::new(c, s)
            }
        }
    }
}

/// Tries per disc before the region counts as full.
const TRIES: usize = 20_000;

/// The radii in the order of their discs, from the same seed always the same.
pub fn radii(count: usize, [low, high]: [f64; 2], seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| low + (high - low) * random.random::<f64>()).collect()
}

/// Centres of discs at random, no two of which overlap each other, the `others` or a wall; the largest are placed
/// first.
///
/// # Errors
/// The share of the region that could be filled.
pub fn scatter(
    region: &Region,
    radii: &[f64],
    seed: u64,
    others: &[(Shape, Pose)],
    walls: &[Wall],
) -> Result<Vec<Point>, f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // the radii have the numbers of this seed already
    random.set_stream(1);
    let mut order: Vec<usize> = (0..radii.len()).collect();
    order.sort_by(|&a, &b| radii[b].total_cmp(&radii[a]));
    let widest = radii.iter().copied().fold(0.0, f64::max);
    let mut grid = Grid::new(2.0 * widest);
    let mut large = Vec::new();
    for (shape, pose) in others {
        match shape.circumradius() {
            radius if radius <= widest => grid.add(pose.position, radius),
            _ => large.push((shape, pose)),
        }
    }
    let mut centres = vec![Point::zeros(); radii.len()];
    let mut filled = 0.0;
    for at in order {
        let radius = radii[at];
        let free = |x: &Point| {
            !grid.meets(*x, radius)
                && walls.iter().all(|wall| disc_to_wall(*x, radius, wall) >= 0.0)
                && large.iter().all(|(shape, pose)| (x - pose.position).norm() >= radius + shape.circumradius())
        };
        let mut tries = (0..TRIES).map(|_| region.draw(radius, &mut random));
        let Some(centre) = tries.find(free) else { return Err(filled / region.area()) };
        grid.add(centre, radius);
        filled += std::f64::consts::PI * radius * radius;
        centres[at] = centre;
    }
    Ok(centres)
}

/// Discs in square cells at least as wide as the widest of them.
#[derive(Debug)]
struct Grid {
    width: f64,
    cells: HashMap<(i64, i64), Vec<(Point, f64)>>,
}

impl Grid {
    fn new(width: f64) -> Self {
        Self { width, cells: HashMap::new() }
    }

    fn cell(&self, x: Point) -> (i64, i64) {
        ((x.x / self.width).floor() as i64, (x.y / self.width).floor() as i64)
    }

    fn add(&mut self, x: Point, radius: f64) {
        self.cells.entry(self.cell(x)).or_default().push((x, radius));
    }

    fn meets(&self, x: Point, radius: f64) -> bool {
        let (i, j) = self.cell(x);
        (-1..=1)
            .flat_map(|a| (-1..=1).map(move |b| (i + a, j + b)))
            .any(|cell| self.cells.get(&cell).into_iter().flatten().any(|(y, other)| (x - y).norm() < radius + other))
    }
}

/// Gap between a disc and a wall, whichever side of a segment it is on.
fn disc_to_wall(x: Point, radius: f64, wall: &Wall) -> f64 {
    match wall {
        Wall::Segment([a, b]) => {
            let along = b - a;
            let share = ((x - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            (x - a - share * along).norm() - radius
        }
        Wall::Disc { centre, radius: other } => (x - centre).norm() - other - radius,
        Wall::Hollow { centre, radius: other } => other - (x - centre).norm() - radius,
    }
}

/// What overlaps at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Overlap {
    /// Two bodies, and how deep.
    Bodies(usize, usize, f64),
    /// Two bodies about one point.
    Coincident(usize, usize),
    /// A body and a wall, and how deep.
    Wall(usize, usize, f64),
}

/// Deeper than this share of a body's size is an overlap.
const TOUCHING: f64 = 1e-9;

/// The first overlap of bodies with each other or with walls. `ignore` tells pairs and bodies that nothing moves.
pub fn first_overlap(bodies: &[Body], walls: &[Wall], immobile: &dyn Fn(&Body) -> bool) -> Option<Overlap> {
    if let Some((at, number, depth)) = first_in_wall(bodies, walls, immobile) {
        return Some(Overlap::Wall(at, number, depth));
    }
    let mut by_x: Vec<usize> = (0..bodies.len()).collect();
    let left = |at: &usize| bodies[*at].start.position.x - bodies[*at].shape.circumradius();
    by_x.sort_by(|a, b| left(a).total_cmp(&left(b)).then(a.cmp(b)));
    let mut found: Vec<Overlap> = Vec::new();
    for (k, &i) in by_x.iter().enumerate() {
        let right = bodies[i].start.position.x + bodies[i].shape.circumradius();
        for &j in by_x[k + 1..].iter().take_while(|j| left(j) <= right) {
            let (a, b) = (i.min(j), i.max(j));
            found.extend(overlap(bodies, a, b, immobile));
        }
    }
    let names = |overlap: &Overlap| match *overlap {
        Overlap::Bodies(a, b, _) | Overlap::Coincident(a, b) | Overlap::Wall(a, b, _) => (a, b),
    };
    found.into_iter().min_by_key(names)
}

/// The first two that a margin would part at once by more than half of the thickness of the thinner one, and their gap.
pub fn first_crowded(bodies: &[Body], walls: &[Wall], margin: f64) -> Option<(usize, Partner, f64)> {
    let range = |body: &Body| {
        let moves = match body.hold {
            Hold::Free | Hold::Pinned(_) => true,
            Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => false,
        };
        Range { centre: body.start.position, half: body.shape.circumradius() + margin, moves }
    };
    let ranges: Vec<Range> = bodies.iter().map(range).collect();
    let all = Walls::new(walls);
    let mut near = Vec::new();
    pairs::find(&ranges, walls).pushed.into_iter().find_map(|Pair { body: at, partner }| {
        near.clear();
        let first = Placed::new(&bodies[at].shape, &bodies[at].start);
        let mut thin = bodies[at].shape.inradius();
        match partner {
            Partner::Body(other) => {
                let other = &bodies[other];
                thin = thin.min(other.shape.inradius());
                touches(&first, &Placed::new(&other.shape, &other.start), margin, &mut near);
            }
            Partner::Wall(wall) => all.touches(wall, &first, margin, &mut near),
        }
        let gap = near.iter().map(|touch| touch.gap).reduce(f64::min)?;
        (margin - gap > thin).then_some((at, partner, gap))
    })
}

/// Why a margin is too large, and what to do.
pub fn crowded_rule(body: &str, partner: &str, gap: f64) -> (String, String) {
    let rule = format!(
        "is too large for the gap of {gap:.3e} that `{body}` and {partner} have at the start: the first step would \
         throw them apart by more than \
         half of a body"
    );
    (rule, "take a smaller margin, or place the bodies farther apart".into())
}

/// What overlaps among bodies whose motion is given, and walls: nothing parts it.
pub fn given_overlap(bodies: &[Body], walls: &[Wall]) -> Option<String> {
    let given: Vec<Body> = bodies
        .iter()
        .filter(|body| match body.hold {
            Hold::Free | Hold::Pinned(_) => false,
            Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => true,
        })
        .cloned()
        .collect();
    let name = |at: usize| format!("`{}`", given[at].name);
    let (first, second, depth) = match first_overlap(&given, walls, &|_| false)? {
        Overlap::Bodies(a, b, depth) => (name(a), name(b), depth),
        Overlap::Coincident(a, b) => (name(a), name(b), given[a].shape.inradius() + given[b].shape.inradius()),
        Overlap::Wall(a, wall, depth) => (name(a), format!("wall {}", wall + 1), depth),
    };
    Some(format!(
        "{first} and {second} overlap by {depth:.3e} at the start: the motion of both is given, and nothing parts them"
    ))
}

/// The first body that overlaps a wall, the wall, and how deep.
pub fn first_in_wall(bodies: &[Body], walls: &[Wall], immobile: &dyn Fn(&Body) -> bool) -> Option<(usize, usize, f64)> {
    let all = Walls::new(walls);
    let mut near = Vec::new();
    for (at, body) in bodies.iter().enumerate().filter(|(_, body)| !immobile(body)) {
        let placed = Placed::new(&body.shape, &body.start);
        for number in 0..walls.len() {
            near.clear();
            all.touches(number, &placed, 0.0, &mut near);
            let depth = deepest(&near);
            if depth > TOUCHING * body.shape.circumradius() {
                return Some((at, number, depth));
            }
        }
    }
    None
}

/// Depth of the deepest overlap, 0 without one.
fn deepest(near: &[Touch]) -> f64 {
    near.iter().map(|touch| -touch.gap).fold(0.0, f64::max)
}

/// Points all around a body, and its centre.
pub fn outline(shape: &Shape, pose: &Pose) -> Vec<Point> {
    const ON_A_TURN: f64 = 64.0;
    const ON_A_SIDE: usize = 16;
    let along = |piece: Piece| {
        let (from, to) = piece.range();
        let count = match piece {
            Piece::Segment { .. } => ON_A_SIDE,
            Piece::Arc { .. } => (ON_A_TURN * (to - from) / std::f64::consts::TAU).ceil() as usize,
        };
        (0..count).map(move |k| piece.at(from + (to - from) * k as f64 / count as f64))
    };
    shape.at(*pose).boundary().into_iter().flat_map(along).chain([pose.position]).collect()
}

fn overlap(bodies: &[Body], i: usize, j: usize, immobile: &dyn Fn(&Body) -> bool) -> Option<Overlap> {
    let (a, b) = (&bodies[i], &bodies[j]);
    let apart = (a.start.position - b.start.position).norm();
    let size = a.shape.circumradius().min(b.shape.circumradius());
    if apart <= TOUCHING * size {
        return Some(Overlap::Coincident(i, j));
    }
    if apart >= a.shape.circumradius() + b.shape.circumradius() {
        return None;
    }
    let mut near = Vec::new();
    touches(&Placed::new(&a.shape, &a.start), &Placed::new(&b.shape, &b.start), 0.0, &mut near);
    let depth = deepest(&near);
    let deep = depth > TOUCHING * size && !(immobile(a) && immobile(b));
    deep.then_some(Overlap::Bodies(i, j, depth))
}
