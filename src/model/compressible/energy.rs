//! Numbers of a state of the compressible sheet: its free energy and the rate of that, its pressure, and how stiff its
//! density is.

use std::sync::Arc;

use super::Compressible;
use crate::expression::ExpressionError;
use crate::form::FacePoint;
use crate::form::compression::Compression;
use crate::form::elastic::PolarEnergy;
use crate::mesh::Point;
use crate::model::State;
use crate::model::fields::{DENSITY, POLARITY, VELOCITY};
use crate::model::polarity::FORMULA_DEGREE;
use crate::model::terms::Given;
use crate::solve::dot;
use crate::space::{Continuity, Field, Space};

impl Compressible {
    /// The polarity's part of the free energy.
    fn polar_energy<'a>(
        &'a self,
        p: &'a Field,
        given: &'a Given,
    ) -> PolarEnergy<'a, impl Fn(&FacePoint) -> Point + Sync> {
        PolarEnergy {
            loops: &self.loops,
            p,
            kappa: self.parameters.coherence,
            dirichlet: self.polarity.dirichlet,
            degree: FORMULA_DEGREE,
            data: move |s: &FacePoint| given.polarity(s),
        }
    }

    /// `F_h`   [5.39]
    pub fn free_energy(&self, state: &State, t: f64) -> f64 {
        self.polar_energy(&state[POLARITY], &self.given(t)).with(&state[DENSITY], &self.parameters.compression())
    }

    /// `dF_h/dt` for the given rate of the polarity, and that of the density that the transport gives.
    pub fn energy_rate(&self, state: &State, rate_of_p: &[f64], t: f64) -> f64 {
        let (rho, p) = (&state[DENSITY], &state[POLARITY]);
        let by_polarity = match self.parameters.elasticity {
            0.0 => 0.0,
            b => b * dot(&self.molecular_functional(rho, p, t), rate_of_p),
        };
        let Ok(rate) = self.density_rate(state, t) else { return f64::NAN };
        by_polarity + self.polar_energy(p, &self.given(t)).along(rho, &rate, &self.parameters.compression())
    }

    /// `∂_t ρ` that follows from the flow.
    ///
    /// # Errors
    /// A formula that is not finite.
    pub fn density_rate(&self, state: &State, t: f64) -> Result<Field, ExpressionError> {
        let transport = self.transport(&state[DENSITY], &state[VELOCITY], &self.inputs(t)?);
        let values = self.density.mass_solve(&transport).into_iter().map(|r| -r).collect();
        Ok(Field::new(&self.density.space, values))
    }

    /// A bound on `−λ` of the density's equation, per time: transport through a cell, and the relaxation of a squeezed
    /// cell, `ds/dρ` of the isotropic stress s over four times the viscosity.
    pub fn stiffness(&self, state: &State) -> f64 {
        let (rho, p) = (&state[DENSITY], &state[POLARITY]);
        let compression = self.parameters.compression();
        let k = (self.density.space.degree + 1) as f64;
        let mut largest = 0.0_f64;
        for cell in 0..self.loops.mesh.cells.len() {
            let size = |field: &Field| {
                let components = field.coefficients(cell, 0).zip(field.coefficients(cell, 1));
                components.fold(0.0_f64, |m, (x, y)| m.max(x.hypot(y)))
            };
            let densest = rho.coefficients(cell, 0).fold(0.0_f64, f64::max);
            let squeezed = compression.stress_by_density(densest, size(p).powi(2)).abs() / 4.0;
            largest = largest.max(0.75 * k * k * self.loops.ratio(cell) * size(&state[VELOCITY]) + squeezed);
        }
        largest
    }

    /// `ρΠ = c_0 ρ^(γ+1) − ½Bρ_min|p|²` at the nodes of the polarity   [5.50]
    pub fn pressure(&self, state: &State) -> Field {
        let (rho, p) = (&state[DENSITY], &state[POLARITY]);
        let stress = Compression { active: 0.0, ..self.parameters.compression() };
        let nodes = crate::element::basis::nodes(p.space.degree);
        let space = Arc::new(Space::new(&self.loops.mesh, Continuity::Discontinuous, p.space.degree, 1));
        let mut out = Field::zero(&space);
        for cell in 0..self.loops.mesh.cells.len() {
            for (i, xi) in nodes.iter().enumerate() {
                // between the points of the limiter rounding may leave it below zero
                let density = rho.scalar_at(cell, *xi).max(0.0);
                out.values[space.dof(cell, 0, i)] = stress.stress(density, p.vector_at(cell, *xi).norm_squared());
            }
        }
        out
    }
}
