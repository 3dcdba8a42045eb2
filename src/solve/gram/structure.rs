//! The order of elimination, and the fronts.

use std::ops::Range;

use super::Rows;
use crate::solve::sparse::least_degree;

/// Pivots that fronts are filled up to, where the zeros that this adds are few.
const FULL: usize = 8;

/// A dense front: pivots first, then the boundary, the later unknowns that the pivots couple to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Front {
    /// The first pivot, and their number.
    pub start: usize,
    pub pivots: usize,
    /// Where its boundary is, of all of them, and its length.
    pub edge: usize,
    pub boundary: usize,
    /// `u32::MAX` without one.
    pub parent: u32,
    /// Where its rows are.
    pub rows: (u32, u32),
    /// Where its numbers are.
    pub numbers: usize,
}

impl Front {
    /// Distance of columns of the panel, whose last three rows are zero.
    pub fn stride(&self) -> usize {
        self.pivots + self.boundary + 3
    }

    /// Distance of columns of what is handed on.
    pub fn rest_stride(&self) -> usize {
        self.boundary + 3
    }

    /// Where the panel is.
    pub fn panel(&self) -> Range<usize> {
        self.numbers..self.numbers + self.stride() * self.pivots
    }

    /// Where that is which it hands on.
    pub fn rest(&self) -> Range<usize> {
        let start = self.panel().end;
        start..start + self.rest_stride() * self.boundary
    }

    pub fn edges(&self) -> Range<usize> {
        self.edge..self.edge + self.boundary
    }
}

#[derive(Debug, Default)]
pub(super) struct Structure {
    /// Unknown at every place of the elimination, and the place of every unknown.
    pub order: Vec<u32>,
    pub place: Vec<u32>,
    pub fronts: Vec<Front>,
    /// Places of the boundaries, ascending in each, and their rows in the parent's front.
    pub boundaries: Vec<u32>,
    pub into_parent: Vec<u32>,
    /// Rows of B by the front that takes them, the front of each, and the rows of their entries in that front.
    pub rows: Vec<u32>,
    pub front_of_row: Vec<u32>,
    pub local: Vec<u32>,
    /// How many numbers the fronts have.
    pub numbers: usize,
}

impl Structure {
    pub fn new(unknowns: usize, rows: &Rows) -> Self {
        let groups = Groups::new(unknowns, rows);
        let links = groups.links(rows);
        let order = least_degree(groups.len(), &links);
        let lists = Lists::new(groups.len(), &links, &order);
        let mut out = Self::default();
        // where the groups begin in the order of elimination
        let mut starts = vec![0];
        for &group in &order {
            out.order.extend(groups.starts[group]..groups.starts[group + 1]);
            starts.push(out.order.len());
        }
        out.place = vec![0; unknowns];
        for (place, &unknown) in out.order.iter().enumerate() {
            out.place[unknown as usize] = place as u32;
        }
        out.join(&lists, &starts);
        out.link();
        out.take_rows(rows);
        out
    }

    /// Fronts of groups that follow each other and couple to nearly the same others.
    fn join(&mut self, lists: &Lists, starts: &[usize]) {
        let size = |list: &[u32]| list.iter().map(|&g| starts[g as usize + 1] - starts[g as usize]).sum::<usize>();
        let (mut first, count) = (0, starts.len() - 1);
        for group in 0..count {
            let list = lists.of(group);
            let pivots = starts[group + 1] - starts[first];
            if let Some(&next) = list.first()
                && next as usize == group + 1
            {
                let zeros = size(lists.of(group + 1)) + starts[group + 2] - starts[group + 1] - size(list);
                if zeros == 0 || pivots + starts[group + 2] - starts[group + 1] <= FULL && zeros <= FULL {
                    continue;
                }
            }
            let edge = self.boundaries.len();
            for &g in list {
                self.boundaries.extend(starts[g as usize] as u32..starts[g as usize + 1] as u32);
            }
            let boundary = self.boundaries.len() - edge;
            let (start, numbers) = (starts[first], self.numbers);
            let front = Front { start, pivots, edge, boundary, parent: u32::MAX, rows: (0, 0), numbers };
            self.numbers = front.rest().end;
            self.fronts.push(front);
            first = group + 1;
        }
    }

    /// Parents, and where boundaries are in them.
    fn link(&mut self) {
        let front_of = self.front_of();
        self.into_parent = vec![0; self.boundaries.len()];
        for k in 0..self.fronts.len() {
            let Some(&first) = self.boundaries[self.fronts[k].edges()].first() else { continue };
            let parent = front_of[first as usize];
            self.fronts[k].parent = parent;
            let above = self.fronts[parent as usize];
            let (mut at, end) = (0, above.start + above.pivots);
            for e in self.fronts[k].edges() {
                let place = self.boundaries[e] as usize;
                self.into_parent[e] = if place < end {
                    place - above.start
                } else {
                    while self.boundaries[above.edge + at] as usize != place {
                        at += 1;
                    }
                    above.pivots + at
                } as u32;
            }
        }
    }

    /// The front that eliminates every place.
    fn front_of(&self) -> Vec<u32> {
        let each = self.fronts.iter().enumerate();
        each.flat_map(|(k, front)| std::iter::repeat_n(k as u32, front.pivots)).collect()
    }

    /// Every row goes to the front of its first unknown.
    fn take_rows(&mut self, rows: &Rows) {
        let front_of = self.front_of();
        let first = |c: usize| rows.entries(c).map(|(k, _)| self.place[k]).min();
        self.front_of_row = (0..rows.len()).map(|c| first(c).map_or(0, |place| front_of[place as usize])).collect();
        let mut starts = vec![0_u32; self.fronts.len() + 1];
        for &front in &self.front_of_row {
            starts[front as usize + 1] += 1;
        }
        for k in 0..self.fronts.len() {
            starts[k + 1] += starts[k];
            self.fronts[k].rows = (starts[k], starts[k + 1]);
        }
        self.rows = vec![0; rows.len()];
        for (c, &front) in self.front_of_row.iter().enumerate() {
            self.rows[starts[front as usize] as usize] = c as u32;
            starts[front as usize] += 1;
        }
        self.local = vec![0; rows.unknowns.len()];
        let mut local = vec![0; self.order.len()];
        for front in &self.fronts {
            let edges = self.boundaries[front.edges()].iter().map(|&place| place as usize);
            for (row, place) in (front.start..front.start + front.pivots).chain(edges).enumerate() {
                local[place] = row as u32;
            }
            for &c in &self.rows[front.rows.0 as usize..front.rows.1 as usize] {
                for entry in rows.range(c as usize) {
                    self.local[entry] = local[self.place[rows.unknowns[entry] as usize] as usize];
                }
            }
        }
    }
}

/// Unknowns that are eliminated together.
struct Groups {
    /// The first unknown of every group.
    starts: Vec<u32>,
    of: Vec<u32>,
}

impl Groups {
    /// Unknowns that follow each other, as long as the rows of each are among those of the one before, or all of them.
    fn new(unknowns: usize, rows: &Rows) -> Self {
        let mut ends = vec![0_u32; unknowns + 1];
        for &k in &rows.unknowns {
            ends[k as usize + 1] += 1;
        }
        for k in 0..unknowns {
            ends[k + 1] += ends[k];
        }
        let (mut at, mut with) = (ends.clone(), vec![0_u32; rows.unknowns.len()]);
        for c in 0..rows.len() {
            for &k in &rows.unknowns[rows.range(c)] {
                with[at[k as usize] as usize] = c as u32;
                at[k as usize] += 1;
            }
        }
        let list = |k: usize| &with[ends[k] as usize..ends[k + 1] as usize];
        let (mut starts, mut of) = (Vec::new(), Vec::with_capacity(unknowns));
        let mut last: &[u32] = &[];
        for k in 0..unknowns {
            let next = list(k);
            let joins = !next.is_empty() && !last.is_empty() && (is_among(next, last) || is_among(last, next));
            if !joins {
                starts.push(k as u32);
                last = next;
            } else if next.len() > last.len() {
                last = next;
            }
            of.push(starts.len() as u32 - 1);
        }
        starts.push(unknowns as u32);
        Self { starts, of }
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Pairs of groups that a row couples, the lower one first, ascending and each once.
    fn links(&self, rows: &Rows) -> Vec<(u32, u32)> {
        let mut links = Vec::with_capacity(rows.len());
        let mut groups = Vec::new();
        for c in 0..rows.len() {
            groups.clear();
            groups.extend(rows.unknowns[rows.range(c)].iter().map(|&k| self.of[k as usize]));
            groups.sort_unstable();
            groups.dedup();
            for (i, &a) in groups.iter().enumerate() {
                links.extend(groups[i + 1..].iter().map(|&b| (a, b)));
            }
        }
        links.sort_unstable();
        links.dedup();
        links
    }
}

/// Whether every number of an ascending list is in another one.
fn is_among(few: &[u32], many: &[u32]) -> bool {
    let mut rest = many.iter();
    few.len() <= many.len() && few.iter().all(|k| rest.any(|other| other == k))
}

/// Of every group in the order of elimination the later ones that it couples to when it is eliminated, ascending.
struct Lists {
    starts: Vec<u32>,
    all: Vec<u32>,
}

impl Lists {
    fn new(count: usize, links: &[(u32, u32)], order: &[usize]) -> Self {
        let mut place = vec![0_u32; count];
        for (at, &group) in order.iter().enumerate() {
            place[group] = at as u32;
        }
        // links by the place of their first end
        let mut ends = vec![0_u32; count + 1];
        let ordered = |&(a, b): &(u32, u32)| {
            let (a, b) = (place[a as usize], place[b as usize]);
            (a.min(b), a.max(b))
        };
        for (a, _) in links.iter().map(ordered) {
            ends[a as usize + 1] += 1;
        }
        for k in 0..count {
            ends[k + 1] += ends[k];
        }
        let (mut at, mut later) = (ends.clone(), vec![0_u32; links.len()]);
        for (a, b) in links.iter().map(ordered) {
            later[at[a as usize] as usize] = b;
            at[a as usize] += 1;
        }
        let mut out = Self { starts: vec![0], all: Vec::with_capacity(4 * links.len()) };
        let (mut seen, mut child, mut sibling) = (vec![u32::MAX; count], vec![u32::MAX; count], vec![u32::MAX; count]);
        for k in 0..count {
            let begin = out.all.len();
            seen[k] = k as u32;
            for &other in &later[ends[k] as usize..ends[k + 1] as usize] {
                if std::mem::replace(&mut seen[other as usize], k as u32) != k as u32 {
                    out.all.push(other);
                }
            }
            let mut below = child[k];
            while below != u32::MAX {
                for at in out.starts[below as usize]..out.starts[below as usize + 1] {
                    let other = out.all[at as usize];
                    if std::mem::replace(&mut seen[other as usize], k as u32) != k as u32 {
                        out.all.push(other);
                    }
                }
                below = sibling[below as usize];
            }
            out.all[begin..].sort_unstable();
            if let Some(&parent) = out.all.get(begin) {
                sibling[k] = std::mem::replace(&mut child[parent as usize], k as u32);
            }
            out.starts.push(out.all.len() as u32);
        }
        out
    }

    fn of(&self, group: usize) -> &[u32] {
        &self.all[self.starts[group] as usize..self.starts[group + 1] as usize]
    }
}
