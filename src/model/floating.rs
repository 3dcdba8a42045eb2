//! Rigid bodies in a tissue: where they are, and what of the mesh is left to the tissue.

use std::sync::Arc;

use super::momentum::MomentumError;
use super::passive::{Continuation, Covered};
use crate::body::Body;
use crate::body::guide::Guide;
use crate::cut::Cover;
use crate::form::Integrator;
use crate::model::immersed::penalty::{Immersion, Strength};
use crate::shape::Pose;
use crate::space::Space;

/// Bodies at their places in a tissue.
#[derive(Debug)]
pub struct Floating {
    /// What the bodies are, and what is prescribed of them.
    pub guide: Arc<Guide>,
    /// Where they are.
    pub poses: Vec<Pose>,
    /// The cells, and the loops over the tissue that is left.
    pub covered: Covered,
}

impl Floating {
    /// Of bodies that are in a velocity space already.
    pub fn new(loops: &Integrator, guide: &Arc<Guide>, immersion: &Immersion) -> Self {
        let covered = Covered::new(loops, &immersion.cover, Continuation::default());
        Self { guide: guide.clone(), poses: immersion.poses.clone(), covered }
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Body] {
        &self.guide.bodies
    }
}

/// Puts bodies into a velocity space.
///
/// # Errors
/// A body outside of the mesh, or all over it.
pub fn immerse(
    loops: &Integrator,
    velocity: &Arc<Space>,
    bodies: &[Body],
    (poses, strength): (&[Pose], Strength),
) -> Result<Immersion, MomentumError> {
    let placed: Vec<_> = bodies.iter().zip(poses).map(|(body, pose)| (body.shape.clone(), *pose)).collect();
    let cover = Arc::new(Cover::new(&loops.mesh, None, &placed));
    let names: Vec<String> = bodies.iter().map(|body| body.name.clone()).collect();
    Ok(Immersion::new(loops, velocity, cover, &names, (poses, strength))?)
}
