//! L² products.

use nalgebra::Matrix2;

use super::integrate::{CellPoint, FacePoint, Faces};
use super::words::{Scalar, Trace, Vector};
use super::{Bilinear, Linear};
use crate::mesh::Point;
use crate::space::Space;

/// `(φ|χ) = ∫ φχ`   [7.11]
pub fn mass<'a>(space: &Space) -> Bilinear<'a, Scalar, Scalar> {
    Bilinear::cells(2 * space.degree, |_| |phi: Scalar, chi: Scalar| phi.value * chi.value)
}

/// `(v|w) = ∫ v·w`   [7.11a]
pub fn vector_mass<'a>(space: &Space) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(2 * space.degree, |_| |v: Vector, w: Vector| v.value.dot(&w.value))
}

/// `(cφ|χ)` with a weight `c` of degree `weight_degree`   [7.11c]
pub fn weighted_mass<'a>(
    space: &Space,
    weight_degree: usize,
    c: impl Fn(&CellPoint) -> f64 + Sync + 'a,
) -> Bilinear<'a, Scalar, Scalar> {
    Bilinear::cells(2 * space.degree + weight_degree, move |x| {
        let c = c(x);
        move |phi: Scalar, chi: Scalar| c * phi.value * chi.value
    })
}

/// `∫ q·C·p` with a matrix weight `C` of degree `weight_degree`.
pub fn matrix_mass<'a>(
    space: &Space,
    weight_degree: usize,
    c: impl Fn(&CellPoint) -> Matrix2<f64> + Sync + 'a,
) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(2 * space.degree + weight_degree, move |x| {
        let c = c(x);
        move |p: Vector, q: Vector| q.value.dot(&(c * p.value))
    })
}

/// `(φ|w) = ∫ φ·w` between two spaces, trial φ, test w   [7.11a]
pub fn vector_load_by<'a>(test: &Space, trial: &Space) -> Bilinear<'a, Vector, Vector> {
    Bilinear::cells(test.degree + trial.degree, |_| |phi: Vector, w: Vector| phi.value.dot(&w.value))
}

/// `(f|w) = ∫ f·w` for a vector `f` of degree `degree`   [7.11a]
pub fn load<'a>(space: &Space, degree: usize, f: impl Fn(&CellPoint) -> Point + Sync + 'a) -> Linear<'a, Vector> {
    Linear::cells(space.degree + degree, move |x| {
        let f = f(x);
        move |w: Vector| f.dot(&w.value)
    })
}

/// `∫ δρ r·q` for a vector `r` of degree `degree`, trial δρ, test q: how a load depends on a density in it   [7.34]
pub fn load_by_density<'a>(
    test: &Space,
    density: &Space,
    degree: usize,
    r: impl Fn(&CellPoint) -> Point + Sync + 'a,
) -> Bilinear<'a, Scalar, Vector> {
    Bilinear::cells(test.degree + density.degree + degree, move |x| {
        let r = r(x);
        move |change: Scalar, q: Vector| change.value * r.dot(&q.value)
    })
}

/// `(f|χ) = ∫ fχ` for a scalar `f` of degree `degree`.
pub fn scalar_load<'a>(space: &Space, degree: usize, f: impl Fn(&CellPoint) -> f64 + Sync + 'a) -> Linear<'a, Scalar> {
    Linear::cells(space.degree + degree, move |x| {
        let f = f(x);
        move |chi: Scalar| f * chi.value
    })
}

/// `∫_Γ g·w ds` for a vector `g` of degree `degree`: a prescribed traction [5.45], or a prescribed slope [6.25]
pub fn face_load<'a>(
    space: &Space,
    faces: Faces,
    degree: usize,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Linear<'a, Vector> {
    Linear::zero().faces(faces, space.degree + degree, move |s| {
        let g = g(s);
        move |w: Trace<Vector>| g.dot(&w.minus.value)
    })
}

/// `∫_Γ δρ g·q ds`, trial δρ, test q: a prescribed slope in tissue of density ρ, `∫ ρ g·q`, along ρ   [6.25]
pub fn face_load_by_density<'a>(
    test: &Space,
    density: &Space,
    faces: Faces,
    degree: usize,
    g: impl Fn(&FacePoint) -> Point + Sync + 'a,
) -> Bilinear<'a, Scalar, Vector> {
    Bilinear::zero().faces(faces, test.degree + density.degree + degree, move |s| {
        let g = g(s);
        move |change: Trace<Scalar>, q: Trace<Vector>| change.minus.value * g.dot(&q.minus.value)
    })
}
