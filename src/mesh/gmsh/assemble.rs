//! From the content of a file to a mesh.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::super::geometry::{Nodes, straight_nodes};
use super::super::{BoundaryEdge, Curve, Mesh, Point};
use super::parse::{Content, Element};
use super::{Fault, circle, groups};
use crate::element::basis;

/// Deviation of a geometry node from its place on a straight triangle, relative to the longest edge, that rounding causes.
const STRAIGHT: f64 = 1e-10;
/// Largest |z| relative to the extent of the mesh.
const PLANE: f64 = 1e-9;

/// A line element on the boundary.
struct BoundaryLine {
    vertices: [usize; 2],
    group: i32,
    entity: i32,
    positions: Vec<Point>,
}

/// Builds the mesh.
pub fn assemble(content: Content) -> Result<Mesh, Fault> {
    if content.triangles.is_empty() {
        let hint =
            "mesh in two dimensions (`gmsh -2`); if there are physical curves, give the surface a physical group too";
        return Err(Fault::new("the mesh has no triangles", hint));
    }
    let places = Places::new(&content)?;
    let shapes = content.triangles.iter().map(|t| places.triangle(t)).collect::<Result<Vec<_>, _>>()?;
    let cells: Vec<[usize; 3]> = shapes.iter().map(|(corners, _)| *corners).collect();
    let lines = boundary_lines(&content, &places, &cells)?;

    let used: BTreeSet<i32> = lines.iter().map(|l| l.group).collect();
    let (mut tags, mut tag_of) = (Vec::<String>::new(), HashMap::new());
    for group in used {
        let name = content.names.get(&group).cloned().unwrap_or_else(|| group.to_string());
        let tag = tags.iter().position(|t| *t == name).unwrap_or_else(|| {
            tags.push(name);
            tags.len() - 1
        });
        tag_of.insert(group, tag);
    }
    let (curves, curve_of) = circles(&lines);
    let boundary: Vec<BoundaryEdge> = lines
        .iter()
        .zip(curve_of)
        .map(|(line, curve)| BoundaryEdge { vertices: line.vertices, tag: tag_of[&line.group], curve })
        .collect();

    let mut mesh = Mesh::build(places.vertices, cells, &boundary, tags, curves)?;
    mesh.curved = shapes.into_iter().map(|(_, nodes)| nodes.map(Box::new)).collect();
    mesh.check_curved()?;
    Ok(mesh)
}

/// Positions of the nodes, and which of them are corners of triangles.
struct Places {
    position: HashMap<usize, Point>,
    vertex: HashMap<usize, usize>,
    vertices: Vec<Point>,
}

impl Places {
    fn new(content: &Content) -> Result<Self, Fault> {
        let used: HashSet<usize> = content.triangles.iter().flat_map(|t| &t.nodes).copied().collect();
        let corners: HashSet<usize> = content.triangles.iter().flat_map(|t| &t.nodes[..3]).copied().collect();
        let mut places = Self { position: HashMap::new(), vertex: HashMap::new(), vertices: Vec::new() };
        let (mut extent, mut height, mut highest) = (0.0_f64, 0.0_f64, 0);
        for &(number, [x, y, z]) in &content.nodes {
            if places.position.insert(number, Point::new(x, y)).is_some() {
                return Err(Fault::new(format!("node {number} is listed twice"), "export the mesh from Gmsh again"));
            }
            if corners.contains(&number) {
                places.vertex.insert(number, places.vertices.len());
                places.vertices.push(Point::new(x, y));
            }
            if used.contains(&number) {
                extent = extent.max(x.abs()).max(y.abs());
                if z.abs() > height {
                    (height, highest) = (z.abs(), number);
                }
            }
        }
        if height > PLANE * extent {
            let what = format!("node {highest} has |z| = {height:.3e}, but the mesh must lie in the plane z = 0");
            return Err(Fault::new(what, "move or project the geometry into the plane z = 0"));
        }
        Ok(places)
    }

    fn positions(&self, element: &Element) -> Result<Vec<Point>, Fault> {
        let find = |node: &usize| {
            self.position.get(node).copied().ok_or_else(|| {
                let what = format!("element {} names node {node}, which section $Nodes does not list", element.number);
                Fault::new(what, "export the mesh from Gmsh again")
            })
        };
        element.nodes.iter().map(find).collect()
    }

    /// The corners counterclockwise, and the geometry nodes unless the cell is straight.
    fn triangle(&self, element: &Element) -> Result<([usize; 3], Option<Nodes>), Fault> {
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
        Ok((corners, bent.then_some(Nodes { degree, positions })))
    }
}

/// The nodes of the same triangle with its second and third vertex exchanged.
fn mirrored(degree: usize, positions: &[Point]) -> Vec<Point> {
    let indices = basis::node_indices(degree);
    let find = |wanted: [usize; 3]| indices.iter().position(|&index| index == wanted);
    indices.iter().filter_map(|&[i, j, k]| find([i, k, j])).map(|node| positions[node]).collect()
}

/// The line elements in physical curves; every boundary edge must be among them.
fn boundary_lines(content: &Content, places: &Places, cells: &[[usize; 3]]) -> Result<Vec<BoundaryLine>, Fault> {
    let mut cells_at: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    for cell in cells {
        (0..3).for_each(|f| *cells_at.entry(sorted(cell[f], cell[(f + 1) % 3])).or_default() += 1);
    }
    let mut lines = Vec::new();
    let mut group_of = HashMap::new();
    for element in &content.lines {
        let Some(group) = single_group(content, element.entity)? else { continue };
        let positions = places.positions(element)?;
        let name = content.names.get(&group).cloned().unwrap_or_else(|| group.to_string());
        let ends = [places.vertex.get(&element.nodes[0]), places.vertex.get(&element.nodes[1])];
        let [Some(&a), Some(&b)] = ends else {
            return Err(misplaced(&name, &positions));
        };
        if cells_at.get(&sorted(a, b)) != Some(&1) {
            return Err(misplaced(&name, &positions));
        }
        match group_of.insert(sorted(a, b), group) {
            None => lines.push(BoundaryLine { vertices: [a, b], group, entity: element.entity, positions }),
            Some(other) if other == group => {}
            Some(other) => {
                let what = format!("{} lies in two physical curves, {other} and {group}", edge(&positions));
                return Err(Fault::new(what, "put every boundary curve into exactly one physical group"));
            }
        }
    }
    match cells_at.iter().find(|(ends, count)| **count == 1 && !group_of.contains_key(*ends)) {
        None => Ok(lines),
        Some((ends, _)) => {
            let what = format!("{} is in no physical curve", edge(&ends.map(|v| places.vertices[v])));
            Err(Fault::new(what, "give every boundary curve a physical group: `Physical Curve(\"walls\") = {1, 2};`"))
        }
    }
}

/// The physical group of a curve of the geometry.
fn single_group(content: &Content, entity: i32) -> Result<Option<i32>, Fault> {
    match content.groups.get(&entity).map_or(&[][..], Vec::as_slice) {
        [] => Ok(None),
        [group] => Ok(Some(*group)),
        [first, second, ..] => {
            let what = format!("curve {entity} is in two physical groups, {first} and {second}");
            Err(Fault::new(what, "put every boundary curve into exactly one physical group"))
        }
    }
}

fn misplaced(name: &str, positions: &[Point]) -> Fault {
    let what = format!("{} of the physical curve `{name}` is no boundary edge of a triangle", edge(positions));
    Fault::new(what, "physical curves may only cover the boundary; take inner curves out of the physical groups")
}

fn edge(ends: &[Point]) -> String {
    format!("the edge from ({:.4}, {:.4}) to ({:.4}, {:.4})", ends[0].x, ends[0].y, ends[1].x, ends[1].y)
}

fn sorted(a: usize, b: usize) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

/// The circles that boundary parts follow, and the circle of every line.
///
/// Tried first is a whole connected part of a group, for Gmsh draws a circle as several arcs; then each arc by itself.
fn circles(lines: &[BoundaryLine]) -> (Vec<Curve>, Vec<Option<usize>>) {
    let edges: Vec<_> = lines.iter().map(|l| l.vertices).collect();
    let whole = groups(&edges, |i, j| lines[i].group == lines[j].group);
    let arcs = groups(&edges, |i, j| lines[i].group == lines[j].group && lines[i].entity == lines[j].entity);
    let mut curves = Vec::new();
    let mut curve_of = vec![None; lines.len()];
    for labels in [whole, arcs] {
        let mut parts = BTreeMap::<usize, Vec<usize>>::new();
        (0..lines.len()).for_each(|line| parts.entry(labels[line]).or_default().push(line));
        for part in parts.into_values() {
            if curve_of[part[0]].is_none()
                && let Some(curve) = circle_of(part.iter().map(|&line| &lines[line]))
            {
                part.iter().for_each(|&line| curve_of[line] = Some(curves.len()));
                curves.push(curve);
            }
        }
    }
    (curves, curve_of)
}

/// The circle of a connected part of the boundary. Each curve of the geometry in it must have an inner node: the straight
/// sides of a regular polygon, one edge each, are no circle although their ends lie on one.
fn circle_of<'a>(lines: impl Iterator<Item = &'a BoundaryLine>) -> Option<Curve> {
    let mut nodes = BTreeMap::new();
    let mut faces = Vec::new();
    let mut per_entity = BTreeMap::<i32, usize>::new();
    for line in lines {
        let ends = [line.positions[0], line.positions[1]];
        nodes.extend(line.vertices.into_iter().zip(ends));
        *per_entity.entry(line.entity).or_default() += line.positions.len() - 1;
        faces.push((ends, &line.positions[2..]));
    }
    let inner = faces.iter().flat_map(|(_, inner)| inner.iter().copied());
    let all: Vec<Point> = nodes.into_values().chain(inner).collect();
    let ends: Vec<[Point; 2]> = faces.iter().map(|(ends, _)| *ends).collect();
    if per_entity.values().any(|&pieces| pieces < 2) { None } else { circle::through(&all, &ends) }
}
