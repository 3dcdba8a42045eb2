//! Quadratic velocities and linear pressures on squares: pivots of pressures vanish until the velocities around are
//! eliminated.

use std::sync::Arc;

use monolayer::solve::dissection::{Group, LateGroup, Tree, dissect};
use monolayer::solve::multifrontal::Multifrontal;
use monolayer::solve::symbolic::{Element, Symbolic};

/// `n × n` squares; velocities at the inner points of the half grid, pressures at the vertices, one multiplier.
struct Stokes {
    n: usize,
}

/// Simpson's rule for `∫ ψ_a φ_i` and `∫ ψ_a φ_i'` with linear `ψ` and quadratic `φ` on `[0, 1]`.
fn integrals() -> [[[f64; 3]; 2]; 2] {
    let mut result = [[[0.0; 3]; 2]; 2];
    for (x, weight) in [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)] {
        let psi = [1.0 - x, x];
        let phi = [(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)];
        let slope = [4.0 * x - 3.0, 4.0 - 8.0 * x, 4.0 * x - 1.0];
        for a in 0..2 {
            for i in 0..3 {
                result[0][a][i] += weight * psi[a] * phi[i];
                result[1][a][i] += weight * psi[a] * slope[i];
            }
        }
    }
    result
}

impl Stokes {
    fn inner(&self) -> usize {
        2 * self.n - 1
    }
    fn velocity(&self, x: usize, y: usize) -> Option<usize> {
        let inside = (1..2 * self.n).contains(&x) && (1..2 * self.n).contains(&y);
        inside.then(|| (y - 1) * self.inner() + x - 1)
    }
    fn pressure(&self, i: usize, j: usize) -> usize {
        2 * self.inner().pow(2) + j * (self.n + 1) + i
    }
    fn multiplier(&self) -> usize {
        self.pressure(self.n, self.n) + 1
    }
    fn unknowns(&self) -> usize {
        self.multiplier() + 1
    }

    /// Springs along the grid lines with some transport, divergence and its transpose, and the mean value.
    fn element(&self, square: usize) -> Element {
        let (i, j) = (square % self.n, square / self.n);
        let nodes: Vec<_> = (0..9).map(|k| self.velocity(2 * i + k % 3, 2 * j + k / 3)).collect();
        let mut dense = vec![vec![0.0; 23]; 23];
        for (a, b) in (0..9).flat_map(|a| (0..9).map(move |b| (a, b))) {
            let apart = usize::abs_diff(a % 3, b % 3) + usize::abs_diff(a / 3, b / 3);
            if apart == 1 {
                for k in 0..2 {
                    dense[2 * a + k][2 * b + k] -= if a < b { 1.1 } else { 0.9 };
                    dense[2 * a + k][2 * a + k] += 1.0;
                }
            }
        }
        let [mass, slope] = integrals();
        for (q, a) in (0..4).flat_map(|q| (0..9).map(move |a| (q, a))) {
            let (qx, qy, ax, ay) = (q % 2, q / 2, a % 3, a / 3);
            for (k, v) in [slope[qx][ax] * mass[qy][ay], mass[qx][ax] * slope[qy][ay]].into_iter().enumerate() {
                dense[18 + q][2 * a + k] = v;
                dense[2 * a + k][18 + q] = -v;
            }
        }
        dense[22][18..22].fill(0.25);
        dense[18..22].iter_mut().for_each(|row| row[22] = 0.25);
        let mut numbers: Vec<Option<usize>> =
            nodes.iter().flat_map(|node| [node.map(|v| 2 * v), node.map(|v| 2 * v + 1)]).collect();
        numbers.extend((0..4).map(|q| Some(self.pressure(i + q % 2, j + q / 2))));
        numbers.push(Some(self.multiplier()));
        let kept: Vec<usize> = (0..23).filter(|&k| numbers[k].is_some()).collect();
        let rows: Vec<u32> = numbers.iter().flatten().map(|&u| u as u32).collect();
        let values = kept.iter().flat_map(|&r| kept.iter().map(move |&c| (r, c))).map(|(r, c)| dense[r][c]).collect();
        Element { columns: rows.clone(), rows, values }
    }

    fn parts(&self) -> (Vec<Group>, Vec<Vec<u32>>, Vec<LateGroup>) {
        let m = self.inner();
        let group = |v: usize| Group {
            unknowns: vec![2 * v as u32, 2 * v as u32 + 1],
            position: [(v % m) as f64, (v / m) as f64],
        };
        let groups: Vec<Group> = (0..m * m).map(group).collect();
        let mut adjacency = vec![Vec::new(); m * m];
        let vertices = (self.n + 1).pow(2);
        let mut late: Vec<LateGroup> = (0..vertices)
            .map(|v| LateGroup { unknowns: vec![(2 * m * m + v) as u32], neighbours: Vec::new() })
            .collect();
        for square in 0..self.n * self.n {
            let (i, j) = (square % self.n, square / self.n);
            let nodes: Vec<usize> = (0..9).filter_map(|k| self.velocity(2 * i + k % 3, 2 * j + k / 3)).collect();
            for &a in &nodes {
                adjacency[a].extend(nodes.iter().filter(|&&b| b != a).map(|&b| b as u32));
            }
            for q in 0..4 {
                let vertex = (j + q / 2) * (self.n + 1) + i + q % 2;
                late[vertex].neighbours.extend(nodes.iter().map(|&a| a as u32));
            }
        }
        (groups, adjacency, late)
    }

    fn tree(&self, leaf: usize) -> Tree {
        let (groups, adjacency, late) = self.parts();
        dissect(&groups, &adjacency, &late, &[self.multiplier() as u32, self.pressure(0, 0) as u32], leaf)
    }
}

#[test]
fn solves_a_saddle_point() {
    let stokes = Stokes { n: 10 };
    for leaf in [4, 30, 100] {
        let tree = stokes.tree(leaf);
        let fill = |e: usize, element: &mut Element| *element = stokes.element(e);
        let symbolic = Symbolic::new("Stokes", stokes.unknowns(), &tree, 100, fill).expect("a tree");
        let lu = Multifrontal::<f64>::new(Arc::new(symbolic), fill).expect("regular");
        let exact: Vec<f64> = (0..stokes.unknowns()).map(|i| (1.7 * i as f64).sin()).collect();
        let mut x = vec![0.0; exact.len()];
        for element in (0..100).map(|e| stokes.element(e)) {
            for (&r, values) in element.rows.iter().zip(element.values.chunks_exact(element.columns.len())) {
                x[r as usize] += element.columns.iter().zip(values).map(|(&c, v)| v * exact[c as usize]).sum::<f64>();
            }
        }
        lu.solve_in_place(&mut x);
        let error = x.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-8, "leaf {leaf}: error {error}");
    }
}

#[test]
fn without_its_multiplier_it_is_singular() {
    let stokes = Stokes { n: 6 };
    let fill = |e: usize, element: &mut Element| {
        *element = stokes.element(e);
        let width = element.columns.len();
        for (k, v) in element.values.iter_mut().enumerate() {
            let borders = [k / width, k % width].map(|i| i == width - 1);
            *v = if borders == [true, true] {
                1.0
            } else if borders == [false, false] {
                *v
            } else {
                0.0
            };
        }
    };
    let symbolic = Symbolic::new("Stokes", stokes.unknowns(), &stokes.tree(10_000), 36, fill).expect("a tree");
    let message = Multifrontal::<f64>::new(Arc::new(symbolic), fill).expect_err("a free constant").to_string();
    assert!(message.contains("the Stokes matrix"), "{message}");
}

#[test]
fn late_groups_follow_their_neighbours() {
    let stokes = Stokes { n: 12 };
    let tree = stokes.tree(20);
    let mut turn = vec![(0, 0); stokes.unknowns()];
    let mut parents = vec![usize::MAX; tree.nodes.len()];
    for (i, node) in tree.nodes.iter().enumerate() {
        node.pivots.iter().enumerate().for_each(|(k, &u)| turn[u as usize] = (i, k));
        node.children.iter().for_each(|&c| parents[c] = i);
    }
    assert!(tree.nodes.len() > 20, "{} nodes", tree.nodes.len());
    let root = tree.nodes.len() - 1;
    let mut at_root = 0;
    for group in stokes.parts().2 {
        let place = turn[group.unknowns[0] as usize];
        at_root += usize::from(place.0 == root);
        for neighbour in group.neighbours {
            let before = turn[2 * neighbour as usize];
            assert!(before < place, "pressure {:?} comes before a velocity", group.unknowns);
            let mut node = before.0;
            while node < place.0 {
                node = parents[node];
            }
            assert_eq!(node, place.0, "a pressure must lie above its velocities");
        }
    }
    assert!(at_root <= 3 * 13 + 1, "{at_root} pressures at the root");
}
