//! What a state of the compressible sheet is worth: free energy, pressure, and how stiff its density is.

use std::sync::Arc;

use super::Compressible;
use crate::form::compression::Compression;
use crate::form::{FacePoint, elastic};
use crate::model::polarity::FORMULA_DEGREE;
use crate::model::state::State;
use crate::solve::dot;
use crate::space::{Continuity, Field, Space};

impl Compressible {
    /// `F_h`   [5.39]
    pub fn free_energy(&self, state: &State, t: f64) -> f64 {
        let data = |s: &FacePoint| self.polarity.data(s, t);
        let (rho, p) = (state.volume(), &state.p);
        let (kappa, dirichlet) = (self.parameters.coherence, self.polarity.dirichlet);
        elastic::energy_of(&self.loops, (rho, p), &self.compression(), kappa, dirichlet, FORMULA_DEGREE, data)
    }

    /// `dF_h/dt` for the given rate of the polarity, and that of the density that the transport gives.
    pub fn energy_rate(&self, state: &State, rate_of_p: &[f64], t: f64) -> f64 {
        let (rho, p, b) = (state.volume(), &state.p, self.parameters.elasticity);
        let by_polarity = match b {
            0.0 => 0.0,
            b => b * dot(&self.molecular_functional(rho, p, t), rate_of_p),
        };
        let Ok(inputs) = self.inputs(t) else { return f64::NAN };
        let rate = self.density.mass_solve(&self.transport(rho, &state.v, &inputs));
        let rate = Field::new(&self.density.space, rate.into_iter().map(|r| -r).collect());
        let data = |s: &FacePoint| self.polarity.data(s, t);
        let (kappa, dirichlet) = (self.parameters.coherence, self.polarity.dirichlet);
        by_polarity
            + elastic::energy_along_density(
                &self.loops,
                (rho, p),
                &rate,
                &self.compression(),
                kappa,
                dirichlet,
                FORMULA_DEGREE,
                data,
            )
    }

    /// A bound on `−λ` of the density's equation, per time: transport through a cell, and the relaxation of a squeezed cell,
    /// `ds/dρ` of the isotropic stress s over four times the viscosity.
    pub fn stiffness(&self, state: &State) -> f64 {
        let (rho, p) = (state.volume(), &state.p);
        let compression = self.compression();
        let k = (self.density.space.degree + 1) as f64;
        let mut largest = 0.0_f64;
        for cell in 0..self.loops.mesh.cells.len() {
            let size = |field: &Field| {
                let components = field.coefficients(cell, 0).zip(field.coefficients(cell, 1));
                components.fold(0.0_f64, |m, (x, y)| m.max(x.hypot(y)))
            };
            let densest = rho.coefficients(cell, 0).fold(0.0_f64, f64::max);
            let squeezed = compression.stress_by_density(densest, size(p).powi(2)).abs() / 4.0;
            largest = largest.max(0.75 * k * k * self.loops.ratio(cell) * size(&state.v) + squeezed);
        }
        largest
    }

    /// `ρΠ = c_0 ρ^(γ+1) − ½Bρ_min|p|²` at the nodes of the polarity   [5.50]
    pub fn pressure(&self, state: &State) -> Field {
        let (rho, p) = (state.volume(), &state.p);
        let stress = Compression { active: 0.0, ..self.compression() };
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
