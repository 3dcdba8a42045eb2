//! What acts on a tissue from outside.

use super::tagged;
use crate::expression::Expression;
use crate::form::words::Vector;
use crate::form::{CellPoint, FacePoint, Faces, Linear, mass};
use crate::mesh::Point;
use crate::model::boundary::{Conditions, VelocityCondition};
use crate::model::parameters::Parameters;
use crate::model::polarity::FORMULA_DEGREE;
use crate::model::sources::Sources;
use crate::space::Space;

/// `(f_v|w) + ∫_Γ g·w` with the traction `g` of the `traction` tags; of exact fields, where they give the boundary
/// data, `n·σ` on boundaries with a natural condition and its tangential part on walls, there with `β_w v` where they
/// resist. In a compressible sheet ρσ takes the place of σ.
pub fn outer_force<'a>(
    velocity: &Space,
    parameters: &'a Parameters,
    conditions: &'a [Conditions],
    sources: &'a Sources,
    t: f64,
) -> Linear<'a, Vector> {
    let mut form = Linear::zero();
    if sources.has_force() {
        let value = move |x: &CellPoint| sources.force(parameters, x.site.x, t);
        form = form + mass::load(velocity, FORMULA_DEGREE, value);
    }
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
    let traction = move |s: &FacePoint| exact.traction(parameters, s.minus.x, t, s.n);
    let mesh = velocity.mesh.clone();
    let tangential = move |s: &FacePoint| {
        let mut g = traction(s);
        if let Some(beta) = mesh.faces[s.face].tag.and_then(|tag| conditions[tag].velocity.resistance()) {
            g += beta.eval(s.minus.x, t) * exact.at(s.minus.x, t).velocity;
        }
        g - s.exact_n * g.dot(&s.exact_n)
    };
    form + mass::face_load(velocity, whole, FORMULA_DEGREE, traction)
        + mass::face_load(velocity, along, FORMULA_DEGREE, tangential)
}
