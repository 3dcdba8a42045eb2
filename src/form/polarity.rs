//! How the flow turns and stretches the polarity, and how the polarity's molecular field pushes back.

use super::density::Density;
use super::words::{Scalar, Vector, skw, sym};
use super::{Bilinear, Linear};
use crate::space::{Field, Space};

/// `b ω(p,ρq,v) + c δ(p,ρq,v) = ∫ ρ q·[b W(v) + c D(v)]·p` with `weights = [b, c]`, trial p, test q   [7.6d]
pub fn turning_by_polarity<'a>(
    space: &Space,
    flow: &'a Field,
    [b, c]: [f64; 2],
    rho: Density<'a>,
) -> Bilinear<'a, Vector, Vector> {
    super::mass::matrix_mass(space, flow.space.degree - 1 + rho.degree(), move |x| {
        let g = flow.vector_gradient(&x.site);
        (skw(&g) * b + sym(&g) * c) * rho.at(&x.site)
    })
}

/// `ω(p,ℓ,w) = ∫ ℓ·W(w)·p`, test w   [7.6d]
pub fn rotation_force<'a>(velocity: &Space, p: &'a Field, l: &'a Field) -> Linear<'a, Vector> {
    Linear::cells(velocity.degree - 1 + p.space.degree + l.space.degree, move |x| {
        let (p, l) = (p.vector(&x.site), l.vector(&x.site));
        move |w: Vector| l.dot(&(w.skw() * p))
    })
}

/// `δ(ρp,ℓ,w) = ∫ ρ ℓ·D(w)·p`, test w   [7.6d]
pub fn stretching_force<'a>(velocity: &Space, p: &'a Field, l: &'a Field, rho: Density<'a>) -> Linear<'a, Vector> {
    Linear::cells(velocity.degree - 1 + p.space.degree + l.space.degree + rho.degree(), move |x| {
        let (p, l) = (p.vector(&x.site) * rho.at(&x.site), l.vector(&x.site));
        move |w: Vector| l.dot(&(w.sym() * p))
    })
}

/// `b ω(p,ρq,v) + c δ(p,ρq,v)` as a functional of q, `weights = [b, c]`   [7.6d]
pub fn turning<'a>(p: &'a Field, flow: &'a Field, [b, c]: [f64; 2], rho: Density<'a>) -> Linear<'a, Vector> {
    Linear::cells(2 * p.space.degree + flow.space.degree - 1 + rho.degree(), move |x| {
        let g = flow.vector_gradient(&x.site);
        let turned = (skw(&g) * b + sym(&g) * c) * p.vector(&x.site) * rho.at(&x.site);
        move |q: Vector| turned.dot(&q.value)
    })
}

/// `b ω(p,ρq,w) + c δ(p,ρq,w)` for a given p, trial w, test q: how the polarity's turning depends on the flow   [7.6d]
pub fn turning_by_flow<'a>(
    velocity: &Space,
    p: &'a Field,
    [b, c]: [f64; 2],
    rho: Density<'a>,
) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(2 * p.space.degree + velocity.degree - 1 + rho.degree(), move |x| {
        let p = p.vector(&x.site) * rho.at(&x.site);
        move |w: Vector, q: Vector| q.value.dot(&((w.skw() * b + w.sym() * c) * p))
    })
}

/// Derivative of [`turning`] along ρ: `∫ δρ q·[b W(v) + c D(v)]·p`, trial δρ, test q   [7.34]
pub fn turning_by_density<'a>(
    p: &'a Field,
    flow: &'a Field,
    [b, c]: [f64; 2],
    density: &Space,
) -> Bilinear<'a, Scalar, Vector> {
    Bilinear::cells(2 * p.space.degree + flow.space.degree - 1 + density.degree, move |x| {
        let g = flow.vector_gradient(&x.site);
        let turned = (skw(&g) * b + sym(&g) * c) * p.vector(&x.site);
        move |change: Scalar, q: Vector| change.value * turned.dot(&q.value)
    })
}

/// `δ(δρ p,p,w) = ∫ δρ p·D(w)·p`, trial δρ, test w: how the active stress depends on the density   [7.34]
pub fn stretching_force_by_density<'a>(
    velocity: &Space,
    p: &'a Field,
    density: &Space,
) -> Bilinear<'a, Scalar, Vector> {
    Bilinear::cells(velocity.degree - 1 + 2 * p.space.degree + density.degree, move |x| {
        let p = p.vector(&x.site);
        move |change: Scalar, w: Vector| change.value * p.dot(&(w.sym() * p))
    })
}

/// `b ω(φ,ℓ,w) + c δ(φ,ℓ,w)` for a given ℓ, trial φ, test w   [7.6d]
pub fn force_by_polarity<'a>(velocity: &Space, l: &'a Field, b: f64, c: f64) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(velocity.degree - 1 + 2 * l.space.degree, move |x| {
        let l = l.vector(&x.site);
        move |phi: Vector, w: Vector| l.dot(&((w.skw() * b + w.sym() * c) * phi.value))
    })
}

/// `b ω(ρp,λ,w) + c δ(ρp,λ,w)` for a given p, trial λ, test w   [7.6d]
pub fn force_by_field<'a>(
    velocity: &Space,
    p: &'a Field,
    b: f64,
    c: f64,
    rho: Density<'a>,
) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(velocity.degree - 1 + 2 * p.space.degree + rho.degree(), move |x| {
        let p = p.vector(&x.site) * rho.at(&x.site);
        move |lambda: Vector, w: Vector| lambda.value.dot(&((w.skw() * b + w.sym() * c) * p))
    })
}
