//! The loops over the boundaries of bodies.

use super::integrate::Integrator;
use crate::cut::Surface;
use crate::mesh::Point;
use crate::space::field::Site;

/// A quadrature point of a body's boundary.
pub struct OutlinePoint<'t> {
    /// In the cell, whose polynomials are those of the fluid there.
    pub site: Site<'t>,
    /// Unit normal out of the fluid, into the body.
    pub n: Point,
    /// Quadrature weight times arc length.
    pub weight: f64,
}

impl Integrator {
    /// Calls `visit` at every quadrature point of a body's boundary in a cell, for polynomials of degree `degree`.
    pub fn each_outline_point(
        &self,
        surface: &Surface,
        (cell, body): (usize, usize),
        degree: usize,
        visit: &mut dyn FnMut(&OutlinePoint),
    ) {
        let rule = surface.rule(&self.mesh, (cell, body), degree);
        for (q, (n, weight)) in rule.normals.iter().zip(&rule.weights).enumerate() {
            let (site, _) = self.site(cell, &rule.tables, q);
            visit(&OutlinePoint { site, n: *n, weight: *weight });
        }
    }

    /// `∫_∂B f` over what the fluid touches of a body, f of polynomial degree `degree`.
    pub fn sum_outline(
        &self,
        surface: &Surface,
        body: usize,
        degree: usize,
        mut f: impl FnMut(&OutlinePoint) -> f64,
    ) -> f64 {
        let mut total = 0.0;
        for cell in surface.cells() {
            self.each_outline_point(surface, (cell, body), degree, &mut |x| total += x.weight * f(x));
        }
        total
    }
}
