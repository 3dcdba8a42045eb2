//! A member of a space, and its value and gradient at a point of integration.

use std::sync::Arc;

use nalgebra::Matrix2;

use super::{Continuity, Space};
use crate::element::tables::{Table, Tables};
use crate::mesh::Point;

/// Where a field is evaluated: a cell, a tabulated reference point, and the map's `J⁻ᵀ` there.
#[derive(Debug, Clone, Copy)]
pub struct Site<'t> {
    pub cell: usize,
    pub tables: &'t Tables,
    pub q: usize,
    /// Position.
    pub x: Point,
    /// Inverse transposed Jacobian: `∇φ = J⁻ᵀ ∇̂φ`.
    pub inverse_transposed: Matrix2<f64>,
}

impl<'t> Site<'t> {
    /// Basis of degree `q` at this site.
    pub fn table(&self, degree: usize) -> &'t Table {
        self.tables.degree(degree)
    }
}

/// Coefficients in a space.
#[derive(Debug, Clone)]
pub struct Field {
    pub space: Arc<Space>,
    pub values: Vec<f64>,
}

impl Field {
    /// The zero of a space.
    pub fn zero(space: &Arc<Space>) -> Self {
        Self { space: space.clone(), values: vec![0.0; space.dof_count()] }
    }

    /// A field with given coefficients.
    ///
    /// # Panics
    /// When the number of coefficients is not that of the space.
    pub fn new(space: &Arc<Space>, values: Vec<f64>) -> Self {
        assert_eq!(values.len(), space.dof_count());
        Self { space: space.clone(), values }
    }

    /// Coefficients of component `c` on `cell`, node by node.
    pub fn coefficients(&self, cell: usize, c: usize) -> impl Iterator<Item = f64> {
        let space = &self.space;
        let (block, nodes) = match space.continuity {
            Continuity::Continuous => (&[][..], space.cell_nodes(cell)),
            Continuity::Discontinuous => {
                let start = (cell * space.components + c) * space.n;
                (&self.values[start..start + space.n], &[][..])
            }
        };
        let gathered = nodes.iter().map(move |&node| self.values[node as usize * space.components + c]);
        block.iter().copied().chain(gathered)
    }

    fn component(&self, site: &Site, c: usize) -> f64 {
        let basis = site.table(self.space.degree).values(site.q);
        let mut sum = 0.0;
        let mut basis = basis.iter();
        self.coefficients(site.cell, c).for_each(|u| sum += u * basis.next().expect("one coefficient per node"));
        sum
    }

    fn slope(&self, site: &Site, c: usize) -> Point {
        let mut slopes = site.table(self.space.degree).slopes(site.q).iter();
        let (mut x, mut y) = (0.0, 0.0);
        self.coefficients(site.cell, c).for_each(|u| {
            let d = slopes.next().expect("one coefficient per node");
            x += u * d.x;
            y += u * d.y;
        });
        site.inverse_transposed * Point::new(x, y)
    }

    /// Value of a scalar field.
    pub fn scalar(&self, site: &Site) -> f64 {
        self.component(site, 0)
    }

    /// Gradient of a scalar field.
    pub fn scalar_gradient(&self, site: &Site) -> Point {
        self.slope(site, 0)
    }

    /// Value of a vector field.
    pub fn vector(&self, site: &Site) -> Point {
        Point::new(self.component(site, 0), self.component(site, 1))
    }

    /// Gradient of a vector field, `G_ij = ∂_j v_i`.
    pub fn vector_gradient(&self, site: &Site) -> Matrix2<f64> {
        let (a, b) = (self.slope(site, 0), self.slope(site, 1));
        Matrix2::new(a.x, a.y, b.x, b.y)
    }

    /// Value of a scalar field at a reference point of a cell.
    pub fn scalar_at(&self, cell: usize, xi: Point) -> f64 {
        self.component_at(cell, xi, 0)
    }

    /// Value of a vector field at a reference point of a cell.
    pub fn vector_at(&self, cell: usize, xi: Point) -> Point {
        Point::new(self.component_at(cell, xi, 0), self.component_at(cell, xi, 1))
    }

    /// Value of component `c` at a reference point of a cell.
    pub fn component_at(&self, cell: usize, xi: Point, c: usize) -> f64 {
        let (basis, _) = crate::element::basis::evaluate(self.space.degree, xi);
        basis.iter().zip(self.coefficients(cell, c)).map(|(phi, u)| phi * u).sum()
    }
}
