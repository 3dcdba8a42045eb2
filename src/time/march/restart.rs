//! A march put down and taken up again: from a checkpoint, or with another model of the same unknowns.

use serde::{Deserialize, Serialize};

use super::{Counts, March, MarchSettings, NEVER};
use crate::model::State;
use crate::model::fields::{FieldId, POLARITY, Role, VELOCITY};
use crate::scheme::control::Control;
use crate::time::kept_factors::{KeptFactors, Origin};
use crate::time::{CouplingKind, Phases, Sheet};

/// All that a restart needs, to continue bit for bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Time of the state.
    pub t: f64,
    /// Totals up to here.
    pub counts: Counts,
    /// The step control.
    pub control: Control,
    /// Times and carried vectors, newest first; the newest is the current state.
    pub past: Vec<(f64, Vec<f64>)>,
    /// Coefficients of the fields that are not carried.
    pub flow: Vec<(FieldId, Vec<f64>)>,
    /// `∂_t p`
    pub rate_of_p: Vec<f64>,
    /// Mass at the start and gained since at the times of `past`, and what is gained per time now.
    pub gained: Vec<f64>,
    /// Net mass that enters per time.
    pub gain: f64,
    /// Cells whose density was limited in the last step.
    pub limited: usize,
    /// Steps in a row with `|dF/dt|` below its bound.
    pub quiet: usize,
    /// Where the factors of Newton's method come from.
    pub origin: Option<Origin>,
}

/// A march without its model.
#[derive(Debug)]
pub struct Parked {
    settings: MarchSettings,
    saved: Checkpoint,
    /// Its fields.
    pub state: State,
    phases: Phases,
    kept: KeptFactors,
}

impl Checkpoint {
    /// The coefficients of a field that is not carried.
    pub fn flow_of(&self, id: FieldId) -> Option<&[f64]> {
        self.flow.iter().find(|(known, _)| *known == id).map(|(_, values)| &values[..])
    }

    /// Whether it has the unknowns of a model.
    pub fn fits(&self, model: &dyn Sheet) -> bool {
        let carried = model.carried_len();
        let fields = model.fields();
        let flow = fields.iter().filter(|(id, _)| id.role != Role::Carried);
        flow.clone().count() == self.flow.len()
            && flow.clone().all(|(id, space)| self.flow_of(id).is_some_and(|values| values.len() == space.dof_count()))
            && self.rate_of_p.len() == model.space(POLARITY).dof_count()
            && self.origin.as_ref().is_none_or(|o| o.fits(model.space(VELOCITY).dof_count(), carried))
            && !self.past.is_empty()
            && self.past.iter().all(|(_, y)| y.len() == carried)
    }
}

impl Parked {
    /// Of the state.
    pub fn time(&self) -> f64 {
        self.saved.t
    }

    /// The state of the march, as [`March::checkpoint`] had it.
    pub fn checkpoint(&self) -> &Checkpoint {
        &self.saved
    }
}

impl<'m> March<'m> {
    /// Continues from a checkpoint of the same problem.
    pub fn resume(model: &'m dyn Sheet, settings: MarchSettings, from: Checkpoint) -> Self {
        let of_flow = |id| from.flow_of(id).expect("a checkpoint has all fields of its model").to_vec();
        let state = model.joined(&from.past[0].1, &of_flow);
        Self {
            model,
            settings,
            t: from.t,
            state,
            counts: from.counts,
            phases: Phases::default(),
            quiet: from.quiet,
            interrupt: &NEVER,
            control: from.control.within(&settings.control),
            past: from.past,
            gained: from.gained,
            gain: from.gain,
            limited: from.limited,
            rate_of_p: from.rate_of_p,
            kept: from
                .origin
                .filter(|_| settings.coupling.kind == CouplingKind::Newton)
                .map(|origin| KeptFactors::restore(model, origin))
                .unwrap_or_default(),
        }
    }

    /// The current state of the march.
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            t: self.t,
            counts: self.counts,
            control: self.control.clone(),
            past: self.past.clone(),
            flow: self
                .state
                .fields()
                .filter(|(id, _)| id.role != Role::Carried)
                .map(|(id, field)| (id, field.values.clone()))
                .collect(),
            rate_of_p: self.rate_of_p.clone(),
            gained: self.gained.clone(),
            gain: self.gain,
            limited: self.limited,
            quiet: self.quiet,
            origin: self.kept.origin().cloned(),
        }
    }

    /// Puts the march down, to be taken up with another model of the same unknowns.
    pub fn park(self) -> Parked {
        let saved = self.checkpoint();
        Parked { settings: self.settings, saved, state: self.state, phases: self.phases, kept: self.kept }
    }

    /// Takes up a march with a model of the same unknowns; `forget` what was factorised for the other one.
    pub fn unpark(model: &'m dyn Sheet, parked: Parked, forget: bool) -> Self {
        let Parked { settings, saved, state, phases, kept } = parked;
        let kept = if forget { KeptFactors::default() } else { kept };
        // what was factorised is here, and need not be made again from where it came from
        let march = Self::resume(model, settings, Checkpoint { origin: None, ..saved });
        Self { state, phases, kept, ..march }
    }
}
