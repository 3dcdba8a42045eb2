//! What walls do to the balance of momentum beside the conditions at nodes: the penalty of [10.3], and the traction of
//! walls that resist.

use super::boundary::Conditions;
use super::momentum::{SlipTreatment, tagged};
use super::polarity::FORMULA_DEGREE;
use crate::expression::{Expression, ExpressionError};
use crate::form::words::Vector;
use crate::form::{Bilinear, Faces, Integrator, stokes};
use crate::space::{Field, Space};

/// Faces of walls, and what the tissue meets there.
#[derive(Debug, Clone)]
pub struct Walls {
    /// Faces with `v·n = 0` by penalty, and `ε_r √|Ω|`.
    penalty: Option<(Faces, f64)>,
    /// Faces of each wall that resists, and its `β_w`.
    resisting: Vec<(Faces, Expression)>,
}

impl Walls {
    /// Reads the conditions of every boundary tag.
    ///
    /// # Errors
    /// A `β_w` that is not finite or below zero somewhere on its wall.
    pub fn new(loops: &Integrator, conditions: &[Conditions], slip: SlipTreatment) -> Result<Self, ExpressionError> {
        let penalty = match slip {
            SlipTreatment::Rotated => None,
            SlipTreatment::Penalty { epsilon } => {
                Some((tagged(conditions, |c| c.is_impermeable()), epsilon * loops.mesh.area().sqrt()))
            }
        };
        let walls = conditions.iter().enumerate().filter_map(|(tag, c)| Some((tag, c.velocity.resistance()?)));
        let walls: Vec<(usize, &Expression)> = walls.collect();
        let mut first = Ok(());
        for (face, &(_, beta)) in loops.mesh.faces.iter().enumerate().flat_map(|(index, face)| {
            walls.iter().filter(move |(tag, _)| face.tag == Some(*tag)).map(move |wall| (index, wall))
        }) {
            loops.each_face_point(face, FORMULA_DEGREE, &mut |s| {
                if first.is_ok() {
                    first = beta.try_amount(s.minus.x, 0.0, "the friction of a wall").map(drop);
                }
            });
        }
        let resisting = walls.into_iter().map(|(tag, beta)| (Faces::tag(tag), beta.clone())).collect();
        first.map(|()| Self { penalty, resisting })
    }

    /// `(1/ε_r) ∫ (v·n)(w·n)` [10.3] on the faces with penalty, and `∫ β_w (v·t)(w·t)` [N.1] on the walls that resist.
    pub fn form(&self, velocity: &Space) -> Bilinear<'_, Vector, Vector> {
        let mut form = Bilinear::zero();
        if let Some((faces, epsilon)) = self.penalty {
            form = form + stokes::slip_penalty(velocity, faces, epsilon);
        }
        for (faces, beta) in &self.resisting {
            form = form + stokes::wall_friction(velocity, *faces, degree(beta), |s| beta.eval(s.minus.x, 0.0));
        }
        form
    }

    /// `∫ β_w (v·t)²`, the power that walls take.
    pub fn dissipation(&self, loops: &Integrator, v: &Field) -> f64 {
        let on_wall = |(faces, beta): &(Faces, Expression)| {
            loops.sum_faces(*faces, 2 * v.space.degree + degree(beta), |s| {
                beta.eval(s.minus.x, 0.0) * s.exact_n.perp(&v.vector(&s.minus)).powi(2)
            })
        };
        self.resisting.iter().map(on_wall).fold(0.0, |sum, power| sum + power)
    }
}

fn degree(beta: &Expression) -> usize {
    if beta.is_constant() { 0 } else { FORMULA_DEGREE }
}
