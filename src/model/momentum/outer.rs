//! What acts on a flow from outside.

use super::tagged;
use crate::expression::Expression;
use crate::form::words::Vector;
use crate::form::{CellPoint, FacePoint, Faces, Linear, mass};
use crate::mesh::Point;
use crate::model::boundary::{Conditions, VelocityCondition};
use crate::model::numbers::Numbers;
use crate::model::polarity::FORMULA_DEGREE;
use crate::model::sources::Sources;
use crate::space::Space;

/// `(f_v|w)`
pub fn body_force<'a>(
    velocity: &Space,
    numbers: impl Into<Numbers<'a>>,
    sources: &'a Sources,
    t: f64,
) -> Linear<'a, Vector> {
    if !sources.has_force() {
        return Linear::zero();
    }
    let numbers = numbers.into();
    mass::load(velocity, FORMULA_DEGREE, move |x: &CellPoint| sources.force(numbers, x.site.x, t))
}

/// `(f_v|w) + ∫_Γ g·w` with the traction `g` of the `traction` tags; of exact fields, where they give the boundary
/// data, `n·σ` on boundaries with a natural condition and its tangential part on walls, there with `β_w v` where they
/// resist. In a compressible sheet ρσ takes the place of σ.
pub fn outer_force<'a>(
    velocity: &Space,
    numbers: impl Into<Numbers<'a>>,
    conditions: &'a [Conditions],
    sources: &'a Sources,
    t: f64,
) -> Linear<'a, Vector> {
    let numbers = numbers.into();
    let mut form = body_force(velocity, numbers, sources, t);
    let pulled = tagged(conditions, |c| c.traction().is_some_and(|g| !g.iter().all(Expression::is_zero)));
    if pulled != Faces::NONE {
        let mesh = velocity.mesh.clone();
        let value =
            move |s: &FacePoint| match mesh.faces[s.face].tag.and_then(|tag| conditions[tag].velocity.traction()) {
                Some([f, g]) => Point::new(f.eval(s.minus.x, t), g.eval(s.minus.x, t)),
                None => unreachable!("only traction tags are in the set"),
            };
        form = form + mass::face_load(velocity, pulled, FORMULA_DEGREE, value);
    }
    let Some(exact) = sources.boundary() else { return form };
    let whole = tagged(conditions, VelocityCondition::fixes_pressure);
    let along = tagged(conditions, VelocityCondition::is_impermeable);
    let traction = move |s: &FacePoint| exact.traction(numbers, s.minus.x, t, s.n);
    let mesh = velocity.mesh.clone();
    let tangential = move |s: &FacePoint| {
        let mut g = traction(s);
        if let Some(beta) = mesh.faces[s.face].tag.and_then(|tag| conditions[tag].velocity.resistance()) {
            g += beta.eval(s.minus.x, t) * exact.flow(s.minus.x, t).value;
        }
        g - s.exact_n * g.dot(&s.exact_n)
    };
    form + mass::face_load(velocity, whole, FORMULA_DEGREE, traction)
        + mass::face_load(velocity, along, FORMULA_DEGREE, tangential)
}
