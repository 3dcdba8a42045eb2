//! Which boundary edge lies on which curve, in which physical group.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::super::Point;
use super::Fault;
use super::assemble::{Places, Shape};
use super::parse::{Content, Element};
use crate::element::basis;

/// An edge of the boundary.
pub struct BoundaryLine {
    pub vertices: [usize; 2],
    pub group: Option<i32>,
    /// The curve of the geometry; `None` where no line element says it.
    pub entity: Option<i32>,
    /// Ends and inner geometry nodes.
    pub positions: Vec<Point>,
}

/// A side of a triangle.
#[derive(Clone, Copy)]
struct Edge {
    cells: usize,
    /// The first cell that has it, and which face of it.
    cell: usize,
    face: usize,
}

/// Line elements that are no boundary edges.
#[derive(Default)]
struct Left {
    /// Inside of the mesh, by the curve's name.
    inner: BTreeMap<String, usize>,
    /// On no triangle.
    stray: BTreeMap<String, usize>,
    /// Edges in two groups: the one that counts, and the other.
    double: BTreeMap<[i32; 2], usize>,
}

/// All edges of the boundary: first those that line elements name, in the order of the file, then the rest.
pub fn lines(
    content: &Content,
    places: &Places,
    shapes: &[Shape],
    notes: &mut Vec<String>,
) -> Result<Vec<BoundaryLine>, Fault> {
    let mut edges: BTreeMap<[usize; 2], Edge> = BTreeMap::new();
    for (cell, shape) in shapes.iter().enumerate() {
        for face in 0..3 {
            let ends = sorted(shape.corners[(face + 1) % 3], shape.corners[(face + 2) % 3]);
            edges.entry(ends).or_insert(Edge { cells: 0, cell, face }).cells += 1;
        }
    }
    let mut lines: Vec<BoundaryLine> = Vec::new();
    let mut line_of: HashMap<[usize; 2], usize> = HashMap::new();
    let mut left = Left::default();
    for element in &content.lines {
        let positions = places.positions(element)?;
        let vertex = |k: usize| places.vertex.get(&element.nodes[k]).copied();
        let ends = vertex(0).zip(vertex(1)).map(|(a, b)| [a, b]);
        let edge = ends.and_then(|[a, b]| edges.get(&sorted(a, b)));
        match (ends, edge.map(|edge| edge.cells)) {
            (Some(vertices), Some(1)) => {
                let entity = Some(element.entity).filter(|&entity| entity != 0);
                let new = BoundaryLine { vertices, group: element.group, entity, positions };
                left.add(&mut lines, &mut line_of, new);
            }
            (Some(_), Some(_)) => *left.inner.entry(name(content, element)).or_default() += 1,
            (Some(_) | None, _) => *left.stray.entry(name(content, element)).or_default() += 1,
        }
    }
    for (ends, edge) in edges.iter().filter(|(ends, edge)| edge.cells == 1 && !line_of.contains_key(*ends)) {
        lines.push(bare(*ends, edge, places, shapes));
    }
    note_decisions(content, places, &lines, &left, notes);
    Ok(lines)
}

impl Left {
    /// Keeps a line unless its edge has one; a group counts more than none, the first more than others.
    fn add(&mut self, lines: &mut Vec<BoundaryLine>, line_of: &mut HashMap<[usize; 2], usize>, new: BoundaryLine) {
        let [a, b] = new.vertices;
        let at = *line_of.entry(sorted(a, b)).or_insert(lines.len());
        match lines.get_mut(at) {
            None => lines.push(new),
            Some(old) => match (old.group, new.group) {
                (Some(first), Some(second)) if first != second => *self.double.entry([first, second]).or_default() += 1,
                (None, Some(_)) => *old = new,
                (Some(_) | None, _) => {}
            },
        }
    }
}

/// A boundary edge that no line element names; its nodes are those of its triangle.
fn bare(ends: [usize; 2], edge: &Edge, places: &Places, shapes: &[Shape]) -> BoundaryLine {
    let nodes = &shapes[edge.cell].nodes;
    let inner = basis::face_nodes(nodes.degree, edge.face);
    let inner = inner[1..nodes.degree].iter().map(|&node| nodes.positions[node]);
    let positions = ends.iter().map(|&v| places.vertices[v]).chain(inner).collect();
    BoundaryLine { vertices: ends, group: None, entity: None, positions }
}

fn name(content: &Content, element: &Element) -> String {
    match element.group {
        Some(group) => format!("`{}`", content.name(group)),
        None => "no group".to_owned(),
    }
}

/// Notes on what was left out or had to be decided.
fn note_decisions(content: &Content, places: &Places, lines: &[BoundaryLine], left: &Left, notes: &mut Vec<String>) {
    let listed = |map: &BTreeMap<String, usize>| {
        let count: usize = map.values().sum();
        (count, map.keys().cloned().collect::<Vec<_>>().join(", "))
    };
    let without: Vec<&BoundaryLine> = lines.iter().filter(|line| line.group.is_none()).collect();
    if let Some(first) = without.first() {
        let [a, b] = first.vertices.map(|v| places.vertices[v]);
        let all = if without.len() == lines.len() { "all " } else { "" };
        notes.push(format!(
            "{all}{} boundary edges without a physical group have the tag `boundary`, the first from ({:.4}, {:.4}) \
             to ({:.4}, {:.4}); \
             a curve gets another by `Physical Curve(\"walls\") = {{1, 2}};`{}",
            without.len(),
            a.x,
            a.y,
            b.x,
            b.y,
            unused_names(content, lines)
        ));
    }
    let mut seen = BTreeSet::new();
    for ([first, second], count) in &left.double {
        let (first, second) = (content.name(*first), content.name(*second));
        if first != second && seen.insert((first.clone(), second.clone())) {
            notes.push(format!(
                "{count} boundary edges are in two physical curves, `{first}` and `{second}`: they have the tag \
                 `{first}`"
            ));
        }
    }
    if !left.inner.is_empty() {
        let (count, names) = listed(&left.inner);
        notes.push(format!("{count} line elements inside of the mesh are ignored: of {names}"));
    }
    if !left.stray.is_empty() {
        let (count, names) = listed(&left.stray);
        notes.push(format!("{count} line elements that are no side of a triangle are ignored: of {names}"));
    }
}

/// Names that the file gives to groups without elements.
fn unused_names(content: &Content, lines: &[BoundaryLine]) -> &'static str {
    match !content.names.is_empty() && lines.iter().all(|line| line.group.is_none()) {
        true => "; the file names groups, but nothing is in them: version 2 with `Mesh.SaveAll` leaves them out",
        false => "",
    }
}

fn sorted(a: usize, b: usize) -> [usize; 2] {
    [a.min(b), a.max(b)]
}
