//! The terms of the energy law [5.47], [7.18] at one state.

use crate::form::words::sym;
use crate::model::State;
use crate::model::compressible::Compressible;
use crate::model::incompressible::Incompressible;
use crate::solve::dot;
use crate::time::{March, Sheet, SheetKind};

/// `dF_h/dt + C_F‖v‖² + 2‖D(v)‖² + ‖L_h‖²/(Pe B) = T_a(p|v) + S_a δ(p,p,v) + defect`
///
/// In a compressible sheet `2∫ρ[|D(v)|² + (div v)²]`, `∫|L_h|²/(Pe B ρ)` and `S_a δ(ρp,p,v) + S_a' ∫ρ|p|² div v` take
/// their places.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Budget {
    /// `dF_h/dt = (L_h|∂_t p)`
    pub rate: f64,
    /// `C_F‖v‖²`
    pub friction: f64,
    /// `2‖D(v)‖²`
    pub viscosity: f64,
    /// `‖L_h‖²/(Pe B)`
    pub relaxation: f64,
    /// `T_a(p|v)`
    pub traction: f64,
    /// `S_a δ(p,p,v)`
    pub active_stress: f64,
}

impl Budget {
    /// The terms at the current state of a march, with `∂_t p` by the time scheme; exact on straight cells.
    pub fn of(march: &March) -> Self {
        Self::at(march.model, &march.state, march.rate_of_p(), march.t)
    }

    /// The terms at a state with this `∂_t p`.
    pub fn at(model: &dyn Sheet, state: &State, rate_of_p: &[f64], t: f64) -> Self {
        match model.kind() {
            SheetKind::Incompressible(sheet) => Self::incompressible(sheet, state, rate_of_p, t),
            SheetKind::Compressible(sheet) => Self::compressible(sheet, state, rate_of_p, t),
        }
    }

    fn incompressible(model: &Incompressible, state: &State, rate_of_p: &[f64], t: f64) -> Self {
        let (m, v, p) = (&model.parameters, &state.v, &state.p);
        let k = v.space.degree;
        let stretch = |x: &crate::form::CellPoint| sym(&v.vector_gradient(&x.site));
        let mut budget = Self {
            friction: m.friction * model.tissue().sum(2 * k, |x| v.vector(&x.site).norm_squared()),
            viscosity: 2.0 * model.loops.sum(2 * (k - 1), |x| stretch(x).norm_squared()),
            traction: m.traction
                * model.tissue().sum(k + p.space.degree, |x| p.vector(&x.site).dot(&v.vector(&x.site))),
            ..Self::default()
        };
        if m.active_stress != 0.0 {
            budget.active_stress = m.active_stress
                * model.tissue().sum(k - 1 + 2 * p.space.degree, |x| {
                    let p = p.vector(&x.site);
                    p.dot(&(stretch(x) * p))
                });
        }
        if m.elasticity != 0.0 {
            let well = model.polarity.molecular_functional(model.tissue(), p, t);
            budget.rate = m.elasticity * dot(&well, rate_of_p);
            budget.relaxation = m.elasticity * dot(&well, &model.polarity.project(&well)) / m.peclet;
        }
        budget
    }

    fn compressible(model: &Compressible, state: &State, rate_of_p: &[f64], t: f64) -> Self {
        let (m, law, loops) = (&model.parameters, &model.law(), &model.loops);
        let (v, rho, p) = (&state.v, state.volume(), &state.p);
        let (k, r, q) = (v.space.degree, rho.space.degree, p.space.degree);
        let mut budget = Self {
            rate: model.energy_rate(state, rate_of_p, t),
            friction: m.friction * loops.sum(2 * k, |x| v.vector(&x.site).norm_squared()),
            viscosity: loops.sum(2 * (k - 1) + r, |x| {
                let g = v.vector_gradient(&x.site);
                2.0 * rho.scalar(&x.site) * (sym(&g).norm_squared() + g.trace().powi(2))
            }),
            traction: m.traction * loops.sum(k + q, |x| p.vector(&x.site).dot(&v.vector(&x.site))),
            ..Self::default()
        };
        if m.active_stress != 0.0 || law.active_stress_iso != 0.0 {
            budget.active_stress = loops.sum(k - 1 + 2 * q + r, |x| {
                let (g, p) = (v.vector_gradient(&x.site), p.vector(&x.site));
                let along =
                    m.active_stress * p.dot(&(sym(&g) * p)) + law.active_stress_iso * p.norm_squared() * g.trace();
                rho.scalar(&x.site) * along
            });
        }
        if m.elasticity != 0.0 {
            let l = model.molecular(&model.molecular_functional(rho, p, t)).expect("there is elasticity");
            // where there is no tissue, nothing relaxes
            budget.relaxation = m.elasticity / m.peclet
                * loops.sum(2 * q + r, |x| match rho.scalar(&x.site) {
                    density if density > 0.0 => l.vector(&x.site).norm_squared() / density,
                    _ => 0.0,
                });
        }
        budget
    }

    /// What the terms leave: power through the boundary and of sources, and the error of a discretisation that does not
    /// keep the law.
    pub fn defect(&self) -> f64 {
        self.rate + self.friction + self.viscosity + self.relaxation - self.traction - self.active_stress
    }
}
