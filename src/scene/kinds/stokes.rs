//! `kind = "stokes"`: a Stokes flow with friction, and the rigid bodies that it carries.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::particles::{MotionTime, MotionTimeTable};
use super::{Keys, SceneKind};
use crate::body::leaving::Passage;
use crate::expression::{Formula, VectorFormula};
use crate::mesh::Mesh;
use crate::mesh::generate::MeshScene;
use crate::model::boundary::{NamedCondition, PASSAGE, velocity_schema};
use crate::model::fields::{PRESSURE, VELOCITY};
use crate::model::momentum::SlipTreatment;
use crate::model::{Conditions, Fluid, Sources, TermStatus};
use crate::names;
use crate::scene::bodies::Bodies;
use crate::scene::bodies::tables::{BodiesTable, BodyTable, ContactTable, RigidTable, WallTable};
use crate::scene::error::{Place, SceneError};
use crate::scene::output::{Output, OutputTable};
use crate::scene::path::quoted;
use crate::scene::resolve;
use crate::scene::source::SceneSource;
use crate::scene::tables::{ExactBoundary, SpaceTable, WallsName};
use crate::scene::tell_of_zero_mean;
use crate::schema::{self, Range, fields};

/// Its row.
pub static KIND: SceneKind = SceneKind {
    names: &["stokes"],
    shown: "a Stokes flow (kind = \"stokes\")",
    keys: Keys {
        top: fields::<StokesFile>,
        model: fields::<StokesModel>,
        time: fields::<MotionTimeTable>,
        space: fields::<StokesSpace>,
    },
    fields: &[VELOCITY, PRESSURE],
    set: SceneSource::set_in::<StokesFile>,
    said: schema::of::<StokesFile>,
};

/// A Stokes flow, checked as far as possible without its mesh.
#[derive(Debug, Clone)]
pub struct StokesScene {
    /// One line for reports.
    pub title: Option<String>,
    /// What flows.
    pub fluid: Fluid,
    /// `mesh.file` is absolute.
    pub mesh: MeshScene,
    /// Degrees of velocity and pressure, `k + 1` and `k`.
    pub degrees: [usize; 2],
    /// How `v·n = 0` is imposed.
    pub slip: SlipTreatment,
    /// By boundary tag; only the velocity has a meaning.
    pub boundary: BTreeMap<String, Conditions>,
    /// `f_v`, given or that of exact fields.
    pub sources: Sources,
    /// The bodies that it carries, and their contact.
    pub bodies: Option<Bodies>,
    /// Steps and end.
    pub time: MotionTime,
    /// What is written, and when.
    pub outputs: Vec<Output>,
    pub(in crate::scene) resolved: StokesFile,
    pub(in crate::scene) source: SceneSource,
}

/// A Stokes flow with friction, and the rigid bodies that it carries.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct StokesFile {
    /// One line for reports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Equations and their parameters.
    pub model: StokesModel,
    /// Domain and mesh.
    pub mesh: MeshScene,
    /// Polynomial degrees, and how slip walls are imposed.
    #[serde(default)]
    pub space: StokesSpace,
    /// Conditions by boundary tag, for every tag of the mesh.
    #[serde(default)]
    pub boundary: BTreeMap<String, StokesBoundary>,
    /// Forces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<StokesSource>,
    /// Fields that solve the equations with the force that follows from them; not with bodies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact: Option<StokesExact>,
    /// How the flow carries rigid bodies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rigid: Option<RigidTable>,
    /// Rigid bodies, one by one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub body: Vec<BodyTable>,
    /// Discs by the dozen.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<BodiesTable>,
    /// What bodies keep apart from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wall: Vec<WallTable>,
    /// How bodies keep apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactTable>,
    /// Steps and end.
    pub time: MotionTimeTable,
    /// What is written, and when.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub output: Vec<OutputTable>,
}

/// `[model]` of a Stokes flow, whose viscosity is 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct StokesModel {
    /// A Stokes flow of viscosity 1.
    #[schemars(extend("const" = "stokes"))]
    pub kind: String,
    /// Friction with the substrate, `C_F`.
    #[serde(default)]
    #[schemars(transform = Range::NOT_NEGATIVE.said())]
    pub friction: f64,
}

/// `[space]` of a Stokes flow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct StokesSpace {
    /// Velocity P(k+1), pressure P(k).
    #[schemars(transform = SpaceTable::K.said())]
    pub k: usize,
    /// How `v·n = 0` is imposed on slip walls.
    pub walls: WallsName,
    /// `ε_r` [10.3], for `walls = "penalty"`, in units of the root of the domain's area.
    #[schemars(transform = SpaceTable::PENALTY.said())]
    pub penalty: f64,
}

impl Default for StokesSpace {
    fn default() -> Self {
        Self { k: 1, walls: WallsName::Rotated, penalty: 1e-8 }
    }
}

/// `[boundary.TAG]` of a Stokes flow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct StokesBoundary {
    /// What holds for the velocity.
    #[schemars(schema_with = "velocity_schema")]
    pub velocity: NamedCondition,
    /// What rigid bodies meet here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = PASSAGE))]
    pub bodies: Option<Passage>,
}

/// `[source]` of a Stokes flow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct StokesSource {
    /// `f_v`, the force on the flow.
    pub force: VectorFormula,
}

/// `[exact]` of a Stokes flow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct StokesExact {
    /// `v`, with `div v = 0`.
    pub velocity: VectorFormula,
    /// `Π`.
    pub pressure: Formula,
    /// Whose data natural boundary conditions have.
    #[serde(default)]
    pub boundary: ExactBoundary,
}

impl StokesScene {
    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// Whatever is wrong with it, see [`SceneError`].
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        Self::check(SceneSource::read(path)?)
    }

    /// Checks a text; `origin` is its file, for messages and relative paths.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, origin: &Path) -> Result<Self, SceneError> {
        Self::check(SceneSource::parse(text, origin)?)
    }

    /// Checks a scene with its overrides: every rule that does not need the mesh.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn check(source: SceneSource) -> Result<Self, SceneError> {
        crate::scene::check::stokes(source)
    }

    /// The text that the scene was checked from, for further overrides.
    pub fn source(&self) -> &SceneSource {
        &self.source
    }

    /// The scene as TOML with every default and override filled in; it parses back to the same scene.
    pub fn resolved_toml(&self) -> String {
        resolve::to_toml(&self.resolved)
    }

    /// Compares boundary conditions, walls and bodies with the mesh: each tag has a condition, each condition a tag,
    /// each body has its place.
    ///
    /// # Errors
    /// The first of them that does not fit.
    pub fn check_mesh(&self, mesh: &Mesh) -> Result<(), SceneError> {
        check_tags(&self.source, self.boundary.keys(), &mesh.tags)?;
        self.bodies.as_ref().map_or(Ok(()), |bodies| bodies.check_mesh(&self.source, mesh))
    }

    /// The scene with conditions on other tags, for counting: those that it does not know take the ones that it does,
    /// in turn.
    pub fn on(&self, tags: &[String]) -> StokesScene {
        StokesScene { boundary: conditions_on(&self.boundary, tags), ..self.clone() }
    }

    /// The conditions in the order of the mesh's tags.
    pub fn conditions(&self, mesh: &Mesh) -> Vec<Conditions> {
        mesh.tags.iter().map(|tag| self.boundary[tag].clone()).collect()
    }

    /// The terms of the flow, on and off.
    pub fn terms(&self) -> Vec<TermStatus> {
        let mut terms = self.fluid.terms();
        if self.pressure_is_free() {
            tell_of_zero_mean(&mut terms);
        }
        terms.extend(self.sources.terms(&self.fluid));
        terms
    }

    /// Whether the pressure takes zero mean: no tag prescribes a normal stress.
    pub fn pressure_is_free(&self) -> bool {
        !self.boundary.values().any(|c| c.velocity.fixes_pressure())
    }
}

/// Conditions on these tags: those that are unknown take the known ones in turn.
pub(in crate::scene) fn conditions_on(
    boundary: &BTreeMap<String, Conditions>,
    tags: &[String],
) -> BTreeMap<String, Conditions> {
    let known: Vec<&Conditions> = boundary.values().collect();
    let of = |(at, tag): (usize, &String)| {
        let conditions = boundary.get(tag).or_else(|| known.get(at % known.len().max(1)).copied());
        conditions.map(|conditions| (tag.clone(), conditions.clone()))
    };
    tags.iter().enumerate().filter_map(of).collect()
}

/// Compares boundary conditions with the tags of the mesh: each tag has one, each one has a tag.
///
/// # Errors
/// The first condition without a tag, else the first tag without a condition.
pub(in crate::scene) fn check_tags<'a>(
    source: &SceneSource,
    given: impl Iterator<Item = &'a String> + Clone,
    tags: &[String],
) -> Result<(), SceneError> {
    if let Some(tag) = given.clone().find(|tag| !tags.contains(tag)) {
        let raw: Vec<&str> = tags.iter().map(String::as_str).collect();
        let nearest = names::nearest(tag, &raw);
        let suggestion = nearest.map_or(String::new(), |found| format!(" (did you mean `{}`?)", quoted(found)));
        let known: Vec<String> = tags.iter().map(|tag| quoted(tag)).collect();
        let place: Box<Place> = source.place(&format!("boundary.{}", quoted(tag)));
        return Err(SceneError::UnknownTag { place, tag: tag.clone(), suggestion, known: known.join(", ") });
    }
    let file = source.origin().to_owned();
    let bare = tags.iter().find(|tag| !given.clone().any(|other| other == *tag));
    bare.map_or(Ok(()), |tag| Err(SceneError::TagWithoutCondition { file, tag: tag.clone() }))
}
