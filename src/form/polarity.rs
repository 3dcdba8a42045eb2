//! How the flow turns and stretches the polarity, and how the polarity's molecular field pushes back.

use super::words::{Vector, skw, sym};
use super::{Bilinear, Linear};
use crate::space::{Field, Space};

/// `ω(p,q,v) = ∫ q·W(v)·p`, trial p, test q   [7.6d]
pub fn rotation<'a>(space: &Space, flow: &'a Field) -> Bilinear<'a, Vector, Vector> {
    super::mass::matrix_mass(space, flow.space.degree - 1, |x| skw(&flow.vector_gradient(&x.site)))
}

/// `δ(p,q,v) = ∫ q·D(v)·p`, trial p, test q   [7.6d]
pub fn stretching<'a>(space: &Space, flow: &'a Field) -> Bilinear<'a, Vector, Vector> {
    super::mass::matrix_mass(space, flow.space.degree - 1, |x| sym(&flow.vector_gradient(&x.site)))
}

/// `ω(p,q,v) + a δ(p,q,v) = ∫ q·[W(v) + a D(v)]·p`, both at once   [7.11c]
pub fn objective<'a>(space: &Space, flow: &'a Field, a: f64) -> Bilinear<'a, Vector, Vector> {
    super::mass::matrix_mass(space, flow.space.degree - 1, move |x| {
        let g = flow.vector_gradient(&x.site);
        skw(&g) + sym(&g) * a
    })
}

/// `ω(p,ℓ,w) = ∫ ℓ·W(w)·p`, test w   [7.6d]
pub fn rotation_force<'a>(velocity: &Space, p: &'a Field, l: &'a Field) -> Linear<'a, Vector> {
    Linear::cells(velocity.degree - 1 + p.space.degree + l.space.degree, move |x| {
        let (p, l) = (p.vector(&x.site), l.vector(&x.site));
        move |w: Vector| l.dot(&(w.skw() * p))
    })
}

/// `δ(p,ℓ,w) = ∫ ℓ·D(w)·p`, test w   [7.6d]
pub fn stretching_force<'a>(velocity: &Space, p: &'a Field, l: &'a Field) -> Linear<'a, Vector> {
    Linear::cells(velocity.degree - 1 + p.space.degree + l.space.degree, move |x| {
        let (p, l) = (p.vector(&x.site), l.vector(&x.site));
        move |w: Vector| l.dot(&(w.sym() * p))
    })
}
