//! Nitsche's method on the boundary of a rigid body that cuts cells: no slip between the fluid and the body, whose
//! motion is an unknown (Hansbo & Hansbo 2002; Burman & Hansbo 2012).

use super::integrate::Integrator;
use super::kernel::Basis;
use crate::cut::Surface;
use crate::mesh::Point;
use crate::shape::rigid_motion;
use crate::space::Space;

/// Symmetric block, row-major, of
///
/// ```text
/// −∫_∂B (2D(v)n − Πn)·(w−ω) − ∫_∂B (2D(w)n − ξn)·(v−u) + (γ/h) ∫_∂B (v−u)·(w−ω),   h = (2|K|)^½
/// ```
/// over what of the boundary of body `body` lies in a cell K: n out of the fluid, `u = V + Ω (x−x_B)^⊥` the motion of
/// the body and ω that of the test. Unknowns are the cell's velocities (component after component), its pressures, and
/// `V₁`, `V₂`, Ω.
pub fn block(
    loops: &Integrator,
    (velocity, pressure): (&Space, &Space),
    surface: &Surface,
    (cell, body): (usize, usize),
    centre: Point,
    gamma: f64,
) -> Vec<f64> {
    let (n, np) = (velocity.n, pressure.n);
    let size = 2 * n + np + 3;
    let strength = gamma / (2.0 * loops.mesh.cell_area(cell)).sqrt();
    let mut block = vec![0.0; size * size];
    // traction and slip of every function at a point
    let (mut traction, mut slip) = (vec![Point::zeros(); size], vec![Point::zeros(); size]);
    let (mut phi, mut psi) = (Basis::new(velocity), Basis::new(pressure));
    loops.each_outline_point(surface, (cell, body), 2 * velocity.degree, &mut |x| {
        phi.evaluate(&x.site);
        psi.evaluate(&x.site);
        for i in 0..n {
            let (value, slope) = phi.at(i);
            for c in 0..2 {
                let mut along = slope * x.n[c];
                along[c] += slope.dot(&x.n);
                traction[c * n + i] = along;
                slip[c * n + i][c] = value;
            }
        }
        for j in 0..np {
            traction[2 * n + j] = -psi.at(j).0 * x.n;
        }
        for k in 0..3 {
            slip[2 * n + np + k] = -rigid_motion(k, centre, x.site.x);
        }
        for (a, row) in block.chunks_exact_mut(size).enumerate() {
            for (b, entry) in row.iter_mut().enumerate() {
                let consistent = traction[b].dot(&slip[a]) + traction[a].dot(&slip[b]);
                *entry += x.weight * (strength * slip[a].dot(&slip[b]) - consistent);
            }
        }
    });
    block
}
