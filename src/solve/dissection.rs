//! Geometric nested dissection (George 1973): an elimination tree whose fronts stay small.
//!
//! The unknowns come in groups that are always eliminated together (the coefficients of a mesh cell, the components of
//! a node). A set of groups is cut in two by a light separator, which is eliminated after both parts; so on down to
//! small sets.

use super::separator::{Cut, Graph, Side, cut};

/// Unknowns that are eliminated together.
#[derive(Debug, Clone)]
pub struct Group {
    /// Numbers of the unknowns.
    pub unknowns: Vec<u32>,
    /// Where the group lies; only its order along straight lines matters.
    pub position: [f64; 2],
}

/// Unknowns that must not be eliminated before any of their neighbours, because their pivots only then differ from
/// zero: pressures of a saddle point.
#[derive(Debug, Clone)]
pub struct LateGroup {
    /// Numbers of the unknowns.
    pub unknowns: Vec<u32>,
    /// The [`Group`]s, by index, to which the unknowns couple.
    pub neighbours: Vec<u32>,
}

/// A node of the elimination tree.
#[derive(Debug, Clone, Default)]
pub struct TreeNode {
    /// Unknowns that are eliminated here, in this order.
    pub pivots: Vec<u32>,
    /// Indices of the nodes that are eliminated just before.
    pub children: Vec<usize>,
}

/// An elimination tree: unknowns of two different nodes couple only if one node is an ancestor of the other.
#[derive(Debug, Clone)]
pub struct Tree {
    /// Nodes in postorder: all of a node's descendants stand directly before it, and the root is the last.
    pub nodes: Vec<TreeNode>,
}

/// Size of the sets (unknowns) that are not cut any further, when the caller has no better idea.
pub const LEAF: usize = 80;

/// Sets above this weight are cut in parallel.
const PARALLEL: u64 = 2000;

/// Groups that were cut in two again and again, so that others may couple later on.
#[derive(Debug, Clone)]
pub struct Dissection {
    /// Groups of every node, in the order of their elimination.
    members: Vec<Vec<u32>>,
    /// Parent of every node, which has the larger number; the root is its own.
    parents: Vec<usize>,
    node_of: Vec<usize>,
}

impl Dissection {
    /// Cuts `groups`. `adjacency[g]` lists the groups that couple to group `g` (symmetric, without `g` itself); sets of
    /// at most `leaf` unknowns are not cut any further.
    ///
    /// # Panics
    /// For a neighbour that does not exist.
    pub fn new(groups: &[Group], adjacency: &[Vec<u32>], leaf: usize) -> Self {
        let mut flat = Self { members: Vec::new(), parents: Vec::new(), node_of: vec![0; groups.len()] };
        flat.flatten(divide(whole(groups, adjacency), leaf as u64));
        for (node, members) in flat.members.iter().enumerate() {
            members.iter().for_each(|&g| flat.node_of[g as usize] = node);
        }
        flat
    }

    /// Lets two groups couple that did not: unless one is eliminated after the other anyway, the first is eliminated
    /// later, with the groups that part them. What couples already still may.
    pub fn couple(&mut self, first: usize, second: usize) {
        let (old, other) = (self.node_of[first], self.node_of[second]);
        let common = self.common_ancestor(old, other);
        if common != old && common != other {
            self.members[old].retain(|&g| g as usize != first);
            self.members[common].push(first as u32);
            self.node_of[first] = common;
        }
    }

    /// The elimination tree. `late` are groups that are eliminated after their neighbours (two of them may couple only
    /// if they share a neighbour), `last` unknowns that are eliminated at the very end wherever else they are listed.
    pub fn tree(&self, groups: &[Group], late: &[LateGroup], last: &[u32]) -> Tree {
        let root = self.members.len() - 1;
        let gather = |members: &Vec<u32>| -> Vec<u32> {
            members.iter().flat_map(|&g| &groups[g as usize].unknowns).copied().filter(|u| !last.contains(u)).collect()
        };
        let mut pivots: Vec<Vec<u32>> = self.members.iter().map(gather).collect();
        for group in late {
            let nodes = group.neighbours.iter().map(|&g| self.node_of[g as usize]);
            let node = nodes.reduce(|a, b| self.common_ancestor(a, b)).unwrap_or(root);
            pivots[node].extend(group.unknowns.iter().filter(|u| !last.contains(u)));
        }
        pivots[root].extend(last);
        prune(pivots, &self.parents)
    }

    fn flatten(&mut self, branch: Branch) -> usize {
        let children: Vec<usize> = branch.children.into_iter().map(|child| self.flatten(child)).collect();
        let node = self.members.len();
        self.members.push(branch.groups);
        self.parents.push(node);
        children.into_iter().for_each(|child| self.parents[child] = node);
        node
    }

    /// In postorder an ancestor has the larger number, so the smaller one of two nodes may climb.
    fn common_ancestor(&self, mut a: usize, mut b: usize) -> usize {
        while a != b {
            if a < b {
                a = self.parents[a];
            } else {
                b = self.parents[b];
            }
        }
        a
    }
}

/// The elimination tree of groups that couple as `adjacency` tells, in one go; see [`Dissection`].
///
/// # Panics
/// For a neighbour that does not exist.
pub fn dissect(groups: &[Group], adjacency: &[Vec<u32>], late: &[LateGroup], last: &[u32], leaf: usize) -> Tree {
    Dissection::new(groups, adjacency, leaf).tree(groups, late, last)
}

/// The graph of all groups.
fn whole(groups: &[Group], adjacency: &[Vec<u32>]) -> Graph {
    let mut starts = vec![0];
    starts.extend(adjacency.iter().scan(0, |end, around| {
        *end += around.len();
        Some(*end)
    }));
    Graph {
        ids: (0..groups.len() as u32).collect(),
        weights: groups.iter().map(|g| g.unknowns.len() as u64).collect(),
        positions: groups.iter().map(|g| g.position).collect(),
        starts,
        neighbours: adjacency.concat(),
    }
}

/// A node of the tree while it grows.
struct Branch {
    groups: Vec<u32>,
    children: Vec<Branch>,
}

fn divide(graph: Graph, leaf: u64) -> Branch {
    let weight = graph.weight();
    if weight <= leaf || graph.len() < 2 {
        return Branch { groups: graph.ids, children: Vec::new() };
    }
    let sides = best_cut(&graph).sides;
    let part = |side| -> Vec<usize> { (0..graph.len()).filter(|&v| sides[v] == side).collect() };
    let (left, right) = (part(Side::Left), part(Side::Right));
    if left.is_empty() || right.is_empty() {
        return Branch { groups: graph.ids, children: Vec::new() };
    }
    let groups = part(Side::Middle).iter().map(|&v| graph.ids[v]).collect();
    let (left, right) = (graph.induce(&left), graph.induce(&right));
    drop(graph);
    let (left, right) = if weight > PARALLEL {
        rayon::join(|| divide(left, leaf), || divide(right, leaf))
    } else {
        (divide(left, leaf), divide(right, leaf))
    };
    Branch { groups, children: vec![left, right] }
}

/// The best of the cuts across the coordinate axes and across the principal axes.
fn best_cut(graph: &Graph) -> Cut {
    let [c, s] = principal_axis(graph);
    let mut directions = vec![[1.0, 0.0], [0.0, 1.0]];
    if c.abs().min(s.abs()) > 0.05 {
        directions.extend([[c, s], [-s, c]]);
    }
    let cuts = directions.into_iter().map(|d| cut(graph, d));
    cuts.reduce(|a, b| if b.cost < a.cost { b } else { a }).expect("there are directions")
}

/// Unit vector along which the weights spread most.
fn principal_axis(graph: &Graph) -> [f64; 2] {
    let total = graph.weight() as f64;
    let points = || graph.positions.iter().zip(&graph.weights).map(|(&p, &w)| (p, w as f64 / total));
    let centre = points().fold([0.0; 2], |c, (p, w)| [c[0] + w * p[0], c[1] + w * p[1]]);
    let [xx, xy, yy] = points().fold([0.0; 3], |m, (p, w)| {
        let (x, y) = (p[0] - centre[0], p[1] - centre[1]);
        [m[0] + w * x * x, m[1] + w * x * y, m[2] + w * y * y]
    });
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    [angle.cos(), angle.sin()]
}

/// Drops nodes without pivots, whose children go to the next ancestor; the root stays.
fn prune(pivots: Vec<Vec<u32>>, parents: &[usize]) -> Tree {
    let root = pivots.len() - 1;
    let mut waiting: Vec<Vec<usize>> = vec![Vec::new(); pivots.len()];
    let mut nodes = Vec::new();
    for (node, pivots) in pivots.into_iter().enumerate() {
        let children = std::mem::take(&mut waiting[node]);
        if pivots.is_empty() && node != root {
            waiting[parents[node]].extend(children);
        } else {
            waiting[parents[node]].push(nodes.len());
            nodes.push(TreeNode { pivots, children });
        }
    }
    Tree { nodes }
}
