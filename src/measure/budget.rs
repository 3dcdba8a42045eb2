//! The terms of the energy law [5.47], [7.18] at one state.

use crate::form::upwind::Carrier;
use crate::model::State;
use crate::model::compressible::Compressible;
use crate::model::fields::{DENSITY, POLARITY, VELOCITY};
use crate::model::incompressible::Incompressible;
use crate::model::momentum::MomentumError;
use crate::model::terms::power::{COUNT, LINES, powers};
use crate::model::terms::{At, Loops, Side};
use crate::solve::dot;
use crate::time::{March, Sheet, SheetKind};

/// `dF_h/dt + C_F‖v‖² + ∫_∂Ω β_w (v·t)² + 2‖D(v)‖² + ‖L_h‖²/(Pe B) = T_a(p|v) + S_a δ(p,p,v) + defect`
///
/// In a compressible sheet `2∫ρ[|D(v)|² + (div v)²]`, `∫|L_h|²/(Pe B ρ)` and `S_a δ(ρp,p,v) + S_a' ∫ρ|p|² div v` take
/// their places. Rate and relaxation are of the whole molecular field; all other lines are those of listed terms, and
/// stand on the side of the term.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Budget {
    /// `dF_h/dt = (L_h|∂_t p)`, and `∫_∂B Ψ u·n` where bodies move.
    pub rate: f64,
    /// What bodies take, the sum of [`Incompressible::powers_to_bodies`].
    pub bodies: f64,
    /// `∫_∂Ω β_w (v·t)²`
    pub wall_friction: f64,
    /// `‖L_h‖²/(Pe B)`
    pub relaxation: f64,
    /// In the order of [`LINES`].
    pub lines: [f64; COUNT],
}

impl Budget {
    /// The terms at the current state of a march, with `∂_t p` by the time scheme; exact on straight cells.
    ///
    /// # Errors
    /// As [`Budget::at`].
    pub fn of(march: &March) -> Result<Self, MomentumError> {
        Self::at(march.model, &march.state, march.rate_of_p(), march.t)
    }

    /// The terms at a state with this `∂_t p`.
    ///
    /// # Errors
    /// What acts on bodies that is not finite, or cannot be solved for.
    pub fn at(model: &dyn Sheet, state: &State, rate_of_p: &[f64], t: f64) -> Result<Self, MomentumError> {
        match model.kind() {
            SheetKind::Incompressible(sheet) => Self::incompressible(sheet, state, rate_of_p, t),
            SheetKind::Compressible(sheet) => Ok(Self::compressible(sheet, state, rate_of_p, t)),
        }
    }

    fn incompressible(model: &Incompressible, state: &State, rate_of_p: &[f64], t: f64) -> Result<Self, MomentumError> {
        let (m, v, p) = (&model.parameters, &state[VELOCITY], &state[POLARITY]);
        let (given, l) = (model.given(t), model.molecular(p, v, t));
        let at = At::new(m, p, &given).with_flow(&v.space, Carrier::from(v)).with_field(l.as_ref());
        let flow = if model.momentum.boundaries().is_some() { model.tissue() } else { &model.loops };
        let loops = Loops { tissue: model.tissue(), flow };
        let (wall_friction, twists) = (model.momentum.walls().dissipation(flow, v), model.twists(state, t)?);
        let bodies = model.powers_to_bodies(state, &twists, t)?.iter().sum();
        let mut budget = Self { wall_friction, bodies, lines: powers(&at, &loops), ..Self::default() };
        if let Some(l) = &l {
            let well = model.molecular_functional(p, v, t);
            budget.rate = m.elasticity * dot(&well, rate_of_p) + model.swept_energy(p, &twists);
            budget.relaxation = m.elasticity * dot(&well, &l.values) / m.peclet;
        }
        Ok(budget)
    }

    fn compressible(model: &Compressible, state: &State, rate_of_p: &[f64], t: f64) -> Self {
        let (m, v, rho, p) = (&model.parameters, &state[VELOCITY], &state[DENSITY], &state[POLARITY]);
        let (given, l) = (model.given(t), model.molecular(&model.molecular_functional(rho, p, t)));
        let at = model.at(rho, p, v, &given).with_field(l.as_ref());
        let loops = Loops { tissue: &model.loops, flow: &model.loops };
        let rate = model.energy_rate(state, rate_of_p, t);
        let wall_friction = model.walls.dissipation(&model.loops, v);
        let mut budget = Self { rate, wall_friction, lines: powers(&at, &loops), ..Self::default() };
        if let Some(l) = &l {
            // where there is no tissue, nothing relaxes
            budget.relaxation = m.elasticity / m.peclet
                * model.loops.sum(2 * p.space.degree + rho.space.degree, |x| match rho.scalar(&x.site) {
                    density if density > 0.0 => l.vector(&x.site).norm_squared() / density,
                    _ => 0.0,
                });
        }
        budget
    }

    /// The line of a column, such as `budget_friction`.
    ///
    /// # Panics
    /// A column that no term has.
    pub fn line(&self, column: &str) -> f64 {
        let place = LINES.iter().position(|listed| listed.line.column == column);
        self.lines[place.expect("the column of a term")]
    }

    /// The sum of the lines of one side.
    fn side(&self, side: Side) -> f64 {
        let lines = LINES.iter().zip(self.lines).filter(|(listed, _)| listed.side == side);
        lines.map(|(_, power)| power).sum()
    }

    /// What the terms leave: power through the boundary and of sources, and the error of a discretisation that does not
    /// keep the law.
    pub fn defect(&self) -> f64 {
        self.rate + self.side(Side::Left) + self.wall_friction + self.bodies + self.relaxation - self.side(Side::Right)
    }
}
