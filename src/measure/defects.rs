//! Topological defects of the polarity.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use crate::element::{MAX_DEGREE, basis};
use crate::mesh::{Mesh, Point};
use crate::space::{Continuity, Field, Space};

/// Every cell is cut into `CUTS²` triangles, no coarser than the nodes of any polarity.
const CUTS: usize = MAX_DEGREE;

/// A point about which the polarity turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Defect {
    /// Where it is.
    pub x: Point,
    /// Full turns of p on a counterclockwise way around: +1 or −1.
    pub charge: i32,
    /// `|p|` there, of the cell's own polynomial.
    pub size: f64,
}

/// All defects of one polarity.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Census {
    /// In the order of the cells.
    pub defects: Vec<Defect>,
    /// Full turns of p along each part of [`Defects::boundaries`], counterclockwise.
    pub windings: Vec<i32>,
}

impl Census {
    /// Number of defects of one sign.
    pub fn count(&self, charge: i32) -> usize {
        self.defects.iter().filter(|d| d.charge == charge).count()
    }
}

/// A closed curve of the boundary.
#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    /// The tags along it in their order, joined by `+`; a number follows where several curves have the same ones.
    pub name: String,
    /// Whether the domain lies inside.
    pub outer: bool,
    /// Nodes along it, the domain on the left, each once.
    nodes: Vec<usize>,
}

/// Finds where the angle of p winds.
///
/// p is averaged at the nodes of degree 5, over the cells that meet there, and its turns between neighbouring nodes
/// (the shorter way round) are added along the sides of the small triangles between the nodes. As every side is passed
/// in both directions, `Σ charges = winding of the outer boundary − Σ windings of the holes`, exactly.
#[derive(Debug)]
pub struct Defects {
    space: Arc<Space>,
    /// Small triangles by local node, counterclockwise.
    triangles: Vec<[usize; 3]>,
    /// The closed curves of the boundary.
    pub boundaries: Vec<Boundary>,
}

impl Defects {
    /// Numbers the nodes and follows the boundary.
    pub fn new(mesh: &Arc<Mesh>) -> Self {
        let space = Arc::new(Space::new(mesh, Continuity::Continuous, CUTS, 2));
        let indices = basis::node_indices(CUTS);
        let number: BTreeMap<[usize; 2], usize> = indices.iter().enumerate().map(|(i, n)| ([n[1], n[2]], i)).collect();
        let mut triangles = Vec::new();
        for j in 0..CUTS {
            for k in 0..CUTS - j {
                triangles.push([[j, k], [j + 1, k], [j, k + 1]].map(|at| number[&at]));
                if j + k + 2 <= CUTS {
                    triangles.push([[j + 1, k], [j + 1, k + 1], [j, k + 1]].map(|at| number[&at]));
                }
            }
        }
        let boundaries = follow_boundary(&space);
        Self { space, triangles, boundaries }
    }

    /// Defects and windings of `p`. Neighbouring defects of opposite signs are kept, however close they are.
    pub fn of(&self, p: &Field) -> Census {
        let values = self.averages(p);
        let reference = basis::nodes(CUTS);
        let mut census = Census::default();
        for cell in 0..self.space.mesh.cells.len() {
            for &local in &self.triangles {
                let nodes = local.map(|i| self.space.node(cell, i));
                let charge = winding(&values, &nodes);
                if charge != 0 {
                    let xi = zero(nodes.map(|node| values[node]), local.map(|i| reference[i]));
                    let (x, size) = (self.space.mesh.map(cell).at(xi).0, p.vector_at(cell, xi).norm());
                    census.defects.push(Defect { x, charge, size });
                }
            }
        }
        let around = |b: &Boundary| if b.outer { winding(&values, &b.nodes) } else { -winding(&values, &b.nodes) };
        census.windings = self.boundaries.iter().map(around).collect();
        census
    }

    /// p at every node, the mean over the cells that share it.
    fn averages(&self, p: &Field) -> Vec<Point> {
        let rows: Vec<Vec<f64>> =
            basis::nodes(CUTS).into_iter().map(|xi| basis::values(p.space.degree, xi).collect()).collect();
        let mut sums = vec![(Point::zeros(), 0.0); self.space.node_count];
        for cell in 0..self.space.mesh.cells.len() {
            for (i, row) in rows.iter().enumerate() {
                let value = [0, 1].map(|c| row.iter().zip(p.coefficients(cell, c)).map(|(phi, u)| phi * u).sum());
                let (sum, count) = &mut sums[self.space.node(cell, i)];
                *sum += Point::from(value);
                *count += 1.0;
            }
        }
        sums.into_iter().map(|(sum, count)| sum / count).collect()
    }
}

/// Full turns of the values along the closed way through the nodes.
fn winding(values: &[Point], nodes: &[usize]) -> i32 {
    let ends = nodes.iter().zip(nodes.iter().cycle().skip(1));
    (ends.map(|(&a, &b)| turn(values, a, b)).sum::<f64>() / TAU).round() as i32
}

/// Angle from the value at `a` to that at `b`, the shorter way; of opposite values one and the same way from both ends.
fn turn(values: &[Point], a: usize, b: usize) -> f64 {
    if a > b {
        return -turn(values, b, a);
    }
    // a value that vanishes has any direction: taking one leaves every winding whole
    let direction = |v: Point| if v == Point::zeros() { Point::x() } else { v / v.amax() };
    let (u, w) = (direction(values[a]), direction(values[b]));
    u.perp(&w).atan2(u.dot(&w))
}

/// The zero of the linear interpolant of three values at three places, which lies between them if they wind.
fn zero(values: [Point; 3], places: [Point; 3]) -> Point {
    let [a, b, c] = values;
    let shares = [b.perp(&c), c.perp(&a), a.perp(&b)];
    let sum: f64 = shares.iter().sum();
    let inside = shares.iter().all(|s| (0.0..=1.0).contains(&(s / sum)));
    let share = |k: usize| if inside { shares[k] / sum } else { 1.0 / 3.0 };
    places[0] * share(0) + places[1] * share(1) + places[2] * share(2)
}

/// The closed curves of the boundary, in the order of their first faces.
fn follow_boundary(space: &Space) -> Vec<Boundary> {
    let mesh = &*space.mesh;
    let mut from: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let rim: Vec<usize> = (0..mesh.faces.len()).filter(|&f| mesh.faces[f].plus.is_none()).collect();
    for &f in rim.iter().rev() {
        from.entry(mesh.face_vertices(&mesh.faces[f])[0]).or_default().push(f);
    }
    let mut boundaries: Vec<Boundary> = Vec::new();
    for &first in &rim {
        let (mut nodes, mut tags, mut area) = (Vec::new(), Vec::new(), 0.0);
        let mut vertex = mesh.face_vertices(&mesh.faces[first])[0];
        while let Some(f) = from.get_mut(&vertex).and_then(Vec::pop) {
            let face = &mesh.faces[f];
            let [a, b] = mesh.face_vertices(face);
            area += mesh.vertices[a].perp(&mesh.vertices[b]);
            let along = basis::face_nodes(CUTS, face.minus.face);
            nodes.extend(along[..CUTS].iter().map(|&i| space.node(face.minus.cell, i)));
            let tag = face.tag.map_or("", |t| mesh.tags[t].as_str());
            if !tags.contains(&tag) {
                tags.push(tag);
            }
            vertex = b;
        }
        if !nodes.is_empty() {
            let name = tags.join("+");
            let same = boundaries.iter().filter(|b| b.name == name || b.name.starts_with(&format!("{name} "))).count();
            let name = if same == 0 { name } else { format!("{name} {}", same + 1) };
            boundaries.push(Boundary { name, outer: area > 0.0, nodes });
        }
    }
    boundaries
}
