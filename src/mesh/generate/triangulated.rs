//! From an outline to a mesh whose edges follow a size function.

use super::mirror::Draft;
use super::outline::Outline;
use super::size::Size;
use super::stretch::Stretch;
use super::{front, relax};
use crate::mesh::{Mesh, MeshError, Slits};

/// What an unstructured mesh is made of.
pub(super) struct Plan {
    /// Of the domain, or of its upper half where the mesh is symmetric.
    pub outline: Outline,
    pub size: Size,
    pub symmetric: bool,
    pub stretch: Stretch,
    /// Degree of the cells on circles.
    pub curved: usize,
}

impl Plan {
    /// A mesh that is not stretched.
    pub fn new(outline: Outline, size: Size, symmetric: bool, curved: usize) -> Self {
        Self { outline, size, symmetric, stretch: Stretch::NONE, curved }
    }

    /// Triangulates the outline, lays points inside, smooths, bends.
    ///
    /// # Errors
    /// A cell that the stretch turned over; the errors of [`Mesh::build`] and [`Mesh::bend`]; boundaries that meet.
    pub fn build(self) -> Result<Mesh, MeshError> {
        let Self { outline, size, symmetric, stretch, curved } = self;
        let border = outline.divide(&size);
        let points = relax::relax(front::fill(&border, &size), &border, &size);
        let cells = front::triangulate(&points, &border.edges);
        let mut mesh = Draft { points, cells, border, outline }.finish(symmetric, &stretch)?;
        mesh.bend(curved)?;
        mesh.check_embedding(Slits::Refused)?;
        Ok(mesh)
    }
}
