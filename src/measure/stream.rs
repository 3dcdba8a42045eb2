//! The stream function of a velocity.

use std::sync::Arc;

use super::MeasureError;
use crate::form::words::{Scalar, Trace};
use crate::form::{Faces, Integrator, Linear, gradient, mass};
use crate::model::closed::part_of_nodes;
use crate::solve::SolveError;
use crate::solve::sparse::{Factored, Matrix};
use crate::space::{Continuity, Field, Space};

/// The factorised Neumann problem for ψ.
#[derive(Debug)]
pub struct StreamFunction {
    /// Of ψ.
    pub space: Arc<Space>,
    laplacian: Factored,
    means: Vec<f64>,
    /// The node of each connected part whose value is held, and the part of every node.
    held: Vec<usize>,
    part_of: Vec<usize>,
}

impl StreamFunction {
    /// Prepares ψ in the continuous space of the velocity's degree.
    ///
    /// # Errors
    /// A factorisation that fails.
    pub fn new(loops: &Integrator, velocity: &Space) -> Result<Self, SolveError> {
        let space = Arc::new(Space::new(&loops.mesh, Continuity::Continuous, velocity.degree, 1));
        let form = gradient::gradients(&space);
        // ψ is free up to a constant in each connected part: hold one node, shift afterwards
        let parts = loops.mesh.parts();
        let part_of = part_of_nodes(&loops.mesh, &space, &parts);
        let first = |part| part_of.iter().position(|&p| p == part).expect("a part has a node");
        let held: Vec<usize> = (0..parts.count).map(first).collect();
        let mut triplets = loops.triplets(&form, &space, &space);
        triplets.retain(|(i, j, _)| !held.contains(i) && !held.contains(j));
        triplets.extend(held.iter().map(|&node| (node, node, 1.0)));
        let n = space.dof_count();
        let laplacian = Factored::new("stream function", Matrix::from_triplets(n, n, &triplets))?;
        let means = loops.vector(&mass::scalar_load(&space, 0, |_| 1.0), &space);
        Ok(Self { space, laplacian, means, held, part_of })
    }

    /// `∫∇ψ·∇χ = ∫(curl v)χ − ∫_∂Ω (v·t)χ`, t = n turned by +90°; ψ has mean zero in each connected part   [B.54]
    ///
    /// # Errors
    /// A velocity or solution that is not finite; a relative residual that shows a singular matrix.
    pub fn of(&self, loops: &Integrator, v: &Field) -> Result<Field, MeasureError> {
        let (q, k) = (self.space.degree, v.space.degree);
        let form = Linear::cells(q + k - 1, |x| {
            let g = v.vector_gradient(&x.site);
            let curl = g.m21 - g.m12;
            move |chi: Scalar| curl * chi.value
        })
        .faces(Faces::BOUNDARY, q + k, |s| {
            let u = v.vector(&s.minus);
            let along = -u.x * s.n.y + u.y * s.n.x;
            move |chi: Trace<Scalar>| -along * chi.minus.value
        });
        let mut right = loops.vector(&form, &self.space);
        self.held.iter().for_each(|&node| right[node] = 0.0);
        let mut psi = self.laplacian.solve(&right)?;
        let mut sums = vec![[0.0; 2]; self.held.len()];
        for ((value, weight), &part) in psi.iter().zip(&self.means).zip(&self.part_of) {
            sums[part][0] += value * weight;
            sums[part][1] += weight;
        }
        psi.iter_mut().zip(&self.part_of).for_each(|(value, &part)| *value -= sums[part][0] / sums[part][1]);
        Ok(Field::new(&self.space, psi))
    }
}
