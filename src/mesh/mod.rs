//! Conforming meshes of straight or curved triangles, with named boundary tags.
//!
//! Vertices of a cell run counterclockwise; local face `f` lies opposite local vertex `f` and runs from vertex `f+1` to
//! vertex `f+2` (mod 3). A face has a side `minus` and, unless it lies on the boundary, a side `plus`; its normal
//! points from minus to plus, or outwards. Lengths are in the scene's unit (dimensionless).

pub mod curve;
pub mod embedding;
pub mod generate;
pub mod geometry;
pub mod gmsh;
pub mod locate;
pub mod quality;
pub(crate) mod refine;

use std::collections::HashMap;

use nalgebra::Vector2;

pub use curve::Curve;
pub use embedding::{NearMiss, Parts, Slits};
pub use geometry::CellMap;

/// A point or vector of the plane.
pub type Point = Vector2<f64>;

/// What can be wrong with a mesh.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum MeshError {
    #[error("cell {cell} at ({x:.4}, {y:.4}) is inverted or flat: its signed area is {area:.3e}; hint: {hint}")]
    Inverted { cell: usize, x: f64, y: f64, area: f64, hint: &'static str },
    #[error("the edge between vertices {a} and {b} belongs to {count} cells; a conforming mesh has at most two")]
    NonManifold { a: usize, b: usize, count: usize },
    #[error(
        "the boundary edge from ({x0:.4}, {y0:.4}) to ({x1:.4}, {y1:.4}) has no tag; hint: give every boundary edge a \
         tag (a physical curve in Gmsh)"
    )]
    Untagged { x0: f64, y0: f64, x1: f64, y1: f64 },
    #[error("the tagged edge between vertices {a} and {b} (tag `{tag}`) is no boundary face of the mesh")]
    NotOnBoundary { a: usize, b: usize, tag: String },
    #[error("cell {cell} names vertex {vertex}, but the mesh has {count} vertices")]
    BadVertex { cell: usize, vertex: usize, count: usize },
    #[error("the mesh has no cells")]
    Empty,
    #[error(
        "the mesh is folded at the edge from ({x0:.4}, {y0:.4}) to ({x1:.4}, {y1:.4}): cells {cells:?} lie on the \
         same side of it; \
         hint: move the vertex that lies beyond its neighbours, or mesh again"
    )]
    Folded { x0: f64, y0: f64, x1: f64, y1: f64, cells: [usize; 2] },
    #[error(
        "the mesh overlaps itself at ({x:.4}, {y:.4}): {what}; hint: look at this place in Gmsh; surfaces may touch \
         but not \
         overlap (`BooleanDifference`, `BooleanFragments`)"
    )]
    Overlap { x: f64, y: f64, what: String },
    #[error(
        "the mesh touches itself in the single vertex ({x:.4}, {y:.4}), where nothing can flow from one side to the \
         other; hint: \
         let the parts share an edge, or move them apart"
    )]
    Pinched { x: f64, y: f64 },
    #[error(
        "the mesh is cut through: {count} pairs of boundary edges lie on one another without sharing their nodes, the \
         first from ({:.4}, {:.4}) to ({:.4}, {:.4}), of the tags `{}` and `{}` (connected parts: {parts}); hint: \
         merge what touches before meshing (`Coherence;` or `BooleanFragments` in Gmsh) or the mesh itself (`Coherence \
         Mesh;`), or set `mesh.slits = true` if these are walls without thickness",
        .ends[0], .ends[1], .ends[2], .ends[3], .tags[0], .tags[1]
    )]
    Cut { count: usize, ends: [f64; 4], tags: [String; 2], parts: usize },
    #[error("mesh key `{key}` = {value}: {rule}; hint: {hint}")]
    BadKey { key: String, value: String, rule: String, hint: String },
    #[error("{file}: {what}; hint: {hint}")]
    File { file: String, what: String, hint: String },
}

/// A boundary edge as a generator or a file names it.
#[derive(Debug, Clone, Copy)]
pub struct BoundaryEdge {
    /// Its ends.
    pub vertices: [usize; 2],
    /// Index into the mesh's tags.
    pub tag: usize,
    /// Index into the mesh's curves; `None` for a straight edge.
    pub curve: Option<usize>,
}

/// One side of a face: the cell, and which of its three local faces this is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Side {
    /// Number of the cell.
    pub cell: usize,
    /// Local number of the face in it, 0 to 2.
    pub face: usize,
}

/// A face between two cells, or on the boundary.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    /// The cell that the normal leaves.
    pub minus: Side,
    /// `None` on the boundary.
    pub plus: Option<Side>,
    /// Tag of a boundary face.
    pub tag: Option<usize>,
    /// Exact curve of a boundary face.
    pub curve: Option<usize>,
}

/// A conforming triangle mesh.
#[derive(Debug, Clone)]
pub struct Mesh {
    /// Corners of cells.
    pub vertices: Vec<Point>,
    /// Corners of each cell, counterclockwise.
    pub cells: Vec<[usize; 3]>,
    /// All sides of cells, each once.
    pub faces: Vec<Face>,
    /// The three faces of every cell, by local face number.
    pub cell_faces: Vec<[usize; 3]>,
    /// Names of the boundary parts.
    pub tags: Vec<String>,
    /// Exact boundary curves that faces refer to.
    pub curves: Vec<Curve>,
    /// Geometry nodes (isoparametric degree and positions) of curved cells; `None` for affine cells.
    pub curved: Vec<Option<Box<geometry::Nodes>>>,
    /// Vertices that lie where another one lies, of the boundary.
    pub coincident: Vec<usize>,
    /// What a reader of the mesh's file left out or had to decide.
    pub notes: Vec<String>,
}

impl Mesh {
    /// Builds faces and adjacency from cells and tagged boundary edges. Cells given clockwise are turned.
    ///
    /// # Errors
    /// Flat cells, non-manifold edges, boundary edges without a tag, tagged edges that are not on the boundary; folds,
    /// overlaps, and parts that touch in a vertex or along edges without sharing their nodes.
    pub fn build(
        vertices: Vec<Point>,
        cells: Vec<[usize; 3]>,
        boundary: &[BoundaryEdge],
        tags: Vec<String>,
        curves: Vec<Curve>,
    ) -> Result<Self, MeshError> {
        let mut mesh = Self::connected(vertices, cells, boundary, tags, curves)?;
        mesh.check_embedding(Slits::Refused)?;
        Ok(mesh)
    }

    /// As [`Mesh::build`], of a mesh whose cells are still to be bent: whether parts far from each other overlap is
    /// not checked.
    pub(crate) fn connected(
        vertices: Vec<Point>,
        mut cells: Vec<[usize; 3]>,
        boundary: &[BoundaryEdge],
        tags: Vec<String>,
        curves: Vec<Curve>,
    ) -> Result<Self, MeshError> {
        if cells.is_empty() {
            return Err(MeshError::Empty);
        }
        orient(&vertices, &mut cells)?;
        let (mut faces, cell_faces, by_edge) = connect(&vertices, &cells)?;
        for edge in boundary {
            let [a, b] = edge.vertices;
            match by_edge.get(&key(a, b)).map(|&f| &mut faces[f]) {
                Some(face) if face.plus.is_none() => {
                    face.tag = Some(edge.tag);
                    face.curve = edge.curve;
                }
                Some(_) | None => {
                    return Err(MeshError::NotOnBoundary { a, b, tag: tags[edge.tag].clone() });
                }
            }
        }
        let curved = vec![None; cells.len()];
        let mesh = Self {
            vertices,
            cells,
            faces,
            cell_faces,
            tags,
            curves,
            curved,
            coincident: Vec::new(),
            notes: Vec::new(),
        };
        if let Some(face) = mesh.faces.iter().find(|f| f.plus.is_none() && f.tag.is_none()) {
            let [p, q] = mesh.face_vertices(face).map(|v| mesh.vertices[v]);
            return Err(MeshError::Untagged { x0: p.x, y0: p.y, x1: q.x, y1: q.y });
        }
        mesh.check_fans()?;
        Ok(mesh)
    }

    /// The two vertices of a face, in the direction in which the minus cell runs along it.
    pub fn face_vertices(&self, face: &Face) -> [usize; 2] {
        let cell = &self.cells[face.minus.cell];
        [cell[(face.minus.face + 1) % 3], cell[(face.minus.face + 2) % 3]]
    }

    /// Index of the tag `name`.
    pub fn tag(&self, name: &str) -> Option<usize> {
        self.tags.iter().position(|t| t == name)
    }

    /// Corner positions of a cell.
    pub fn corners(&self, cell: usize) -> [Point; 3] {
        self.cells[cell].map(|v| self.vertices[v])
    }

    /// Mean of the corners.
    pub fn centroid(&self, cell: usize) -> Point {
        let [a, b, c] = self.corners(cell);
        (a + b + c) / 3.0
    }

    /// The cell on the other side of local face `face` of `cell`, as seen from there.
    pub fn neighbour(&self, cell: usize, face: usize) -> Option<Side> {
        let shared = &self.faces[self.cell_faces[cell][face]];
        if shared.minus.cell == cell && shared.minus.face == face { shared.plus } else { Some(shared.minus) }
    }

    /// A number that tells meshes apart: a hash of cells, vertices, tags and geometry nodes, bit by bit.
    pub fn fingerprint(&self) -> u64 {
        // FNV-1a: the same on every machine, unlike the standard library's hashers
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut add = |word: u64| hash = (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3);
        self.cells.iter().flatten().for_each(|&v| add(v as u64));
        self.faces.iter().filter_map(|f| f.tag).for_each(|tag| add(tag as u64));
        let bent = self.curved.iter().flatten().flat_map(|nodes| &nodes.positions);
        self.vertices.iter().chain(bent).flat_map(|x| [x.x, x.y]).for_each(|c| add(c.to_bits()));
        hash
    }

    /// Area of the domain, curved cells included.
    pub fn area(&self) -> f64 {
        (0..self.cells.len()).map(|cell| self.cell_area(cell)).sum()
    }
}

fn key(a: usize, b: usize) -> (usize, usize) {
    (a.min(b), a.max(b))
}

/// Turns clockwise cells; refuses flat ones and vertices out of range.
fn orient(vertices: &[Point], cells: &mut [[usize; 3]]) -> Result<(), MeshError> {
    for (index, cell) in cells.iter_mut().enumerate() {
        if let Some(&vertex) = cell.iter().find(|&&v| v >= vertices.len()) {
            return Err(MeshError::BadVertex { cell: index, vertex, count: vertices.len() });
        }
        let [a, b, c] = cell.map(|v| vertices[v]);
        let area = 0.5 * (b - a).perp(&(c - a));
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        if area.abs() <= 1e-14 * longest || area.is_nan() {
            let hint = "remove the sliver or the repeated vertex from the mesh";
            let centre = (a + b + c) / 3.0;
            return Err(MeshError::Inverted { cell: index, x: centre.x, y: centre.y, area, hint });
        }
        if area < 0.0 {
            cell.swap(1, 2);
        }
    }
    Ok(())
}

type Connections = (Vec<Face>, Vec<[usize; 3]>, HashMap<(usize, usize), usize>);

/// Numbers the faces in the order in which the cells meet them.
fn connect(vertices: &[Point], cells: &[[usize; 3]]) -> Result<Connections, MeshError> {
    let mut faces: Vec<Face> = Vec::with_capacity(cells.len() * 3 / 2 + 16);
    let mut cell_faces = vec![[0; 3]; cells.len()];
    let mut by_edge = HashMap::with_capacity(cells.len() * 2);
    for (index, cell) in cells.iter().enumerate() {
        for local in 0..3 {
            let (a, b) = (cell[(local + 1) % 3], cell[(local + 2) % 3]);
            let side = Side { cell: index, face: local };
            let number = *by_edge.entry(key(a, b)).or_insert_with(|| {
                faces.push(Face { minus: side, plus: None, tag: None, curve: None });
                faces.len() - 1
            });
            let face = &mut faces[number];
            if face.minus != side {
                if face.plus.is_some() {
                    return Err(MeshError::NonManifold { a, b, count: 3 });
                }
                let first = cells[face.minus.cell];
                // counterclockwise neighbours run along their face in opposite directions
                if first[(face.minus.face + 1) % 3] == a {
                    let (p, q) = (vertices[a], vertices[b]);
                    let cells = [face.minus.cell, index];
                    return Err(MeshError::Folded { x0: p.x, y0: p.y, x1: q.x, y1: q.y, cells });
                }
                face.plus = Some(side);
            }
            cell_faces[index][local] = number;
        }
    }
    Ok((faces, cell_faces, by_edge))
}
