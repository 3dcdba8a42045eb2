//! Steps of moving bodies: as long as the scene's, and shorter while that is too long for their forces or for contact.

use serde::{Deserialize, Serialize};

use super::schedule::{plain, trim};

/// Bounds of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepBounds {
    /// First and largest step.
    pub step: f64,
    /// The step below which a run fails.
    pub step_min: SmallestStep,
}

/// The step below which a run fails; equal where the lengths are, whoever chose them.
#[derive(Debug, Clone, Copy)]
pub enum SmallestStep {
    /// `time.step_min`
    Given(f64),
    /// A millionth of `time.step`.
    Default(f64),
}

impl SmallestStep {
    /// A millionth of `time.step`, where nothing is said.
    pub fn of(step: f64) -> Self {
        Self::Default(1e-6 * step)
    }

    /// Its length.
    pub fn value(self) -> f64 {
        match self {
            Self::Given(step) | Self::Default(step) => step,
        }
    }
}

impl PartialEq for SmallestStep {
    fn eq(&self, other: &Self) -> bool {
        self.value() == other.value()
    }
}

impl std::fmt::Display for SmallestStep {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Given(step) => write!(f, "`time.step_min` = {step:.1e}"),
            Self::Default(step) => {
                write!(f, "{step:.1e}, a millionth of `time.step` (`time.step_min` sets another bound)")
            }
        }
    }
}

/// Why a step is not made.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// Forces change too much; they may do so again.
    Force(String),
    /// Bodies would pass through each other, which is over soon.
    Contact(String),
    /// No shorter step helps.
    Failure(String),
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Self::Force(reason) | Self::Contact(reason) | Self::Failure(reason)) = self;
        out.write_str(reason)
    }
}

/// The current step, and the row of easy steps behind it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AdaptiveStep {
    /// The step where it is shorter than the longest.
    short: Option<f64>,
    easy: usize,
    /// Easy steps after which the step is doubled.
    wait: usize,
    /// Easy steps after the next step that forces refuse.
    after_force: usize,
}

/// Easy steps before a longer one, twice as many after every refusal: a force that draws back must not see longer steps
/// at the same place of every swing, which would feed it.
const AFTER_FORCE: usize = 100;
const AFTER_CONTACT: usize = 4;

/// Load of the forces, relative to the largest, at which a step twice as long can be made: they grow with its third
/// power at most.
pub const EASY: f64 = 0.125;

/// What to do about forces that no step follows.
const HINT: &str =
    "look at how the force grows with the place, and take a milder one; `time.tolerance` tells how well it is followed";

/// A step that was made.
#[derive(Debug, Clone, PartialEq)]
pub struct AdaptedStep<T> {
    /// Time after the step.
    pub t: f64,
    /// Its length.
    pub dt: f64,
    /// Steps that were too long before it.
    pub rejected: usize,
    /// Why the first of them was, where the step was not short already.
    pub why: Option<String>,
    /// What the attempt has made.
    pub done: T,
}

impl Default for AdaptiveStep {
    /// Starts with the longest step.
    fn default() -> Self {
        Self { short: None, easy: 0, wait: AFTER_CONTACT, after_force: AFTER_FORCE }
    }
}

impl AdaptiveStep {
    /// Of the next step, where no output shortens it.
    pub fn length(&self, settings: &StepBounds) -> f64 {
        self.short.map_or(settings.step, |short| short.min(settings.step))
    }

    /// Makes one step from `t`, trimmed to land on `landing`, halved as long as `attempt` refuses; it tells whether the
    /// step was easy.
    ///
    /// # Errors
    /// The reason why there is none; the last good state is the caller's.
    pub fn advance<T>(
        &mut self,
        (t, landing): (f64, f64),
        settings: &StepBounds,
        mut attempt: impl FnMut(f64, f64) -> Result<(T, bool), Refusal>,
    ) -> Result<AdaptedStep<T>, String> {
        let (mut rejected, mut why) = (0, None);
        self.short = self.short.filter(|short| *short < settings.step);
        loop {
            let dt = trim(t, self.short.unwrap_or(settings.step), landing);
            let (reason, wait) = match attempt(t, dt) {
                Ok((done, easy)) => {
                    self.accept(easy, settings);
                    // so that no rounding piles up before an output
                    let t = if dt == landing - t { landing } else { plain(t + dt, 0.0) };
                    return Ok(AdaptedStep { t, dt, rejected, why, done });
                }
                Err(Refusal::Failure(reason)) => return Err(reason),
                Err(Refusal::Force(reason)) => {
                    let wait = self.after_force;
                    // a step that is halved several times in a row is refused once
                    if rejected == 0 {
                        self.after_force = self.after_force.saturating_mul(2);
                    }
                    (reason, wait)
                }
                Err(Refusal::Contact(reason)) => (reason, AFTER_CONTACT),
            };
            let half = 0.5 * dt;
            if half < settings.step_min.value() || t + half == t {
                let (reason, hint) = reason.split_once("; hint: ").unwrap_or((&reason, HINT));
                return Err(format!("Δt would fall below {} at t = {t}: {reason}; hint: {hint}", settings.step_min));
            }
            self.wait = if self.short.is_some() { self.wait.max(wait) } else { wait };
            why = why.or(self.short.is_none().then_some(reason));
            (self.short, self.easy) = (Some(half), 0);
            rejected += 1;
        }
    }

    fn accept(&mut self, easy: bool, settings: &StepBounds) {
        self.easy = if easy { self.easy + 1 } else { 0 };
        if self.easy >= self.wait {
            (self.short, self.easy) = (self.short.map(|short| 2.0 * short).filter(|step| *step < settings.step), 0);
        }
    }
}
