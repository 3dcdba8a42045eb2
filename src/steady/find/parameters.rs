//! The way over easier parameters: their steady states, followed to the scene's.

use super::{Finder, Way};
use crate::model::parameters::Parameters;
use crate::steady::pseudo::{Pseudo, Stall, Work, relax};
use crate::time::StepFailure;
use crate::time::equations::Trial;

impl Finder<'_, '_> {
    /// Follows steady states from easier parameters to the scene's.
    pub(super) fn by_parameters(&mut self, p: &mut Vec<f64>, settings: &Pseudo) -> Result<Option<Trial>, Stall> {
        let target = *self.model.parameters();
        let easy = easier(&target);
        let (mut reached, mut step, mut steps) = (0.0_f64, 0.25_f64, 0);
        let mut at = 0.0;
        let outcome = loop {
            let parameters = between(&easy, &target, at);
            let here = self
                .model
                .changed(&parameters, self.model.conditions(), self.model.sources())
                .map_err(StepFailure::from)?;
            let bound = if at == 1.0 { settings.residual } else { settings.residual.max(1e-6) };
            let mut guess = p.clone();
            let mut work = Work { kept: &mut self.kept, phases: &mut *self.phases, interrupt: self.interrupt };
            let quick = Pseudo { residual: bound, max_steps: settings.max_steps.min(60), ..*settings };
            let found = relax(&*here, &mut guess, &quick, &mut work, &mut |_, _| steps += 1);
            match found {
                Ok(trial) => {
                    *p = guess;
                    if at == 1.0 {
                        break Ok(trial);
                    }
                    step = if at == 0.0 { step } else { 1.5 * step };
                    reached = at;
                }
                Err(stall @ (Stall::Interrupted | Stall::Failed(_))) => return Err(stall),
                Err(stall) if at == 0.0 || step < 1.0 / 64.0 => break Err(stall),
                Err(_) => step *= 0.5,
            }
            at = (reached + step).min(1.0);
        };
        self.conclude(Way::Parameters, steps, outcome)
    }
}

/// No elasticity, no active stress, at most moderate relaxation times, and no short coherence length.
fn easier(target: &Parameters) -> Parameters {
    Parameters {
        elasticity: 0.0,
        active_stress: 0.0,
        peclet: target.peclet.min(1.0),
        coherence: target.coherence.max(0.1),
        ..*target
    }
}

/// A share `s` of the way from `a` to `b`.
fn between(a: &Parameters, b: &Parameters, s: f64) -> Parameters {
    let mix = |x: f64, y: f64| if s == 1.0 { y } else { x + s * (y - x) };
    Parameters {
        elasticity: mix(a.elasticity, b.elasticity),
        active_stress: mix(a.active_stress, b.active_stress),
        peclet: mix(a.peclet, b.peclet),
        coherence: mix(a.coherence, b.coherence),
        ..*b
    }
}
