//! Test matrices on structured triangles: random blocks that couple across faces and through vertices.

use std::collections::HashMap;

use monolayer::solve::SolveError;
use monolayer::solve::dissection::{Group, Tree, dissect};
use monolayer::solve::symbolic::{Element, Symbolic};

/// Reproducible numbers in `[-1/2, 1/2)`.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 40) as f64 / (1u64 << 24) as f64 - 0.5
    }
}

/// Cells with `block` unknowns each and vertices with one unknown each.
pub struct Problem {
    pub groups: Vec<Group>,
    pub adjacency: Vec<Vec<u32>>,
    pub elements: Vec<Element>,
    pub unknowns: usize,
}

impl Problem {
    /// Triangles of an `nx × ny` grid of which `keep` accepts the square; points are moved by `map`.
    pub fn new(
        [nx, ny]: [usize; 2],
        block: usize,
        keep: impl Fn(usize, usize) -> bool,
        map: impl Fn([f64; 2]) -> [f64; 2],
    ) -> Self {
        let mut triangles = Vec::new();
        for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))).filter(|&(i, j)| keep(i, j)) {
            triangles.push([[i, j], [i + 1, j], [i + 1, j + 1]]);
            triangles.push([[i, j], [i + 1, j + 1], [i, j + 1]]);
        }
        let mut vertices: Vec<_> = triangles.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let cells = triangles.len();
        let group_of: HashMap<_, _> = vertices.iter().enumerate().map(|(k, &v)| (v, cells + k)).collect();
        let mut groups = Vec::new();
        for (c, corners) in triangles.iter().enumerate() {
            let centre = [0, 1].map(|k| corners.iter().map(|p| p[k] as f64).sum::<f64>() / 3.0);
            let unknowns = (c * block..(c + 1) * block).map(|u| u as u32).collect();
            groups.push(Group { unknowns, position: map(centre) });
        }
        for (k, &[i, j]) in vertices.iter().enumerate() {
            groups.push(Group { unknowns: vec![(cells * block + k) as u32], position: map([i as f64, j as f64]) });
        }
        let faces = faces(&triangles);
        let (mut adjacency, mut elements) = (vec![Vec::new(); groups.len()], Vec::new());
        let mut random = Random(7);
        for (c, corners) in triangles.iter().enumerate() {
            let mut own = vec![c];
            own.extend(corners.iter().map(|v| group_of[v]));
            let around = &faces[c];
            for (&a, &b) in own.iter().flat_map(|a| own.iter().chain(around).map(move |b| (a, b))) {
                if a != b {
                    adjacency[a].push(b as u32);
                    adjacency[b].push(a as u32);
                }
            }
            let unknowns = |list: &[usize]| list.iter().flat_map(|&g| groups[g].unknowns.clone()).collect::<Vec<_>>();
            let rows = unknowns(&own);
            let columns = [rows.clone(), unknowns(around)].concat();
            let (height, width) = (rows.len(), columns.len());
            let diagonal = |i: usize, j: usize| if i == j { 3.0 } else { 0.0 };
            let values = (0..height * width).map(|k| random.next() + diagonal(k / width, k % width)).collect();
            elements.push(Element { rows, columns, values });
        }
        for list in &mut adjacency {
            list.sort_unstable();
            list.dedup();
        }
        Self { unknowns: cells * block + vertices.len(), groups, adjacency, elements }
    }

    pub fn tree(&self, leaf: usize) -> Tree {
        dissect(&self.groups, &self.adjacency, &[], &[], leaf)
    }

    pub fn symbolic(&self, leaf: usize) -> Result<Symbolic, SolveError> {
        Symbolic::new("test", self.unknowns, &self.tree(leaf), self.elements.len(), |e, element| {
            *element = self.elements[e].clone();
        })
    }
}

/// Cells that share two vertices with each cell.
fn faces(triangles: &[[[usize; 2]; 3]]) -> Vec<Vec<usize>> {
    let mut cells_of: HashMap<_, Vec<usize>> = HashMap::new();
    let ends = |t: &[[usize; 2]; 3], k: usize| {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        (a.min(b), a.max(b))
    };
    for (c, t) in triangles.iter().enumerate() {
        (0..3).for_each(|k| cells_of.entry(ends(t, k)).or_default().push(c));
    }
    let across = |c: usize, t, k| cells_of[&ends(t, k)].iter().copied().filter(move |&d| d != c);
    triangles.iter().enumerate().map(|(c, t)| (0..3).flat_map(|k| across(c, t, k)).collect()).collect()
}

/// `A x`.
pub fn product(elements: &[Element], x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    for element in elements {
        let rows = element.rows.iter().zip(element.values.chunks_exact(element.columns.len()));
        for (&r, values) in rows {
            for (&c, v) in element.columns.iter().zip(values) {
                y[r as usize] += v * x[c as usize];
            }
        }
    }
    y
}
