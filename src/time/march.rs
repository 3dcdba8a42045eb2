//! Marching in time: history and rejected steps.

mod failure;
mod restart;

use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::Phases;
use super::coupling::{CouplingSettings, DensityStep, Step, StepFailure, StepOutcome, solve_step};
use super::kept_factors::{KeptFactors, Origin};
use super::sheet::Sheet;
use crate::expression::ExpressionError;
use crate::model::fields::{DENSITY, POLARITY};
use crate::model::momentum::MomentumError;
use crate::model::{Residuals, State};
use crate::scheme::control::{Control, ControlSettings};
use crate::scheme::schedule::{plain, trim};
use crate::scheme::{abdf, bdf};
pub use failure::MarchError;
use failure::hint;
pub use restart::{Checkpoint, Parked};

/// How time is discretised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarchSettings {
    /// Order b of the BDF, 1 to 6; the start uses `b_n = min(n, b)`.
    pub order: usize,
    /// How long steps are.
    pub control: ControlSettings,
    /// Ratio in which successive steps alternate about the step control's Δt; 1 for equal steps.
    pub alternate: f64,
    /// How a step is solved.
    pub coupling: CouplingSettings,
    /// Whether a density is marched by the implicit BDF alone, never by A-BDF(θ*).
    pub density_implicit: bool,
}

impl MarchSettings {
    /// The BDF of an order with the largest step `Δt_0 = step`; all else as in a scene that does not speak of it.
    pub fn new(order: usize, step: f64) -> Self {
        Self {
            order,
            control: ControlSettings::new(step),
            alternate: 1.0,
            coupling: CouplingSettings::default(),
            density_implicit: false,
        }
    }

    /// Δt of step `index` (from 0) where the step control has `step`.
    pub fn length(&self, step: f64, index: usize) -> f64 {
        let r = self.alternate;
        step * if index.is_multiple_of(2) { 2.0 / (1.0 + r) } else { 2.0 * r / (1.0 + r) }
    }
}

/// What one accepted step was.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// Number of the step, from 1.
    pub step: usize,
    /// Time reached.
    pub t: f64,
    /// Δt
    pub dt: f64,
    /// Of the BDF in this step.
    pub order: usize,
    /// k
    pub iterations: usize,
    /// `e_k`, the last increment.
    pub increment: f64,
    /// `η_k = −log10(e_k/e_1)`
    pub rate: f64,
    /// Whether the tolerance was reached; else the step was accepted at k_max.
    pub converged: bool,
    /// Halvings before this step was accepted.
    pub rejected: usize,
}

/// Totals over a run, resumed parts included.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Accepted steps.
    pub steps: usize,
    /// Steps that were tried in vain.
    pub rejected: usize,
    /// Of accepted steps.
    pub nonlinear_iterations: usize,
    /// Of the linear solves of the polarity.
    pub polarity_linear_iterations: usize,
    /// Steps that were accepted at k_max without reaching the tolerance.
    pub accepted_late: usize,
    /// Steps whose density had to be taken by the implicit BDF, because A-BDF(θ) would not have been stable.
    pub density_implicit: usize,
    /// Cells whose density was limited, over all steps.
    pub limited: usize,
}

/// What a step begins with: counts, step control, and where Newton's factors come from.
pub(super) type Entry = (Counts, Control, Option<Origin>);

/// What interrupts a march that nobody interrupts.
static NEVER: AtomicBool = AtomicBool::new(false);

/// A march in progress.
#[derive(Debug)]
pub struct March<'m> {
    /// What is marched.
    pub model: &'m dyn Sheet,
    /// How.
    pub settings: MarchSettings,
    /// Time of the state.
    pub t: f64,
    /// Its fields.
    pub state: State,
    /// Totals so far.
    pub counts: Counts,
    /// Where time was spent.
    pub phases: Phases,
    /// Steps in a row with `|dF/dt|` below its bound.
    pub quiet: usize,
    /// Set from outside to give up the step at work.
    pub interrupt: &'m AtomicBool,
    control: Control,
    past: Vec<(f64, Vec<f64>)>,
    rate_of_p: Vec<f64>,
    /// Mass at the start and gained since, at the times of `past`.
    gained: Vec<f64>,
    /// Net mass that enters per time.
    gain: f64,
    /// Cells whose density was limited in the last step.
    limited: usize,
    kept: KeptFactors,
}

impl<'m> March<'m> {
    /// Starts at `t = 0` from the carried vector `y`; the flow follows from it.
    ///
    /// # Errors
    /// A flow that cannot be solved for; a density that is negative; a formula that is not finite.
    pub fn start(model: &'m dyn Sheet, settings: MarchSettings, y: Vec<f64>) -> Result<Self, StepFailure> {
        Self::start_after(model, settings, vec![(0.0, y)])
    }

    /// Starts after known levels `(t_i, y_i)`, newest first: all but the oldest count as steps.
    ///
    /// # Errors
    /// A flow that cannot be solved for; a density that is negative; a formula that is not finite.
    ///
    /// # Panics
    /// Without a level.
    pub fn start_after(
        model: &'m dyn Sheet,
        settings: MarchSettings,
        mut past: Vec<(f64, Vec<f64>)>,
    ) -> Result<Self, StepFailure> {
        let (t, y) = past.first().cloned().expect("at least one level");
        let state = model.state_of(&y, t)?;
        // the density may have been limited
        past[0].1 = state.carried();
        let gain = model.gain(&state, &model.inputs(t)?);
        let size = state[POLARITY].values.len();
        let mut rate_of_p = vec![0.0; size];
        if past.len() > 1 {
            let times: Vec<f64> = past.iter().map(|(t, _)| *t).collect();
            for (weight, (_, y)) in bdf::derivative_weights(&times).into_iter().zip(&past) {
                crate::solve::axpy(weight, &y[y.len() - size..], &mut rate_of_p);
            }
        }
        Ok(Self {
            model,
            settings,
            t,
            state,
            counts: Counts { steps: past.len() - 1, ..Counts::default() },
            phases: Phases::default(),
            quiet: 0,
            interrupt: &NEVER,
            control: Control::new(&settings.control),
            gained: past.iter().map(|(_, y)| model.mass(y)).collect(),
            gain,
            limited: 0,
            past,
            rate_of_p,
            kept: KeptFactors::default(),
        })
    }

    /// Stands at a state that was found in another way, at rest, after so many steps.
    pub fn adopt(&mut self, state: State, steps: usize) {
        self.counts.steps = steps;
        self.rate_of_p.fill(0.0);
        self.past = vec![(self.t, state.carried())];
        self.gained = vec![self.model.mass(&self.past[0].1)];
        // a formula that is not finite stops the next step
        self.gain = self.model.inputs(self.t).map_or(0.0, |inputs| self.model.gain(&state, &inputs));
        self.limited = 0;
        self.state = state;
    }

    /// Δt as the step control has it, before it is trimmed to land on an output.
    pub fn nominal_step(&self) -> f64 {
        self.control.step
    }

    /// Takes one step, trimmed to land on `landing`, halving Δt until the coupling converges.
    ///
    /// # Errors
    /// Δt below its minimum, or a failure that no smaller step can cure; the state is then the last good one.
    pub fn advance(&mut self, landing: f64) -> Result<StepReport, MarchError> {
        let step = self.counts.steps + 1;
        let (mut rejected, mut cap) = (0, f64::INFINITY);
        let entry = self.entry();
        loop {
            let (t, dt) = self.aim(cap, landing);
            match self.attempt(t, dt, rejected) {
                Ok(report) => return Ok(report),
                Err(cause) => cap = self.after_failure(cause, (step, dt), &mut rejected, &entry)?,
            }
        }
    }

    /// What an interrupted step goes back to.
    pub(super) fn entry(&self) -> Entry {
        (self.counts, self.control.clone(), self.kept.origin().cloned())
    }

    /// Where the next step leads, and its Δt, of at most `cap` and trimmed to land on `landing`.
    pub(super) fn aim(&self, cap: f64, landing: f64) -> (f64, f64) {
        let step = self.counts.steps + 1;
        let dt = trim(self.t, self.settings.length(self.control.step, step - 1).min(cap), landing);
        let lands = self.t + dt >= landing - 1e-9 * dt;
        (if lands { landing } else { plain(self.t + dt, 0.0) }, dt)
    }

    /// One try of a step to `t`.
    pub(super) fn attempt(&mut self, t: f64, dt: f64, rejected: usize) -> Result<StepReport, StepFailure> {
        let stiffness = self.model.stiffness(&self.state);
        let order = self.order_for(dt);
        let known: Vec<(f64, &[f64])> =
            self.past.iter().take(self.usable(dt).min(order + 1)).map(|(t, y)| (*t, &y[..])).collect();
        let density = self.density_step(t, stiffness * dt)?;
        let attempt = Step {
            model: self.model,
            t,
            past: &known[..order],
            known: &known,
            density: density.as_ref(),
            guess: &self.state,
            settings: &self.settings.coupling,
            interrupt: self.interrupt,
        };
        let outcome = solve_step(&attempt, &mut self.kept, &mut self.phases)?;
        Ok(self.accept(outcome, t, order, rejected, density.as_ref()))
    }

    /// The bound on Δt of the next try.
    ///
    /// # Errors
    /// Where there can be none.
    pub(super) fn after_failure(
        &mut self,
        cause: StepFailure,
        (step, dt): (usize, f64),
        rejected: &mut usize,
        entry: &Entry,
    ) -> Result<f64, MarchError> {
        if matches!(cause, StepFailure::Interrupted) {
            // a resumed run begins this step anew, with what it began with
            (self.counts, self.control) = (entry.0, entry.1.clone());
            self.kept.rewind(entry.2.clone());
            return Err(MarchError::Interrupted { step, t: self.t });
        }
        if !cause.may_be_cured_by_a_smaller_step() {
            return Err(MarchError::Failed { step, t: self.t, cause: Box::new(cause) });
        }
        *rejected += 1;
        self.counts.rejected += 1;
        let cap = 0.5 * dt;
        if cap < self.settings.control.step_min.value() {
            let step_min = self.settings.control.step_min;
            let hint = hint(&cause, self.settings.coupling.kind);
            let cause = Box::new(cause);
            return Err(MarchError::StepTooSmall { step, t: self.t, step_min, cause, hint });
        }
        // a step that was trimmed to a sliver says nothing about the steps to come
        if dt > 0.5 * self.control.step {
            self.control.halve(&self.settings.control);
        }
        Ok(cap)
    }

    /// The highest order up to the scheme's that the past allows.
    fn order_for(&self, dt: f64) -> usize {
        self.settings.order.min(self.usable(dt))
    }

    /// Past levels, newest first, whose steps are not much shorter than `dt`: a difference over a sliver is mostly the
    /// tolerance of the coupling, and a formula that extrapolates it over a long step amplifies that.
    fn usable(&self, dt: f64) -> usize {
        const LONGEST_RATIO: f64 = 5.0;
        let steps = self.past.windows(2).map(|pair| pair[0].0 - pair[1].0);
        1 + steps.take_while(|&earlier| dt <= LONGEST_RATIO * earlier).count()
    }

    /// The formula of the density for a step to `t`, where there is one; `z` is a bound on `−λΔt`.
    fn density_step(&self, t: f64, z: f64) -> Result<Option<DensityStep>, ExpressionError> {
        if self.state.get(DENSITY).is_none() {
            return Ok(None);
        }
        let order = self.order_for(t - self.t).min(abdf::MAX_ORDER);
        let times: Vec<f64> = std::iter::once(t).chain(self.past.iter().map(|(t, _)| *t)).take(order + 1).collect();
        let formula = abdf::Formula::choose(&times, order, z, self.settings.density_implicit);
        let rate = match formula.beta[1] {
            0.0 => Vec::new(),
            _ => self.model.density_rate(&self.state, self.t)?,
        };
        Ok(Some(DensityStep { formula, rate }))
    }

    /// Mass gained at the new time by the formula of the density, and that now: what the density's total has to agree
    /// with.
    fn gained_after(&self, density: Option<&DensityStep>, dt: f64, gain: f64) -> f64 {
        density.map_or(0.0, |step| {
            let past: f64 = step.formula.alpha.iter().zip(&self.gained).map(|(alpha, gained)| alpha * gained).sum();
            past + dt * (step.formula.beta[0] * gain + step.formula.beta[1] * self.gain)
        })
    }

    fn accept(
        &mut self,
        outcome: StepOutcome,
        t: f64,
        order: usize,
        rejected: usize,
        density: Option<&DensityStep>,
    ) -> StepReport {
        let implicit = density.is_some_and(|step| step.formula.theta == 0.0);
        let gained = self.gained_after(density, t - self.t, outcome.settled.gain);
        self.gained.insert(0, gained);
        self.gain = outcome.settled.gain;
        self.limited = outcome.settled.limited;
        self.counts.limited += self.limited;
        self.counts.density_implicit += usize::from(implicit && !self.settings.density_implicit);
        self.counts.steps += 1;
        self.counts.nonlinear_iterations += outcome.iterations;
        self.counts.polarity_linear_iterations += outcome.linear_iterations;
        self.counts.accepted_late += usize::from(!outcome.converged);
        let report = StepReport {
            step: self.counts.steps,
            t,
            dt: plain(t - self.t, t),
            order,
            iterations: outcome.iterations,
            increment: outcome.increment,
            rate: outcome.rate,
            converged: outcome.converged,
            rejected,
        };
        self.t = t;
        self.state = outcome.settled.state;
        self.rate_of_p = outcome.rate_of_p;
        self.past.insert(0, (t, self.state.carried()));
        // one level more than the formula needs, for predictions
        self.past.truncate(self.settings.order.min(bdf::MAX_ORDER) + 1);
        self.gained.truncate(self.past.len());
        // an iteration that begins next to its tolerance has no rate to show, and is as good as any
        let at_rest = outcome.first_increment < 10.0 * self.settings.coupling.tolerance;
        let rate = if at_rest { f64::INFINITY } else { outcome.rate };
        self.control.accept(&self.settings.control, rate);
        report
    }

    /// Residuals of the stationary equations at the current state.
    ///
    /// # Errors
    /// A formula that is not finite; a mass matrix that cannot be solved with.
    pub fn residuals(&mut self) -> Result<Residuals, MomentumError> {
        let (model, state, t) = (self.model, &self.state, self.t);
        self.phases.measure("residuals", || model.residuals(state, t))
    }

    /// The mass at the start and what came through the boundary and from sources since, as the time scheme counts it.
    pub fn mass_counted(&self) -> f64 {
        self.gained[0]
    }

    /// Cells whose density was limited in the last step.
    pub fn limited(&self) -> usize {
        self.limited
    }

    /// `∂_t p` at the current state by the time scheme.
    pub fn rate_of_p(&self) -> &[f64] {
        &self.rate_of_p
    }

    /// Free energy `F_h` and its rate, `(L_h|∂_t p)` and what a density adds.
    pub fn energy(&mut self) -> (f64, f64) {
        let (model, state, t) = (self.model, &self.state, self.t);
        let rate_of_p = &self.rate_of_p;
        self.phases.measure("energy", || {
            let rate = model.energy_rate(state, rate_of_p, t);
            (model.free_energy(state, t), rate)
        })
    }
}
