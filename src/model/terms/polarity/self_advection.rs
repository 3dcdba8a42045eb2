//! The polarity carries itself along, `ζρ(p·∇)p`, as in the models of Marcq (2014) and of Banerjee and Marchetti
//! (2019).
//!
//! On a face the mean `{ρ}{p}·n` carries, which is one number for both sides though p jumps; upstream is the side that
//! `ζ{p}·n` comes from. Where a polarity is prescribed, it comes in where the inner `ζp·n` points inwards.

use super::{At, data};
use crate::form::words::{Scalar, Trace, Vector};
use crate::form::{Bilinear, Density, FacePoint, Faces, Linear};
use crate::mesh::Point;
use crate::model::terms::{Factor, Formula, Functional, Line, Pass, Power, Strong, Term, Weak, power};
use crate::space::Field;

pub const SELF_ADVECTION: Term<Vector> = Term {
    name: "self-advection",
    formula: Formula::Both("ζ a_upw(p,q;p)", "ζ a_upw(p,q;ρp)"),
    tag: "[T5]",
    factor: Some(FACTOR),
    weak: Weak::Functional(Functional {
        value: |at| Carrying::new(at).advection(at),
        by_density: |at| Carrying::new(at).by_density(at),
        by_polarity: |at| Carrying::new(at).by_carrier(at),
        by_components: |at| Carrying::new(at).by_carried(),
        wide: true,
        ..Functional::NOTHING
    }),
    // what carries is that of the last iterate
    pass: Pass::Frozen { operator: |at| Carrying::new(at).by_carried(), rest: |at| -Carrying::new(at).brought_in(at) },
    strong: Strong::Vector(|s| {
        let p = s.polarity();
        s.rho().value() * Point::new(s.p()[0].gradient().dot(&p), s.p()[1].gradient().dot(&p))
    }),
    power: Some(Power {
        line: Line { column: "budget_self_advection", words: "energy law: self-advection", short: "self-advection" },
        of: |at, loops| power::along_field(at, loops, Carrying::new(at).advection(at)),
    }),
    ..Term::PLAIN
};

const FACTOR: Factor = Factor {
    key: "self_advection",
    symbol: "ζ",
    help: "velocity with which polarity of length 1 carries itself along",
};

/// The polarity as what carries, over ζ.
#[derive(Clone, Copy)]
struct Carrying<'a> {
    p: &'a Field,
    rho: Density<'a>,
    /// Of ζ: it decides what is upstream.
    sign: f64,
    inflow: Faces,
}

impl<'a> Carrying<'a> {
    fn new(at: &At<'a>) -> Self {
        let sign = at.parameters.factors.of(FACTOR.key).signum();
        Self { p: at.p, rho: at.rho, sign, inflow: at.given.dirichlet }
    }

    /// Of a product with ρp on a face; one less in a cell, where one factor is a derivative.
    fn degree(&self) -> usize {
        3 * self.p.space.degree + self.rho.degree()
    }

    /// `{p}·n`, and `sgn(ζ{p}·n)`, zero at zero.
    fn through(&self, s: &FacePoint) -> (f64, f64) {
        let inner = self.p.vector(&s.minus);
        let mean = s.plus.as_ref().map_or(inner, |plus| (inner + self.p.vector(plus)) * 0.5);
        let pn = mean.dot(&s.n);
        (pn, if pn == 0.0 { 0.0 } else { self.sign * pn.signum() })
    }

    /// `(p·n)⊖`, `−(p·n)⊕` for a ζ < 0, on the boundary, and its derivative along `p·n`.
    fn entering(&self, s: &FacePoint) -> (f64, f64) {
        let (pn, side) = self.through(s);
        if side < 0.0 { (-pn, -1.0) } else { (0.0, 0.0) }
    }

    /// `[p]` on an interior face.
    fn jump(&self, s: &FacePoint) -> Point {
        s.plus.as_ref().map_or_else(Point::zeros, |plus| self.p.vector(&s.minus) - self.p.vector(plus))
    }

    /// `a_upw(p,q;ρp) − ∫_Γ ρ(p·n)⊖ p_D·q`, test q   [T5]
    fn advection(self, at: &At<'a>) -> Linear<'a, Vector> {
        let (p, rho, g) = (self.p, self.rho, data(at));
        Linear::cells(self.degree() - 1, move |x| {
            let carried = p.vector_gradient(&x.site) * p.vector(&x.site) * rho.at(&x.site);
            move |q: Vector| carried.dot(&q.value)
        })
        .faces(Faces::INTERIOR, self.degree(), move |s| {
            let ((pn, side), jump) = (self.through(s), self.jump(s) * rho.mean(s));
            let (inner, outer) = (jump * (0.5 * pn * (side - 1.0)), jump * (0.5 * pn * (side + 1.0)));
            move |q: Trace<Vector>| inner.dot(&q.minus.value) - outer.dot(&q.plus.value)
        })
        .faces(self.inflow, self.degree(), move |s| {
            let brought = (p.vector(&s.minus) - g(s)) * (self.entering(s).0 * rho.mean(s));
            move |q: Trace<Vector>| brought.dot(&q.minus.value)
        })
    }

    /// `∫_Γ ρ(p·n)⊖ p_D·q`, test q, at the points of [`Carrying::advection`]: a pass then solves the same equation.
    fn brought_in(self, at: &At<'a>) -> Linear<'a, Vector> {
        let (rho, g) = (self.rho, data(at));
        Linear::zero().faces(self.inflow, self.degree(), move |s| {
            let brought = g(s) * (self.entering(s).0 * rho.mean(s));
            move |q: Trace<Vector>| brought.dot(&q.minus.value)
        })
    }

    /// `a_upw(φ,χ;ρp)`: the derivative along what is carried, trial φ, test χ   [6.13]
    fn by_carried(self) -> Bilinear<'a, Scalar, Scalar> {
        let (p, rho) = (self.p, self.rho);
        Bilinear::cells(self.degree() - 1, move |x| {
            let along = p.vector(&x.site) * rho.at(&x.site);
            move |phi: Scalar, chi: Scalar| along.dot(&phi.grad) * chi.value
        })
        .faces(Faces::INTERIOR, self.degree(), move |s| {
            let ((pn, side), rho) = (self.through(s), rho.mean(s));
            let (pn, upstream) = (rho * pn, 0.5 * rho * side * pn);
            move |phi: Trace<Scalar>, chi: Trace<Scalar>| (upstream * chi.jump() - pn * chi.mean()) * phi.jump()
        })
        .faces(self.inflow, self.degree(), move |s| {
            let entering = self.entering(s).0 * rho.mean(s);
            move |phi: Trace<Scalar>, chi: Trace<Scalar>| entering * phi.minus.value * chi.minus.value
        })
    }

    /// The derivative along what carries, trial φ, test q:
    ///
    /// `∫ ρ(φ·∇_hp)·q + Σ_Si ∫ {ρ}({φ}·n){½ sgn({p}·n)[q] − {q}}·[p] − ∫_{Γ, p·n<0} ρ(φ·n)(p−p_D)·q`   [T5]
    fn by_carrier(self, at: &At<'a>) -> Bilinear<'a, Vector, Vector> {
        let (p, rho, g) = (self.p, self.rho, data(at));
        Bilinear::cells(self.degree() - 1, move |x| {
            let gradient = p.vector_gradient(&x.site) * rho.at(&x.site);
            move |phi: Vector, q: Vector| (gradient * phi.value).dot(&q.value)
        })
        .faces(Faces::INTERIOR, self.degree(), move |s| {
            let ((_, side), jump, n) = (self.through(s), self.jump(s) * rho.mean(s), s.n);
            let (inner, outer) = (jump * (0.5 * (side - 1.0)), jump * (0.5 * (side + 1.0)));
            move |phi: Trace<Vector>, q: Trace<Vector>| {
                let carrying = 0.5 * (phi.minus.value + phi.plus.value).dot(&n);
                carrying * (inner.dot(&q.minus.value) - outer.dot(&q.plus.value))
            }
        })
        .faces(self.inflow, self.degree(), move |s| {
            let (defect, n) = ((p.vector(&s.minus) - g(s)) * (self.entering(s).1 * rho.mean(s)), s.n);
            move |phi: Trace<Vector>, q: Trace<Vector>| phi.minus.value.dot(&n) * defect.dot(&q.minus.value)
        })
    }

    /// The derivative along the density, trial δρ, test q: `a_upw(p,q;δρ p) − ∫_Γ δρ(p·n)⊖ p_D·q`   [T5]
    fn by_density(self, at: &At<'a>) -> Bilinear<'a, Scalar, Vector> {
        let (p, g) = (self.p, data(at));
        Bilinear::cells(self.degree() - 1, move |x| {
            let carried = p.vector_gradient(&x.site) * p.vector(&x.site);
            move |change: Scalar, q: Vector| change.value * carried.dot(&q.value)
        })
        .faces(Faces::INTERIOR, self.degree(), move |s| {
            let ((pn, side), jump) = (self.through(s), self.jump(s));
            let (inner, outer) = (jump * (0.5 * pn * (side - 1.0)), jump * (0.5 * pn * (side + 1.0)));
            move |change: Trace<Scalar>, q: Trace<Vector>| {
                change.mean() * (inner.dot(&q.minus.value) - outer.dot(&q.plus.value))
            }
        })
        .faces(self.inflow, self.degree(), move |s| {
            let brought = (p.vector(&s.minus) - g(s)) * self.entering(s).0;
            move |change: Trace<Scalar>, q: Trace<Vector>| change.minus.value * brought.dot(&q.minus.value)
        })
    }
}
