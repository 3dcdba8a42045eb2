//! Up–down asymmetry of a vector field.

use super::MeasureError;
use crate::form::Integrator;
use crate::mesh::Point;
use crate::mesh::locate::Locator;
use crate::space::Field;

/// The mirror images of all quadrature points, found once.
#[derive(Debug)]
pub struct Mirror {
    degree: usize,
    /// First image of every cell.
    start: Vec<usize>,
    images: Vec<(usize, Point)>,
}

impl Mirror {
    /// Finds the images in `x₂ = axis` of the points of a quadrature of degree `degree`.
    ///
    /// # Errors
    /// A point without image.
    pub fn new(loops: &Integrator, locator: &Locator, axis: f64, degree: usize) -> Result<Self, MeasureError> {
        let (mut start, mut images, mut missing) = (Vec::new(), Vec::new(), None);
        for cell in 0..loops.mesh.cells.len() {
            start.push(images.len());
            loops.each_cell_point(cell, degree, &mut |x| {
                let image = Point::new(x.site.x.x, 2.0 * axis - x.site.x.y);
                // a curved boundary may be meshed a little differently on the other side
                match locator.locate_near(&loops.mesh, image, 1e-2) {
                    Some(found) => images.push(found),
                    None => missing = missing.or(Some(x.site.x)),
                }
            });
        }
        match missing {
            Some(x) => Err(MeasureError::NoMirror { axis, x: x.x, y: x.y }),
            None => Ok(Self { degree, start, images }),
        }
    }

    /// `(∫[c₁(x) − c₁(x')]² + ∫[c₂(x) + c₂(x')]²)^½`, x' the mirror image of x   [10.7]
    pub fn asymmetry(&self, loops: &Integrator, field: &Field) -> f64 {
        let points = |cell: usize| {
            let end = self.start.get(cell + 1).copied().unwrap_or(self.images.len());
            &self.images[self.start[cell]..end]
        };
        let square = loops.sum(self.degree, |x| {
            let (other, xi) = points(x.site.cell)[x.site.q];
            let (here, there) = (field.vector(&x.site), field.vector_at(other, xi));
            (here.x - there.x).powi(2) + (here.y + there.y).powi(2)
        });
        square.sqrt()
    }
}
