//! The search for a steady state: ways that are tried in a stated order, and the way from an unstable state to a stable
//! one.

mod marching;
mod parameters;

use std::sync::atomic::AtomicBool;

use super::oscillation::Oscillation;
use super::pseudo::{Pseudo, PseudoStep, Stall, Work, relax};
use super::spectrum::{Mode, Spectrum, SpectrumSettings, spectrum};
use crate::model::{Residuals, State};
use crate::time::equations::Trial;
use crate::time::kept_factors::KeptFactors;
use crate::time::{CouplingKind, CouplingSettings, March, MarchSettings, Phases, Sheet, StepFailure, StepReport};
use marching::Marched;

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
    /// Whether a state that is found must be stable.
    pub want: Want,
    /// Leading eigenvalues to find; with 0 nothing is said about stability.
    pub eigenvalues: usize,
    /// Time that the last resort, plain time marching, may cover; 0 does without it.
    pub march: f64,
}

/// How a steady state is searched for, and how time is stepped where nothing but marching leads there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchSettings {
    /// How it is searched for.
    pub steady: SteadySettings,
    /// How time is stepped.
    pub marching: MarchSettings,
}

impl Default for SteadySettings {
    /// A residual of 1e-9, six eigenvalues, and no marching as the last resort.
    fn default() -> Self {
        Self { residual: 1e-9, step: 1.0, max_steps: 300, want: Want::Stable, eigenvalues: 6, march: 0.0 }
    }
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
    /// Which way was tried.
    pub way: Way,
    /// Pseudo-steps or time steps.
    pub steps: usize,
    /// What came of it, in words.
    pub outcome: String,
}

/// A steady state.
#[derive(Debug, Clone)]
pub struct Steady {
    /// Its fields.
    pub state: State,
    /// What is left of the stationary equations.
    pub residuals: Residuals,
    /// Empty when nobody asked.
    pub spectrum: Option<Spectrum>,
}

/// What a search found.
#[derive(Debug, Clone)]
pub enum Found {
    /// A state at rest.
    Steady(Box<Steady>),
    /// The flow repeats itself; `about` is the unstable steady state in its midst, if one was found.
    Oscillating {
        /// Period and amplitude.
        oscillation: Oscillation,
        /// The unstable state in its midst.
        about: Option<Box<Steady>>,
    },
    /// No way led anywhere.
    Nothing,
    /// The caller wished it.
    Interrupted,
}

/// A search at its end.
#[derive(Debug, Clone)]
pub struct Search {
    /// What came of it.
    pub found: Found,
    /// What was tried, in order.
    pub tries: Vec<Try>,
    /// The carried vector that was reached, whatever was found.
    pub last: Vec<f64>,
}

/// What a caller hears while a search goes on.
#[derive(Debug)]
pub enum Event<'e, 'm> {
    /// A sentence.
    Note(String),
    /// A pseudo-step, with what it led to.
    Pseudo(&'e PseudoStep, &'e Trial),
    /// A time step, with the march that took it.
    Step(&'e StepReport, &'e mut March<'m>),
}

/// Most unstable states that are left before the last one is taken.
const DEPARTURES: usize = 4;

/// Largest nodal disturbance with which an unstable state is left.
const DISTURBANCE: f64 = 0.5;

/// A search at work.
struct Finder<'f, 'm> {
    model: &'m dyn Sheet,
    settings: &'f SteadySettings,
    march: MarchSettings,
    kept: KeptFactors,
    phases: &'f mut Phases,
    interrupt: &'m AtomicBool,
    seen: &'f mut dyn FnMut(Event<'_, 'm>) -> Result<(), Stall>,
    tries: Vec<Try>,
}

/// Searches from the carried vector `start`.
///
/// # Errors
/// What no other way can cure: the momentum balance or a formula fails, or `seen` does.
pub fn find<'m>(
    model: &'m dyn Sheet,
    start: Vec<f64>,
    settings: &SearchSettings,
    interrupt: &'m AtomicBool,
    phases: &mut Phases,
    seen: &mut dyn FnMut(Event<'_, 'm>) -> Result<(), Stall>,
) -> Result<Search, Stall> {
    let SearchSettings { steady: settings, marching } = settings;
    let coupling = CouplingSettings { kind: CouplingKind::Newton, ..marching.coupling };
    let march = MarchSettings { coupling, alternate: 1.0, ..*marching };
    let (kept, tries) = (KeptFactors::default(), Vec::new());
    let mut finder = Finder { model, settings, march, kept, phases, interrupt, seen, tries };
    let mut last = start;
    let found = match finder.search(&mut last) {
        Err(Stall::Interrupted) => Found::Interrupted,
        other => other?,
    };
    Ok(Search { found, tries: finder.tries, last })
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
                "on the way, a steady state that is unstable: a disturbance grows at the rate {rate:.4}{}; leaving it \
                 along that mode",
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
        let from = from.state.carried();
        let moved = |trial: &Trial| distance(self.model, &trial.state.carried(), &from);
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
        let residuals = model.residuals(&state, 0.0).map_err(StepFailure::from)?;
        let ask = SpectrumSettings { wanted: self.settings.eigenvalues, growing_suffices: leaves, fast: true };
        let mut work = Work { kept: &mut self.kept, phases: &mut *self.phases, interrupt: self.interrupt };
        let found = (ask.wanted > 0).then(|| spectrum(model, &state, ask, &mut work)).transpose()?;
        Ok(Steady { state, residuals, spectrum: found })
    }

    /// Pseudo-transient continuation; `None` where another way may do better.
    fn relax(&mut self, way: Way, p: &mut Vec<f64>, settings: &Pseudo) -> Result<Option<Trial>, Stall> {
        let (mut steps, mut failed) = (0, None);
        let seen = &mut self.seen;
        let mut work = Work { kept: &mut self.kept, phases: &mut *self.phases, interrupt: self.interrupt };
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

    /// A state with a visible share of a mode; as much of it as the density allows.
    fn disturbed(&self, state: &State, mode: &Mode) -> Vec<f64> {
        let largest = mode.vector[0].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let mut share = DISTURBANCE / largest;
        loop {
            let mut y = state.carried();
            crate::solve::axpy(share, &mode.vector[0], &mut y);
            match self.model.with_carried(state, &y) {
                Some(disturbed) => return disturbed.carried(),
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
