//! A member of a space, and its value and gradient at a point of integration.

use std::sync::Arc;

use nalgebra::Matrix2;

use super::{Continuity, Space};
use crate::element::basis;
use crate::element::tables::{Table, Tables};
use crate::mesh::Point;

/// Where a field is evaluated: a cell, a tabulated reference point, and the map's `J⁻ᵀ` there.
#[derive(Debug, Clone, Copy)]
pub struct Site<'t> {
    /// Number of the cell.
    pub cell: usize,
    /// Values of bases at all points of the rule.
    pub tables: &'t Tables,
    /// Which of these points this is.
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
    /// Where it lives.
    pub space: Arc<Space>,
    /// Its coefficients, in the numbering of the space.
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

    /// Combines `K` tabulated rows with the coefficients of each of `C` components: `out[c][k] = Σ_i row_k[i] u_c[i]`.
    fn combine<const C: usize, const K: usize>(&self, cell: usize, rows: [&[f64]; K]) -> [[f64; K]; C] {
        let space = &*self.space;
        let n = space.n;
        let rows = rows.map(|r| &r[..n]);
        let mut out = [[0.0; K]; C];
        match space.continuity {
            Continuity::Continuous => {
                for (i, &node) in space.cell_nodes(cell).iter().enumerate() {
                    let values = &self.values[node as usize * C..(node as usize + 1) * C];
                    for (out, u) in out.iter_mut().zip(values) {
                        for (out, row) in out.iter_mut().zip(rows) {
                            *out += row[i] * u;
                        }
                    }
                }
            }
            Continuity::Discontinuous => {
                let block = &self.values[cell * C * n..(cell + 1) * C * n];
                for i in 0..n {
                    for (c, out) in out.iter_mut().enumerate() {
                        for (out, row) in out.iter_mut().zip(rows) {
                            *out += row[i] * block[c * n + i];
                        }
                    }
                }
            }
        }
        out
    }

    /// Value of a scalar field.
    pub fn scalar(&self, site: &Site) -> f64 {
        let table = site.table(self.space.degree);
        let [[value]] = self.combine(site.cell, [table.values(site.q)]);
        value
    }

    /// Gradient of a scalar field.
    pub fn scalar_gradient(&self, site: &Site) -> Point {
        let table = site.table(self.space.degree);
        let [[x, y]] = self.combine(site.cell, [table.slopes(site.q, 0), table.slopes(site.q, 1)]);
        site.inverse_transposed * Point::new(x, y)
    }

    /// Value of a vector field.
    pub fn vector(&self, site: &Site) -> Point {
        let table = site.table(self.space.degree);
        let [[x], [y]] = self.combine(site.cell, [table.values(site.q)]);
        Point::new(x, y)
    }

    /// Gradient of a vector field, `G_ij = ∂_j v_i`.
    pub fn vector_gradient(&self, site: &Site) -> Matrix2<f64> {
        let table = site.table(self.space.degree);
        let [a, b] = self.combine(site.cell, [table.slopes(site.q, 0), table.slopes(site.q, 1)]);
        Matrix2::new(a[0], a[1], b[0], b[1]) * site.inverse_transposed.transpose()
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
        basis::values(self.space.degree, xi).zip(self.coefficients(cell, c)).map(|(phi, u)| phi * u).sum()
    }

    /// Value of component `c` where the basis of the field's degree has these values; the same bits as
    /// [`component_at`](Self::component_at).
    pub fn component_by(&self, cell: usize, basis: &[f64], c: usize) -> f64 {
        basis.iter().zip(self.coefficients(cell, c)).map(|(phi, u)| phi * u).sum()
    }
}
