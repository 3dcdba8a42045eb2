//! The density carried by the flow: balance of mass by upwind fluxes.
//!
//! On the boundary mass passes through `open` faces only: on a curved wall the discrete `v·n` is not exactly zero.

use super::integrate::{FacePoint, Faces};
use super::upwind::Carrier;
use super::words::{Scalar, Trace, Vector};
use super::{Bilinear, Density, Linear};
use crate::space::{Field, Space};

/// `a_mass(ρ,z;v) = −∫ ρ v·∇_hz + ∫_Γ (v·n)⊕ ρz + Σ_Si ∫ (½|v·n|[ρ] + (v·n){ρ})[z]`, Γ = `open`   [7.32]
pub fn a_mass<'a>(space: &Space, flow: &'a Field, open: Faces) -> Bilinear<'a, Scalar, Scalar> {
    let carrier = Carrier::from(flow);
    let (r, k) = (space.degree, flow.space.degree);
    Bilinear::cells(2 * r + k - 1, move |x| {
        let v = flow.vector(&x.site);
        move |rho: Scalar, z: Scalar| -rho.value * v.dot(&z.grad)
    })
    .faces(Faces::INTERIOR, 2 * r + k, move |s| {
        let vn = carrier.flux(s);
        let upstream = 0.5 * carrier.side(s) * vn;
        move |rho: Trace<Scalar>, z: Trace<Scalar>| (upstream * rho.jump() + vn * rho.mean()) * z.jump()
    })
    .faces(open, 2 * r + k, move |s| {
        let leaving = carrier.leaving(s);
        move |rho: Trace<Scalar>, z: Trace<Scalar>| leaving * rho.minus.value * z.minus.value
    })
}

/// `l_mass(z;v) = ∫_Γ (v·n)⊖ g z`, Γ = `open`: what flows in with the density `g`, integrated as a member of `space`  
/// [7.32]
pub fn l_mass<'a>(
    space: &Space,
    flow: &'a Field,
    open: Faces,
    g: impl Fn(&FacePoint) -> f64 + Sync + 'a,
) -> Linear<'a, Scalar> {
    let carrier = Carrier::from(flow);
    Linear::zero().faces(open, 2 * space.degree + flow.space.degree, move |s| {
        let brought = carrier.entering(s) * g(s);
        move |z: Trace<Scalar>| brought * z.minus.value
    })
}

/// `a_mass(ρ,z;v) − l_mass(z;v)`: what leaves a cell per time, less what comes in, as a functional of z   [7.32]
pub fn transport<'a>(
    rho: &'a Field,
    flow: &'a Field,
    open: Faces,
    g: impl Fn(&FacePoint) -> f64 + Sync + 'a,
) -> Linear<'a, Scalar> {
    let carrier = Carrier::from(flow);
    let (r, k) = (rho.space.degree, flow.space.degree);
    Linear::cells(2 * r + k - 1, move |x| {
        let carried = flow.vector(&x.site) * rho.scalar(&x.site);
        move |z: Scalar| -carried.dot(&z.grad)
    })
    .faces(Faces::INTERIOR, 2 * r + k, move |s| {
        let flux = carrier.flux(s) * upstream_of(rho, s, carrier.side(s));
        move |z: Trace<Scalar>| flux * z.jump()
    })
    .faces(open, 2 * r + k, move |s| {
        let flux = carrier.leaving(s) * rho.scalar(&s.minus) - carrier.entering(s) * g(s);
        move |z: Trace<Scalar>| flux * z.minus.value
    })
}

/// Derivative of [`transport`] along the flow, trial w, test z:
///
/// `−∫ ρ w·∇_hz + Σ_Si ∫ (w·n)(½ sgn(v·n)[ρ] + {ρ})[z] + ∫_Γ (w·n) (ρ where v·n > 0, g where v·n < 0) z`   [7.32]
///
/// Each side of a face sees w by its own trace, so that every block belongs to one cell.
pub fn transport_by_flow<'a>(
    rho: &'a Field,
    flow: &'a Field,
    open: Faces,
    g: impl Fn(&FacePoint) -> f64 + Sync + 'a,
) -> Bilinear<'a, Vector, Scalar> {
    let carrier = Carrier::from(flow);
    let (r, k) = (rho.space.degree, flow.space.degree);
    Bilinear::cells(2 * r + k - 1, move |x| {
        let rho = rho.scalar(&x.site);
        move |w: Vector, z: Scalar| -rho * w.value.dot(&z.grad)
    })
    .faces(Faces::INTERIOR, 2 * r + k, move |s| {
        let (n, rho) = (s.n, upstream_of(rho, s, carrier.side(s)));
        move |w: Trace<Vector>, z: Trace<Scalar>| {
            rho * (w.minus.value.dot(&n) * z.minus.value - w.plus.value.dot(&n) * z.plus.value)
        }
    })
    .faces(open, 2 * r + k, move |s| {
        let side = carrier.side(s);
        let (n, rho) = (s.n, if side < 0.0 { g(s) } else { side * rho.scalar(&s.minus) });
        move |w: Trace<Vector>, z: Trace<Scalar>| rho * w.minus.value.dot(&n) * z.minus.value
    })
}

/// `½ sgn(v·n)[ρ] + {ρ}` on an interior face: the density of the side from which the flow comes.
fn upstream_of(rho: &Field, s: &FacePoint, side: f64) -> f64 {
    let plus = s.plus.as_ref().expect("an interior face");
    0.5 * side * (rho.scalar(&s.minus) - rho.scalar(plus)) + Density::Of(rho).mean(s)
}
