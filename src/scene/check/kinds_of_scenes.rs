//! The rules of scenes that are no tissue, and of keys that belong to another kind.

use std::collections::BTreeMap;

use toml_edit::Item;

use super::amounts::Course;
use super::bodies::{Around, NO_BODIES};
use super::outputs::Scope;
use super::passages::Side;
use super::{Checker, shown};
use crate::body::leaving::Passage;
use crate::expression::Expression;
use crate::model::{Conditions, Fluid, ModelError, ModelKind, Parameters, Sources};
use crate::scene::SceneSource;
use crate::scene::bodies::tables::BodyTables;
use crate::scene::error::SceneError;
use crate::scene::kinds::particles::{Dynamics, MotionTime, MotionTimeTable, ParticlesFile, ParticlesScene};
use crate::scene::kinds::stokes::{StokesFile, StokesScene};
use crate::scene::kinds::{self, SceneKind};
use crate::scene::path::quoted;
use crate::scene::tables::{DegreeTable, SceneFile, SpaceTable};
use crate::schema::Range;
use crate::scheme::adaptive::{SmallestStep, StepBounds};

impl Checker<'_> {
    /// Refuses keys that only scenes of other kinds have; a key that no scene has is left to the tables.
    pub(in crate::scene) fn keys_of_kind(&self) -> Result<(), SceneError> {
        let kind = self.source.kind();
        for (at, (table, own)) in kind.keys.tables().into_iter().enumerate() {
            let names: Vec<String> = match table {
                "" => self.source.names(),
                table => {
                    let table = self.source.value(table).and_then(Item::as_table_like);
                    table.map(|table| table.iter().map(|(name, _)| name.to_owned()).collect()).unwrap_or_default()
                }
            };
            // a whole table that does not belong is told by its name
            if own.is_empty() && !(kind.keys.top)().contains(&table) {
                continue;
            }
            let owners = |name: &str| -> Vec<&str> {
                let has = |other: &&&SceneKind| other.keys.tables()[at].1.contains(&name);
                kinds::ALL.iter().filter(has).map(|other| other.shown).collect()
            };
            let foreign = |name: &&String| !own.contains(&name.as_str()) && !owners(name).is_empty();
            if let Some(name) = names.iter().find(foreign) {
                let key = if table.is_empty() { name.clone() } else { format!("{table}.{name}") };
                let rule = format!("{} has no such key; it belongs to {}", kind.shown, owners(name).join(" and "));
                let hint = format!("remove it; the keys that exist there are {}", own.join(", "));
                return Err(self.error(&key, "(given)", &rule, &hint));
            }
        }
        Ok(())
    }

    /// The smallest step, given or not.
    pub(in crate::scene) fn step_min(&self, step: f64, given: Option<f64>) -> Result<SmallestStep, SceneError> {
        let Some(step_min) = given else {
            let step_min = SmallestStep::of(step);
            let rule = "is so small that a millionth of it, the smallest step, is 0";
            self.require(step_min.value() > 0.0, "time.step", shown(step), rule, "such as 0.01")?;
            return Ok(step_min);
        };
        self.positive("time.step_min", step_min, "without it, a millionth of `step` is taken")?;
        let rule = format!("must not be below time.step_min = {}", shown(step_min));
        self.require(step >= step_min, "time.step", shown(step), &rule, "raise `step` or lower `step_min`")?;
        Ok(SmallestStep::Given(step_min))
    }

    fn motion_time(&self, table: &mut MotionTimeTable) -> Result<MotionTime, SceneError> {
        let step = self.positive("time.step", table.step, "the time step, such as 0.01")?;
        let end = self.positive("time.end", table.end, "runs start at t = 0")?;
        self.step_before_end(step, end)?;
        self.step_counts(step, end)?;
        let step_min = self.step_min(step, table.step_min)?;
        let tolerance = *table.tolerance.get_or_insert(MotionTimeTable::USUAL_TOLERANCE);
        let holds = MotionTimeTable::TOLERANCE.has(tolerance);
        let hint = "1e-3 of a body's size is the usual value; smaller ones make shorter steps where forces vary with \
            the place";
        self.require(holds, "time.tolerance", tolerance, "must be greater than 0 and at most 1", hint)?;
        self.most_steps(table.max_steps)?;
        Ok(MotionTime { bounds: StepBounds { step, step_min }, end, tolerance, max_steps: table.max_steps })
    }
}

/// As [`super::check`] for particles.
pub(in crate::scene) fn particles(source: SceneSource) -> Result<ParticlesScene, SceneError> {
    let checker = Checker { source: &source };
    checker.of_kind(&kinds::particles::KIND)?;
    checker.keys_of_kind()?;
    let mut file = source.tables::<ParticlesFile>().map_err(|found| found.1)?;
    let drag = file.model.drag;
    let hint = "force −drag·m·V, torque −drag·I·ω; 0 is none";
    let holds = Range::NOT_NEGATIVE.has(drag);
    checker.require(holds, "model.drag", shown(drag), "must be finite and not negative", hint)?;
    let dynamics = file.model.dynamics;
    let rule = "without inertia a body moves as its drag lets it, so there must be some";
    let determined = dynamics == Dynamics::Inertial || drag > 0.0;
    checker.require(determined, "model.drag", shown(drag), rule, "give `drag > 0`, or take dynamics = \"inertial\"")?;
    let symbols = [("drag", drag)];
    let gravity = checker.pair("model.gravity", &file.model.gravity, &symbols)?;
    let alone = gravity.iter().all(Expression::depends_on_time_alone);
    let (rule, hint) = ("must be formulas of t alone", "`force` of a body may depend on x, y, theta");
    checker.require(alone, "model.gravity", "(formulas)", rule, hint)?;
    let around = Around::Nothing { inertia: dynamics == Dynamics::Inertial };
    let mut tables = BodyTables {
        rigid: None,
        body: std::mem::take(&mut file.body),
        bodies: std::mem::take(&mut file.bodies),
        wall: std::mem::take(&mut file.wall),
        contact: file.contact.take(),
    };
    let bodies = checker.bodies(&mut tables, around, &symbols, &mut [])?;
    let hint = "add [[body]] with `shape` and `position`, or [[bodies]] with `count`, `radius` and `box`";
    let missing = || SceneError::Missing { place: source.place("body"), key: "body".to_owned(), hint: hint.to_owned() };
    let bodies = bodies.ok_or_else(missing)?;
    BodyTables { body: file.body, bodies: file.bodies, wall: file.wall, contact: file.contact, .. } = tables;
    let time = checker.motion_time(&mut file.time)?;
    let scope = Scope { tissue: None, kind: &kinds::particles::KIND, bodies: &bodies.bodies, boundary: None };
    let outputs = checker.outputs(&file.output, scope)?;
    let course = Course { step: time.bounds.step, end: time.end, max_steps: time.max_steps };
    checker.amounts(&outputs, course)?;
    let title = file.title.clone();
    Ok(ParticlesScene { title, dynamics, gravity, drag, bodies, time, outputs, resolved: file, source })
}

/// As [`super::check`] for a Stokes flow.
pub(in crate::scene) fn stokes(source: SceneSource) -> Result<StokesScene, SceneError> {
    let checker = Checker { source: &source };
    checker.of_kind(&kinds::stokes::KIND)?;
    checker.keys_of_kind()?;
    let mut file = source.tables::<StokesFile>().map_err(|found| found.1)?;
    let friction = file.model.friction;
    let holds = Range::NOT_NEGATIVE.has(friction);
    let hint = "friction of the fluid with the substrate; 0 is none";
    checker.require(holds, "model.friction", shown(friction), "must be finite and not negative", hint)?;
    let sound = friction == 0.0 || (1e-40..=1e40).contains(&friction);
    let rule = "its size must lie between 1e-40 and 1e40, or be 0";
    checker.require(sound, "model.friction", shown(friction), rule, "choose units in which lengths are near 1")?;
    let symbols = [("friction", friction)];
    let table = &file.space;
    let mut space =
        SpaceTable { k: table.k, degree: DegreeTable::default(), walls: table.walls, penalty: table.penalty };
    let space = checker.space(&mut space, ModelKind::Incompressible)?;
    checker.curved_where_it_turns(&mut file.mesh, space.velocity, file.boundary.values().map(|table| &table.velocity));
    checker.mesh(&mut file.mesh)?;
    let sources = checker.sources_of_flow(&file, &symbols)?;
    let boundary = checker.flow_boundary(&mut file, &symbols, &sources)?;
    let mut tables = BodyTables {
        rigid: file.rigid.take(),
        body: std::mem::take(&mut file.body),
        bodies: std::mem::take(&mut file.bodies),
        wall: std::mem::take(&mut file.wall),
        contact: file.contact.take(),
    };
    let said = file.boundary.iter_mut().map(|(tag, table)| (tag, &mut table.bodies));
    let bodies = checker.bodies(&mut tables, Around::Flow, &symbols, &mut sides(said, &boundary))?;
    BodyTables { rigid: file.rigid, body: file.body, bodies: file.bodies, wall: file.wall, contact: file.contact } =
        tables;
    let time = checker.motion_time(&mut file.time)?;
    let (kind, listed) = (&kinds::stokes::KIND, bodies.as_ref().map_or(&[][..], |bodies| &bodies.bodies));
    let scope = Scope { tissue: None, kind, bodies: listed, boundary: Some(&boundary) };
    let outputs = checker.outputs(&file.output, scope)?;
    let course = Course { step: time.bounds.step, end: time.end, max_steps: time.max_steps };
    checker.amounts(&outputs, course)?;
    let (title, mesh) = (file.title.clone(), file.mesh.clone());
    Ok(StokesScene {
        title,
        fluid: Fluid { friction },
        mesh,
        degrees: [space.velocity, space.pressure],
        slip: space.slip,
        boundary,
        sources,
        bodies,
        time,
        outputs,
        resolved: file,
        source,
    })
}

/// The parts of a boundary, as bodies meet them.
fn sides<'a>(
    said: impl Iterator<Item = (&'a String, &'a mut Option<Passage>)>,
    boundary: &'a BTreeMap<String, Conditions>,
) -> Vec<Side<'a>> {
    said.map(|(tag, given)| Side { tag, given, flow: &boundary[tag].velocity }).collect()
}

impl Checker<'_> {
    /// Refuses scenes of another kind, and kinds that do not exist.
    pub(in crate::scene) fn of_kind(&self, kind: &'static SceneKind) -> Result<(), SceneError> {
        let found = self.source.kind();
        if found == kind {
            return Ok(());
        }
        let rule = format!("this needs {}, and the scene is of {}", kind.shown, found.shown);
        let hint = match *kind == kinds::TISSUE {
            true => {
                "`run`, `check` and `study` take scenes of every kind, `order` those of tissue and of Stokes flows; \
                 trade-offs, branches, comparisons, steady states and estimates are those of tissue"
            }
            false => "take the scene of another kind",
        };
        let value = self.source.value("model").and_then(|model| model.get("kind")).map(|kind| kind.to_string());
        Err(self.error("model.kind", value.unwrap_or_default().trim(), &rule, hint))
    }

    fn flow_boundary(
        &self,
        file: &mut StokesFile,
        symbols: &[(&str, f64)],
        sources: &Sources,
    ) -> Result<BTreeMap<String, Conditions>, SceneError> {
        let mut checked = BTreeMap::new();
        for (tag, table) in &mut file.boundary {
            let velocity = table
                .velocity
                .of_velocity(symbols, sources.exact.as_deref())
                .map_err(|error: ModelError| self.model(&format!("boundary.{}", quoted(tag)), error))?;
            let conditions =
                Conditions::new(velocity).given_at(&|key| self.given(&format!("boundary.{}.{key}", quoted(tag))));
            self.no_traction_beside_exact(tag, &table.velocity, &conditions, sources)?;
            table.velocity = table.velocity.resolved();
            checked.insert(tag.clone(), conditions);
        }
        self.determined(&checked, file.model.friction)?;
        Ok(checked)
    }

    /// The bodies of a tissue, which only an incompressible one carries.
    pub(super) fn bodies_of_tissue(
        &self,
        file: &mut SceneFile,
        parameters: &Parameters,
        boundary: &BTreeMap<String, Conditions>,
    ) -> Result<Option<crate::scene::bodies::Bodies>, SceneError> {
        let mut tables = BodyTables {
            rigid: file.rigid.take(),
            body: std::mem::take(&mut file.body),
            bodies: std::mem::take(&mut file.bodies),
            wall: std::mem::take(&mut file.wall),
            contact: file.contact.take(),
        };
        let mut sides = sides(file.boundary.iter_mut().map(|(tag, table)| (tag, &mut table.bodies)), boundary);
        let bodies = match parameters.kind() {
            ModelKind::Incompressible => self.bodies(&mut tables, Around::Flow, &parameters.symbols(), &mut sides)?,
            ModelKind::Compressible => {
                self.no_bodies(&tables)?;
                self.no_passage(&sides, NO_BODIES, "remove it, or take kind = \"incompressible\" or \"stokes\"")?;
                None
            }
        };
        BodyTables {
            rigid: file.rigid,
            body: file.body,
            bodies: file.bodies,
            wall: file.wall,
            contact: file.contact,
        } = tables;
        Ok(bodies)
    }
}
