//! Fields from what other fields are at points of cells.

use std::sync::Arc;

use rayon::prelude::*;

use super::Integrator;
use crate::element::basis;
use crate::element::tables::Tables;
use crate::space::field::Site;
use crate::space::{Continuity, Field, Space};

impl Integrator {
    /// The discontinuous field of this degree that has the values of `of` at the nodes of every cell, each seen from
    /// inside of its cell. Exact where these are polynomials of the degree in the coordinates of the reference
    /// triangle.
    ///
    /// # Panics
    /// For a degree outside 1 to [`MAX_DEGREE`](crate::element::MAX_DEGREE), and for other than 1 to 3 components.
    pub fn at_nodes<const C: usize>(&self, degree: usize, of: impl Fn(&Site) -> [f64; C] + Sync) -> Field {
        let space = Arc::new(Space::new(&self.mesh, Continuity::Discontinuous, degree, C));
        let tables = Tables::new(basis::nodes(degree));
        let cell = |cell: usize| {
            let mut block = vec![0.0; C * space.n];
            for q in 0..space.n {
                let value = of(&self.site(cell, &tables, q).0);
                (0..C).for_each(|c| block[c * space.n + q] = value[c]);
            }
            block
        };
        let values: Vec<Vec<f64>> = (0..self.mesh.cells.len()).into_par_iter().map(cell).collect();
        Field::new(&space, values.concat())
    }
}
