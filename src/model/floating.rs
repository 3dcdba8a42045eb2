//! Rigid bodies in the momentum balance of a tissue, by penalty.

use std::sync::Arc;

use super::expression::ExpressionError;
use super::passive::{Continuation, Covered};
use crate::body::cut::Cover;
use crate::body::{Body, Hold, Pose, Twist, perpendicular};
use crate::form::{CellPoint, Integrator, mass, stokes};
use crate::mesh::Point;
use crate::space::{Field, Space};

/// Bodies at their places.
#[derive(Debug)]
pub struct Floating {
    pub covered: Covered,
    pub bodies: Arc<[Body]>,
    pub poses: Vec<Pose>,
    /// ε of the penalty `(2/ε) ∫_B D(v):D(w)`   [L1.13]
    pub epsilon: f64,
    /// Loops over each body, its area `|B|_h` and its second moment about the centre, by the same quadrature.
    inside: Vec<(Integrator, f64, f64)>,
}

impl Floating {
    /// Places the bodies.
    pub fn new(whole: &Integrator, bodies: &Arc<[Body]>, poses: Vec<Pose>, epsilon: f64) -> Self {
        let placed: Vec<_> = bodies.iter().zip(&poses).map(|(body, pose)| (body.shape.clone(), *pose)).collect();
        let cover = Arc::new(Cover::new(&whole.mesh, None, &placed));
        Self::on(whole, bodies, poses, epsilon, &cover)
    }

    /// The same bodies elsewhere.
    pub fn moved(&self, poses: Vec<Pose>) -> Self {
        let cover = Arc::new(self.covered.cover.moved(&poses).0);
        Self::on(&self.covered.passive.whole, &self.bodies, poses, self.epsilon, &cover)
    }

    fn on(whole: &Integrator, bodies: &Arc<[Body]>, poses: Vec<Pose>, epsilon: f64, cover: &Arc<Cover>) -> Self {
        let inside = poses
            .iter()
            .enumerate()
            .map(|(body, pose)| {
                let loops = whole.inside(cover, Some(body));
                let area = loops.sum(0, |_| 1.0);
                let second = loops.sum(2, |x| (x.site.x - pose.position).norm_squared());
                (loops, area, second)
            })
            .collect();
        let covered = Covered::new(whole, cover, Continuation::default());
        Self { covered, bodies: bodies.clone(), poses, epsilon, inside }
    }

    /// Velocity and spin of every body: means of the flow over it, `⟨v⟩` and `∫(x−x_B)^⊥·v / ∫|x−x_B|²`.
    pub fn twists(&self, v: &Field) -> Vec<Twist> {
        let k = v.space.degree;
        let of = |((loops, area, second), pose): (&(Integrator, f64, f64), &Pose)| {
            let mean = |e: Point| loops.sum(k, |x| v.vector(&x.site).dot(&e)) / area;
            let velocity = Point::new(mean(Point::new(1.0, 0.0)), mean(Point::new(0.0, 1.0)));
            let turning =
                loops.sum(k + 1, |x| perpendicular(x.site.x - pose.position).dot(&v.vector(&x.site)));
            Twist { velocity, spin: turning / second }
        };
        self.inside.iter().zip(&self.poses).map(of).collect()
    }

    /// Poses after a step to `t`: `free` ones for bodies that follow the flow, the others where they have to be.
    pub fn guided(&self, mut free: Vec<Pose>, t: f64) -> Vec<Pose> {
        for ((pose, body), old) in free.iter_mut().zip(self.bodies.iter()).zip(&self.poses) {
            match &body.hold {
                Hold::Free | Hold::Held { .. } => {}
                Hold::Fixed => *pose = *old,
                Hold::Pinned(pin) => {
                    let held = old.to_space(*pin);
                    pose.position += held - pose.to_space(*pin);
                }
                Hold::Path { position, angle } => {
                    let [x, y] = position.each_ref().map(|f| f.eval(old.position, t));
                    *pose = Pose { position: Point::new(x, y), angle: angle.eval(old.position, t) };
                }
            }
        }
        free
    }

    /// Calls `visit` with the forms that replace `2(D(v)|D(w)) + C_F(v|w)`: loops, and the form over them.
    pub(super) fn each_form(
        &self,
        velocity: &Space,
        friction: f64,
        mut visit: impl FnMut(&Integrator, crate::form::Bilinear<'_, crate::form::words::Vector, crate::form::words::Vector>),
    ) {
        if friction != 0.0 {
            visit(&self.covered.tissue, friction * mass::vector_mass(velocity));
        }
        for ((loops, _, _), body) in self.inside.iter().zip(self.bodies.iter()) {
            let mut form = (1.0 / self.epsilon) * stokes::viscosity(velocity);
            let drag = body.friction + if self.is_held(body) { 1.0 / self.epsilon } else { 0.0 };
            if drag != 0.0 {
                form = form + drag * mass::vector_mass(velocity);
            }
            visit(loops, form);
        }
    }

    fn is_held(&self, body: &Body) -> bool {
        match body.hold {
            Hold::Free | Hold::Pinned(_) => false,
            Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => true,
        }
    }

    /// Forces on the bodies at time `t`, as a functional on the velocity space.
    ///
    /// # Errors
    /// A formula that is not finite.
    pub fn force(&self, velocity: &Space, t: f64) -> Result<Vec<f64>, ExpressionError> {
        let mut out = vec![0.0; velocity.dof_count()];
        for (((loops, area, second), body), pose) in self.inside.iter().zip(self.bodies.iter()).zip(&self.poses) {
            let x = pose.position;
            let [fx, fy] = [body.force[0].try_eval(x, t)?, body.force[1].try_eval(x, t)?];
            let torque = body.torque.try_eval(x, t)?;
            let mut push = (Point::new(fx, fy) / *area, torque / second);
            if let Hold::Held { velocity: [vx, vy], spin } = &body.hold {
                let scale = 1.0 / self.epsilon;
                push.0 += Point::new(vx.try_eval(x, t)?, vy.try_eval(x, t)?) * scale;
                push.1 += spin.try_eval(x, t)? * scale;
            }
            if push != (Point::zeros(), 0.0) {
                let value = |at: &CellPoint| push.0 + perpendicular(at.site.x - x) * push.1;
                crate::solve::axpy(1.0, &loops.vector(&mass::load(velocity, 1, value), velocity), &mut out);
            }
        }
        Ok(out)
    }
}
