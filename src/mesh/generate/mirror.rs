//! From the triangulated outline to the mesh: mirror image, stretch, tags.

use super::outline::{Border, Outline};
use super::stretch::Stretch;
use crate::mesh::{BoundaryEdge, Curve, Mesh, MeshError, Point};

/// Points (those of the border first) and cells in the isotropic coordinates.
pub(super) struct Draft {
    pub points: Vec<Point>,
    pub cells: Vec<[usize; 3]>,
    pub border: Border,
    pub outline: Outline,
}

impl Draft {
    /// The mesh in the scene's coordinates.
    ///
    /// # Errors
    /// A cell that the stretch turned over, and what [`Mesh::build`] finds.
    pub fn finish(self, symmetric: bool, stretch: &Stretch) -> Result<Mesh, MeshError> {
        let Outline { tags, curves, .. } = self.outline;
        let mut cells = self.cells;
        let mut edges = Vec::with_capacity(2 * self.border.edges.len());
        for (&vertices, &(tag, curve)) in self.border.edges.iter().zip(&self.border.marks) {
            // The axis of a symmetric mesh has no tag and is no boundary.
            edges.extend(tag.map(|tag| BoundaryEdge { vertices, tag, curve }));
        }
        let mut vertices = self.points;
        if symmetric {
            reflect(&mut vertices, &mut cells, &mut edges, &curves);
        }
        for x in &mut vertices {
            x.x = stretch.back(x.x);
        }
        // `Mesh::build` would turn a clockwise cell; after the stretch it is one that overlaps its neighbours.
        for (cell, &corners) in cells.iter().enumerate() {
            let [a, b, c] = corners.map(|v| vertices[v]);
            let area = 0.5 * (b - a).perp(&(c - a));
            if area <= 0.0 || area.is_nan() {
                let x = (a + b + c) / 3.0;
                let hint = "choose a smaller `mesh.stretch` or `mesh.h`";
                return Err(MeshError::Inverted { cell, x: x.x, y: x.y, area, hint });
            }
        }
        Mesh::connected(vertices, cells, &edges, tags, curves)
    }
}

/// Adds the mirror image in `x₂ = 0`; vertices on the axis are shared.
fn reflect(vertices: &mut Vec<Point>, cells: &mut Vec<[usize; 3]>, edges: &mut Vec<BoundaryEdge>, curves: &[Curve]) {
    let count = vertices.len();
    let mut image = Vec::with_capacity(count);
    for v in 0..count {
        let x = vertices[v];
        if x.y == 0.0 {
            image.push(v);
        } else {
            image.push(vertices.len());
            vertices.push(Point::new(x.x, -x.y));
        }
    }
    cells.extend_from_within(..);
    let half = cells.len() / 2;
    for cell in &mut cells[half..] {
        let [a, b, c] = cell.map(|v| image[v]);
        *cell = [a, c, b];
    }
    let mirrored = |curve: usize| {
        let Curve::Circle { centre, radius } = curves[curve];
        let same = Curve::Circle { centre: Point::new(centre.x, -centre.y), radius };
        curves.iter().position(|c| *c == same).expect("the curves of a symmetric outline come in mirrored pairs")
    };
    edges.extend_from_within(..);
    let half = edges.len() / 2;
    for edge in &mut edges[half..] {
        edge.vertices = edge.vertices.map(|v| image[v]);
        edge.curve = edge.curve.map(mirrored);
    }
}
