//! A stress of gradients of the polarity, `αρ sym∇p`, as in the model of Marcq (2014).
//!
//! `s(p,w;ρ) = Σ_K ∫ρ sym∇p:D(w) − Σ_Si ∫[p]·{ρD(w)}n`: the jumps of p are a part of its gradient.

use super::At;
use crate::form::words::{Scalar, Trace, Vector, sym};
use crate::form::{Bilinear, Density, FacePoint, Faces, Linear};
use crate::mesh::Point;
use crate::model::terms::{Factor, Formula, Functional, Line, Power, Strong, Term, Weak};
use crate::solve::dot;
use crate::space::{Field, Space};

pub const POLAR_STRESS: Term<Vector> = Term {
    name: "polar stress",
    formula: Formula::Both("α s(p,w)", "α s(p,w;ρ)"),
    tag: "[T8]",
    factor: Some(Factor {
        key: "polar_stress",
        symbol: "α",
        help: "stress of gradients of the polarity, along their symmetric part",
    }),
    weak: Weak::Functional(Functional {
        value: |at| force(at),
        by_density: |at| by_density(at.velocity(), at.p, at.density().1),
        by_polarity: |at| by_polarity(at.velocity(), &at.p.space, at.rho),
        wide: true,
        ..Functional::NOTHING
    }),
    strong: Strong::Stress(|s| {
        let slope = |c: usize, k: usize| if k == 0 { s.p()[c].dx() } else { s.p()[c].dy() };
        s.stress_of(|i, j| s.weighed(0.5 * (slope(i, j) + slope(j, i))))
    }),
    power: Some(Power {
        line: Line { column: "budget_polar_stress", words: "energy law: polar stress", short: "polar stress" },
        of: |at, loops| dot(&loops.tissue.vector(&force(at), at.velocity()), &at.v().values),
    }),
    ..Term::PLAIN
};

/// Degrees in cells and on faces.
fn degrees(velocity: &Space, p: &Space, density: usize) -> (usize, usize) {
    (velocity.degree + p.degree - 2 + density, velocity.degree - 1 + p.degree + density)
}

/// `ρ−` and `ρ+` on an interior face.
fn sides(rho: Density, s: &FacePoint) -> [f64; 2] {
    [rho.at(&s.minus), s.plus.as_ref().map_or(0.0, |plus| rho.at(plus))]
}

/// `[p]` on an interior face.
fn jump(p: &Field, s: &FacePoint) -> Point {
    s.plus.as_ref().map_or_else(Point::zeros, |plus| p.vector(&s.minus) - p.vector(plus))
}

/// `s(p,w;ρ)`, test w   [T8]
fn force<'a>(at: &At<'a>) -> Linear<'a, Vector> {
    let (p, rho) = (at.p, at.rho);
    let (cell, face) = degrees(at.velocity(), &p.space, rho.degree());
    Linear::cells(cell, move |x| {
        let stress = sym(&p.vector_gradient(&x.site)) * rho.at(&x.site);
        move |w: Vector| stress.dot(&w.grad)
    })
    .faces(Faces::INTERIOR, face, move |s| {
        let (n, jump, [inner, outer]) = (s.n, jump(p, s) * 0.5, sides(rho, s));
        move |w: Trace<Vector>| -jump.dot(&((w.minus.sym() * inner + w.plus.sym() * outer) * n))
    })
}

/// `s(φ,w;ρ)`, trial φ, test w   [T8]
fn by_polarity<'a>(velocity: &Space, p: &Space, rho: Density<'a>) -> Bilinear<'a, Vector, Vector> {
    let (cell, face) = degrees(velocity, p, rho.degree());
    Bilinear::cells(cell, move |x| {
        let rho = rho.at(&x.site);
        move |phi: Vector, w: Vector| rho * phi.sym().dot(&w.grad)
    })
    .faces(Faces::INTERIOR, face, move |s| {
        let (n, [inner, outer]) = (s.n, sides(rho, s));
        move |phi: Trace<Vector>, w: Trace<Vector>| {
            let pull = (w.minus.sym() * inner + w.plus.sym() * outer) * n;
            -0.5 * (phi.minus.value - phi.plus.value).dot(&pull)
        }
    })
}

/// `s(p,w;δρ)`, trial δρ, test w   [T8]
fn by_density<'a>(velocity: &Space, p: &'a Field, density: &Space) -> Bilinear<'a, Scalar, Vector> {
    let (cell, face) = degrees(velocity, &p.space, density.degree);
    Bilinear::cells(cell, move |x| {
        let stress = sym(&p.vector_gradient(&x.site));
        move |change: Scalar, w: Vector| change.value * stress.dot(&w.grad)
    })
    .faces(Faces::INTERIOR, face, move |s| {
        let (n, jump) = (s.n, jump(p, s) * 0.5);
        move |change: Trace<Scalar>, w: Trace<Vector>| {
            let pull = w.minus.sym() * change.minus.value + w.plus.sym() * change.plus.value;
            -jump.dot(&(pull * n))
        }
    })
}
