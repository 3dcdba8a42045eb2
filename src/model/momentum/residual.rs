//! What a flow leaves of its equations.

use super::factors::System;
use super::{Momentum, MomentumError};
use crate::body::guide::Rule;
use crate::model::immersed::nitsche::Moved;
use crate::shape::Wrench;
use crate::solve::sparse::Factored;
use crate::solve::{SolveError, dot, norm, root};

impl Momentum {
    /// Residuals of both equations on the free unknowns, as functionals.
    fn residual(&self, f: &[f64], v: &[f64], pi: &[f64]) -> [Vec<f64>; 2] {
        let mut momentum: Vec<f64> = f.iter().map(|v| -v).collect();
        self.stiffness.times_add(1.0, v, &mut momentum);
        self.gradient.times_add(1.0, pi, &mut momentum);
        if let Some(bodies) = self.bodies() {
            bodies.add_residual(v, &mut momentum);
        }
        let mut volume = self.divergence.times(v);
        // the multiplier of the zero mean takes the part of div v that no pressure can see
        let sums = self.closed.sums(&volume);
        let shifts: Vec<f64> = sums.iter().zip(self.closed.sums(&self.means)).map(|(sum, area)| sum / area).collect();
        self.closed.shift(&mut volume, &shifts, |dof| self.means[dof]);
        [self.frames.restrict(&momentum), volume]
    }

    /// `(rᵀMr)^½` of `r = M⁻¹ R` for the momentum balance and for `div v = 0`   [9.8], [9.9]
    ///
    /// # Errors
    /// As [`Factored::solve`].
    ///
    /// # Panics
    /// With bodies.
    pub fn residual_norms(&self, f: &[f64], v: &[f64], pi: &[f64]) -> Result<[f64; 2], SolveError> {
        assert!(self.cover().is_none(), "the loads on bodies are a part of the force");
        self.norms(self.residual(f, v, pi))
    }

    /// The same with bodies, under loads on them and rules of their motion.
    ///
    /// # Errors
    /// As [`Momentum::carry`].
    ///
    /// # Panics
    /// Without bodies.
    pub fn residual_norms_around(
        &self,
        (f, prescribed): (&[f64], &[f64]),
        (v, pi): (&[f64], &[f64]),
        loads: &[Wrench],
        rules: &[Rule],
    ) -> Result<[f64; 2], MomentumError> {
        let residual = match &self.system {
            System::Nitsche(bodies) => {
                let twists = bodies.twists_in(self.ground(), (v, pi), prescribed, loads, rules)?;
                bodies.residual(self.ground(), f, Moved { v, pi, twists: &twists })
            }
            System::Immersed(_) | System::Open(_) | System::Closed(_) => {
                let mut force = f.to_vec();
                let holding = self.carry(f, prescribed, loads, rules)?.holding;
                self.add_body_loads(loads, &mut force);
                self.add_body_loads(&holding, &mut force);
                self.residual(&force, v, pi)
            }
        };
        Ok(self.norms(residual)?)
    }

    fn norms(&self, [momentum, volume]: [Vec<f64>; 2]) -> Result<[f64; 2], SolveError> {
        let size = |mass: &Factored, r: &[f64]| -> Result<f64, SolveError> {
            if norm(r) == 0.0 {
                return Ok(0.0);
            }
            Ok(root(dot(r, &mass.solve(r)?)))
        };
        Ok([size(&self.residual_masses.0, &momentum)?, size(&self.residual_masses.1, &volume)?])
    }
}
