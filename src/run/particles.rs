//! Particles: report and run.

use std::fmt;

use serde::Serialize;

use super::motion::{self, MotionSummary, Mover, Plan, Stride};
use super::stokes::{contact_term, head};
use super::{Options, RunError};
use crate::body::{Hold, Pose, Shape, Twist};
use crate::contact::Contact;
use crate::model::Term;
use crate::scene::particles::Dynamics;
use crate::scene::{Field, ParticlesScene};

/// What will be computed, and with how much.
#[derive(Debug, Clone, Serialize)]
pub struct ParticlesReport {
    pub title: Option<String>,
    pub terms: Vec<Term>,
    pub bodies: usize,
    /// Bodies that forces and contact move.
    pub moving: usize,
    /// Smallest and largest distance of a body's points from its centre.
    pub size: [f64; 2],
    pub area: f64,
    pub mass: f64,
    pub walls: usize,
    pub steps: f64,
    pub remarks: Vec<String>,
}

/// Counts what a scene has; computes nothing.
pub fn report(scene: &ParticlesScene) -> ParticlesReport {
    let bodies = &scene.bodies.bodies;
    let moves = |hold: &Hold| match hold {
        Hold::Free | Hold::Pinned(_) => true,
        Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => false,
    };
    let sizes = || bodies.iter().map(|body| body.shape.circumradius());
    ParticlesReport {
        title: scene.title.clone(),
        terms: terms(scene),
        bodies: bodies.len(),
        moving: bodies.iter().filter(|body| moves(&body.hold)).count(),
        size: [sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max)],
        area: bodies.iter().map(|body| body.shape.area()).sum(),
        mass: bodies.iter().map(|body| body.mass()).sum(),
        walls: scene.bodies.walls.len(),
        steps: (scene.time.end / scene.time.step).ceil(),
        remarks: remarks(scene),
    }
}

/// What is worth knowing before the run and no error.
fn remarks(scene: &ParticlesScene) -> Vec<String> {
    let mut remarks = Vec::new();
    let steps = scene.time.end / scene.time.step;
    if steps > 1e6 && scene.time.max_steps.is_none() {
        remarks.push(format!("{steps:.1e} steps of {} lead to the end {}", scene.time.step, scene.time.end));
    }
    let smallest = scene.bodies.bodies.iter().map(|body| radius(&body.shape)).fold(f64::INFINITY, f64::min);
    let fast = |body: &crate::body::Body| body.start_twist.velocity.norm() * scene.time.step > smallest;
    if let Some(body) = scene.bodies.bodies.iter().find(|body| fast(body)) {
        remarks.push(format!(
            "`{}` moves farther in a step than the smallest body is thick: contacts are found late; take a shorter `time.step`",
            body.name
        ));
    }
    remarks
}

/// Half of the least thickness.
fn radius(shape: &Shape) -> f64 {
    crate::scene::bodies::place::inradius(shape)
}

/// The terms of the motion, on and off.
pub fn terms(scene: &ParticlesScene) -> Vec<Term> {
    let term = |name, formula, on, reason: String| Term { name, formula, on, reason };
    let inertial = scene.dynamics == Dynamics::Inertial;
    let forced = scene.bodies.bodies.iter().filter(|body| {
        !(body.force.iter().all(crate::model::Expression::is_zero) && body.torque.is_zero())
    });
    let (forced, [g1, g2]) = (forced.count(), &scene.gravity);
    let dynamics = if inertial { "inertial" } else { "overdamped" };
    vec![
        term("inertia", "m dV/dt, I dω/dt", inertial, format!("dynamics = \"{dynamics}\"")),
        term("gravity", "m g", !(g1.is_zero() && g2.is_zero()), format!("gravity = [{}, {}]", g1.text(), g2.text())),
        term("drag", "−drag m V, −drag I ω", scene.drag > 0.0, format!("drag = {}", scene.drag)),
        term("forces", "F(t, x, θ), torque", forced > 0, format!("{forced} of {} bodies", scene.bodies.bodies.len())),
        contact_term(&scene.bodies),
    ]
}

impl fmt::Display for ParticlesReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        head(out, self.title.as_deref(), &self.terms)?;
        writeln!(out, "\nbodies         {} ({} that forces and contact move)", self.bodies, self.moving)?;
        writeln!(out, "size           {} to {} from centre to edge", self.size[0], self.size[1])?;
        writeln!(out, "area, mass     {:.6}, {:.6} in all", self.area, self.mass)?;
        writeln!(out, "walls          {}", self.walls)?;
        write!(out, "steps          {:.0}", self.steps)?;
        self.remarks.iter().try_for_each(|remark| write!(out, "\n\nnote: {remark}"))
    }
}

/// Runs a scene to its end and leaves the results in `options.out`.
///
/// # Errors
/// Anything that is wrong before the first step, and results that cannot be written.
pub fn run(scene: &ParticlesScene, options: &Options) -> Result<MotionSummary, RunError> {
    let _ = (scene, options);
    unimplemented!("waits for the stepper")
}
