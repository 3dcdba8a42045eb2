//! Uniform refinement.

use super::{BoundaryEdge, Mesh, MeshError, Point, Slits};

impl Mesh {
    /// Every cell cut into four. Midpoints of faces on a curve lie on the curve; tags, curves and the degree of curved
    /// cells are kept, and so is mirror symmetry in x₂ = 0.
    ///
    /// # Errors
    /// [`MeshError::Inverted`] where the curve is too far from the straight faces of a coarse mesh.
    pub fn refined(&self) -> Result<Mesh, MeshError> {
        let old = self.vertices.len();
        let mut vertices = self.vertices.clone();
        vertices.extend((0..self.faces.len()).map(|face| self.face_midpoint(face)));
        let mut cells = Vec::with_capacity(4 * self.cells.len());
        for (&[a, b, c], faces) in self.cells.iter().zip(&self.cell_faces) {
            let [p, q, r] = faces.map(|face| old + face);
            cells.extend([[a, r, q], [r, b, p], [q, p, c], [p, q, r]]);
        }
        check_orientation(&vertices, &cells)?;
        let mut boundary = Vec::new();
        for (index, face) in self.faces.iter().enumerate() {
            let Some(tag) = face.tag else { continue };
            let [a, b] = self.face_vertices(face);
            let halves = [[a, old + index], [old + index, b]];
            boundary.extend(halves.map(|vertices| BoundaryEdge { vertices, tag, curve: face.curve }));
        }
        let mut fine = Mesh::connected(vertices, cells, &boundary, self.tags.clone(), self.curves.clone())?;
        fine.notes.clone_from(&self.notes);
        let degree = self.curved.iter().flatten().map(|nodes| nodes.degree).max().unwrap_or(1);
        fine.bend(degree)?;
        // slits of the coarse mesh have been accepted
        fine.check_embedding(Slits::Kept)?;
        Ok(fine)
    }

    /// The midpoint of a face, on its curve. The mean is projected, not the arc halved: the same bits, mirrored, on the
    /// other side of a symmetric mesh.
    fn face_midpoint(&self, face: usize) -> Point {
        let face = &self.faces[face];
        let [a, b] = self.face_vertices(face).map(|v| self.vertices[v]);
        let middle = (a + b) * 0.5;
        face.curve.map_or(middle, |curve| self.curves[curve].project(middle))
    }
}

/// `Mesh::build` would turn a clockwise cell; here it is one that overlaps its neighbours.
fn check_orientation(vertices: &[Point], cells: &[[usize; 3]]) -> Result<(), MeshError> {
    for (cell, corners) in cells.iter().enumerate() {
        let [a, b, c] = corners.map(|v| vertices[v]);
        let area = 0.5 * (b - a).perp(&(c - a));
        if area <= 0.0 || area.is_nan() {
            let x = (a + b + c) / 3.0;
            let hint = "the mesh is too coarse for its curved boundary: choose a smaller `mesh.h`";
            return Err(MeshError::Inverted { cell, x: x.x, y: x.y, area, hint });
        }
    }
    Ok(())
}
