//! The rules of `[space]`.

use super::{CONSTANT_DENSITY, Checker, WRONG_KIND};
use crate::element::MAX_DEGREE;
use crate::model::parameters::PolarityForm;
use crate::model::{Degrees, ModelKind, Parameters};
use crate::scene::error::SceneError;
use crate::scene::tables::{DegreeTable, SceneFile, SpaceTable, WallsName};
use crate::scene::{SlipTreatment, Space};

impl Checker<'_> {
    pub(super) fn space(&self, table: &mut SpaceTable, kind: ModelKind) -> Result<Space, SceneError> {
        let k = table.k;
        let spaces = match kind {
            ModelKind::Incompressible => "velocity k+1, pressure k, polarity k+2; k = 1 is the usual choice",
            ModelKind::Compressible => "velocity k+1, density k, polarity k+1; k = 1 is the usual choice",
        };
        self.require(SpaceTable::K.has_count(k), "space.k", k, "must be 1, 2 or 3", spaces)?;
        let usual = Degrees::of(kind, k);
        let velocity = *table.degree.velocity.get_or_insert(usual.velocity);
        let least_velocity = match kind {
            ModelKind::Incompressible => DegreeTable::LEAST_VELOCITY,
            ModelKind::Compressible => 1,
        };
        let polarity = *table.degree.polarity.get_or_insert(usual.polarity);
        self.degree("velocity", velocity, least_velocity)?;
        let (pressure, density) = match kind {
            ModelKind::Incompressible => (self.pressure_degree(table, velocity)?, 0),
            ModelKind::Compressible => (0, self.density_degree(table)?),
        };
        self.degree("polarity", polarity, 1)?;
        let epsilon = self.penalty(table.penalty)?;
        let slip = match table.walls {
            WallsName::Rotated => SlipTreatment::Rotated,
            WallsName::Penalty => SlipTreatment::Penalty { epsilon },
        };
        Ok(Space { velocity, pressure, density, polarity, slip })
    }

    /// The form that the polarity has: the hybrid one where nothing is said and nothing forbids it.
    pub(super) fn polarity_form(
        &self,
        file: &mut SceneFile,
        parameters: &Parameters,
    ) -> Result<PolarityForm, SceneError> {
        let bodies = !file.body.is_empty() || !file.bodies.is_empty();
        let cut = bodies.then_some("bodies in the tissue cut its cells");
        let forbidden = parameters.keeps_direct().or(cut);
        let (given, hint) = (file.model.polarity_form, "take polarity_form = \"direct\", or leave it out");
        let fits = given != Some(PolarityForm::Hybrid) || forbidden.is_none();
        self.require(fits, "model.polarity_form", "\"hybrid\"", forbidden.unwrap_or_default(), hint)?;
        let form = match forbidden {
            Some(_) => PolarityForm::Direct,
            None => given.unwrap_or_default(),
        };
        Ok(*file.model.polarity_form.insert(form))
    }

    /// `ε_r`, whether slip is imposed by it or not.
    fn penalty(&self, epsilon: f64) -> Result<f64, SceneError> {
        let rule = "must lie between 1e-16 and 0.01: above, tissue leaks through slip walls, below, no digit is left \
                    for the rest";
        self.within("space.penalty", epsilon, SpaceTable::PENALTY, rule, "1e-8 is the usual value")
    }

    fn degree(&self, name: &str, degree: usize, least: usize) -> Result<(), SceneError> {
        let rule = format!("must lie between {least} and {MAX_DEGREE}");
        let bases = format!("bases exist for degrees up to {MAX_DEGREE}");
        let within = degree >= least && DegreeTable::ANY.has_count(degree);
        self.require(within, &format!("space.degree.{name}"), degree, &rule, &bases)
    }

    fn pressure_degree(&self, table: &mut SpaceTable, velocity: usize) -> Result<usize, SceneError> {
        let given = table.degree.density;
        let shown = given.unwrap_or_default();
        self.require(given.is_none(), "space.degree.density", shown, CONSTANT_DENSITY, WRONG_KIND)?;
        let pressure = *table.degree.pressure.get_or_insert(table.k);
        let stable = "Taylor–Hood pairs are stable only so";
        let rule = format!("must be at least 1 and less than the velocity's degree {velocity}");
        self.require((1..velocity).contains(&pressure), "space.degree.pressure", pressure, &rule, stable)?;
        Ok(pressure)
    }

    fn density_degree(&self, table: &mut SpaceTable) -> Result<usize, SceneError> {
        let given = table.degree.pressure;
        let (shown, rule) =
            (given.unwrap_or_default(), "the pressure of a compressible sheet follows from its density");
        self.require(
            given.is_none(),
            "space.degree.pressure",
            shown,
            rule,
            "remove it, or give the degree of `density`",
        )?;
        let density = *table.degree.density.get_or_insert(table.k);
        self.degree("density", density, 1)?;
        Ok(density)
    }
}
