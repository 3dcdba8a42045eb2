//! What a multifrontal factorisation needs to know besides the values: the order of elimination and the fronts.

use super::SolveError;
use super::dissection::Tree;

/// A dense block of the matrix, which is the sum of all of them. The same buffer is filled again and again.
#[derive(Debug, Clone, Default)]
pub struct Element {
    /// Unknowns (equation numbers) of the rows, without repetition.
    pub rows: Vec<u32>,
    /// Unknowns of the columns, without repetition.
    pub columns: Vec<u32>,
    /// Row-major `rows × columns`.
    pub values: Vec<f64>,
}

/// A dense front `[F11 F12; F21 F22]`: pivots first, then the boundary, that is the unknowns of ancestors to which the
/// pivots couple. All unknowns are named by their place in the order of elimination.
pub(super) struct Front {
    /// First pivot of the subtree below.
    pub lowest: usize,
    /// The pivots are `start..end`.
    pub start: usize,
    pub end: usize,
    /// Ascending.
    pub boundary: Vec<u32>,
    /// First front of the subtree below.
    pub first: usize,
    pub children: Vec<usize>,
    /// For every boundary unknown its row in the parent's front. Ascending.
    pub into_parent: Vec<u32>,
    /// Elements with entries in the rows or columns of the pivots.
    pub elements: Vec<u32>,
    /// Floating-point operations of the subtree.
    pub work: f64,
}

impl Front {
    pub fn pivots(&self) -> usize {
        self.end - self.start
    }

    /// Row in the front, or `None` for an unknown that is eliminated before or does not couple.
    pub fn row(&self, place: usize) -> Option<usize> {
        if place < self.start {
            None
        } else if place < self.end {
            Some(place - self.start)
        } else {
            self.boundary.binary_search(&(place as u32)).ok().map(|i| self.pivots() + i)
        }
    }

    /// Factor entries: `p² + 2 p b`.
    fn entries(&self) -> usize {
        self.pivots() * (self.pivots() + 2 * self.boundary.len())
    }

    /// `2 p³/3 + 2 p² b + 2 p b²`.
    pub fn flops(&self) -> f64 {
        let (p, b) = (self.pivots() as f64, self.boundary.len() as f64);
        2.0 * p * (p * p / 3.0 + p * b + b * b)
    }
}

/// The structure of the factors of all matrices with the same elements; made once per mesh and shared.
pub struct Symbolic {
    pub(super) system: String,
    /// Unknown at every place of the elimination.
    pub(super) order: Vec<u32>,
    /// Place of every unknown: inverse of `order`.
    pub(super) place: Vec<u32>,
    pub(super) fronts: Vec<Front>,
    /// In how many fronts every element has entries.
    pub(super) visits: Vec<u32>,
    /// Numbers of every element.
    sizes: Vec<u32>,
}

impl std::fmt::Debug for Symbolic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (unknowns, entries) = (self.unknowns(), self.factor_entries());
        f.debug_struct("Symbolic")
            .field("system", &self.system)
            .field("unknowns", &unknowns)
            .field("entries", &entries)
            .finish()
    }
}

impl Symbolic {
    /// The fronts of a matrix of order `unknowns` that is the sum of `elements` element matrices. `pattern(e, element)`
    /// sets the rows and columns of element `e`; values are not needed. Every entry makes its row and its column couple
    /// both ways. `system` is what errors call the matrix.
    ///
    /// # Errors
    /// The tree does not hold every unknown just once, or an element couples unknowns of unrelated tree nodes.
    pub fn new(
        system: &str,
        unknowns: usize,
        tree: &Tree,
        elements: usize,
        pattern: impl Fn(usize, &mut Element),
    ) -> Result<Self, SolveError> {
        let (order, place) = number(system, unknowns, tree)?;
        let (fronts, visits, sizes) = (skeleton(tree), vec![0; elements], vec![0; elements]);
        let mut symbolic = Self { system: system.into(), order, place, fronts, visits, sizes };
        symbolic.touch(&pattern);
        symbolic.close()?;
        Ok(symbolic)
    }

    /// Order of the matrix.
    pub fn unknowns(&self) -> usize {
        self.order.len()
    }

    /// Numbers that the factors hold: `Σ p² + 2 p b` over fronts with `p` pivots and `b` boundary unknowns.
    pub fn factor_entries(&self) -> usize {
        self.fronts.iter().map(Front::entries).sum()
    }

    /// Floating-point operations of a factorisation: `Σ 2 p³/3 + 2 p² b + 2 p b²`.
    pub fn flops(&self) -> f64 {
        self.fronts.last().map_or(0.0, |root| root.work)
    }

    /// The fronts of another structure that hold the same factors as ours: the same unknowns, elements that are not
    /// `touched`, and such fronts below.
    pub(super) fn fronts_as_in(&self, other: &Symbolic, touched: &[bool]) -> Vec<Option<usize>> {
        let mut by_pivot = vec![None; other.place.len().max(self.place.len())];
        for (k, front) in other.fronts.iter().enumerate().filter(|(_, front)| front.pivots() > 0) {
            by_pivot[other.order[front.start] as usize] = Some(k);
        }
        let mut same: Vec<Option<usize>> = Vec::with_capacity(self.fronts.len());
        for front in &self.fronts {
            let first = self.order.get(front.start).filter(|_| front.pivots() > 0);
            let found = first.and_then(|&unknown| by_pivot[unknown as usize]).filter(|&k| {
                let theirs = &other.fronts[k];
                let boundaries = || {
                    let ours = front.boundary.iter().map(|&place| self.order[place as usize]);
                    ours.eq(theirs.boundary.iter().map(|&place| other.order[place as usize]))
                };
                self.order[front.start..front.end] == other.order[theirs.start..theirs.end]
                    && front.elements == theirs.elements
                    && !front.elements.iter().any(|&e| touched[e as usize])
                    && front.children.len() == theirs.children.len()
                    && front.children.iter().zip(&theirs.children).all(|(&ours, &theirs)| same[ours] == Some(theirs))
                    && boundaries()
            });
            same.push(found);
        }
        same
    }

    /// Numbers that contributions and fronts hold at most besides the factors, with so many threads.
    pub fn stack_entries(&self, threads: usize) -> usize {
        self.stack_below(self.fronts.len() - 1, threads)
    }

    fn stack_below(&self, node: usize, threads: usize) -> usize {
        let front = &self.fronts[node];
        let square = |node: usize| self.fronts[node].boundary.len().pow(2);
        let together = threads.min(front.children.len());
        let (mut held, mut peak) = (0, 0);
        if together > 1 {
            let share = threads.div_ceil(together);
            let peaks: Vec<usize> = front.children.iter().map(|&child| self.stack_below(child, share)).collect();
            peak = peaks.iter().sum();
            held = front.children.iter().map(|&child| square(child)).sum();
        } else {
            for &child in &front.children {
                peak = peak.max(held + self.stack_below(child, 1));
                held += square(child);
            }
        }
        peak.max(held + square(node))
    }

    /// Numbers that elements hold at most while they wait for further fronts, on one thread.
    pub fn waiting_entries(&self) -> usize {
        let mut left = self.visits.clone();
        let (mut held, mut peak) = (0, 0);
        for front in &self.fronts {
            for &e in &front.elements {
                let e = e as usize;
                if left[e] == self.visits[e] {
                    held += self.sizes[e] as usize;
                    peak = peak.max(held);
                }
                left[e] -= 1;
                if left[e] == 0 {
                    held -= self.sizes[e] as usize;
                }
            }
        }
        peak
    }

    /// Boundary unknowns by the elements' own entries, and which front needs which elements.
    fn touch(&mut self, pattern: &impl Fn(usize, &mut Element)) {
        let mut front_of = vec![0; self.unknowns()];
        for (i, front) in self.fronts.iter().enumerate() {
            front_of[front.start..front.end].fill(i);
        }
        let mut element = Element::default();
        for e in 0..self.visits.len() {
            pattern(e, &mut element);
            self.sizes[e] = (element.rows.len() * element.columns.len()) as u32;
            let sorted = |unknowns: &[u32]| {
                let mut places: Vec<u32> = unknowns.iter().map(|&u| self.place[u as usize]).collect();
                places.sort_unstable();
                places
            };
            let (rows, columns) = (sorted(&element.rows), sorted(&element.columns));
            let mut owners: Vec<usize> = rows.iter().chain(&columns).map(|&k| front_of[k as usize]).collect();
            owners.sort_unstable();
            owners.dedup();
            for owner in owners {
                self.visits[e] += u32::from(self.fronts[owner].touch(e, &rows, &columns));
            }
        }
    }

    /// Hands every front's boundary on to its parent, in postorder.
    fn close(&mut self) -> Result<(), SolveError> {
        for i in 0..self.fronts.len() {
            let (done, rest) = self.fronts.split_at_mut(i);
            let front = &mut rest[0];
            for &child in &front.children {
                let end = front.end as u32;
                front.boundary.extend(done[child].boundary.iter().filter(|&&k| k >= end));
            }
            front.boundary.sort_unstable();
            front.boundary.dedup();
            front.work = front.flops() + front.children.iter().map(|&c| done[c].work).sum::<f64>();
            for &child in &front.children {
                let child = &mut done[child];
                let rows = child.boundary.iter().map(|&k| front.row(k as usize).map(|r| r as u32).ok_or(k));
                child.into_parent = match rows.collect() {
                    Ok(rows) => rows,
                    Err(k) => return Err(self.unrelated(i, k as usize)),
                };
            }
        }
        let beyond = self.fronts.last().and_then(|root| root.boundary.first().copied());
        beyond.map_or(Ok(()), |k| Err(self.unrelated(self.fronts.len() - 1, k as usize)))
    }

    fn unrelated(&self, front: usize, place: usize) -> SolveError {
        let unknown = self.order[place];
        let reason =
            format!("unknown {unknown} couples to unknowns of tree node {front}, which is no relative of its own");
        refuse(&self.system, reason)
    }
}

impl Front {
    /// Notes the entries of an element in the rows and columns of the pivots; whether there are any.
    fn touch(&mut self, element: usize, rows: &[u32], columns: &[u32]) -> bool {
        let from = |places: &[u32], k: usize| places.partition_point(|&place| (place as usize) < k);
        let has_pivot = |places: &[u32]| from(places, self.start) < from(places, self.end);
        let (row_pivots, column_pivots) = (has_pivot(rows), has_pivot(columns));
        let mut touched = false;
        for (pivots, others) in [(row_pivots, columns), (column_pivots, rows)] {
            if pivots {
                touched |= from(others, self.start) < others.len();
                self.boundary.extend(&others[from(others, self.end)..]);
            }
        }
        if touched {
            self.elements.push(element as u32);
        }
        // Neighbouring elements repeat each other's unknowns.
        if self.boundary.len() > 4096 {
            self.boundary.sort_unstable();
            self.boundary.dedup();
        }
        touched
    }
}

/// Order of elimination and its inverse.
fn number(system: &str, unknowns: usize, tree: &Tree) -> Result<(Vec<u32>, Vec<u32>), SolveError> {
    let order: Vec<u32> = tree.nodes.iter().flat_map(|node| &node.pivots).copied().collect();
    let mut place = vec![u32::MAX; unknowns];
    for (k, &unknown) in order.iter().enumerate() {
        match place.get_mut(unknown as usize) {
            Some(place) if *place == u32::MAX => *place = k as u32,
            Some(_) => return Err(refuse(system, format!("the tree holds unknown {unknown} twice"))),
            None => return Err(refuse(system, format!("the tree holds unknown {unknown} of {unknowns}"))),
        }
    }
    match place.iter().position(|&k| k == u32::MAX) {
        Some(missing) => Err(refuse(system, format!("the tree lacks unknown {missing}"))),
        None => Ok((order, place)),
    }
}

fn refuse(system: &str, reason: String) -> SolveError {
    let hint = "the groups, their adjacency and the elements must describe the same matrix".into();
    SolveError::Factorise { system: system.into(), reason, hint }
}

/// Fronts without boundaries.
fn skeleton(tree: &Tree) -> Vec<Front> {
    let mut fronts: Vec<Front> = Vec::with_capacity(tree.nodes.len());
    let mut start = 0;
    for (i, node) in tree.nodes.iter().enumerate() {
        let first_child = node.children.first().map(|&c| &fronts[c]);
        let (lowest, first) = first_child.map_or((start, i), |child| (child.lowest, child.first));
        let end = start + node.pivots.len();
        fronts.push(Front {
            lowest,
            start,
            end,
            boundary: Vec::new(),
            first,
            children: node.children.clone(),
            into_parent: Vec::new(),
            elements: Vec::new(),
            work: 0.0,
        });
        start = end;
    }
    fronts
}
