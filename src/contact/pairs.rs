//! Which bodies and walls can meet: grids of cells, one for each power of two among the sizes, in a time about
//! proportional to their number.

use super::{Partner, Wall};
use crate::mesh::Point;

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

/// A box of a body or a wall.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: Point,
    high: Point,
}

impl Bounds {
    fn of_range(range: &Range) -> Self {
        let half = Point::repeat(range.half);
        Self { low: range.centre - half, high: range.centre + half }
    }

    /// Of walls that bodies are outside of; inside of a hollow one a body may be anywhere.
    fn of_wall(wall: &Wall) -> Option<Self> {
        match wall {
            Wall::Segment([p, q]) => Some(Self { low: p.inf(q), high: p.sup(q) }),
            Wall::Disc { centre, radius } => {
                let half = Point::repeat(*radius);
                Some(Self { low: centre - half, high: centre + half })
            }
            Wall::Hollow { .. } => None,
        }
    }

    fn meets(&self, other: &Self) -> bool {
        self.low.x <= other.high.x
            && other.low.x <= self.high.x
            && self.low.y <= other.high.y
            && other.low.y <= self.high.y
    }

    /// The power of two that is no less than its longest side.
    fn level(&self) -> i32 {
        let side = (self.high - self.low).max();
        let level = side.log2().ceil().clamp(-LEVELS, LEVELS) as i32;
        level + i32::from(2.0_f64.powi(level) < side)
    }
}

/// Largest power of two of a cell.
const LEVELS: f64 = 1000.0;

/// A body, or past them a wall, in the cell of its middle: its level, row and column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Item {
    cell: (i32, i64, i64),
    index: usize,
}

/// Items in cells that are no smaller than they are.
struct Grids {
    bounds: Vec<Option<Bounds>>,
    /// Ascending.
    items: Vec<Item>,
    /// Levels, and where their items are.
    levels: Vec<(i32, std::ops::Range<usize>)>,
}

impl Grids {
    fn new(bounds: Vec<Option<Bounds>>) -> Self {
        let place = |(index, bounds): (usize, &Option<Bounds>)| {
            let bounds = bounds.as_ref()?;
            let (level, middle) = (bounds.level(), 0.5 * (bounds.low + bounds.high));
            let size = 2.0_f64.powi(level);
            Some(Item { cell: (level, cell(middle.y, size), cell(middle.x, size)), index })
        };
        let mut items: Vec<Item> = bounds.iter().enumerate().filter_map(place).collect();
        items.sort_unstable();
        let mut levels: Vec<(i32, std::ops::Range<usize>)> = Vec::new();
        for (k, item) in items.iter().enumerate() {
            match levels.last_mut() {
                Some((level, range)) if *level == item.cell.0 => range.end = k + 1,
                _ => levels.push((item.cell.0, k..k + 1)),
            }
        }
        Self { bounds, items, levels }
    }

    /// Calls with every pair of items that meet, the lower first; each once.
    fn meetings(&self, mut found: impl FnMut(usize, usize)) {
        for (at, item) in self.items.iter().enumerate() {
            let Some(own) = &self.bounds[item.index] else { continue };
            let first = self.levels.partition_point(|(level, _)| *level < item.cell.0);
            for (level, range) in &self.levels[first..] {
                // of the same level those that follow see the ones before
                let same = *level == item.cell.0;
                let items = &self.items[if same { at + 1 } else { range.start }..range.end];
                // half a cell for the size of the others, and rounding
                let size = 2.0_f64.powi(*level);
                let (low, high) = (own.low.add_scalar(-0.51 * size), own.high.add_scalar(0.51 * size));
                let (mut row, last) = (if same { item.cell.1 } else { cell(low.y, size) }, cell(high.y, size));
                let columns = cell(low.x, size)..=cell(high.x, size);
                loop {
                    let start = items.partition_point(|other| (other.cell.1, other.cell.2) < (row, *columns.start()));
                    let Some(next) = items.get(start).filter(|next| next.cell.1 <= last) else { break };
                    if next.cell.1 > row {
                        row = next.cell.1;
                        continue;
                    }
                    let of_row = items[start..].iter().take_while(|o| o.cell.1 == row && o.cell.2 <= *columns.end());
                    for other in of_row {
                        if self.bounds[other.index].is_some_and(|bounds| bounds.meets(own)) {
                            found(item.index.min(other.index), item.index.max(other.index));
                        }
                    }
                    if row == last {
                        break;
                    }
                    row += 1;
                }
            }
        }
    }
}

/// The cell of a coordinate; the last one of those too far away.
fn cell(x: f64, size: f64) -> i64 {
    (x / size).floor() as i64
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
    let bounds = ranges.iter().map(|range| Some(Bounds::of_range(range))).chain(walls.iter().map(Bounds::of_wall));
    let mut pairs = Pairs::default();
    let mut note = |body: usize, partner: Partner| {
        let pushed = ranges[body].moves
            || match partner {
                Partner::Body(other) => ranges[other].moves,
                Partner::Wall(_) => false,
            };
        let list = if pushed { &mut pairs.pushed } else { &mut pairs.given };
        list.push(Pair { body, partner });
    };
    Grids::new(bounds.collect()).meetings(|first, second| {
        // walls never meet
        if second < n {
            note(first, Partner::Body(second));
        } else if first < n {
            note(first, Partner::Wall(second - n));
        }
    });
    for (index, wall) in walls.iter().enumerate() {
        if let Wall::Hollow { centre, radius } = wall {
            let near = ranges.iter().enumerate().filter(|(_, range)| reaches(range, *centre, *radius));
            near.for_each(|(body, _)| note(body, Partner::Wall(index)));
        }
    }
    pairs.pushed.sort_unstable();
    pairs.given.sort_unstable();
    pairs
}
