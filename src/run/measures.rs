//! Which numbers a scene asks for, and their values at a state.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{RunError, Setup};
use crate::body::penalty::Wrench;
use crate::body::{Pose, Twist};
use crate::measure::errors::{History, errors};
use crate::measure::{Budget, Census, Defects, Inlet, Mirror, Overshoot};
use crate::mesh::generate::Track;
use crate::model::boundary::PolarityCondition;
use crate::model::{Exact, ModelKind, Residuals, State};
use crate::scene::{Measure, Scene, What};
use crate::space::Field;
use crate::time::{Kind, March, Schedule, Sheet};

/// What was measured after one step; empty where nothing was due.
#[derive(Debug, Clone, Default)]
pub struct Readings {
    pub residuals: Option<Residuals>,
    /// `F` and `dF/dt`.
    pub energy: Option<(f64, f64)>,
    /// By column of the history.
    pub values: BTreeMap<&'static str, f64>,
    /// Defects of the polarity.
    pub census: Option<Census>,
}

/// The measures of a scene, with what they need prepared once.
#[derive(Debug)]
pub struct Gauges<'s> {
    setup: &'s Setup,
    due: Vec<(Measure, Schedule)>,
    mirror: Option<Mirror>,
    defects: Option<Defects>,
    track: Option<Track>,
    residual_each_step: bool,
    energy_each_step: bool,
    /// Disc radius, and its centre.
    radius: f64,
    centre: [f64; 2],
    end: f64,
    exact: Option<Arc<Exact>>,
    /// Errors against the exact fields, step by step, where somebody asks for them.
    pub errors: Option<History>,
}

impl<'s> Gauges<'s> {
    /// Prepares what the scene measures, and nothing else.
    ///
    /// # Errors
    /// A domain without mirror image for the asymmetry.
    pub fn new(scene: &Scene, setup: &'s Setup) -> Result<Self, RunError> {
        let mut due = Vec::new();
        for output in &scene.outputs {
            match &output.what {
                What::Measures(measures) => due.extend(measures.iter().map(|m| (*m, output.schedule))),
                What::Fields(_) | What::Cuts(_) | What::Maps(_) | What::Bodies { .. } | What::Checkpoint => {}
            }
        }
        let mut centre = scene.mesh.centre();
        let mut radius = scene.mesh.radius();
        if let Some((middle, end)) = super::tissue::wake(scene) {
            (centre, radius) = (middle.into(), end - middle.x);
        }
        let loops = setup.model.loops();
        let degree = 2 * setup.model.polarity().space.degree;
        let mirror = if due.iter().any(|(m, _)| *m == Measure::Asymmetry) {
            Some(Mirror::new(loops, &setup.locator, centre[1], degree)?)
        } else {
            None
        };
        let defects = due.iter().any(|(m, _)| *m == Measure::Defects).then(|| Defects::new(&setup.mesh));
        Ok(Self {
            setup,
            due,
            mirror,
            defects,
            track: scene.mesh.track(),
            residual_each_step: scene.time.stop_residual.is_some(),
            energy_each_step: scene.time.stop_energy_rate.is_some(),
            radius,
            centre,
            end: setup.mesh.vertices.iter().fold(f64::MIN, |m, x| m.max(x.x)),
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
        let mut due: Vec<Measure> =
            self.due.iter().filter(|(_, s)| s.is_due(before, t, step)).map(|(m, _)| *m).collect();
        due.sort_by_key(|m| m.name());
        due.dedup();
        let residuals = if self.residual_each_step || !due.is_empty() { Some(march.residuals()?) } else { None };
        let energy = (self.energy_each_step || due.contains(&Measure::FreeEnergy)).then(|| march.energy());
        let census = if due.contains(&Measure::Defects) { self.census(&march.state) } else { None };
        let mut readings = Readings { residuals, energy, values: BTreeMap::new(), census };
        for measure in due {
            self.fields(measure, march, &mut readings.values)?;
        }
        Ok(readings)
    }

    /// Every measure that the scene names, at the last state.
    ///
    /// # Errors
    /// A measure that cannot be taken.
    pub fn all(&self, march: &mut March) -> Result<BTreeMap<&'static str, f64>, RunError> {
        let mut values = BTreeMap::new();
        for (measure, _) in &self.due {
            self.take(*measure, march, &mut values)?;
        }
        Ok(values)
    }

    /// As [`Gauges::all`] after a failure: what cannot be measured is left out.
    pub fn finite(&self, march: &March) -> BTreeMap<&'static str, f64> {
        let mut values = BTreeMap::new();
        for (measure, _) in &self.due {
            if *measure != Measure::FreeEnergy {
                // the run has failed already: a measure that fails too adds nothing
                let _ = self.fields(*measure, march, &mut values);
            }
        }
        values.retain(|_, v| v.is_finite());
        values
    }

    fn take(
        &self,
        measure: Measure,
        march: &mut March,
        values: &mut BTreeMap<&'static str, f64>,
    ) -> Result<(), RunError> {
        if measure == Measure::FreeEnergy {
            let (energy, rate) = march.energy();
            values.extend([("free_energy", energy), ("free_energy_rate", rate)]);
        }
        self.fields(measure, march, values)
    }

    fn fields(
        &self,
        measure: Measure,
        march: &March,
        values: &mut BTreeMap<&'static str, f64>,
    ) -> Result<(), RunError> {
        match measure {
            // they are taken where the residuals are
            Measure::FreeEnergy => return Ok(()),
            Measure::LimitedCells => {
                values.insert("limited_cells", march.limited() as f64);
            }
            _ => {}
        }
        self.of_state(measure, &At::of(march), values)?;
        if let (Measure::Mass, Some(mass)) = (measure, values.get("mass").copied()) {
            values.insert("mass_defect", mass - march.mass_counted());
        }
        Ok(())
    }

    /// Every measure that the scene names at a steady state of a model, and its residuals; [`OF_A_MARCH`] are not among
    /// them.
    ///
    /// # Errors
    /// A measure that cannot be taken.
    pub fn at_rest(&self, model: &dyn Sheet, state: &State) -> Result<BTreeMap<&'static str, f64>, RunError> {
        let still = vec![0.0; state.p.values.len()];
        let at = At { model, state, t: 0.0, rate_of_p: &still };
        let residuals = model.residuals(state, at.t)?;
        let volume = match model.kind() {
            Kind::Incompressible(_) => "residual_pressure",
            Kind::Compressible(_) => "residual_density",
        };
        let mut values = BTreeMap::from([
            ("residual", residuals.total()),
            ("residual_velocity", residuals.velocity),
            (volume, residuals.volume),
            ("residual_polarity", residuals.polarity),
        ]);
        for (measure, _) in &self.due {
            self.of_state(*measure, &at, &mut values)?;
        }
        Ok(values)
    }

    /// What a state alone tells.
    fn of_state(&self, measure: Measure, at: &At, values: &mut BTreeMap<&'static str, f64>) -> Result<(), RunError> {
        let At { model, state, t, rate_of_p } = *at;
        match measure {
            Measure::FreeEnergy => {
                values.insert("free_energy", model.free_energy(state, t));
                values.insert("free_energy_rate", model.energy_rate(state, rate_of_p, t));
            }
            Measure::EnergyBudget => values.extend(Budget::at(model, state, rate_of_p, t).columns()),
            Measure::Mass => self.mass(state, values),
            Measure::DensityMin => self.smallest_density(state, values),
            Measure::Overshoot => self.overshoot(at, values)?,
            Measure::Asymmetry => self.asymmetry(state, values),
            Measure::Defects => self.count_defects(state, values),
            Measure::Circulation => self.circulation(state, values),
            Measure::ElasticStrain => super::strain::measure(self.setup, state, values)?,
            Measure::Body => of_first_body(model, state, values),
            Measure::Holding => holding(model, state, t, values)?,
            Measure::LimitedCells => {}
            Measure::KineticEnergy | Measure::Gap | Measure::Overlap => {}
            Measure::Contacts | Measure::WallForce => {}
        }
        Ok(())
    }

    /// Relative to what flows in on the axis; empty while that is zero.
    fn overshoot(&self, at: &At, values: &mut BTreeMap<&'static str, f64>) -> Result<(), RunError> {
        let At { model, state, t, .. } = *at;
        let Setup { mesh, locator, .. } = self.setup;
        let (axis, span) = (self.centre[1], (self.centre[0] + self.radius, self.end));
        let Some(inlet) = Inlet::on(mesh, axis) else { return Ok(()) };
        // the polarity is imposed weakly: what is given counts, not its trace
        let polarity = match &model.conditions()[inlet.tag].polarity {
            PolarityCondition::Dirichlet([first, _]) => Some(first.eval(inlet.x, t)),
            PolarityCondition::Neumann => inlet.value(&state.p, mesh, locator),
        };
        let fields = [
            (&state.v, inlet.value(&state.v, mesh, locator), ["overshoot_velocity", "overshoot_velocity_x1"]),
            (&state.p, polarity, ["overshoot_polarity", "overshoot_polarity_x1"]),
        ];
        for (field, inflow, [percent, place]) in fields {
            if let Some(inflow) = inflow.filter(|inflow| *inflow != 0.0) {
                let found = Overshoot::of(field, mesh, locator, span, (axis, inflow))?;
                values.extend([(percent, found.percent), (place, found.x1)]);
            }
        }
        Ok(())
    }

    /// `∫ρ`
    fn mass(&self, state: &State, values: &mut BTreeMap<&'static str, f64>) {
        if let Kind::Compressible(sheet) = self.setup.model.kind() {
            values.insert("mass", sheet.density.total(&state.volume().values));
        }
    }

    /// Over every point where a density is evaluated.
    fn smallest_density(&self, state: &State, values: &mut BTreeMap<&'static str, f64>) {
        if let Kind::Compressible(sheet) = self.setup.model.kind() {
            values.insert("density_min", sheet.density.limiter.smallest(state.volume()));
        }
    }

    /// `(1/|Ω|) ∫ c·τ` of velocity and polarity, τ the unit vector along the track.
    fn circulation(&self, state: &State, values: &mut BTreeMap<&'static str, f64>) {
        let Some(track) = self.track else { return };
        let (loops, area) = (self.setup.model.loops(), self.setup.model.area());
        // the direction is no polynomial
        let degree = 2 * state.v.space.degree.max(state.p.space.degree);
        let mean = |field: &Field| loops.sum(degree, |x| field.vector(&x.site).dot(&track.tangent(x.site.x))) / area;
        values.extend([("circulation_velocity", mean(&state.v)), ("circulation_polarity", mean(&state.p))]);
    }

    /// The defects of the polarity, where the scene measures them.
    pub fn census(&self, state: &State) -> Option<Census> {
        self.defects.as_ref().map(|defects| defects.of(&state.p))
    }

    fn count_defects(&self, state: &State, values: &mut BTreeMap<&'static str, f64>) {
        if let Some(census) = self.census(state) {
            let [plus, minus] = [1, -1].map(|charge| census.count(charge) as f64);
            values.extend([("defects_plus", plus), ("defects_minus", minus)]);
        }
    }

    fn asymmetry(&self, state: &State, values: &mut BTreeMap<&'static str, f64>) {
        let loops = self.setup.model.loops();
        if let Some(mirror) = &self.mirror {
            values.insert("asymmetry_velocity", mirror.asymmetry(loops, &state.v));
            values.insert("asymmetry_polarity", mirror.asymmetry(loops, &state.p));
        }
    }
}

/// A state and its model.
#[derive(Clone, Copy)]
struct At<'a> {
    model: &'a dyn Sheet,
    state: &'a State,
    t: f64,
    /// `∂_t p`
    rate_of_p: &'a [f64],
}

impl<'a> At<'a> {
    fn of(march: &'a March) -> Self {
        Self { model: march.model, state: &march.state, t: march.t, rate_of_p: march.rate_of_p() }
    }
}

/// Place and motion of the first body, which is fixed.
fn of_first_body(model: &dyn Sheet, state: &State, values: &mut BTreeMap<&'static str, f64>) {
    if let Kind::Incompressible(model) = model.kind()
        && let (Some(pose), Some(twist)) = (model.poses().first(), model.twists(&state.v).first())
    {
        values.extend(of_body(pose, twist));
    }
}

fn holding(model: &dyn Sheet, state: &State, t: f64, values: &mut BTreeMap<&'static str, f64>) -> Result<(), RunError> {
    if let Kind::Incompressible(model) = model.kind()
        && model.bodies.is_some()
    {
        values.extend(model.holding(state, t)?.first().into_iter().flat_map(of_holding));
    }
    Ok(())
}

/// Columns that belong to a march in time, or to bodies that move: a steady state by itself has none of them.
pub const OF_A_MARCH: [&str; 8] =
    ["mass_defect", "limited_cells", "kinetic_energy", "gap", "overlap", "contacts", "wall_force_x1", "wall_force_x2"];

/// The numbers that a measure has, in the order in which they are written.
pub fn columns_of(measure: Measure) -> Vec<&'static str> {
    match measure {
        Measure::FreeEnergy => vec!["free_energy", "free_energy_rate"],
        Measure::Overshoot => {
            vec!["overshoot_velocity", "overshoot_velocity_x1", "overshoot_polarity", "overshoot_polarity_x1"]
        }
        Measure::Asymmetry => vec!["asymmetry_velocity", "asymmetry_polarity"],
        Measure::Mass => vec!["mass", "mass_defect"],
        Measure::DensityMin => vec!["density_min"],
        Measure::LimitedCells => vec!["limited_cells"],
        Measure::ElasticStrain => super::strain::COLUMNS.to_vec(),
        Measure::Circulation => vec!["circulation_velocity", "circulation_polarity"],
        Measure::Defects => vec!["defects_plus", "defects_minus"],
        Measure::EnergyBudget => Budget::default().columns().map(|(name, _)| name).to_vec(),
        Measure::KineticEnergy => vec!["kinetic_energy"],
        Measure::Gap => vec!["gap"],
        Measure::Overlap => vec!["overlap"],
        Measure::Contacts => vec!["contacts"],
        Measure::WallForce => vec!["wall_force_x1", "wall_force_x2"],
        Measure::Body => vec!["body_x1", "body_x2", "body_angle", "body_velocity_1", "body_velocity_2", "body_spin"],
        Measure::Holding => vec!["holding_x1", "holding_x2", "holding_torque"],
    }
}

/// The numbers of `body`.
pub fn of_body(pose: &Pose, twist: &Twist) -> [(&'static str, f64); 6] {
    [
        ("body_x1", pose.position.x),
        ("body_x2", pose.position.y),
        ("body_angle", pose.angle),
        ("body_velocity_1", twist.velocity.x),
        ("body_velocity_2", twist.velocity.y),
        ("body_spin", twist.spin),
    ]
}

/// The numbers of `holding`.
pub fn of_holding(held: &Wrench) -> [(&'static str, f64); 3] {
    [("holding_x1", held.force.x), ("holding_x2", held.force.y), ("holding_torque", held.torque)]
}

/// Columns of the history that a scene's measures fill, in the order in which they are written.
pub fn columns(scene: &Scene) -> Vec<&'static str> {
    let named = |measure: Measure| {
        scene.outputs.iter().any(|output| match &output.what {
            What::Measures(measures) => measures.contains(&measure),
            What::Fields(_) | What::Cuts(_) | What::Maps(_) | What::Bodies { .. } | What::Checkpoint => false,
        })
    };
    let with_residual = [Measure::FreeEnergy, Measure::Overshoot, Measure::Asymmetry, Measure::EnergyBudget];
    let mut columns = Vec::new();
    if with_residual.into_iter().any(named) || scene.time.stop_residual.is_some() || scene.steady.is_some() {
        let volume = match scene.parameters.kind() {
            ModelKind::Incompressible => "residual_pressure",
            ModelKind::Compressible => "residual_density",
        };
        columns.extend(["residual", "residual_velocity", volume, "residual_polarity"]);
    }
    let is_written =
        |measure: &Measure| named(*measure) || *measure == Measure::FreeEnergy && scene.time.stop_energy_rate.is_some();
    columns.extend(Measure::ALL.into_iter().filter(is_written).flat_map(columns_of));
    columns
}

impl Readings {
    /// Of a state of which only the total residual is known.
    pub fn of_residual(residual: f64) -> Self {
        Self { values: BTreeMap::from([("residual", residual)]), ..Self::default() }
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
            other => self.values.get(other).copied(),
        }
    }
}
