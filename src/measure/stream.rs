//! The stream function of a velocity.

use std::sync::Arc;

use super::MeasureError;
use crate::form::words::{Scalar, Trace};
use crate::form::{Faces, Integrator, Linear, gradient, mass};
use crate::solve::sparse::{Factored, Matrix};
use crate::solve::{SolveError, dot};
use crate::space::{Continuity, Field, Space};

/// The factorised Neumann problem for ψ.
#[derive(Debug)]
pub struct StreamFunction {
    pub space: Arc<Space>,
    laplacian: Factored,
    means: Vec<f64>,
}

impl StreamFunction {
    /// Prepares ψ in the continuous space of the velocity's degree.
    ///
    /// # Errors
    /// A factorisation that fails.
    pub fn new(loops: &Integrator, velocity: &Space) -> Result<Self, SolveError> {
        let space = Arc::new(Space::new(&loops.mesh, Continuity::Continuous, velocity.degree, 1));
        let form = gradient::gradients(&space);
        // ψ is free up to a constant: hold one node, shift afterwards
        let held = 0;
        let mut triplets = loops.triplets(&form, &space, &space);
        triplets.retain(|&(i, j, _)| i != held && j != held);
        triplets.push((held, held, 1.0));
        let n = space.dof_count();
        let laplacian = Factored::new("stream function", Matrix::from_triplets(n, n, &triplets))?;
        let means = loops.vector(&mass::scalar_load(&space, 0, |_| 1.0), &space);
        Ok(Self { space, laplacian, means })
    }

    /// `∫∇ψ·∇χ = ∫(curl v)χ − ∫_∂Ω (v·t)χ`, t = n turned by +90°; ψ has mean zero   [B.54]
    ///
    /// # Errors
    /// As [`Factored::solve`].
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
        right[0] = 0.0;
        let mut psi = self.laplacian.solve(&right)?;
        let mean = dot(&psi, &self.means) / self.means.iter().sum::<f64>();
        psi.iter_mut().for_each(|value| *value -= mean);
        Ok(Field::new(&self.space, psi))
    }
}
