//! Which numbers a scene asks for, and their values at a state.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::RunError;
use super::kinds::sheet::show_bodies_at_rest;
use super::stepper::{Ground, Plan};
use super::view::{TissueNow, View, acting, powers};
use crate::measure::Measure;
use crate::measure::errors::History;
use crate::measure::fields::{Fields, TissueFields};
use crate::measure::list::{
    Acting, Asked, Boundary, Column, Domain, FREE_ENERGY, Flow, Powers, Prepared, Subject, Taken, Tissue,
};
use crate::model::fields::{self, POLARITY, VELOCITY};
use crate::model::{Exact, Residuals, State};
use crate::scene::{Output, Scene, measured};
use crate::scheme::Schedule;
use crate::time::Sheet;
use crate::time::phases::Phases;

/// What was measured after one step; empty where nothing was due.
#[derive(Debug, Clone, Default)]
pub struct Readings {
    /// Of the stationary equations, where they were taken.
    pub residuals: Option<Residuals>,
    /// `F` and `dF/dt`.
    pub energy: Option<(f64, f64)>,
    /// Of measures, in the order of their columns.
    pub taken: Taken,
}

/// The measures of a scene, with what they need prepared once.
#[derive(Debug)]
pub struct Gauges<'s> {
    domain: Option<Domain<'s>>,
    /// Each measure once, in the order of the columns.
    gauges: Vec<(Asked, Prepared)>,
    due: Vec<(Asked, Schedule)>,
    residual_each_step: bool,
    energy_each_step: bool,
    exact: Option<Arc<Exact>>,
    /// Errors against the exact fields, step by step, where somebody asks for them.
    pub errors: Option<History>,
    /// Time that was spent.
    pub phases: Phases,
}

impl<'s> Gauges<'s> {
    /// Prepares what the scene measures, and nothing else.
    ///
    /// # Errors
    /// A domain in which one of the measures cannot be taken.
    pub fn new(plan: &Plan, ground: Option<&'s Ground>) -> Result<Self, RunError> {
        let scheduled = plan.outputs.iter().map(|output| (output.what.measures(), output.schedule));
        let due =
            scheduled.flat_map(|(measures, schedule)| measures.iter().map(move |m| (m.clone(), schedule))).collect();
        let polarity = plan.tissue.map_or(0, |scene| scene.space.polarity);
        let domain = ground.map(|ground| domain(ground, polarity));
        let first = plan.bodies.first().map(|body| &*body.name);
        let prepare = |asked: Asked| Ok((asked.clone(), asked.prepare(domain.as_ref())?.of_first(first)));
        Ok(Self {
            gauges: measured(plan.outputs).into_iter().map(prepare).collect::<Result<_, RunError>>()?,
            domain,
            due,
            residual_each_step: plan.limits.stop_residual.is_some(),
            energy_each_step: plan.limits.stop_energy_rate.is_some(),
            exact: plan.exact.clone(),
            errors: None,
            phases: Phases::default(),
        })
    }

    /// Forgets the errors of earlier states: those of the current one count alone.
    pub fn only_now(&mut self, view: &View) {
        if let (Some(history), Some(exact)) = (&mut self.errors, &self.exact)
            && let Some(errors) = view.errors(exact)
        {
            *history = History::default();
            history.add(&errors, 1.0);
        }
    }

    /// Whether something is to be measured after the step that began at `before`.
    fn is_due(&self, asked: &Asked, (before, t): (f64, f64), step: usize) -> bool {
        self.due.iter().any(|(other, s)| other == asked && s.is_due(before, t, step))
    }

    /// Whether [`Gauges::read`] has anything to do after the step that began at `before`.
    pub fn has_work(&self, before: f64, t: f64, step: usize) -> bool {
        let each = self.errors.is_some() || self.residual_each_step || self.energy_each_step;
        each || self.gauges.iter().any(|(measure, _)| self.is_due(measure, (before, t), step))
    }

    /// Measures what is due after the step that began at `before`.
    ///
    /// # Errors
    /// A measure that cannot be taken.
    pub fn read(&mut self, view: &View, before: f64, step: usize) -> Result<Readings, RunError> {
        if let (Some(history), Some(exact)) = (&mut self.errors, &self.exact)
            && let Some(errors) = view.errors(exact)
        {
            history.add(&errors, view.t - before);
        }
        let due: Vec<_> =
            self.gauges.iter().filter(|(measure, _)| self.is_due(measure, (before, view.t), step)).collect();
        let mut phases = std::mem::take(&mut self.phases);
        let residuals = match (view.tissue, self.residual_each_step || !due.is_empty()) {
            (Some(now), true) => Some(phases.measure("residuals", || now.model.residuals(now.state, view.t))?),
            (_, _) => None,
        };
        let needs_energy = self.energy_each_step || self.is_due(&Asked::from(&FREE_ENERGY), (before, view.t), step);
        let energy = view.tissue.filter(|_| needs_energy).map(|now| phases.measure("energy", || energy(&now, view.t)));
        let mut taken = Taken::default();
        let gauges = due.iter().map(|(_, gauge)| gauge);
        self.take(view, energy, gauges, &mut taken)?;
        self.phases = phases;
        Ok(Readings { residuals, energy, taken })
    }

    /// Every measure that the scene names, at the last state.
    ///
    /// # Errors
    /// A measure that cannot be taken.
    pub fn all(&mut self, view: &View) -> Result<Taken, RunError> {
        let wanted = view.tissue.filter(|_| self.has(&FREE_ENERGY));
        let energy = wanted.map(|now| self.phases.measure("energy", || energy(&now, view.t)));
        let mut taken = Taken::default();
        self.take(view, energy, self.gauges.iter().map(|(_, gauge)| gauge), &mut taken)?;
        Ok(taken)
    }

    /// As [`Gauges::all`] after a failure: what cannot be measured is left out, and the energy.
    pub fn finite(&self, view: &View) -> Taken {
        let mut taken = Taken::default();
        for (_, gauge) in &self.gauges {
            // the run has failed already: a measure that fails too adds nothing
            let _ = self.take(view, None, std::iter::once(gauge), &mut taken);
        }
        taken.values.retain(|_, v| v.is_finite());
        taken
    }

    /// Every measure that the scene names at a steady state of a model, and its residuals; the columns of a march are
    /// not among them.
    ///
    /// # Errors
    /// A measure that cannot be taken.
    pub fn at_rest(&self, model: &dyn Sheet, state: &State) -> Result<BTreeMap<&'static str, f64>, RunError> {
        let (still, t) = (vec![0.0; state[POLARITY].values.len()], 0.0);
        let energy = self.has(&FREE_ENERGY).then(|| (model.free_energy(state, t), model.energy_rate(state, &still, t)));
        let fields = TissueFields { model, state, t };
        let v = state[VELOCITY].clone();
        let flowing = fields.flowing();
        let domain = self.domain.as_ref().expect("a tissue has a domain");
        let tissue = Tissue { domain, model, state, t, rate_of_p: &still, energy, march: None };
        let find = || model.reactions(state, t);
        let boundary = Boundary::new(&find);
        let act = || acting(model, state, t).unwrap_or_else(|| Ok(Vec::new()));
        let take = || powers(model, state, t).unwrap_or_else(|| Ok(Vec::new()));
        let (acting, powers) = (Acting::new(&act), Powers::new(&take));
        let mut taken = Taken::default();
        show_bodies_at_rest(model, &mut |bodies| {
            let flow = Some(Flow { v: &v, loops: &flowing });
            let (boundary, acting, powers) = (Some(&boundary), Some(&acting), Some(&powers));
            let at = Subject { flow, boundary, bodies, acting, powers, tissue: Some(tissue) };
            Ok(self.gauges.iter().try_for_each(|(_, gauge)| gauge.take(&at, &mut taken))?)
        })?;
        let residuals = model.residuals(state, t)?;
        let mut values = taken.values;
        values.insert("residual", residuals.total());
        values.extend(residuals.each().map(|(field, residual)| (field.residual, residual)));
        Ok(values)
    }

    fn has(&self, measure: &Measure) -> bool {
        self.gauges.iter().any(|(asked, _)| asked.measure == measure)
    }

    fn take<'g>(
        &self,
        view: &View,
        energy: Option<(f64, f64)>,
        mut gauges: impl Iterator<Item = &'g Prepared>,
        taken: &mut Taken,
    ) -> Result<(), RunError> {
        let v = view.fields.map(|fields| fields.field(VELOCITY)).transpose()?.flatten();
        let flowing = view.fields.map(Fields::flowing);
        let flow = v.as_ref().zip(flowing.as_ref()).map(|(v, loops)| Flow { v, loops });
        let tissue = view.tissue.zip(self.domain.as_ref()).map(|(now, domain)| Tissue {
            domain,
            model: now.model,
            state: now.state,
            t: view.t,
            rate_of_p: now.rate_of_p,
            energy,
            march: Some(now.march),
        });
        let find = || view.reactions().expect("a flow that forces drive");
        let boundary = Boundary::new(&find);
        let act = || view.acting().unwrap_or_else(|| Ok(Vec::new()));
        let take = || view.powers().unwrap_or_else(|| Ok(Vec::new()));
        let (acting, powers) = (Acting::new(&act), Powers::new(&take));
        let driven = view.tissue.is_some() || view.flow.is_some();
        let boundary = driven.then_some(&boundary);
        let (acting, powers) = (Some(&acting), Some(&powers));
        let at = Subject { flow, boundary, bodies: view.bodies, acting, powers, tissue };
        Ok(gauges.try_for_each(|gauge| gauge.take(&at, taken))?)
    }
}

/// `F` and `dF/dt`
pub(super) fn energy(now: &TissueNow, t: f64) -> (f64, f64) {
    let rate = now.model.energy_rate(now.state, now.rate_of_p, t);
    (now.model.free_energy(now.state, t), rate)
}

/// The domain of a run, as measures know it.
fn domain(ground: &Ground, polarity: usize) -> Domain<'_> {
    let (centre, radius) = ground.disc();
    Domain {
        mesh: &ground.mesh,
        locator: &ground.locator,
        centre,
        radius,
        end: ground.mesh.vertices.iter().fold(f64::MIN, |m, x| m.max(x.x)),
        track: ground.shape.track(),
        strain: ground.tools.strain.as_ref(),
        polarity,
    }
}

/// Columns of the history that a scene's measures fill, in the order in which they are written.
pub fn columns(outputs: &[Output], tissue: Option<&Scene>) -> Vec<&'static str> {
    let mut named = measured(outputs);
    let mut columns = Vec::new();
    let with_residuals = named.iter().any(|asked| asked.measure.with_residuals);
    if let Some(scene) = tissue
        && (with_residuals || scene.time.stop_residual.is_some() || scene.steady.is_some())
    {
        columns.push("residual");
        columns.extend(scene.parameters.kind().fields().iter().map(|field| field.residual));
    }
    let stops_by_energy = tissue.is_some_and(|scene| scene.time.stop_energy_rate.is_some());
    let energy = Asked::from(&FREE_ENERGY);
    if stops_by_energy && !named.contains(&energy) {
        // the first of the list
        named.insert(0, energy);
    }
    let given = |column: &Column| {
        let has_bodies = tissue.is_some_and(|scene| scene.bodies.is_some());
        (has_bodies || !column.of_bodies)
            && column.key.is_none_or(|key| tissue.is_some_and(|scene| scene.parameters.factors.of(key) != 0.0))
    };
    let written = named.iter().flat_map(Asked::columns);
    columns.extend(written.filter(given).map(|column| column.name));
    columns
}

impl Readings {
    /// Of a state of which only the total residual is known.
    pub fn of_residual(residual: f64) -> Self {
        let values = BTreeMap::from([("residual", residual)]);
        Self { taken: Taken { values, census: None }, ..Self::default() }
    }

    /// The entry of a column, if it was measured.
    pub fn value(&self, column: &str) -> Option<f64> {
        match column {
            "residual" if self.residuals.is_some() => self.residuals.as_ref().map(Residuals::total),
            "free_energy" => self.energy.map(|e| e.0),
            "free_energy_rate" => self.energy.map(|e| e.1),
            other => match fields::of_residual(other) {
                Some(field) => {
                    self.residuals.as_ref()?.each().find(|(of, _)| *of == field).map(|(_, residual)| residual)
                }
                None => self.taken.values.get(other).copied(),
            },
        }
    }
}
