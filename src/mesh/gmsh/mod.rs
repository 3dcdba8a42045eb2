//! Mesh files of Gmsh: format MSH 4.1, ASCII or binary (little-endian).
//!
//! Read are triangles of order 1, 2 and 3 and the line elements on their boundary. A physical curve becomes a boundary
//! tag under its name, or under its number when it has none. High-order triangles that are not straight keep the nodes of
//! the file; boundary parts whose nodes lie on one circle get that circle as exact curve. What is written is read back
//! with the same vertices, cells, tags, circles and geometry nodes, bit for bit.

mod assemble;
mod circle;
mod parse;
mod scan;
mod write;

use std::path::Path;

use super::{Mesh, MeshError};
use crate::output::mark::MADE_BY;

/// How numbers are stored in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Ascii,
    Binary,
}

/// What is wrong with a file; [`read`] adds the file's name.
#[derive(Debug)]
struct Fault {
    what: String,
    hint: String,
}

impl Fault {
    fn new(what: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { what: what.into(), hint: hint.into() }
    }

    fn in_file(self, path: &Path) -> MeshError {
        MeshError::File { file: path.display().to_string(), what: self.what, hint: self.hint }
    }
}

/// Errors of the mesh itself are reported as errors of the file they come from.
impl From<MeshError> for Fault {
    fn from(error: MeshError) -> Self {
        let text = error.to_string();
        match text.split_once("; hint: ") {
            Some((what, hint)) => Self::new(what, hint),
            None => Self::new(text, "open the mesh in Gmsh and look at this place"),
        }
    }
}

/// Reads a mesh.
///
/// # Errors
/// [`MeshError::File`]: a missing or truncated file, another format version, elements other than points, lines and
/// triangles up to order 3, nodes outside the plane z = 0, boundary edges in no physical curve, and whatever
/// [`Mesh::build`] and [`Mesh::check_curved`] refuse.
pub fn read(path: &Path) -> Result<Mesh, MeshError> {
    let unreadable = |e: std::io::Error| Fault::new(format!("cannot be read: {e}"), "check the path of the mesh file");
    std::fs::read(path)
        .map_err(unreadable)
        .and_then(|bytes| parse::parse(&bytes))
        .and_then(assemble::assemble)
        .map_err(|fault| fault.in_file(path))
}

/// Writes a mesh. If a cell is curved the whole mesh is written at the highest geometry degree.
///
/// # Errors
/// [`MeshError::File`] when the file cannot be written.
pub fn write(mesh: &Mesh, path: &Path, encoding: Encoding) -> Result<(), MeshError> {
    let hint = "check that the folder exists and can be written to";
    let mut bytes = write::encode(mesh, encoding);
    bytes.extend(format!("$Comments\n{MADE_BY}\n$EndComments\n").bytes());
    std::fs::write(path, bytes).map_err(|e| Fault::new(format!("cannot be written: {e}"), hint).in_file(path))
}

/// Connected groups of edges: the group number of every edge, groups numbered by their first edge. Two edges that share
/// a vertex belong together when `joined` says so.
fn groups(edges: &[[usize; 2]], joined: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    let mut at_vertex = std::collections::HashMap::<usize, Vec<usize>>::new();
    for (edge, ends) in edges.iter().enumerate() {
        ends.iter().for_each(|&v| at_vertex.entry(v).or_default().push(edge));
    }
    let mut group = vec![None; edges.len()];
    let mut count = 0;
    for first in 0..edges.len() {
        if group[first].is_some() {
            continue;
        }
        let mut open = vec![first];
        while let Some(edge) = open.pop() {
            if group[edge].replace(count).is_none() {
                let near = edges[edge].iter().flat_map(|v| &at_vertex[v]).copied();
                open.extend(near.filter(|&other| group[other].is_none() && joined(edge, other)));
            }
        }
        count += 1;
    }
    group.into_iter().flatten().collect()
}
