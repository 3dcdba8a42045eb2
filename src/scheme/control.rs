//! The thesis' step control [9.1.2, Algorithm 1].

use serde::{Deserialize, Serialize};

use super::adaptive::SmallestStep;

/// Bounds of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlSettings {
    /// `Δt_0`: first and largest step.
    pub step: f64,
    /// `Δt_min`: the run ends when a step would have to be smaller.
    pub step_min: SmallestStep,
    /// Factor by which Δt grows (thesis: 1.25).
    pub growth: f64,
    /// Δt grows after `⌈growth_wait Δt_0/Δt⌉` good steps in a row (thesis: 50).
    pub growth_wait: f64,
    /// A step is good when its rate η is above this (thesis: 0.55).
    pub growth_rate: f64,
}

impl ControlSettings {
    /// The thesis' numbers, and a Δt_min of a millionth of `Δt_0 = step`.
    pub fn new(step: f64) -> Self {
        Self { step, step_min: SmallestStep::of(step), growth: 1.25, growth_wait: 50.0, growth_rate: 0.55 }
    }

    /// The same down to another Δt_min.
    #[must_use]
    pub fn down_to(self, step_min: f64) -> Self {
        Self { step_min: SmallestStep::Given(step_min), ..self }
    }
}

/// The current step and the row of good steps behind it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Control {
    /// `Δt`
    pub step: f64,
    /// Good steps in a row since the last change.
    pub streak: usize,
}

impl Control {
    /// Starts with `Δt_0`.
    pub fn new(settings: &ControlSettings) -> Self {
        Self { step: settings.step, streak: 0 }
    }

    /// Halves Δt after a failure, down to Δt_min.
    pub fn halve(&mut self, settings: &ControlSettings) {
        self.step = (0.5 * self.step).max(settings.step_min.value());
        self.streak = 0;
    }

    /// The same with a step inside of other bounds, for a run that is resumed with them.
    pub fn within(self, settings: &ControlSettings) -> Self {
        Self { step: self.step.clamp(settings.step_min.value(), settings.step), ..self }
    }

    /// Books an accepted step with rate η: after enough good ones in a row Δt grows, up to Δt_0.
    pub fn accept(&mut self, settings: &ControlSettings, rate: f64) {
        self.streak = if rate > settings.growth_rate { self.streak + 1 } else { 0 };
        let needed = (settings.growth_wait * settings.step / self.step).ceil();
        if self.step < settings.step && self.streak as f64 >= needed {
            self.step = (settings.growth * self.step).min(settings.step);
            self.streak = 0;
        }
    }
}
