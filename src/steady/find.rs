//! The search for a steady state: ways that are tried in a stated order, and the way from an unstable state to a stable
//! one.

use std::sync::atomic::AtomicBool;

use super::oscillation::{Oscillation, Watch};
use super::pseudo::{Pseudo, PseudoStep, Stall, Work, relax};
use super::spectrum::{Ask, Mode, Spectrum, spectrum};
use crate::model::parameters::Parameters;
use crate::model::{Residuals, State};
use crate::scheme::pace::Smallest;
use crate::time::equations::Trial;
use crate::time::memory::Memory;
use crate::time::{CouplingKind, March, MarchError, MarchSettings, Phases, Sheet, StepReport};

/// Which steady state is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Want {
    /// One that small disturbances do not destroy: an unstable one is left along the mode that grows.
    #[default]
    Stable,
    /// The first that is found.
    Any,
}

/// How a steady state is searched for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadySettings {
    /// Bound on the total residual of the stationary equations [9.8–9.10].
    pub residual: f64,
    /// First pseudo-step, in units of time.
    pub step: f64,
    /// Most pseudo-steps of each try.
    pub max_steps: usize,
    pub want: Want,
    /// Leading eigenvalues to find; with 0 nothing is said about stability.
    pub eigenvalues: usize,
    /// Time that the last resort, plain time marching, may cover; 0 does without it.
    pub march: f64,
}

/// The ways to a steady state, in the order in which they are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// Pseudo-transient continuation from the scene's start.
    PseudoTransient,
    /// The same with pseudo-steps a tenth as long, and bounded until the residual has fallen.
    SmallerSteps,
    /// Steady states of easier parameters, followed to the scene's.
    Parameters,
    /// Time marching.
    Marching,
    /// From an unstable steady state along the mode that grows fastest.
    Departure,
}

/// One try and what came of it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Try {
    pub way: Way,
    /// Pseudo-steps or time steps.
    pub steps: usize,
    pub outcome: String,
}

/// A steady state.
#[derive(Debug, Clone)]
pub struct Steady {
    pub state: State,
    pub residuals: Residuals,
    /// Empty when nobody asked.
    pub spectrum: Option<Spectrum>,
}

/// What a search found.
#[derive(Debug, Clone)]
pub enum Found {
    Steady(Box<Steady>),
    /// The flow repeats itself; `about` is the unstable steady state in its midst, if one was found.
    Oscillating {
        oscillation: Oscillation,
        about: Option<Box<Steady>>,
    },
    Nothing,
    Interrupted,
}

/// A search at its end.
#[derive(Debug, Clone)]
pub struct Search {
    pub found: Found,
    pub tries: Vec<Try>,
    /// The carried vector that was reached, whatever was found.
    pub last: Vec<f64>,
}

/// What a caller hears while a search goes on.
#[derive(Debug)]
pub enum Event<'e, 'm> {
    Note(String),
    Pseudo(&'e PseudoStep, &'e Trial),
    Step(&'e StepReport, &'e mut March<'m>),
}

/// Most unstable states that are left before the last one is taken.
const DEPARTURES: usize = 4;

/// Largest nodal disturbance with which an unstable state is left.
const DISTURBANCE: f64 = 0.5;

/// Residual at which time marching hands over to Newton's method.
const NEARLY_STEADY: f64 = 1e-6;

/// Steps of a march between two looks at the residual.
const LOOK: usize = 5;

/// Steps that resolve the period of a growing mode.
const STEPS_PER_PERIOD: f64 = 40.0;

/// A search at work.
struct Finder<'f, 'm> {
    model: &'m dyn Sheet,
    settings: &'f SteadySettings,
    march: MarchSettings,
    memory: Memory,
    phases: &'f mut Phases,
    interrupt: &'m AtomicBool,
    seen: &'f mut dyn FnMut(Event<'_, 'm>) -> Result<(), Stall>,
    tries: Vec<Try>,
}

/// Searches from the carried vector `start`; `march` is how time marching would be done.
///
/// # Errors
/// What no other way can cure: the momentum balance or a formula fails, or `seen` does.
pub fn find<'m>(
    model: &'m dyn Sheet,
    start: Vec<f64>,
    settings: &SteadySettings,
    march: MarchSettings,
    interrupt: &'m AtomicBool,
    phases: &mut Phases,
    seen: &mut dyn FnMut(Event<'_, 'm>) -> Result<(), Stall>,
) -> Result<Search, Stall> {
    let coupling = crate::time::CouplingSettings { kind: CouplingKind::Newton, ..march.coupling };
    let march = MarchSettings { coupling, alternate: 1.0, ..march };
    let (memory, tries) = (Memory::default(), Vec::new());
    let mut finder = Finder { model, settings, march, memory, phases, interrupt, seen, tries };
    let mut last = start;
    let found = match finder.search(&mut last) {
        Err(Stall::Interrupted) => Found::Interrupted,
        other => other?,
    };
    Ok(Search { found, tries: finder.tries, last })
}

/// Where a march led.
enum Marched {
    Steady(Trial),
    Oscillating(Oscillation),
    Neither,
}

impl Finder<'_, '_> {
    fn search(&mut self, p: &mut Vec<f64>) -> Result<Found, Stall> {
        let trial = match self.by_pseudo_time(p)? {
            Some(trial) => trial,
            None => match self.by_marching(p, None)? {
                Marched::Steady(trial) => trial,
                Marched::Oscillating(oscillation) => return Ok(Found::Oscillating { oscillation, about: None }),
                Marched::Neither => return Ok(Found::Nothing),
            },
        };
        self.settle(trial, p)
    }

    /// The first three ways.
    fn by_pseudo_time(&mut self, p: &mut Vec<f64>) -> Result<Option<Trial>, Stall> {
        let (start, s) = (p.clone(), *self.settings);
        let free = Pseudo {
            residual: s.residual,
            step: s.step,
            most: f64::INFINITY,
            release: 0.0,
            growth: 1.5,
            max_steps: s.max_steps,
        };
        if let Some(trial) = self.relax(Way::PseudoTransient, p, &free)? {
            return Ok(Some(trial));
        }
        p.clone_from(&start);
        let slow = Pseudo { step: 0.1 * s.step, most: s.step, release: 0.02, growth: 3.0, ..free };
        if let Some(trial) = self.relax(Way::SmallerSteps, p, &slow)? {
            return Ok(Some(trial));
        }
        p.clone_from(&start);
        if let Some(trial) = self.by_parameters(p, &free)? {
            return Ok(Some(trial));
        }
        p.clone_from(&start);
        Ok(None)
    }

    /// Judges a steady state, and leaves it if it is unstable and a stable one is wanted.
    fn settle(&mut self, mut trial: Trial, p: &mut Vec<f64>) -> Result<Found, Stall> {
        for departure in 0.. {
            let leaves = self.settings.want == Want::Stable && departure < DEPARTURES;
            let steady = self.judge(trial.state, leaves)?;
            let growing = steady.spectrum.as_ref().and_then(|s| s.growing().next().cloned());
            let Some(mode) = growing.filter(|_| leaves) else { return Ok(Found::Steady(Box::new(steady))) };
            let (rate, omega) = (mode.value.re, mode.value.im);
            self.note(format!(
                "on the way, a steady state that is unstable: a disturbance grows at the rate {rate:.4}{}; leaving it along that mode",
                if omega == 0.0 { String::new() } else { format!(", turning with the angular frequency {omega:.4}") },
            ))?;
            *p = self.disturbed(&steady.state, &mode);
            let next = if omega == 0.0 { self.depart(p, rate, &steady)? } else { None };
            trial = match next {
                Some(trial) => trial,
                None => match self.by_marching(p, Some(&mode))? {
                    Marched::Steady(next) => next,
                    Marched::Oscillating(oscillation) => {
                        return Ok(Found::Oscillating { oscillation, about: Some(Box::new(steady)) });
                    }
                    // the unstable state is not what was asked for, but it is what is known
                    Marched::Neither => {
                        self.note("nothing stable was found from there".into())?;
                        return Ok(Found::Steady(Box::new(steady)));
                    }
                },
            };
        }
        unreachable!("the last departure returns")
    }

    /// The next steady state after a disturbance that grows at the rate given.
    fn depart(&mut self, p: &mut Vec<f64>, rate: f64, from: &Steady) -> Result<Option<Trial>, Stall> {
        let s = *self.settings;
        // implicit Euler amplifies a growing mode only at steps below 2/λ
        let bounded = Pseudo {
            residual: s.residual,
            step: 0.5 / rate,
            most: 0.5 / rate,
            release: 0.1,
            growth: 4.0,
            max_steps: s.max_steps,
        };
        let begin = p.clone();
        let found = self.relax(Way::Departure, p, &bounded)?;
        let from = self.model.carried(&from.state);
        let moved = |trial: &Trial| distance(self.model, &self.model.carried(&trial.state), &from);
        match found {
            Some(trial) if moved(&trial) > 1e-3 * distance(self.model, &begin, &from) => Ok(Some(trial)),
            Some(_) | None => {
                *p = begin;
                Ok(None)
            }
        }
    }

    /// The residuals and eigenvalues of a state that is to be left when it is unstable, or not.
    fn judge(&mut self, state: State, leaves: bool) -> Result<Steady, Stall> {
        let model = self.model;
        let residuals = model.residuals(&state, 0.0).map_err(crate::time::StepFailure::from)?;
        let ask = Ask { wanted: self.settings.eigenvalues, growing_suffices: leaves, fast: true };
        let mut work = Work { memory: &mut self.memory, phases: &mut *self.phases, interrupt: self.interrupt };
        let found = (ask.wanted > 0).then(|| spectrum(model, &state, ask, &mut work)).transpose()?;
        Ok(Steady { state, residuals, spectrum: found })
    }

    /// Pseudo-transient continuation; `None` where another way may do better.
    fn relax(&mut self, way: Way, p: &mut Vec<f64>, settings: &Pseudo) -> Result<Option<Trial>, Stall> {
        let (mut steps, mut failed) = (0, None);
        let seen = &mut self.seen;
        let mut work = Work { memory: &mut self.memory, phases: &mut *self.phases, interrupt: self.interrupt };
        let outcome = relax(self.model, p, settings, &mut work, &mut |step, trial| {
            steps += 1;
            if failed.is_none() {
                failed = seen(Event::Pseudo(step, trial)).err();
            }
        });
        if let Some(error) = failed {
            return Err(error);
        }
        self.conclude(way, steps, outcome)
    }

    fn conclude(&mut self, way: Way, steps: usize, outcome: Result<Trial, Stall>) -> Result<Option<Trial>, Stall> {
        match outcome {
            Ok(trial) => {
                let residual = trial.size / self.model.area().sqrt();
                self.tries.push(Try { way, steps, outcome: format!("steady, residual {residual:.1e}") });
                Ok(Some(trial))
            }
            Err(stall @ (Stall::Steps { .. } | Stall::Step { .. })) => {
                self.note(format!("{} found no steady state: {stall}", way.name()))?;
                self.tries.push(Try { way, steps, outcome: stall.to_string() });
                Ok(None)
            }
            Err(other) => Err(other),
        }
    }

    /// Follows steady states from easier parameters to the scene's.
    fn by_parameters(&mut self, p: &mut Vec<f64>, settings: &Pseudo) -> Result<Option<Trial>, Stall> {
        let target = *self.model.parameters();
        let easy = easier(&target);
        let (mut reached, mut step, mut steps) = (0.0_f64, 0.25_f64, 0);
        let mut at = 0.0;
        let outcome = loop {
            let parameters = between(&easy, &target, at);
            let here = self
                .model
                .changed(&parameters, self.model.conditions(), self.model.sources())
                .map_err(crate::time::StepFailure::from)?;
            let bound = if at == 1.0 { settings.residual } else { settings.residual.max(1e-6) };
            let mut guess = p.clone();
            let mut work = Work { memory: &mut self.memory, phases: &mut *self.phases, interrupt: self.interrupt };
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

    /// Marches in time until the state is steady or repeats itself; `mode` is one whose period has to be resolved.
    fn by_marching(&mut self, p: &mut Vec<f64>, mode: Option<&Mode>) -> Result<Marched, Stall> {
        self.memory = Memory::default();
        let mut settings = self.march;
        if let Some(omega) = mode.map(|m| m.value.im.abs()).filter(|omega| *omega > 0.0) {
            let step = std::f64::consts::TAU / omega / STEPS_PER_PERIOD;
            settings.control.step = settings.control.step.min(step);
            let step_min = settings.control.step_min.value().min(1e-6 * step);
            settings.control.step_min = Smallest::Given(step_min);
        }
        let end = self.settings.march;
        if end <= 0.0 {
            return Ok(Marched::Neither);
        }
        self.note(format!("marching in time, Δt = {}, at most to t = {end}", settings.control.step))?;
        let mut march = March::start(self.model, settings, p.clone())?;
        march.interrupt = self.interrupt;
        let mut watch = Watch::default();
        let outcome = loop {
            if march.t >= end * (1.0 - 1e-12) {
                break Ok(Marched::Neither);
            }
            let report = match march.advance(end) {
                Ok(report) => report,
                Err(MarchError::Interrupted { .. }) => break Err(Stall::Interrupted),
                Err(error) => {
                    self.note(format!("time marching failed: {error}"))?;
                    break Ok(Marched::Neither);
                }
            };
            (self.seen)(Event::Step(&report, &mut march))?;
            if let Some(oscillation) = watch.see(self.model, &march.state, march.t) {
                break Ok(Marched::Oscillating(oscillation));
            }
            if report.step.is_multiple_of(LOOK) {
                let residual = march.residuals().map_err(crate::time::StepFailure::from)?.total();
                if residual < NEARLY_STEADY.max(self.settings.residual) {
                    let mut near = self.model.carried(&march.state);
                    let polish = Pseudo {
                        residual: self.settings.residual,
                        step: 1e3,
                        most: f64::INFINITY,
                        release: 0.0,
                        growth: 1.5,
                        max_steps: 30,
                    };
                    let mut work =
                        Work { memory: &mut self.memory, phases: &mut *self.phases, interrupt: self.interrupt };
                    match relax(self.model, &mut near, &polish, &mut work, &mut |_, _| {}) {
                        Ok(trial) => break Ok(Marched::Steady(trial)),
                        Err(stall @ (Stall::Interrupted | Stall::Failed(_))) => break Err(stall),
                        Err(Stall::Steps { .. } | Stall::Step { .. }) => {}
                    }
                }
            }
        };
        *p = self.model.carried(&march.state);
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

    /// A state with a visible share of a mode; as much of it as the density allows.
    fn disturbed(&self, state: &State, mode: &Mode) -> Vec<f64> {
        let largest = mode.vector[0].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let mut share = DISTURBANCE / largest;
        loop {
            let mut y = self.model.carried(state);
            crate::solve::axpy(share, &mode.vector[0], &mut y);
            match self.model.with_carried(state, &y) {
                Some(disturbed) => return self.model.carried(&disturbed),
                None => share *= 0.5,
            }
        }
    }

    fn note(&mut self, text: String) -> Result<(), Stall> {
        (self.seen)(Event::Note(text))
    }
}

impl Way {
    /// What messages call it.
    pub fn name(self) -> &'static str {
        match self {
            Way::PseudoTransient => "pseudo-transient continuation",
            Way::SmallerSteps => "pseudo-transient continuation with smaller steps",
            Way::Parameters => "continuation from easier parameters",
            Way::Marching => "time marching",
            Way::Departure => "the departure from the unstable state",
        }
    }
}

/// `‖a − b‖`
fn distance(model: &dyn Sheet, a: &[f64], b: &[f64]) -> f64 {
    let d: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    crate::solve::root(crate::solve::dot(&d, &model.mass_times(&d)))
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
