//! The bytes of a file.

use std::fmt::Write;

use super::super::{Face, Mesh, Point};
use super::{Encoding, groups};
use crate::element::basis;

const LINES: [i32; 3] = [1, 8, 26];
const TRIANGLES: [i32; 3] = [2, 9, 21];
const SURFACE: i32 = 1;

/// Faces that are one curve in the file.
struct FileCurve {
    tag: usize,
    faces: Vec<usize>,
}

/// The whole file.
pub fn encode(mesh: &Mesh, encoding: Encoding) -> Vec<u8> {
    let mut sink = Sink { bytes: Vec::new(), binary: encoding == Encoding::Binary };
    let parts = parts(mesh);
    let numbering = Numbering::new(mesh);
    format(&mut sink);
    names(&mut sink, mesh);
    entities(&mut sink, mesh, &parts);
    nodes(&mut sink, &numbering.positions);
    elements(&mut sink, mesh, &parts, &numbering);
    sink.bytes
}

/// The curves of the file: a connected arc of a circle, or a straight run. A run ends at a corner, so that a reader can
/// tell a polygon whose corners lie on a circle from the circle.
fn parts(mesh: &Mesh) -> Vec<FileCurve> {
    let boundary: Vec<(usize, &Face, usize)> =
        mesh.faces.iter().enumerate().filter_map(|(index, face)| face.tag.map(|tag| (index, face, tag))).collect();
    let ends: Vec<[usize; 2]> = boundary.iter().map(|(_, face, _)| mesh.face_vertices(face)).collect();
    let along = |k: usize| (mesh.vertices[ends[k][1]] - mesh.vertices[ends[k][0]]).normalize();
    let labels = groups(&ends, |i, j| {
        let ((_, f, s), (_, g, t)) = (boundary[i], boundary[j]);
        s == t && f.curve == g.curve && (f.curve.is_some() || along(i).perp(&along(j)).abs() < 1e-6)
    });
    let mut parts = Vec::<FileCurve>::new();
    for (label, (index, _, tag)) in labels.into_iter().zip(boundary) {
        if label == parts.len() {
            parts.push(FileCurve { tag, faces: Vec::new() });
        }
        parts[label].faces.push(index);
    }
    parts
}

/// Node numbers (from 0): first the vertices, then the inner nodes of the faces, then those of the cells.
struct Numbering {
    degree: usize,
    cells: Vec<Vec<usize>>,
    positions: Vec<Point>,
}

impl Numbering {
    fn new(mesh: &Mesh) -> Self {
        let degree = mesh.curved.iter().flatten().map(|nodes| nodes.degree).max().unwrap_or(1);
        let inner = degree - 1;
        let first_of_cells = mesh.vertices.len() + mesh.faces.len() * inner;
        let per_cell = basis::node_count(degree) - 3 - 3 * inner;
        let mut positions = mesh.vertices.clone();
        positions.resize(first_of_cells + mesh.cells.len() * per_cell, Point::zeros());
        let mut cells: Vec<Vec<usize>> = (0..mesh.cells.len())
            .map(|cell| {
                let mut nodes = mesh.cells[cell].to_vec();
                nodes.resize(3 + 3 * inner, 0);
                nodes.extend((0..per_cell).map(|k| first_of_cells + cell * per_cell + k));
                nodes
            })
            .collect();
        for (index, face) in mesh.faces.iter().enumerate() {
            for (side, turned) in [(Some(face.minus), false), (face.plus, true)] {
                let Some(side) = side else { continue };
                for k in 0..inner {
                    let local = basis::face_nodes(degree, side.face)[1 + k];
                    let along = if turned { inner - 1 - k } else { k };
                    cells[side.cell][local] = mesh.vertices.len() + index * inner + along;
                }
            }
        }
        // Curved cells come last, so that a face between a curved and a straight cell keeps the nodes that are stored.
        let (curved, straight): (Vec<usize>, Vec<usize>) = (0..cells.len()).partition(|&c| mesh.curved[c].is_some());
        for cell in straight.into_iter().chain(curved) {
            let places = cell_nodes(mesh, cell, degree);
            cells[cell].iter().zip(places).skip(3).for_each(|(&node, place)| positions[node] = place);
        }
        Self { degree, cells, positions }
    }
}

/// Nodes of degree `degree` of a cell; stored ones are not recomputed.
fn cell_nodes(mesh: &Mesh, cell: usize, degree: usize) -> Vec<Point> {
    match &mesh.curved[cell] {
        Some(nodes) if nodes.degree == degree => nodes.positions.clone(),
        Some(_) | None => basis::nodes(degree).into_iter().map(|xi| mesh.map(cell).at(xi).0).collect(),
    }
}

fn format(sink: &mut Sink) {
    sink.text(&format!("$MeshFormat\n4.1 {} 8\n", i32::from(sink.binary)));
    if sink.binary {
        sink.int(1);
        sink.text("\n");
    }
    sink.text("$EndMeshFormat\n");
}

/// The surface gets a name too: Gmsh saves only named parts once there are any.
fn names(sink: &mut Sink, mesh: &Mesh) {
    let mut text = format!("$PhysicalNames\n{}\n", mesh.tags.len() + 1);
    for (tag, name) in mesh.tags.iter().enumerate() {
        writeln!(text, "1 {} \"{name}\"", tag + 1).expect("writing to a String");
    }
    sink.text(&(text + "2 1 \"cells\"\n$EndPhysicalNames\n"));
}

fn entities(sink: &mut Sink, mesh: &Mesh, parts: &[FileCurve]) {
    sink.text("$Entities\n");
    [0, parts.len(), 1, 0].into_iter().for_each(|count| sink.size(count));
    sink.end_line();
    for (index, part) in parts.iter().enumerate() {
        sink.int(index as i32 + 1);
        let ends = part.faces.iter().flat_map(|&face| mesh.face_vertices(&mesh.faces[face]));
        sink.bounds(ends.map(|v| mesh.vertices[v]));
        sink.size(1);
        sink.int(part.tag as i32 + 1);
        sink.size(0);
        sink.end_line();
    }
    sink.int(SURFACE);
    sink.bounds(mesh.vertices.iter().copied());
    sink.size(1);
    sink.int(1);
    sink.size(parts.len());
    (0..parts.len()).for_each(|index| sink.int(index as i32 + 1));
    sink.end_line();
    sink.text(if sink.binary { "\n$EndEntities\n" } else { "$EndEntities\n" });
}

fn nodes(sink: &mut Sink, positions: &[Point]) {
    sink.text("$Nodes\n");
    [1, positions.len(), 1, positions.len()].into_iter().for_each(|count| sink.size(count));
    sink.end_line();
    [2, SURFACE, 0].into_iter().for_each(|value| sink.int(value));
    sink.size(positions.len());
    sink.end_line();
    for node in 0..positions.len() {
        sink.size(node + 1);
        sink.end_line();
    }
    for x in positions {
        [x.x, x.y, 0.0].into_iter().for_each(|value| sink.real(value));
        sink.end_line();
    }
    sink.text(if sink.binary { "\n$EndNodes\n" } else { "$EndNodes\n" });
}

fn elements(sink: &mut Sink, mesh: &Mesh, parts: &[FileCurve], numbering: &Numbering) {
    let degree = numbering.degree;
    let lines: usize = parts.iter().map(|part| part.faces.len()).sum();
    let total = lines + mesh.cells.len();
    sink.text("$Elements\n");
    [parts.len() + 1, total, 1, total].into_iter().for_each(|count| sink.size(count));
    sink.end_line();
    let mut number = 1;
    let mut element = |sink: &mut Sink, nodes: &[usize]| {
        sink.size(number);
        nodes.iter().for_each(|node| sink.size(node + 1));
        sink.end_line();
        number += 1;
    };
    for (index, part) in parts.iter().enumerate() {
        sink.block(1, index as i32 + 1, LINES[degree - 1], part.faces.len());
        for &face in &part.faces {
            let side = mesh.faces[face].minus;
            let local = basis::face_nodes(degree, side.face);
            let order = [0, degree].into_iter().chain(1..degree);
            let nodes: Vec<usize> = order.map(|k| numbering.cells[side.cell][local[k]]).collect();
            element(sink, &nodes);
        }
    }
    sink.block(2, SURFACE, TRIANGLES[degree - 1], mesh.cells.len());
    numbering.cells.iter().for_each(|nodes| element(sink, nodes));
    sink.text(if sink.binary { "\n$EndElements\n" } else { "$EndElements\n" });
}

/// Collects numbers as text or as bytes.
struct Sink {
    bytes: Vec<u8>,
    binary: bool,
}

impl Sink {
    fn text(&mut self, text: &str) {
        self.bytes.extend_from_slice(text.as_bytes());
    }

    fn int(&mut self, value: i32) {
        if self.binary { self.bytes.extend(value.to_le_bytes()) } else { self.text(&format!("{value} ")) }
    }

    fn size(&mut self, value: usize) {
        if self.binary { self.bytes.extend((value as u64).to_le_bytes()) } else { self.text(&format!("{value} ")) }
    }

    /// The shortest decimal number that is read back as the same bits.
    fn real(&mut self, value: f64) {
        if self.binary { self.bytes.extend(value.to_le_bytes()) } else { self.text(&format!("{value:e} ")) }
    }

    fn bounds(&mut self, points: impl Iterator<Item = Point>) {
        let none = Point::repeat(f64::INFINITY);
        let (low, high) = points.fold((none, -none), |(low, high), x| (low.inf(&x), high.sup(&x)));
        [low.x, low.y, 0.0, high.x, high.y, 0.0].into_iter().for_each(|value| self.real(value));
    }

    /// The head of a block of elements.
    fn block(&mut self, dimension: i32, entity: i32, kind: i32, count: usize) {
        [dimension, entity, kind].into_iter().for_each(|value| self.int(value));
        self.size(count);
        self.end_line();
    }

    fn end_line(&mut self) {
        if !self.binary {
            self.bytes.pop_if(|last| *last == b' ');
            self.text("\n");
        }
    }
}
