//! What a run shows of itself between two steps: fields by their names, rigid bodies, and what only a tissue has.

use crate::measure::errors::{Errors, errors, of_flow};
use crate::measure::fields::Fields;
use crate::measure::list::{ActsOn, Bodies, OfMarch};
use crate::model::immersed::FlowWithBodies;
use crate::model::immersed::flow::Flow;
use crate::model::momentum::MomentumError;
use crate::model::{Exact, Fluid, Reactions, Sources, State};
use crate::time::{Sheet, SheetKind};

/// What only a tissue shows.
#[derive(Debug, Clone, Copy)]
pub struct TissueNow<'a> {
    /// What is solved.
    pub model: &'a dyn Sheet,
    /// Its fields.
    pub state: &'a State,
    /// `∂_t p`
    pub rate_of_p: &'a [f64],
    /// What the march has counted.
    pub march: OfMarch,
}

/// What only a Stokes flow shows.
#[derive(Debug, Clone, Copy)]
pub struct FlowNow<'a> {
    /// What is solved.
    pub flow: &'a Flow,
    /// Its fields and the motion of its bodies.
    pub carried: &'a FlowWithBodies,
    /// The numbers of its equations.
    pub fluid: &'a Fluid,
    /// What acts on it.
    pub sources: &'a Sources,
}

/// All that there is between two steps.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// Time of the state.
    pub t: f64,
    /// `None` where there is nothing but bodies.
    pub fields: Option<&'a dyn Fields>,
    /// `None` where there are no bodies.
    pub bodies: Option<Bodies<'a>>,
    /// `None` where there is no tissue.
    pub tissue: Option<TissueNow<'a>>,
    /// `None` where there is no Stokes flow.
    pub flow: Option<FlowNow<'a>>,
}

impl View<'_> {
    /// The errors of what there is against exact fields; `None` where nothing is solved for.
    pub fn errors(&self, exact: &Exact) -> Option<Errors> {
        let of_tissue = self.tissue.map(|now| errors(now.model, exact, now.state, self.t));
        of_tissue.or_else(|| self.flow.map(|now| of_flow(now.flow, now.carried, exact, self.t)))
    }

    /// The forces and torques that hold the bodies of a flow; `None` where nothing flows around bodies.
    pub fn acting(&self) -> Option<Result<Vec<ActsOn>, MomentumError>> {
        let of_flow = self.flow.map(|now| Ok(acts_on(now.carried)));
        of_flow.or_else(|| self.tissue.and_then(|now| acting(now.model, now.state, self.t)))
    }

    /// What every body takes of the energy of a tissue; `None` where there is none, or no bodies in it.
    pub fn powers(&self) -> Option<Result<Vec<f64>, MomentumError>> {
        self.tissue.and_then(|now| powers(now.model, now.state, self.t))
    }

    /// The forces on the boundary; `None` where none drive the flow.
    pub fn reactions(&self) -> Option<Result<Reactions, MomentumError>> {
        let of_tissue = self.tissue.map(|now| now.model.reactions(now.state, self.t));
        of_tissue.or_else(|| {
            let FlowNow { flow, carried, fluid, sources } = self.flow?;
            Some(Reactions::of_flow(flow, carried, fluid, sources))
        })
    }
}

/// The forces and torques that hold the bodies of a tissue; `None` without bodies.
pub fn acting(model: &dyn Sheet, state: &State, t: f64) -> Option<Result<Vec<ActsOn>, MomentumError>> {
    match model.kind() {
        SheetKind::Incompressible(model) => model.bodies.as_ref().map(|_| Ok(acts_on(&model.carried(state, t)?))),
        SheetKind::Compressible(_) => None,
    }
}

/// What every body takes of the energy of a tissue at a state; `None` without bodies in it.
pub fn powers(model: &dyn Sheet, state: &State, t: f64) -> Option<Result<Vec<f64>, MomentumError>> {
    match model.kind() {
        SheetKind::Incompressible(model) => model.bodies.as_ref().map(|_| {
            let twists = model.twists(state, t)?;
            model.powers_to_bodies(state, &twists, t)
        }),
        SheetKind::Compressible(_) => None,
    }
}

fn acts_on(carried: &FlowWithBodies) -> Vec<ActsOn> {
    let FlowWithBodies { wrenches, holding, .. } = carried;
    wrenches.iter().zip(holding).map(|(&flow, &holding)| ActsOn { flow, holding }).collect()
}
