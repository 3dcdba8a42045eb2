//! Mesh files of Gmsh: formats MSH 2.0 to 2.2, 4.0 and 4.1, ASCII or binary, read; 4.1 written.
//!
//! Read are triangles of order 1, 2 and 3 and the line elements on their boundary. A physical curve becomes a boundary
//! tag under its name, or under its number when it has none; boundary edges in no physical curve get the tag
//! `boundary`. What is left out or had to be decided is told in [`Mesh::notes`]. High-order triangles that are not
//! straight keep the nodes of the file; boundary parts whose nodes lie on one circle get that circle as exact curve.
//! What is written is read back with the same vertices, cells, tags, circles and geometry nodes, bit for bit.

mod assemble;
mod boundary;
mod circle;
mod element_kind;
mod foreign;
mod parse;
mod scan;
mod version2;
mod version4;
mod write;

use std::path::Path;

use super::embedding::Slits;
use super::{Mesh, MeshError};
use crate::names::MADE_BY;

pub use foreign::is_mesh_file;

/// How numbers are stored in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Text, which people and other programs read.
    Ascii,
    /// Quicker to read.
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

/// How a file is taken beyond what is in it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reading {
    /// Degree of the cells on circles; `None` keeps the geometry of the file.
    pub curved: Option<usize>,
    /// What happens to lines inside of the domain.
    pub slits: Slits,
}

/// Reads a mesh.
///
/// # Errors
/// [`MeshError::File`]: a file that cannot be read, or whose mesh has other elements than those of a plane
/// triangulation or is refused.
pub fn read(path: &Path) -> Result<Mesh, MeshError> {
    read_as(path, Reading::default())
}

/// Reads a mesh, perhaps to bend its cells or to keep its slits.
///
/// # Errors
/// [`MeshError::File`]: a missing or truncated file, files of other programs and versions, elements other than points,
/// lines and triangles up to order 3, nodes outside of one plane z = const, and whatever [`Mesh::build`],
/// [`Mesh::bend`] and [`Mesh::check_curved`] refuse.
pub fn read_as(path: &Path, reading: Reading) -> Result<Mesh, MeshError> {
    let unreadable = |e: std::io::Error| Fault::new(format!("cannot be read: {e}"), "check the path of the mesh file");
    let whole = || -> Result<Mesh, Fault> {
        let bytes = std::fs::read(path).map_err(unreadable)?;
        foreign::by_name(path)?;
        foreign::by_content(&bytes)?;
        let mut mesh = assemble::assemble(parse::parse(&bytes)?)?;
        if let Some(degree) = reading.curved {
            mesh.bend(degree)?;
        }
        mesh.check_embedding(reading.slits)?;
        Ok(mesh)
    };
    whole().map_err(|fault| fault.in_file(path))
}

/// Writes a mesh. If a cell is curved the whole mesh is written at the highest geometry degree.
///
/// # Errors
/// [`MeshError::File`] when the file cannot be written, or a tag's name cannot stand in one: the format puts names in
/// quotes and knows no escapes.
pub fn write(mesh: &Mesh, path: &Path, encoding: Encoding) -> Result<(), MeshError> {
    if let Some(tag) = mesh.tags.iter().find(|tag| tag.is_empty() || tag.contains(|c: char| c == '"' || c.is_control()))
    {
        let what = format!("the tag {tag:?} cannot be written: Gmsh's names have no quotes and no line ends");
        return Err(Fault::new(what, "rename the physical curve in the file that the mesh comes from").in_file(path));
    }
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
