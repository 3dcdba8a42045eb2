//! What bodies do in the energy law of a tissue.

use super::{Force, Incompressible, State};
use crate::form::power;
use crate::form::upwind::Carrier;
use crate::model::fields::{POLARITY, PRESSURE, VELOCITY};
use crate::model::momentum::MomentumError;
use crate::model::terms::{At, MOMENTUM, Sum};
use crate::shape::{Pose, Twist};
use crate::solve::dot;
use crate::space::Field;

impl Incompressible {
    /// What bodies that move with some twists take of the power of a tissue: their friction, what holds and pushes them
    /// from outside, with opposite sign, and what the method takes by which they are there. By Nitsche's method that is
    ///
    /// ```text
    /// Σ_i ∫_∂B_i [(γ_N/h)(v−u_i)·v − 2D(v)n·(2v−u_i) + Πn·u_i − σn·v] + γ_v Σ_S g_S(v,v) + γ_Π Σ_S h_S² g_S(Π,Π)
    /// ```
    /// with the stress σ of the polarity, by penalty what it is larger by inside of the bodies than the viscosity.
    ///
    /// # Errors
    /// As [`Incompressible::holding`].
    pub fn power_to_bodies(&self, state: &State, twists: &[Twist], t: f64) -> Result<f64, MomentumError> {
        let Some(floating) = &self.bodies else { return Ok(0.0) };
        let (v, p) = (&state[VELOCITY], &state[POLARITY]);
        let Some(penalty) = self.momentum.bodies() else {
            let (given, l) = (self.given(t), self.molecular(p, t));
            let at = At::new(&self.parameters, p, &given).with_flow(&v.space, Carrier::from(v)).with_field(l.as_ref());
            let pulled = dot(&self.tractions(&Sum::of(&[MOMENTUM]).value(&at)).flow, &v.values);
            return Ok(self.momentum.power_of_boundaries((&v.values, &state[PRESSURE].values), twists) - pulled);
        };
        let mut taken = vec![0.0; v.values.len()];
        penalty.add_residual(&v.values, &mut taken);
        let inside = self.loops.inside(&floating.covered.cover, None);
        let friction = inside.sum(2 * v.space.degree, |x| v.vector(&x.site).norm_squared());
        let mut power = dot(&taken, &v.values) + self.parameters.friction * friction;
        if twists.iter().any(|twist| *twist != Twist::ZERO) {
            let loads = self.loads(&Force::default(), t)?.into_iter().zip(self.holding(state, t)?);
            power -= loads.zip(twists).map(|((load, held), twist)| (load + held).power(twist)).sum::<f64>();
        }
        Ok(power)
    }

    /// `∫_∂B Ψ u·n`, n out of the tissue: how the free energy grows because bodies that move leave more room.
    pub fn swept_energy(&self, p: &Field, twists: &[Twist]) -> f64 {
        let (m, Some(floating)) = (&self.parameters, &self.bodies) else { return 0.0 };
        if m.elasticity == 0.0 || twists.iter().all(|twist| *twist == Twist::ZERO) {
            return 0.0;
        }
        let surface = floating.covered.cover.surface();
        let of = |(body, (twist, pose)): (usize, (&Twist, &Pose))| {
            self.loops.sum_outline(&surface, body, 4 * p.space.degree + 1, |x| {
                power::energy_density(p, &x.site, m.coherence) * x.n.dot(&twist.at(x.site.x, pose.position))
            })
        };
        m.elasticity * twists.iter().zip(&floating.poses).enumerate().map(of).sum::<f64>()
    }
}
