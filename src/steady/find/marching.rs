//! The way of time marching, the last resort: until the state is steady or repeats itself.

use super::{Event, Finder, Try, Way};
use crate::scheme::adaptive::SmallestStep;
use crate::steady::oscillation::{Oscillation, Watch};
use crate::steady::pseudo::{Pseudo, Stall, Work, relax};
use crate::steady::spectrum::Mode;
use crate::time::equations::Trial;
use crate::time::kept_factors::KeptFactors;
use crate::time::{March, MarchError, MarchSettings, StepFailure};

/// Residual at which time marching hands over to Newton's method.
const NEARLY_STEADY: f64 = 1e-6;

/// Steps of a march between two looks at the residual.
const LOOK: usize = 5;

/// Steps that resolve the period of a growing mode.
const STEPS_PER_PERIOD: f64 = 40.0;

/// Where a march led.
pub(super) enum Marched {
    Steady(Trial),
    Oscillating(Oscillation),
    Neither,
}

impl<'m> Finder<'_, 'm> {
    /// Marches in time until the state is steady or repeats itself; `mode` is one whose period has to be resolved.
    pub(super) fn by_marching(&mut self, p: &mut Vec<f64>, mode: Option<&Mode>) -> Result<Marched, Stall> {
        self.kept = KeptFactors::default();
        let end = self.settings.march;
        if end <= 0.0 {
            return Ok(Marched::Neither);
        }
        let settings = resolving(self.march, mode);
        self.note(format!("marching in time, Δt = {}, at most to t = {end}", settings.control.step))?;
        let mut march = March::start(self.model, settings, p.clone())?;
        march.interrupt = self.interrupt;
        let outcome = self.march_to(end, &mut march);
        *p = march.state.carried();
        let (steps, t) = (march.counts.steps, march.t);
        self.phases.add(&march.phases);
        let outcome = outcome?;
        let said = match &outcome {
            Marched::Steady(_) => format!("steady at t = {t}"),
            Marched::Oscillating(o) => format!("repeats itself with the period {:.4}, seen at t = {t}", o.period),
            Marched::Neither => format!("neither steady nor periodic at t = {t}"),
        };
        self.tries.push(Try { way: Way::Marching, steps, outcome: said });
        Ok(outcome)
    }

    /// Step by step, with a look at the state after each and at its residual after some.
    fn march_to(&mut self, end: f64, march: &mut March<'m>) -> Result<Marched, Stall> {
        let mut watch = Watch::default();
        while march.t < end * (1.0 - 1e-12) {
            let report = match march.advance(end) {
                Ok(report) => report,
                Err(MarchError::Interrupted { .. }) => return Err(Stall::Interrupted),
                Err(error) => {
                    self.note(format!("time marching failed: {error}"))?;
                    return Ok(Marched::Neither);
                }
            };
            (self.seen)(Event::Step(&report, march))?;
            if let Some(oscillation) = watch.see(self.model, &march.state, march.t) {
                return Ok(Marched::Oscillating(oscillation));
            }
            if report.step.is_multiple_of(LOOK)
                && let Some(trial) = self.polish(march)?
            {
                return Ok(Marched::Steady(trial));
            }
        }
        Ok(Marched::Neither)
    }

    /// The steady state near the march's, by Newton's method, where the residual is small enough for that.
    fn polish(&mut self, march: &mut March) -> Result<Option<Trial>, Stall> {
        let residual = march.residuals().map_err(StepFailure::from)?.total();
        if residual.is_nan() || residual >= NEARLY_STEADY.max(self.settings.residual) {
            return Ok(None);
        }
        let mut near = march.state.carried();
        let settings = Pseudo {
            residual: self.settings.residual,
            step: 1e3,
            most: f64::INFINITY,
            release: 0.0,
            growth: 1.5,
            max_steps: 30,
        };
        let mut work = Work { kept: &mut self.kept, phases: &mut *self.phases, interrupt: self.interrupt };
        match relax(self.model, &mut near, &settings, &mut work, &mut |_, _| {}) {
            Ok(trial) => Ok(Some(trial)),
            Err(stall @ (Stall::Interrupted | Stall::Failed(_))) => Err(stall),
            Err(Stall::Steps { .. } | Stall::Step { .. }) => Ok(None),
        }
    }
}

/// Settings with steps that resolve the period of a mode that turns.
fn resolving(mut settings: MarchSettings, mode: Option<&Mode>) -> MarchSettings {
    if let Some(omega) = mode.map(|m| m.value.im.abs()).filter(|omega| *omega > 0.0) {
        let step = std::f64::consts::TAU / omega / STEPS_PER_PERIOD;
        settings.control.step = settings.control.step.min(step);
        let step_min = settings.control.step_min.value().min(1e-6 * step);
        settings.control.step_min = SmallestStep::Given(step_min);
    }
    settings
}
