//! The incompressible sheet and the values of its polarity on the faces.

use std::sync::Arc;

use super::{Incompressible, State};
use crate::form::upwind::Carrier;
use crate::model::condensed::Frame;
use crate::model::fields::{POLARITY, VELOCITY};
use crate::model::terms::At;
use crate::space::{Field, Traces};

/// Most passes between flow and traces until they agree.
pub const PASSES: usize = 30;

/// The end of a sequence of flows, each from the traces of the last one: they converge like a geometric series, whose
/// rest follows from two steps.
#[derive(Debug)]
pub struct Settling {
    last: f64,
}

impl Settling {
    /// Before the first step.
    pub fn new() -> Self {
        Self { last: f64::INFINITY }
    }

    /// Whether what is left after a step from `before` to `now` is rounding.
    pub fn is_over(&mut self, before: &[f64], now: &[f64]) -> bool {
        let size = |x: &[f64]| x.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        let step = before.iter().zip(now).fold(0.0_f64, |step, (a, b)| step.max((a - b).abs()));
        let ratio = step / self.last;
        let known = self.last.is_finite() && ratio < 0.5;
        self.last = step;
        let left = if known { step * ratio / (1.0 - ratio) } else { step };
        // small steps are rounding, which does not fall any more
        step <= 1e-12 * size(now) || left <= 1e-14 * size(now)
    }
}

impl Default for Settling {
    fn default() -> Self {
        Self::new()
    }
}

impl Incompressible {
    /// The values of the polarity on the faces in a flow, where it is in hybrid form.
    pub fn traces(&self, p: &Field, flow: &Field, t: f64) -> Option<Traces> {
        self.polarity.hybrid().map(|hybrid| {
            let given = self.given(t);
            let at = At::new(&self.parameters, p, &given).with_flow(&self.momentum.velocity, Carrier::from(flow));
            hybrid.traces(self.tissue(), &at)
        })
    }

    /// `(1/B)(L_h|q)` as a functional; in hybrid form it depends on the flow by the values on the faces   [7.10]
    pub fn molecular_functional(&self, p: &Field, flow: &Field, t: f64) -> Vec<f64> {
        self.polarity.molecular_functional(self.tissue(), p, self.traces(p, flow, t).as_ref(), t)
    }

    /// `Δ_h p` at a state   [7.2]
    pub fn laplacian(&self, state: &State, t: f64) -> Field {
        let (v, p) = (&state[VELOCITY], &state[POLARITY]);
        self.polarity.laplacian(self.tissue(), p, self.traces(p, v, t).as_ref(), t)
    }

    /// `L_h/B` of a functional.
    pub fn projected(&self, functional: &[f64]) -> Field {
        Field::new(&self.polarity.space, self.polarity.project(functional))
    }

    /// `L_h/B` where the model has elasticity; in hybrid form it depends on the flow by the values on the faces.
    pub fn molecular(&self, p: &Field, flow: &Field, t: f64) -> Option<Field> {
        (self.parameters.elasticity != 0.0).then(|| self.projected(&self.molecular_functional(p, flow, t)))
    }

    /// What the elements of a model in hybrid form have in all states.
    ///
    /// # Panics
    /// A model that is not in hybrid form.
    pub fn frame(&self) -> &Arc<Frame> {
        let hybrid = || self.polarity.hybrid().expect("a model in hybrid form");
        self.frame.get_or_init(|| Arc::new(Frame::new(self, hybrid())))
    }
}
