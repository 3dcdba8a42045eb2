//! From the content of a file to a mesh.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::super::geometry::{Nodes, straight_nodes};
use super::super::{BoundaryEdge, Mesh, Point};
use super::parse::{Content, Element};
use super::{Fault, boundary, circle};
use crate::element::basis;

/// Deviation of a geometry node from its place on a straight triangle, relative to the longest edge, that rounding
/// causes.
const STRAIGHT: f64 = 1e-10;
/// Largest range of z relative to the extent of the mesh.
const PLANE: f64 = 1e-9;
/// The tag of boundary edges without a physical group.
const BARE: &str = "boundary";

/// Builds the mesh, whose cells may still overlap.
pub fn assemble(content: Content) -> Result<Mesh, Fault> {
    if content.triangles.is_empty() {
        let hint =
            "mesh in two dimensions (`gmsh -2`); if there are physical curves, give the surface a physical group too";
        return Err(Fault::new("the mesh has no triangles", hint));
    }
    let mut notes = Vec::new();
    let triangles = surfaces(&content, &mut notes);
    let places = Places::new(&content, &triangles)?;
    let shapes = triangles.iter().map(|t| places.triangle(t)).collect::<Result<Vec<_>, _>>()?;
    let lines = boundary::lines(&content, &places, &shapes, &mut notes)?;

    let used: BTreeSet<i32> = lines.iter().filter_map(|l| l.group).collect();
    let (mut tags, mut tag_of) = (Vec::<String>::new(), HashMap::new());
    let groups = used.into_iter().map(|group| (Some(group), content.name(group)));
    let bare = lines.iter().any(|line| line.group.is_none()).then(|| (None, BARE.to_owned()));
    for (group, name) in groups.chain(bare) {
        let tag = tags.iter().position(|t| *t == name).unwrap_or_else(|| {
            tags.push(name);
            tags.len() - 1
        });
        tag_of.insert(group, tag);
    }
    let (curves, curve_of) = circle::of_lines(&lines);
    let boundary: Vec<BoundaryEdge> = lines
        .iter()
        .zip(curve_of)
        .map(|(line, curve)| BoundaryEdge { vertices: line.vertices, tag: tag_of[&line.group], curve })
        .collect();
    notes.extend(ignored(&content, &places));

    let cells: Vec<[usize; 3]> = shapes.iter().map(|shape| shape.corners).collect();
    let mut mesh = Mesh::connected(places.vertices, cells, &boundary, tags, curves)?;
    mesh.curved = shapes.into_iter().map(|shape| shape.bent.then(|| Box::new(shape.nodes))).collect();
    mesh.notes = notes;
    mesh.check_curved()?;
    Ok(mesh)
}

/// The triangles of the mesh: those on surfaces in a physical group if there are any, each once.
fn surfaces<'c>(content: &'c Content, notes: &mut Vec<String>) -> Vec<&'c Element> {
    let grouped = content.triangles.iter().any(|t| t.group.is_some());
    let (mut other, mut twice) = (BTreeMap::<i32, usize>::new(), 0);
    let mut seen = HashSet::new();
    let mut kept = Vec::with_capacity(content.triangles.len());
    for triangle in &content.triangles {
        if grouped && triangle.group.is_none() {
            *other.entry(triangle.entity).or_default() += 1;
            continue;
        }
        let mut corners: Vec<usize> = triangle.nodes[..3].to_vec();
        corners.sort_unstable();
        if seen.insert(corners) {
            kept.push(triangle);
        } else {
            twice += 1;
        }
    }
    if !other.is_empty() {
        let count: usize = other.values().sum();
        let names: Vec<String> = other.keys().map(i32::to_string).collect();
        notes.push(format!(
            "{count} triangles of surfaces without a physical group are left out (surface {}), for other surfaces \
             have one",
            names.join(", ")
        ));
    }
    if twice > 0 {
        notes.push(format!("{twice} triangles that are listed twice are taken once"));
    }
    kept
}

/// What else the file has.
fn ignored(content: &Content, places: &Places) -> Option<String> {
    let mut parts = content.unused.clone();
    for (count, what) in [(content.points, "point elements"), (places.unused, "nodes that no triangle uses")] {
        if count > 0 {
            parts.push(format!("{count} {what}"));
        }
    }
    (!parts.is_empty()).then(|| format!("not used of the file: {}", parts.join(", ")))
}

/// Positions of the nodes, and which of them are corners of triangles.
pub struct Places {
    position: HashMap<usize, Point>,
    pub vertex: HashMap<usize, usize>,
    pub vertices: Vec<Point>,
    unused: usize,
}

impl Places {
    fn new(content: &Content, triangles: &[&Element]) -> Result<Self, Fault> {
        let used: HashSet<usize> = triangles.iter().flat_map(|t| &t.nodes).copied().collect();
        let corners: HashSet<usize> = triangles.iter().flat_map(|t| &t.nodes[..3]).copied().collect();
        let mut places = Self { position: HashMap::new(), vertex: HashMap::new(), vertices: Vec::new(), unused: 0 };
        let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        let mut heights: [(f64, usize); 2] = [(0.0, 0); 2];
        for &(number, place) in &content.nodes {
            let [x, y, z] = place;
            if places.position.insert(number, Point::new(x, y)).is_some() {
                return Err(Fault::new(format!("node {number} is listed twice"), "export the mesh from Gmsh again"));
            }
            if corners.contains(&number) {
                places.vertex.insert(number, places.vertices.len());
                places.vertices.push(Point::new(x, y));
            }
            if !used.contains(&number) {
                places.unused += 1;
                continue;
            }
            if z < bounds[2][0] {
                heights[0] = (z, number);
            }
            if z > bounds[2][1] {
                heights[1] = (z, number);
            }
            for (bound, value) in bounds.iter_mut().zip(place) {
                *bound = [bound[0].min(value), bound[1].max(value)];
            }
        }
        let [width, height, depth] = bounds.map(|[low, high]| high - low);
        if depth > PLANE * width.max(height) {
            let [(low, at), (high, other)] = heights;
            let what = format!(
                "the mesh is three-dimensional: z = {low:?} at node {at}, z = {high:?} at node {other}, but all z \
                 must be equal"
            );
            return Err(Fault::new(what, "move, rotate or project the geometry into the plane z = 0"));
        }
        Ok(places)
    }

    pub fn positions(&self, element: &Element) -> Result<Vec<Point>, Fault> {
        let find = |node: &usize| {
            self.position.get(node).copied().ok_or_else(|| {
                let what = format!("element {} names node {node}, which section $Nodes does not list", element.number);
                Fault::new(what, "export the mesh from Gmsh again")
            })
        };
        element.nodes.iter().map(find).collect()
    }

    fn triangle(&self, element: &Element) -> Result<Shape, Fault> {
        let mut positions = self.positions(element)?;
        let mut corners = std::array::from_fn(|k| self.vertex[&element.nodes[k]]);
        let [a, b, c] = [positions[0], positions[1], positions[2]];
        if (b - a).perp(&(c - a)) < 0.0 {
            corners.swap(1, 2);
            positions = mirrored(element.degree, &positions);
        }
        let degree = element.degree;
        let flat = straight_nodes(degree, [positions[0], positions[1], positions[2]]).positions;
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        let bent = positions.iter().zip(&flat).any(|(p, q)| (p - q).norm() > STRAIGHT * longest);
        Ok(Shape { corners, nodes: Nodes { degree, positions }, bent })
    }
}

/// A triangle: its corners counterclockwise and its geometry nodes.
pub struct Shape {
    pub corners: [usize; 3],
    pub nodes: Nodes,
    /// Whether the nodes are not those of the straight triangle.
    bent: bool,
}

/// The nodes of the same triangle with its second and third vertex exchanged.
fn mirrored(degree: usize, positions: &[Point]) -> Vec<Point> {
    let indices = basis::node_indices(degree);
    let find = |wanted: [usize; 3]| indices.iter().position(|&index| index == wanted);
    indices.iter().filter_map(|&[i, j, k]| find([i, k, j])).map(|node| positions[node]).collect()
}
