//! The stress of exact fields with `div v = 0`.

use super::{Elastic, Matrix, Vector, add_entries};
use crate::model::expression::Taylor;
use crate::model::parameters::Parameters;

/// `σ` [5.48] up to degree 1. Every product is cut there at once: the compiler leaves out what is then not used.
pub(super) fn stress(parameters: &Parameters, v: &Vector, pressure: Taylor, p: &Vector) -> Matrix {
    let shear = (v[0].dy() + v[1].dx()).linear();
    let mut sigma = [[(2.0 * v[0].dx() - pressure).linear(), shear], [shear, (2.0 * v[1].dy() - pressure).linear()]];
    if parameters.elasticity != 0.0 {
        let (b, square) = (parameters.elasticity, parameters.coherence * parameters.coherence);
        // ℓ = B[(|p|²−1) p − κ²Δp]
        let excess = (p[0] * p[0] + p[1] * p[1] - 1.0).linear();
        let l = |p: &Taylor| (b * (excess * *p - square * p.laplacian())).linear();
        let elastic = Elastic::new(parameters.alignment, p, [l(&p[0]), l(&p[1])]);
        let slope = square * b;
        add_entries(&mut sigma, |i, j| (elastic.torque(i, j) - slope * elastic.squares(i, j)).linear());
    }
    if parameters.active_stress != 0.0 {
        add_entries(&mut sigma, |i, j| (-parameters.active_stress * (p[i] * p[j])).linear());
    }
    sigma
}
