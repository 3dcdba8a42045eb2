//! Polynomials on the inner faces of a mesh: the values with which cells of a hybrid method talk to one another.
//!
//! On a face the basis are the Legendre polynomials in the place `s` along it, 0 to 1 as the minus side runs,
//! orthonormal there; two components, one after the other.

use std::sync::Arc;

use crate::element::MAX_DEGREE;
use crate::mesh::{Mesh, Point};

/// Most polynomials on a face.
pub const MAX_MODES: usize = MAX_DEGREE + 1;

/// No values on this face.
const NONE: u32 = u32::MAX;

/// The space of all vector polynomials of some degree on the inner faces.
#[derive(Debug)]
pub struct Skeleton {
    /// Whose faces these are.
    pub mesh: Arc<Mesh>,
    /// Of the polynomials.
    pub degree: usize,
    /// The inner faces, by their number in the mesh.
    pub faces: Vec<u32>,
    /// Place of every face of the mesh among the inner ones.
    place: Vec<u32>,
}

impl Skeleton {
    /// Of polynomials of this degree.
    ///
    /// # Panics
    /// A degree above [`MAX_DEGREE`].
    pub fn new(mesh: &Arc<Mesh>, degree: usize) -> Self {
        assert!(degree <= MAX_DEGREE);
        let mut place = vec![NONE; mesh.faces.len()];
        let mut faces = Vec::new();
        for (index, face) in mesh.faces.iter().enumerate().filter(|(_, face)| face.plus.is_some()) {
            place[index] = faces.len() as u32;
            debug_assert!(face.tag.is_none());
            faces.push(index as u32);
        }
        Self { mesh: mesh.clone(), degree, faces, place }
    }

    /// Polynomials of one component on a face.
    pub fn modes(&self) -> usize {
        self.degree + 1
    }

    /// Unknowns of a face.
    pub fn face_dof_count(&self) -> usize {
        2 * self.modes()
    }

    /// Unknowns in total.
    pub fn dof_count(&self) -> usize {
        self.faces.len() * self.face_dof_count()
    }

    /// The place of a face of the mesh among the inner ones; `None` on the boundary.
    pub fn place(&self, face: usize) -> Option<usize> {
        let place = self.place[face];
        (place != NONE).then_some(place as usize)
    }

    /// Where the unknowns of the local faces of a cell begin; `None` on the boundary.
    pub fn of_cell(&self, cell: usize) -> [Option<usize>; 3] {
        self.mesh.cell_faces[cell].map(|face| self.place(face).map(|place| place * self.face_dof_count()))
    }

    /// The polynomials at a place `s` along a face.
    pub fn values(&self, s: f64) -> [f64; MAX_MODES] {
        legendre(self.degree, s)
    }
}

/// `√(2k+1) P_k(2s−1)` for k up to `degree`, 0 above.
pub(crate) fn legendre(degree: usize, s: f64) -> [f64; MAX_MODES] {
    let x = 2.0 * s - 1.0;
    let mut values = [0.0; MAX_MODES];
    let (mut last, mut now) = (0.0, 1.0);
    for (k, value) in values.iter_mut().enumerate().take(degree + 1) {
        let n = k as f64;
        *value = (2.0 * n + 1.0).sqrt() * now;
        (last, now) = (now, ((2.0 * n + 1.0) * x * now - n * last) / (n + 1.0));
    }
    values
}

/// A member of a [`Skeleton`].
#[derive(Debug, Clone)]
pub struct Traces {
    /// Where it lives.
    pub skeleton: Arc<Skeleton>,
    /// Face after face of the inner ones, component after component on each.
    pub values: Vec<f64>,
}

impl Traces {
    /// The zero of a space.
    pub fn zero(skeleton: &Arc<Skeleton>) -> Self {
        Self { skeleton: skeleton.clone(), values: vec![0.0; skeleton.dof_count()] }
    }

    /// Its value at a place along a face of the mesh.
    ///
    /// # Panics
    /// A face on the boundary.
    pub fn at(&self, face: usize, s: f64) -> Point {
        let (basis, modes) = (self.skeleton.values(s), self.skeleton.modes());
        let first = self.skeleton.place(face).expect("an inner face") * 2 * modes;
        let component = |c: usize| {
            let values = &self.values[first + c * modes..][..modes];
            values.iter().zip(&basis).map(|(v, b)| v * b).sum::<f64>()
        };
        Point::new(component(0), component(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::quadrature::interval;

    #[test]
    fn the_polynomials_are_orthonormal() {
        let rule = interval(2 * MAX_DEGREE);
        for (i, j) in (0..MAX_MODES).flat_map(|i| (0..MAX_MODES).map(move |j| (i, j))) {
            let product = |s: f64| legendre(MAX_DEGREE, s)[i] * legendre(MAX_DEGREE, s)[j];
            let sum: f64 = rule.points.iter().zip(&rule.weights).map(|(&s, w)| w * product(s)).sum();
            assert!((sum - f64::from(u8::from(i == j))).abs() < 1e-13, "{i} {j}: {sum}");
        }
    }
}
