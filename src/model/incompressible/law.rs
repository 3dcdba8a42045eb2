//! What bodies do in the energy law of a tissue.

use super::{Force, Incompressible, State};
use crate::form::power;
use crate::form::upwind::Carrier;
use crate::model::fields::{POLARITY, PRESSURE, VELOCITY};
use crate::model::momentum::MomentumError;
use crate::model::terms::{At, MOMENTUM, Sum};
use crate::shape::{Pose, Twist};
use crate::space::Field;

impl Incompressible {
    /// What every body takes of the power of a tissue when they move with some twists: its friction, what holds and
    /// pushes it from outside, with opposite sign, and what the method takes by which it is there. By Nitsche's method
    /// that is
    ///
    /// ```text
    /// ∫_∂B_i [(γ_N/h)(v−u_i)·v − 2D(v)n·(2v−u_i) + Πn·u_i − σn·v] + γ_v Σ_S g_S(v,v) + γ_Π Σ_S h_S² g_S(Π,Π)
    /// ```
    /// with the stress σ of the polarity and the ghost faces S at its cells, by penalty what it is larger by inside of the
    /// body than the viscosity.
    ///
    /// # Errors
    /// As [`Incompressible::carried`].
    pub fn powers_to_bodies(&self, state: &State, twists: &[Twist], t: f64) -> Result<Vec<f64>, MomentumError> {
        let Some(floating) = &self.bodies else { return Ok(Vec::new()) };
        let (v, p) = (&state[VELOCITY], &state[POLARITY]);
        let Some(penalty) = self.momentum.bodies() else {
            let (given, l) = (self.given(t), self.molecular(p, v, t));
            let at = At::new(&self.parameters, p, &given).with_flow(&v.space, Carrier::from(v)).with_field(l.as_ref());
            let mut powers = self.momentum.powers_of_boundaries((&v.values, &state[PRESSURE].values), twists);
            for (power, pulled) in powers.iter_mut().zip(self.powers_of_tractions(&Sum::of(&[MOMENTUM]).value(&at), v))
            {
                *power -= pulled;
            }
            return Ok(powers);
        };
        let mut powers = penalty.powers(&v.values);
        for (body, power) in powers.iter_mut().enumerate() {
            let inside = self.loops.inside(&floating.covered.cover, Some(body));
            let friction = inside.sum(2 * v.space.degree, |x| v.vector(&x.site).norm_squared());
            *power += self.parameters.friction * friction;
        }
        if twists.iter().any(|twist| *twist != Twist::ZERO) {
            let loads = self.loads(&Force::default(), t)?.into_iter().zip(self.carried(state, t)?.holding);
            for ((power, (load, held)), twist) in powers.iter_mut().zip(loads).zip(twists) {
                *power -= (load + held).power(twist);
            }
        }
        Ok(powers)
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
