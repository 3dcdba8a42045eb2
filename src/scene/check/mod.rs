//! Every rule of a scene that does not need its mesh.

mod amounts;
mod bodies;
mod fields;
mod groups;
mod kinds_of_scenes;
mod maps;
mod outputs;
mod rest;
mod strain;
mod walls;

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::PathBuf;

use super::error::SceneError;
use super::kinds;
use super::path::quoted;
use super::presets;
use super::tables::{CouplingName, DensityScheme, SceneFile, SpaceTable, TimeStart, WallsName};
use super::{
    ControlSettings, CouplingSettings, Scene, SceneSource, SlipTreatment, Sources, Space, SteadySettings, Time,
};
use crate::element::MAX_DEGREE;
use crate::expression::{Expression, Formula, VectorFormula, parse_vector};
use crate::mesh::generate::MeshScene;
use crate::model::boundary::NamedCondition;
use crate::model::{Conditions, Degrees, ModelError, ModelKind, Parameters};
use crate::time::CouplingKind;
pub(in crate::scene) use amounts::Course;
pub(in crate::scene) use outputs::Scope;

/// Reads the tables, checks them, fills in the defaults that depend on other keys.
pub(super) fn check(source: SceneSource) -> Result<Scene, SceneError> {
    if let Some(command) = source.study_command() {
        let named = source.value("scene").map(|scene| scene.as_str().unwrap_or("named in it").to_owned());
        let (file, scene) = (source.origin().to_owned(), named.unwrap_or_else(|| "that of its run".to_owned()));
        return Err(SceneError::Study { file, command, scene });
    }
    let checker = Checker { source: &source };
    checker.of_kind(&kinds::TISSUE)?;
    checker.keys_of_kind()?;
    let (full, preset) = presets::fill(&source).map_err(|error| *error)?;
    let mut file = full.tables::<SceneFile>().map_err(|found| found.1)?;
    let parameters = file.model.check().map_err(|error| checker.model("model", error))?;
    file.model = file.model.resolved().map_err(|error| checker.model("model", error))?;
    let space = checker.space(&mut file.space, parameters.kind())?;
    checker.curved_where_it_turns(&mut file.mesh, space.velocity, file.boundary.values().map(|table| &table.velocity));
    checker.mesh(&mut file.mesh)?;
    let sources = checker.sources(&file, &parameters)?;
    let exact = sources.exact.as_deref();
    let boundary = checker.boundary(&mut file, &parameters, &sources)?;
    let initial = checker.initial(&mut file.initial.polarity, &parameters, exact)?;
    let initial_density = checker.initial_density(&mut file.initial.density, &parameters, exact)?;
    let mut time = checker.time(&mut file, &parameters)?;
    time.rests_from = checker.rest(&time, &file.mesh, &boundary, &sources)?;
    let steady = checker.steady(&mut file, &boundary, &sources)?;
    let coupling = checker.coupling(&mut file)?;
    let bodies = checker.bodies_of_tissue(&mut file, parameters.kind(), &parameters.symbols())?;
    let scope = Scope { tissue: Some(&parameters), kind: &kinds::TISSUE, bodies: bodies.is_some() };
    let outputs = checker.outputs(&file.output, scope)?;
    let course = Course { step: time.control.step, end: time.end, max_steps: time.max_steps };
    checker.amounts(&outputs, course)?;
    checker.on_a_track(&file.mesh, &initial, &outputs)?;
    let strain = checker.strain(&mut file.strain, &space, &outputs)?;
    let (title, mesh) = (file.title.clone(), file.mesh.clone());
    Ok(Scene {
        title,
        parameters,
        mesh,
        space,
        boundary,
        initial,
        initial_density,
        sources,
        time,
        steady,
        coupling,
        strain,
        bodies,
        outputs,
        preset,
        resolved: file,
        source,
    })
}

/// A number as one would type it: 1e-9, not 0.000000001.
pub(in crate::scene) fn shown(value: f64) -> String {
    format!("{value:?}")
}

/// Whether a positive number is farther from 1 than another by more than three powers of ten: it is to blame where
/// the two do not go together.
fn is_odder(one: f64, other: f64) -> bool {
    one.log10().abs() > other.log10().abs() + 3.0
}

/// What to do about a key that only the other kind of sheet has.
const WRONG_KIND: &str = "remove it, or take kind = \"compressible\"";
/// Why an incompressible sheet has no such key.
const CONSTANT_DENSITY: &str = "the density of an incompressible sheet is 1 everywhere";

/// How to give exact fields.
fn exact_hint(kind: ModelKind) -> &'static str {
    match kind {
        ModelKind::Incompressible => "add a table [exact] with velocity, pressure and polarity",
        ModelKind::Compressible => "add a table [exact] with velocity, density and polarity",
    }
}

pub(super) use kinds_of_scenes::{particles, stokes};
pub use maps::MapRule;

pub(in crate::scene) struct Checker<'a> {
    pub(in crate::scene) source: &'a SceneSource,
}

impl Checker<'_> {
    pub(in crate::scene) fn error(&self, key: &str, value: impl Display, rule: &str, hint: &str) -> SceneError {
        let place = self.source.place(key);
        let (key, value) = (key.to_owned(), value.to_string());
        SceneError::Value { place, key, value, rule: rule.to_owned(), hint: hint.to_owned() }
    }

    fn model(&self, table: &str, error: ModelError) -> SceneError {
        self.error(&format!("{table}.{}", error.key), error.value, &error.rule, &error.hint)
    }

    /// A key that other keys make necessary.
    fn missing(&self, table: &str, name: &str, hint: &str) -> SceneError {
        let key = format!("{table}.{name}");
        SceneError::Missing { place: self.source.place(&key), key, hint: hint.to_owned() }
    }

    pub(in crate::scene) fn require(
        &self,
        holds: bool,
        key: &str,
        value: impl Display,
        rule: &str,
        hint: &str,
    ) -> Result<(), SceneError> {
        if holds { Ok(()) } else { Err(self.error(key, value, rule, hint)) }
    }

    pub(in crate::scene) fn positive(&self, key: &str, value: f64, hint: &str) -> Result<f64, SceneError> {
        let holds = value.is_finite() && value > 0.0;
        self.require(holds, key, shown(value), "must be finite and greater than 0", hint)?;
        Ok(value)
    }

    fn vector(&self, key: &str, formulas: &VectorFormula, p: &Parameters) -> Result<[Expression; 2], SceneError> {
        self.pair(key, formulas, &p.symbols())
    }

    /// How messages about the formula under `key` begin while it is used.
    pub(in crate::scene) fn given(&self, key: &str) -> String {
        format!("{}: `{key}`: ", self.source.origin())
    }

    pub(in crate::scene) fn pair(
        &self,
        key: &str,
        formulas: &VectorFormula,
        symbols: &[(&str, f64)],
    ) -> Result<[Expression; 2], SceneError> {
        let given = self.given(key);
        let parsed = parse_vector(formulas, symbols).map(|pair| pair.map(|formula| formula.given_at(&given)));
        parsed.map_err(|error| {
            let error = ModelError::of_expression(key, &error);
            self.error(key, error.value, &error.rule, &error.hint)
        })
    }

    fn formula(&self, key: &str, formula: &Formula, p: &Parameters) -> Result<Expression, SceneError> {
        let parsed = formula.parse(&p.symbols()).map(|parsed| parsed.given_at(&self.given(key)));
        parsed.map_err(|error| {
            let error = ModelError::of_expression(key, &error);
            self.error(key, error.value, &error.rule, &error.hint)
        })
    }

    /// Makes a path of the scene absolute, so that the resolved scene can lie in another folder.
    fn existing_file(&self, key: &str, given: &str) -> Result<PathBuf, SceneError> {
        let path = self.source.folder().join(given);
        let hint = format!("paths start in the scene's folder; looked for {}", path.display());
        self.require(path.is_file(), key, format!("\"{given}\""), "there is no such file", &hint)?;
        std::path::absolute(&path).map_err(|error| self.error(key, given, &error.to_string(), &hint))
    }

    pub(in crate::scene) fn mesh(&self, mesh: &mut MeshScene) -> Result<(), SceneError> {
        let rule = "exactly one of `shape` and `file` is needed";
        let hint = "add shape = \"strip-with-disc\" or file = \"name.msh\"";
        match (mesh.shape(), &mesh.file) {
            (Some(_), None) => {
                *mesh = mesh.defaults_filled();
                Ok(())
            }
            (None, Some(name)) => {
                let path = self.existing_file("mesh.file", name)?;
                self.keys_beside_a_file(mesh)?;
                mesh.file = Some(path.to_string_lossy().into_owned());
                Ok(())
            }
            (None, None) => Err(self.error("mesh.shape", "(missing)", rule, hint)),
            (Some(_), Some(name)) => Err(self.error("mesh.file", format!("\"{name}\""), rule, "remove one of the two")),
        }
    }

    /// In a disc or a ring with slip walls all around nothing but friction holds a rigid rotation, which velocities
    /// have only in cells of at most their own degree.
    fn curved_where_it_turns<'a>(
        &self,
        mesh: &mut MeshScene,
        degree: usize,
        mut velocities: impl Iterator<Item = &'a NamedCondition>,
    ) {
        let round = mesh.track().is_some_and(|track| track.is_round());
        if round && mesh.get::<usize>("curved").is_none() && velocities.all(NamedCondition::lets_turn) {
            *mesh = std::mem::take(mesh).with("curved", degree.min(3));
        }
    }

    /// A mesh from a file takes `curved` and `slits`, and the place of the disc for measures and cuts; nothing else.
    fn keys_beside_a_file(&self, mesh: &MeshScene) -> Result<(), SceneError> {
        if let Some(key) = mesh.wrong_beside_file() {
            let hint = "beside `file`, only `curved`, `slits`, `radius` and `centre` (of the disc) have a meaning";
            return Err(self.error(&format!("mesh.{key}"), "(given)", "does not apply to a mesh from a file", hint));
        }
        self.positive("mesh.radius", mesh.radius(), "the radius of the disc, for measures and cuts")?;
        Ok(())
    }

    fn space(&self, table: &mut SpaceTable, kind: ModelKind) -> Result<Space, SceneError> {
        let k = table.k;
        let spaces = match kind {
            ModelKind::Incompressible => "velocity k+1, pressure k, polarity k+2; k = 1 is the usual choice",
            ModelKind::Compressible => "velocity k+1, density k, polarity k+1; k = 1 is the usual choice",
        };
        self.require((1..=3).contains(&k), "space.k", k, "must be 1, 2 or 3", spaces)?;
        let usual = Degrees::of(kind, k);
        let velocity = *table.degree.velocity.get_or_insert(usual.velocity);
        let least_velocity = match kind {
            ModelKind::Incompressible => 2,
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

    /// `ε_r`, whether slip is imposed by it or not.
    pub(super) fn penalty(&self, epsilon: f64) -> Result<f64, SceneError> {
        let rule = "must lie between 1e-16 and 0.01: above, tissue leaks through slip walls, below, no digit is left \
                    for the rest";
        self.within("space.penalty", epsilon, [1e-16, 0.01], rule, "1e-8 is the usual value")
    }

    /// A length of a body: its area and its moment of inertia stay within the range of numbers.
    fn length(&self, key: &str, value: f64, hint: &str) -> Result<f64, SceneError> {
        self.positive(key, value, hint)?;
        let rule = "must lie between 1e-9 and 1e9";
        self.within(key, value, [1e-9, 1e9], rule, "choose a unit in which lengths are near 1")
    }

    /// A value in a range, both ends included.
    fn within(&self, key: &str, value: f64, [low, high]: [f64; 2], rule: &str, hint: &str) -> Result<f64, SceneError> {
        self.require((low..=high).contains(&value), key, shown(value), rule, hint)?;
        Ok(value)
    }

    fn degree(&self, name: &str, degree: usize, least: usize) -> Result<(), SceneError> {
        let rule = format!("must lie between {least} and {MAX_DEGREE}");
        let bases = format!("bases exist for degrees up to {MAX_DEGREE}");
        let within = (least..=MAX_DEGREE).contains(&degree);
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

    fn boundary(
        &self,
        file: &mut SceneFile,
        p: &Parameters,
        sources: &Sources,
    ) -> Result<BTreeMap<String, Conditions>, SceneError> {
        let exact = sources.exact.as_deref();
        let mut checked = BTreeMap::new();
        for (tag, table) in &mut file.boundary {
            let conditions = table
                .check(p.kind(), &p.symbols(), exact)
                .map_err(|error| self.model(&format!("boundary.{}", quoted(tag)), error))?
                .given_at(&|key| self.given(&format!("boundary.{}.{key}", quoted(tag))));
            let from_exact = sources.boundary().is_some();
            let given = conditions.velocity.traction().is_some_and(|f| !f.iter().all(Expression::is_zero));
            let rule = "the traction is that of the exact fields, so none can be given";
            let hint = "write velocity = \"traction\", or set exact.boundary = \"scene\"";
            self.require(
                !(from_exact && given),
                &format!("boundary.{}.velocity", quoted(tag)),
                &table.velocity,
                rule,
                hint,
            )?;
            *table = table.resolved();
            checked.insert(tag.clone(), conditions);
        }
        let stress_only = checked.values().all(|c| c.velocity.traction().is_some());
        let rule = "without friction and with `traction` on every tag the velocity is undetermined";
        let hint = "give friction > 0, or a velocity condition on some tag";
        let determined = checked.is_empty() || p.friction > 0.0 || !stress_only;
        self.require(determined, "model.friction", p.friction, rule, hint)?;
        Ok(checked)
    }

    fn time(&self, file: &mut SceneFile, p: &Parameters) -> Result<Time, SceneError> {
        let table = &mut file.time;
        let step = self.positive("time.step", table.step, "the first and largest step, such as 0.1")?;
        let end = self.positive("time.end", table.end, "runs start at t = 0")?;
        self.step_counts(step, end)?;
        let step_min = self.step_min(step, table.step_min)?;
        table.step_min = Some(step_min.value());
        self.step_before_end(step, end)?;
        let none = "leave it out for no limit";
        self.require(table.max_steps != Some(0), "time.max_steps", 0, "must be at least 1", none)?;
        let grows = table.growth.is_finite() && table.growth >= 1.0;
        self.require(
            grows,
            "time.growth",
            table.growth,
            "must be finite and at least 1",
            "1 never lets the step grow",
        )?;
        self.positive("time.growth_wait", table.growth_wait, "50 is the usual value")?;
        let rate = table.growth_rate;
        self.require(rate.is_finite(), "time.growth_rate", rate, "must be finite", "0.55 is the usual value")?;
        let stop = &table.stop;
        let stop_residual = stop.residual.map(|value| self.positive("time.stop.residual", value, none)).transpose()?;
        let rate = stop.energy_rate.map(|value| self.positive("time.stop.energy_rate", value, none));
        let stop_energy_rate = rate.transpose()?;
        if let (Some(value), false) = (stop_energy_rate, p.has_free_energy()) {
            let rule = match p.kind() {
                ModelKind::Incompressible => {
                    "with elasticity = 0 the free energy is zero, so the run would end at once"
                }
                ModelKind::Compressible => {
                    "with elasticity = 0 and density.penalty = 0 the free energy is zero, so the run would end at once"
                }
            };
            return Err(self.error("time.stop.energy_rate", shown(value), rule, "use time.stop.residual"));
        }
        let (exact_start, given) = (table.start == TimeStart::Exact, file.exact.is_some());
        let hint = exact_hint(p.kind());
        self.require(!exact_start || given, "time.start", "\"exact\"", "the scene has no exact fields", hint)?;
        let alternate = table.alternate;
        let rule = "must lie between 1 and 5: beyond, a step takes a lower order";
        let hint = "1 keeps the steps equal; 2 makes every other step twice as long";
        self.require((1.0..=5.0).contains(&alternate), "time.alternate", alternate, rule, hint)?;
        let skipped = if exact_start { table.scheme.order() - 1 } else { 0 };
        let rule = format!("the exact start takes {skipped} steps, and no step is left to solve");
        let longest = 2.0 * alternate / (1.0 + alternate) * step;
        let left = skipped as f64 * longest < end && table.max_steps.is_none_or(|most| most > skipped);
        self.require(left, "time.start", "\"exact\"", &rule, "take shorter or more steps, or a lower order")?;
        let density_implicit = self.density_implicit(&mut table.density_scheme, p.kind())?;
        let (growth, growth_wait, growth_rate) = (table.growth, table.growth_wait, table.growth_rate);
        Ok(Time {
            order: table.scheme.order(),
            density_implicit,
            control: ControlSettings { step, step_min, growth, growth_wait, growth_rate },
            end,
            exact_start,
            alternate,
            max_steps: table.max_steps,
            stop_residual,
            stop_energy_rate,
            rests_from: 0.0,
        })
    }

    /// A step that the clock does not see at the end would never get there.
    pub(in crate::scene) fn step_counts(&self, step: f64, end: f64) -> Result<(), SceneError> {
        let holds = end + 0.5 * step > end;
        let hint = "numbers have 16 digits: raise `step` or lower `end`";
        if is_odder(end, step) {
            let rule = format!("makes time.step = {} be lost: t + step would be t", shown(step));
            return self.require(holds, "time.end", shown(end), &rule, hint);
        }
        let rule = format!("is lost beside time.end = {}: t + step would be t", shown(end));
        self.require(holds, "time.step", shown(step), &rule, hint)
    }

    pub(in crate::scene) fn step_before_end(&self, step: f64, end: f64) -> Result<(), SceneError> {
        let hint = "lower `step` or raise `end`";
        if is_odder(end, step) {
            let rule = format!("must not be shorter than a step, time.step = {}", shown(step));
            return self.require(step <= end, "time.end", shown(end), &rule, hint);
        }
        let rule = format!("must not be longer than the run, time.end = {}", shown(end));
        self.require(step <= end, "time.step", shown(step), &rule, hint)
    }

    fn density_implicit(&self, scheme: &mut Option<DensityScheme>, kind: ModelKind) -> Result<bool, SceneError> {
        match (kind, *scheme) {
            (ModelKind::Incompressible, None) => Ok(false),
            (ModelKind::Incompressible, Some(_)) => {
                Err(self.error("time.density_scheme", "(given)", CONSTANT_DENSITY, WRONG_KIND))
            }
            (ModelKind::Compressible, _) => Ok(match scheme.get_or_insert_default() {
                DensityScheme::Abdf => false,
                DensityScheme::Bdf => true,
            }),
        }
    }

    fn steady(
        &self,
        file: &mut SceneFile,
        boundary: &BTreeMap<String, Conditions>,
        sources: &Sources,
    ) -> Result<Option<SteadySettings>, SceneError> {
        let end = file.time.end;
        let Some(table) = &mut file.steady else { return Ok(None) };
        let residual = self.positive("steady.residual", table.residual, "1e-9 is the usual value")?;
        let step =
            self.positive("steady.step", table.step, "in units of time; 1 is usual, smaller for rough starts")?;
        let (most, count) = (table.max_steps, table.eigenvalues);
        self.require(most >= 1, "steady.max_steps", most, "must be at least 1", "300 is usual")?;
        self.require(count <= 60, "steady.eigenvalues", count, "must be at most 60", "6 is usual, 0 finds none")?;
        let march = *table.march.get_or_insert(end);
        let holds = march.is_finite() && march >= 0.0;
        self.require(holds, "steady.march", shown(march), "must be finite and not negative", "time.end is usual")?;
        self.without_time(boundary, sources)?;
        let want = table.want;
        Ok(Some(SteadySettings { residual, step, max_steps: most, want, eigenvalues: count, march }))
    }

    fn coupling(&self, file: &mut SceneFile) -> Result<CouplingSettings, SceneError> {
        let table = &mut file.coupling;
        let tolerance = self.positive("coupling.tolerance", table.tolerance, "1e-8 is the usual value")?;
        self.require(tolerance < 1.0, "coupling.tolerance", tolerance, "must be less than 1", "1e-8 is usual")?;
        let accept = *table.accept.get_or_insert(tolerance.sqrt());
        let (low, high) = (shown(tolerance), shown(table.diverged));
        let rule = format!("must lie between the tolerance {low} and `diverged` = {high}");
        let ordered = tolerance <= accept && accept < table.diverged && table.diverged.is_finite();
        self.require(ordered, "coupling.accept", shown(accept), &rule, "without it, sqrt(tolerance) is taken")?;
        let (most, depth) = (table.max_iterations, table.depth);
        self.require(most >= 1, "coupling.max_iterations", most, "must be at least 1", "100 is usual")?;
        self.require((1..=100).contains(&depth), "coupling.depth", depth, "must lie in 1..100", "10 is usual")?;
        let kind = match table.kind {
            CouplingName::FixedPoint => CouplingKind::FixedPoint,
            CouplingName::Anderson => CouplingKind::Anderson { depth },
            CouplingName::Newton => CouplingKind::Newton,
        };
        Ok(CouplingSettings { kind, tolerance, accept, diverged: table.diverged, max_iterations: most })
    }
}
