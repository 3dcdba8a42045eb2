//! Rigid bodies in a tissue: where they are, and what of the mesh is left to the tissue.

use std::sync::Arc;

use super::momentum::MomentumError;
use super::passive::{Continuation, Covered};
use crate::body::Body;
use crate::body::guide::Guide;
use crate::cut::Cover;
use crate::form::Integrator;
use crate::model::immersed::flow::Method;
use crate::model::immersed::nitsche::Placement;
use crate::model::immersed::penalty::{Immersion, Penalty};
use crate::model::immersed::{Embedding, Rigidity};
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
    /// Of bodies that lie on the mesh in some way.
    pub fn new(loops: &Integrator, guide: &Arc<Guide>, cover: &Arc<Cover>, poses: &[Pose]) -> Self {
        let covered = Covered::new(loops, cover, Continuation::default());
        Self { guide: guide.clone(), poses: poses.to_vec(), covered }
    }

    /// The bodies.
    pub fn bodies(&self) -> &[Body] {
        &self.guide.bodies
    }
}

/// Puts bodies into a flow.
///
/// # Errors
/// By penalty a body outside of the mesh, or all over it.
pub fn embed(
    loops: &Integrator,
    velocity: &Arc<Space>,
    guide: &Guide,
    poses: &[Pose],
    method: Method,
) -> Result<Embedding, MomentumError> {
    let bodies = &guide.bodies;
    let placed: Vec<_> = bodies.iter().zip(poses).map(|(body, pose)| (body.shape.clone(), *pose)).collect();
    let cover = Arc::new(Cover::new(&loops.mesh, None, &placed));
    Ok(match method {
        Method::Penalty(Penalty { epsilon, strength }) => {
            let names: Vec<String> = bodies.iter().map(|body| body.name.clone()).collect();
            let immersion = Immersion::new(loops, velocity, cover, &names, (poses, strength))?;
            let friction = bodies.iter().map(|body| body.friction).collect();
            Embedding::Penalty(immersion, Rigidity { epsilon, friction })
        }
        Method::Nitsche => Embedding::Nitsche(Placement { cover, bodies: bodies.clone(), poses: poses.to_vec() }),
    })
}
