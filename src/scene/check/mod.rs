//! Every rule of a scene that does not need its mesh.

mod amounts;
mod bodies;
mod fields;
mod groups;
mod kinds_of_scenes;
mod maps;
mod outputs;
mod passages;
mod rest;
mod space;
mod strain;
mod time;
mod walls;

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::PathBuf;

use super::error::SceneError;
use super::kinds;
use super::path::quoted;
use super::presets;
use super::tables::SceneFile;
use super::{Scene, SceneSource, Sources};
use crate::expression::{Expression, Formula, VectorFormula, parse_vector};
use crate::measure::OutputField;
use crate::mesh::generate::MeshScene;
use crate::model::boundary::NamedCondition;
use crate::model::fields::DENSITY;
use crate::model::{Conditions, ModelError, ModelKind, Parameters};
use crate::schema::Range;
use crate::shape::LENGTHS;
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
    let mut parameters = file.model.check().map_err(|error| checker.model("model", error))?;
    file.model = file.model.resolved().map_err(|error| checker.model("model", error))?;
    parameters.form = checker.polarity_form(&mut file, &parameters)?;
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
    let bodies = checker.bodies_of_tissue(&mut file, &parameters, &boundary)?;
    let (kind, listed) = (&kinds::TISSUE, bodies.as_ref().map_or(&[][..], |bodies| &bodies.bodies));
    let scope = Scope { tissue: Some(&parameters), kind, bodies: listed, boundary: Some(&boundary) };
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

/// What to do about a key that only the other kind of sheet has.
const WRONG_KIND: &str = "remove it, or take kind = \"compressible\"";
/// Why an incompressible sheet has no such key.
const CONSTANT_DENSITY: &str = "the density of an incompressible sheet is 1 everywhere";

/// Why a tissue of these parameters does not have an output field, and what to do.
fn broken_by(field: &OutputField, p: &Parameters) -> Option<(&'static str, &'static str)> {
    if field.needs.contains(&DENSITY) && p.kind() == ModelKind::Incompressible {
        return Some((CONSTANT_DENSITY, WRONG_KIND));
    }
    field.broken_by(p).map(|rule| (rule.rule, rule.hint))
}

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
        self.require(Range::POSITIVE.has(value), key, shown(value), "must be finite and greater than 0", hint)?;
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

    fn formula(&self, key: &str, formula: &Formula, symbols: &[(&str, f64)]) -> Result<Expression, SceneError> {
        let parsed = formula.parse(symbols).map(|parsed| parsed.given_at(&self.given(key)));
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

    /// A length of a body: its area and its moment of inertia stay within the range of numbers.
    fn length(&self, key: &str, value: f64, hint: &str) -> Result<f64, SceneError> {
        self.positive(key, value, hint)?;
        let rule = "must lie between 1e-9 and 1e9";
        self.within(key, value, LENGTHS, rule, "choose a unit in which lengths are near 1")
    }

    /// A value in a range.
    fn within(&self, key: &str, value: f64, range: Range, rule: &str, hint: &str) -> Result<f64, SceneError> {
        self.require(range.has(value), key, shown(value), rule, hint)?;
        Ok(value)
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
            self.no_traction_beside_exact(tag, &table.velocity, &conditions, sources)?;
            *table = table.resolved();
            checked.insert(tag.clone(), conditions);
        }
        self.determined(&checked, p.friction)?;
        Ok(checked)
    }

    /// Refuses a traction that the exact fields give already.
    fn no_traction_beside_exact(
        &self,
        tag: &str,
        shown: &NamedCondition,
        conditions: &Conditions,
        sources: &Sources,
    ) -> Result<(), SceneError> {
        let given = conditions.velocity.traction().is_some_and(|f| !f.iter().all(Expression::is_zero));
        let rule = "the traction is that of the exact fields, so none can be given";
        let hint = "write velocity = \"traction\", or set exact.boundary = \"scene\"";
        let twice = sources.boundary().is_some() && given;
        self.require(!twice, &format!("boundary.{}.velocity", quoted(tag)), shown, rule, hint)
    }

    /// Something must hold a flow.
    fn determined(&self, checked: &BTreeMap<String, Conditions>, friction: f64) -> Result<(), SceneError> {
        let stress_only = checked.values().all(|c| c.velocity.traction().is_some());
        let rule = "without friction and with `traction` on every tag the velocity is undetermined";
        let hint = "give friction > 0, or a velocity condition on some tag";
        let determined = checked.is_empty() || friction > 0.0 || !stress_only;
        self.require(determined, "model.friction", friction, rule, hint)
    }
}
