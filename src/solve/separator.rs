//! Lightest vertex separators of a plane graph, by maximum flow inside a band around a straight cut.

use std::collections::VecDeque;

/// A graph with weighted vertices at points of the plane; a part of a larger graph.
pub(super) struct Graph {
    /// The vertices' numbers in the whole graph.
    pub ids: Vec<u32>,
    pub weights: Vec<u64>,
    pub positions: Vec<[f64; 2]>,
    /// Neighbours of `v` are `neighbours[starts[v]..starts[v + 1]]`.
    pub starts: Vec<usize>,
    pub neighbours: Vec<u32>,
}

impl Graph {
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    pub fn weight(&self) -> u64 {
        self.weights.iter().sum()
    }

    pub fn around(&self, v: usize) -> &[u32] {
        &self.neighbours[self.starts[v]..self.starts[v + 1]]
    }

    /// The subgraph of the vertices `keep`.
    pub fn induce(&self, keep: &[usize]) -> Self {
        let mut local = vec![u32::MAX; self.len()];
        for (i, &v) in keep.iter().enumerate() {
            local[v] = i as u32;
        }
        let (mut starts, mut neighbours) = (vec![0], Vec::new());
        for &v in keep {
            neighbours.extend(self.around(v).iter().map(|&u| local[u as usize]).filter(|&u| u != u32::MAX));
            starts.push(neighbours.len());
        }
        Self {
            ids: keep.iter().map(|&v| self.ids[v]).collect(),
            weights: keep.iter().map(|&v| self.weights[v]).collect(),
            positions: keep.iter().map(|&v| self.positions[v]).collect(),
            starts,
            neighbours,
        }
    }
}

/// Where a vertex lies with respect to a cut (or, before the cut is known, to the band in which it is sought).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Side {
    Left,
    Middle,
    Right,
}

/// A vertex separator (`Middle`) and the two parts that it separates.
pub(super) struct Cut {
    pub sides: Vec<Side>,
    /// Small for a light separator between parts of similar weights.
    pub cost: f64,
}

/// Half the width of the band, as a share of the whole weight.
const HALF_BAND: f64 = 0.12;
/// What a separator may weigh more (relatively) when it leaves equal parts rather than nothing on one side.
const BALANCE: f64 = 1.0;

/// The lightest separator within the band around the weighted median along `direction`.
pub(super) fn cut(graph: &Graph, direction: [f64; 2]) -> Cut {
    let sides = band(graph, direction);
    let mut network = Network::new(graph, &sides);
    network.saturate();
    let (forward, backward) = (network.reachable(), network.reaching());
    let near_left = network.classify(&sides, |v| (forward[2 * v], forward[2 * v + 1]));
    let near_right = network.classify(&sides, |v| (!backward[2 * v], !backward[2 * v + 1]));
    let (a, b) = (judge(graph, near_left), judge(graph, near_right));
    if b.cost < a.cost { b } else { a }
}

fn judge(graph: &Graph, sides: Vec<Side>) -> Cut {
    let share = |side| -> f64 {
        let inside = sides.iter().zip(&graph.weights).filter(|(s, _)| **s == side);
        inside.map(|(_, &w)| w as f64).sum()
    };
    let (left, middle, right) = (share(Side::Left), share(Side::Middle), share(Side::Right));
    let cost = middle * (1.0 + BALANCE * (left - right).abs() / (left + right).max(1.0));
    Cut { sides, cost }
}

/// Left of the band, in the band, right of it.
fn band(graph: &Graph, [x, y]: [f64; 2]) -> Vec<Side> {
    let key = |v: usize| {
        let p = graph.positions[v];
        (x * p[0] + y * p[1], x * p[1] - y * p[0])
    };
    let mut order: Vec<usize> = (0..graph.len()).collect();
    order.sort_by(|&u, &v| {
        let (a, b) = (key(u), key(v));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(u.cmp(&v))
    });
    let whole = graph.weight() as f64;
    let mut sides = vec![Side::Middle; graph.len()];
    let mut before = 0.0;
    for &v in &order {
        let middle = (before + 0.5 * graph.weights[v] as f64) / whole;
        if middle < 0.5 - HALF_BAND {
            sides[v] = Side::Left;
        } else if middle > 0.5 + HALF_BAND {
            sides[v] = Side::Right;
        }
        before += graph.weights[v] as f64;
    }
    sides[order[0]] = Side::Left;
    sides[order[graph.len() - 1]] = Side::Right;
    sides
}

const UNLIMITED: u64 = u64::MAX / 4;
const NONE: u32 = u32::MAX;

/// A flow network: vertex `v` of the graph has an entry `2 i` and an exit `2 i + 1`, joined by an arc as wide as the
/// vertex is heavy; then come the source and the sink. Only the band and the vertices next to it take part.
struct Network {
    /// Vertex of the network for every vertex of the graph, or `NONE`.
    local: Vec<u32>,
    source: usize,
    /// Latest arc out of every node; arcs `2 k` and `2 k + 1` are opposite.
    latest: Vec<u32>,
    previous: Vec<u32>,
    target: Vec<u32>,
    capacity: Vec<u64>,
    level: Vec<u32>,
    next: Vec<u32>,
}

impl Network {
    fn new(graph: &Graph, sides: &[Side]) -> Self {
        let crosses = |v: usize, u: u32| sides[v] == Side::Middle || sides[u as usize] != sides[v];
        let is_active = |v: &usize| graph.around(*v).iter().any(|&u| crosses(*v, u));
        let active: Vec<usize> = (0..graph.len()).filter(is_active).collect();
        let mut local = vec![NONE; graph.len()];
        active.iter().enumerate().for_each(|(i, &v)| local[v] = i as u32);
        let nodes = 2 * active.len() + 2;
        let mut network = Self {
            local,
            source: nodes - 2,
            latest: vec![NONE; nodes],
            previous: Vec::new(),
            target: Vec::new(),
            capacity: Vec::new(),
            level: vec![NONE; nodes],
            next: vec![NONE; nodes],
        };
        for (i, &v) in active.iter().enumerate() {
            network.join(2 * i, 2 * i + 1, graph.weights[v]);
            match sides[v] {
                Side::Left => network.join(nodes - 2, 2 * i, UNLIMITED),
                Side::Middle => {}
                Side::Right => network.join(2 * i + 1, nodes - 1, UNLIMITED),
            }
            for &u in graph.around(v).iter().filter(|&&u| crosses(v, u)) {
                network.join(2 * i + 1, 2 * network.local[u as usize] as usize, UNLIMITED);
            }
        }
        network
    }

    fn join(&mut self, from: usize, to: usize, capacity: u64) {
        for (a, b, width) in [(from, to, capacity), (to, from, 0)] {
            self.previous.push(self.latest[a]);
            self.latest[a] = self.target.len() as u32;
            self.target.push(b as u32);
            self.capacity.push(width);
        }
    }

    /// Maximum flow, by shortest augmenting paths in levels.
    fn saturate(&mut self) {
        while self.number_levels() {
            self.next.copy_from_slice(&self.latest);
            while self.augment() > 0 {}
        }
    }

    fn number_levels(&mut self) -> bool {
        self.level.fill(NONE);
        self.level[self.source] = 0;
        let mut queue = VecDeque::from([self.source]);
        while let Some(v) = queue.pop_front() {
            let mut arc = self.latest[v];
            while arc != NONE {
                let u = self.target[arc as usize] as usize;
                if self.capacity[arc as usize] > 0 && self.level[u] == NONE {
                    self.level[u] = self.level[v] + 1;
                    queue.push_back(u);
                }
                arc = self.previous[arc as usize];
            }
        }
        self.level[self.source + 1] != NONE
    }

    /// Sends what one path from source to sink can take; 0 when there is none left. Not recursive: the paths of a long
    /// thin mesh are long.
    fn augment(&mut self) -> u64 {
        let mut path: Vec<usize> = Vec::new();
        let mut v = self.source;
        while v != self.source + 1 {
            if self.next[v] == NONE {
                let Some(arc) = path.pop() else { return 0 };
                v = self.target[arc ^ 1] as usize;
                self.next[v] = self.previous[arc];
                continue;
            }
            let arc = self.next[v] as usize;
            let u = self.target[arc] as usize;
            if self.capacity[arc] > 0 && self.level[u] == self.level[v] + 1 {
                path.push(arc);
                v = u;
            } else {
                self.next[v] = self.previous[arc];
            }
        }
        let flow = path.iter().map(|&arc| self.capacity[arc]).min().unwrap_or(0);
        for arc in path {
            self.capacity[arc] -= flow;
            self.capacity[arc ^ 1] += flow;
        }
        flow
    }

    /// Nodes that the source can still send to.
    fn reachable(&self) -> Vec<bool> {
        self.search(self.source, |arc| self.capacity[arc])
    }

    /// Nodes that can still send to the sink.
    fn reaching(&self) -> Vec<bool> {
        self.search(self.source + 1, |arc| self.capacity[arc ^ 1])
    }

    fn search(&self, from: usize, capacity: impl Fn(usize) -> u64) -> Vec<bool> {
        let mut seen = vec![false; self.latest.len()];
        seen[from] = true;
        let mut stack = vec![from];
        while let Some(v) = stack.pop() {
            let mut arc = self.latest[v];
            while arc != NONE {
                let u = self.target[arc as usize] as usize;
                if capacity(arc as usize) > 0 && !seen[u] {
                    seen[u] = true;
                    stack.push(u);
                }
                arc = self.previous[arc as usize];
            }
        }
        seen
    }

    /// Sides by whether a vertex' entry and exit lie on the left of the minimum cut; what takes no part stays, and a
    /// band vertex without neighbours goes right.
    fn classify(&self, sides: &[Side], left: impl Fn(usize) -> (bool, bool)) -> Vec<Side> {
        let classified = |(&i, &side): (&u32, &Side)| match (i, side) {
            (NONE, Side::Left) => Side::Left,
            (NONE, Side::Middle | Side::Right) => Side::Right,
            (i, Side::Left | Side::Middle | Side::Right) => match left(i as usize) {
                (true, true) => Side::Left,
                (true, false) => Side::Middle,
                (false, _) => Side::Right,
            },
        };
        self.local.iter().zip(sides).map(classified).collect()
    }
}
