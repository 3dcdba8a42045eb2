//! Which numbers a scene asks for, and their values at a state.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{RunError, Setup};
use crate::measure::Measure;
use crate::measure::errors::{History, errors};
use crate::measure::list::{ALL, Domain, FREE_ENERGY, Gauge, OfMarch, Taken, Tissue};
use crate::model::{Exact, ModelKind, Residuals, State};
use crate::scene::{Scene, measured};
use crate::scheme::Schedule;
use crate::time::{Kind, March, Sheet};

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
    domain: Domain<'s>,
    /// Each measure once, in the order of the columns.
    gauges: Vec<(&'static Measure, Box<dyn Gauge>)>,
    due: Vec<(&'static Measure, Schedule)>,
    residual_each_step: bool,
    energy_each_step: bool,
    exact: Option<Arc<Exact>>,
    /// Errors against the exact fields, step by step, where somebody asks for them.
    pub errors: Option<History>,
}

impl<'s> Gauges<'s> {
    /// Prepares what the scene measures, and nothing else.
    ///
    /// # Errors
    /// A domain in which one of the measures cannot be taken.
    pub fn new(scene: &Scene, setup: &'s Setup) -> Result<Self, RunError> {
        let scheduled = scene.outputs.iter().map(|output| (output.what.measures(), output.schedule));
        let due = scheduled.flat_map(|(measures, schedule)| measures.iter().map(move |m| (*m, schedule))).collect();
        let domain = domain(scene, setup);
        let prepare = |measure: &'static Measure| Ok((measure, measure.prepare(&domain)?));
        Ok(Self {
            gauges: measured(&scene.outputs).into_iter().map(prepare).collect::<Result<_, RunError>>()?,
            domain,
            due,
            residual_each_step: scene.time.stop_residual.is_some(),
            energy_each_step: scene.time.stop_energy_rate.is_some(),
            exact: scene.sources.exact.clone(),
            errors: None,
        })
    }

    /// Forgets the errors of earlier states: those of the current one count alone.
    pub fn only_now(&mut self, march: &March) {
        if let (Some(history), Some(exact)) = (&mut self.errors, &self.exact) {
            *history = History::default();
            history.add(&errors(march.model, exact, &march.state, march.t), 1.0);
        }
    }

    /// Measures what is due after the step that began at `before`.
    ///
    /// # Errors
    /// A measure that cannot be taken.
    pub fn read(&mut self, march: &mut March, before: f64) -> Result<Readings, RunError> {
        let (t, step) = (march.t, march.counts.steps);
        if let (Some(history), Some(exact)) = (&mut self.errors, &self.exact) {
            history.add(&errors(march.model, exact, &march.state, t), t - before);
        }
        let is_due = |measure: &Measure| self.due.iter().any(|(m, s)| *m == measure && s.is_due(before, t, step));
        let due: Vec<_> = self.gauges.iter().filter(|(measure, _)| is_due(measure)).collect();
        let residuals = if self.residual_each_step || !due.is_empty() { Some(march.residuals()?) } else { None };
        let energy = (self.energy_each_step || is_due(&FREE_ENERGY)).then(|| march.energy());
        let (at, mut taken) = (self.at(march, energy), Taken::default());
        due.iter().try_for_each(|(_, gauge)| gauge.take(&at, &mut taken))?;
        Ok(Readings { residuals, energy, taken })
    }

    /// Every measure that the scene names, at the last state.
    ///
    /// # Errors
    /// A measure that cannot be taken.
    pub fn all(&self, march: &mut March) -> Result<Taken, RunError> {
        let energy = self.has(&FREE_ENERGY).then(|| march.energy());
        self.take(&self.at(march, energy))
    }

    /// As [`Gauges::all`] after a failure: what cannot be measured is left out, and the energy.
    pub fn finite(&self, march: &March) -> Taken {
        let (at, mut taken) = (self.at(march, None), Taken::default());
        for (_, gauge) in &self.gauges {
            // the run has failed already: a measure that fails too adds nothing
            let _ = gauge.take(&at, &mut taken);
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
        let (still, t) = (vec![0.0; state.p.values.len()], 0.0);
        let energy = self.has(&FREE_ENERGY).then(|| (model.free_energy(state, t), model.energy_rate(state, &still, t)));
        let at = Tissue { domain: &self.domain, model, state, t, rate_of_p: &still, energy, march: None };
        let residuals = model.residuals(state, t)?;
        let volume = match model.kind() {
            Kind::Incompressible(_) => "residual_pressure",
            Kind::Compressible(_) => "residual_density",
        };
        let mut values = self.take(&at)?.values;
        values.extend([
            ("residual", residuals.total()),
            ("residual_velocity", residuals.velocity),
            (volume, residuals.volume),
            ("residual_polarity", residuals.polarity),
        ]);
        Ok(values)
    }

    fn has(&self, measure: &Measure) -> bool {
        self.gauges.iter().any(|(other, _)| *other == measure)
    }

    fn take(&self, at: &Tissue) -> Result<Taken, RunError> {
        let mut taken = Taken::default();
        self.gauges.iter().try_for_each(|(_, gauge)| gauge.take(at, &mut taken))?;
        Ok(taken)
    }

    /// The current state of a march.
    fn at<'a>(&'a self, march: &'a March, energy: Option<(f64, f64)>) -> Tissue<'a> {
        Tissue {
            domain: &self.domain,
            model: march.model,
            state: &march.state,
            t: march.t,
            rate_of_p: march.rate_of_p(),
            energy,
            march: Some(OfMarch { limited: march.limited(), mass_counted: march.mass_counted() }),
        }
    }
}

/// The domain of a scene, as measures know it.
fn domain<'s>(scene: &Scene, setup: &'s Setup) -> Domain<'s> {
    let mut centre = scene.mesh.centre();
    let mut radius = scene.mesh.radius();
    if let Some((middle, end)) = super::tissue::wake(scene) {
        (centre, radius) = (middle.into(), end - middle.x);
    }
    Domain {
        model: &*setup.model,
        mesh: &setup.mesh,
        locator: &setup.locator,
        centre,
        radius,
        end: setup.mesh.vertices.iter().fold(f64::MIN, |m, x| m.max(x.x)),
        track: scene.mesh.track(),
        strain: setup.strain.as_ref(),
    }
}

/// Columns of the history that a scene's measures fill, in the order in which they are written.
pub fn columns(scene: &Scene) -> Vec<&'static str> {
    let named = measured(&scene.outputs);
    let mut columns = Vec::new();
    let residuals = named.iter().any(|measure| measure.with_residuals);
    if residuals || scene.time.stop_residual.is_some() || scene.steady.is_some() {
        let volume = match scene.parameters.kind() {
            ModelKind::Incompressible => "residual_pressure",
            ModelKind::Compressible => "residual_density",
        };
        columns.extend(["residual", "residual_velocity", volume, "residual_polarity"]);
    }
    let stops_by_energy = scene.time.stop_energy_rate.is_some();
    let is_written = |measure: &&&Measure| named.contains(measure) || ***measure == FREE_ENERGY && stops_by_energy;
    columns.extend(ALL.iter().filter(is_written).flat_map(|measure| measure.column_names()));
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
        let residual = |part: fn(&Residuals) -> f64| self.residuals.as_ref().map(part);
        match column {
            "residual" if self.residuals.is_some() => residual(Residuals::total),
            "residual_velocity" => residual(|r| r.velocity),
            "residual_pressure" | "residual_density" => residual(|r| r.volume),
            "residual_polarity" => residual(|r| r.polarity),
            "free_energy" => self.energy.map(|e| e.0),
            "free_energy_rate" => self.energy.map(|e| e.1),
            other => self.taken.values.get(other).copied(),
        }
    }
}
