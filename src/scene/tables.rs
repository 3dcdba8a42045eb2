//! The tables of a scene file. What depends on no other key is filled in by serde, so that writing a table back shows
//! every default.

mod solving;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::bodies::tables::{BodiesTable, BodyTable, ContactTable, RigidTable, WallTable};
use super::output::OutputTable;
use super::start::InitialTable;
use crate::element::MAX_DEGREE;
use crate::expression::{Formula, VectorFormula};
use crate::mesh::generate::MeshScene;
use crate::model::boundary::BoundaryScene;
use crate::model::parameters::ModelScene;
use crate::schema::{self, Range};
use crate::scheme::ControlSettings;

pub use solving::{CouplingName, CouplingTable, SteadyTable, StrainTable};

/// A scene of tissue: one computation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct SceneFile {
    /// One line for reports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Preset that fills in what the scene leaves out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<super::presets::Accuracy>,
    /// Equations and their parameters.
    pub model: ModelScene,
    /// Domain and mesh.
    pub mesh: MeshScene,
    /// Polynomial degrees, and how slip walls are imposed.
    #[serde(default)]
    pub space: SpaceTable,
    /// Conditions by boundary tag, for every tag of the mesh.
    #[serde(default)]
    pub boundary: BTreeMap<String, BoundaryScene>,
    /// What a run starts from.
    pub initial: InitialTable,
    /// Forces and sources.
    #[serde(default, skip_serializing_if = "SourceTable::is_empty")]
    pub source: SourceTable,
    /// Fields that solve the equations with the sources that follow from them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact: Option<ExactTable>,
    /// Time scheme, steps and endings.
    pub time: TimeTable,
    /// A steady state is searched for instead of marching in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steady: Option<SteadyTable>,
    /// How velocity and polarity are made to agree within a step.
    #[serde(default)]
    pub coupling: CouplingTable,
    /// The elastic strain that the flow carries.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strain: Option<StrainTable>,
    /// How the tissue carries rigid bodies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "incompressible"))]
    pub rigid: Option<RigidTable>,
    /// Rigid bodies, one by one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("x-kinds" = "incompressible"))]
    pub body: Vec<BodyTable>,
    /// Discs by the dozen.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("x-kinds" = "incompressible"))]
    pub bodies: Vec<BodiesTable>,
    /// What bodies keep apart from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("x-kinds" = "incompressible"))]
    pub wall: Vec<WallTable>,
    /// How bodies keep apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "incompressible"))]
    pub contact: Option<ContactTable>,
    /// What is written, and when.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub output: Vec<OutputTable>,
}

/// `[space]`: polynomial degrees, and how `v·n = 0` is imposed on slip walls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct SpaceTable {
    /// Velocity P(k+1), pressure P(k), polarity discontinuous P(k+2); compressible: velocity P(k+1), density and
    /// polarity discontinuous P(k), P(k+1).
    #[schemars(transform = SpaceTable::K.said())]
    pub k: usize,
    /// Single degrees in place of those that `k` gives.
    pub degree: DegreeTable,
    /// How `v·n = 0` is imposed on slip walls.
    pub walls: WallsName,
    /// `ε_r` [10.3], for `walls = "penalty"`, in units of the root of the domain's area.
    #[schemars(transform = SpaceTable::PENALTY.said())]
    pub penalty: f64,
}

impl SpaceTable {
    pub const K: Range = Range::within(1.0, 3.0);
    /// Above, tissue leaks through slip walls; below, no digit is left for the rest.
    pub const PENALTY: Range = Range::within(1e-16, 0.01);
}

impl Default for SpaceTable {
    fn default() -> Self {
        Self { k: 1, degree: DegreeTable::default(), walls: WallsName::Rotated, penalty: 1e-8 }
    }
}

/// `space.degree`
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct DegreeTable {
    /// Of the velocity; in an incompressible sheet at least 2.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = DegreeTable::ANY.said(), extend("x-default" = "by `k`"))]
    #[schemars(extend("x-incompressible" = { "minimum": DegreeTable::LEAST_VELOCITY }))]
    pub velocity: Option<usize>,
    /// Of the pressure.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::SOME.said())]
    #[schemars(extend("x-default" = "by `k`", "x-rule" = "less than the velocity's", "x-kinds" = "incompressible"))]
    pub pressure: Option<usize>,
    /// Of the density.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = DegreeTable::ANY.said(), extend("x-default" = "by `k`", "x-kinds" = "compressible"))]
    pub density: Option<usize>,
    /// Of the polarity.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = DegreeTable::ANY.said(), extend("x-default" = "by `k`"))]
    pub polarity: Option<usize>,
}

impl DegreeTable {
    /// Degrees for which there are bases.
    pub const ANY: Range = Range::within(1.0, MAX_DEGREE as f64);
    /// Of an incompressible sheet, whose pressure has a lower degree.
    pub const LEAST_VELOCITY: usize = 2;
}

/// How `v·n = 0` is imposed on curved boundaries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WallsName {
    /// At every node, in directions along and across the wall.
    Rotated,
    /// By a penalty.
    Penalty,
}

/// `[source]`: manufactured sources, zero in a physical scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct SourceTable {
    /// `f_v`, the force on the flow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<[Formula; 2]>,
    /// `f_p`, the source of the polarity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polarity: Option<[Formula; 2]>,
    /// `f_ρ`, the source of the density.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "compressible"))]
    pub density: Option<Formula>,
}

impl SourceTable {
    fn is_empty(&self) -> bool {
        self.force.is_none() && self.polarity.is_none() && self.density.is_none()
    }
}

/// `[exact]`: fields that solve the equations with the sources that follow from them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct ExactTable {
    /// `v`, in an incompressible sheet with `div v = 0`.
    pub velocity: VectorFormula,
    /// `Π`, needed there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "incompressible"))]
    pub pressure: Option<Formula>,
    /// `ρ`, needed there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "compressible", "x-rule" = "≥ 0"))]
    pub density: Option<Formula>,
    /// `p`.
    pub polarity: VectorFormula,
    /// Whose data natural boundary conditions have.
    #[serde(default)]
    pub boundary: ExactBoundary,
}

/// `exact.boundary`
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ExactBoundary {
    /// `n·σ` (on slip its tangential part) and, in a tissue, `∂p/∂n` are those of the exact fields.
    #[default]
    Exact,
    /// They are what the scene says: zero, or the given traction.
    Scene,
}

/// `[time]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct TimeTable {
    /// BDF of order 1 to 6 on the polarity.
    pub scheme: Scheme,
    /// How the density is marched, see below.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "compressible", "default" = DensityScheme::default()))]
    pub density_scheme: Option<DensityScheme>,
    /// First and largest step, `Δt_0`.
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "time", "x-rule" = "at most `end`"))]
    pub step: f64,
    /// The run fails when halving takes `Δt` below this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::POSITIVE.said())]
    #[schemars(extend("x-unit" = "time", "x-rule" = "at most `step`", "x-default" = "1e-6 `step`"))]
    pub step_min: Option<f64>,
    /// End time; runs start at `t = 0`.
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "time"))]
    pub end: f64,
    /// How a scheme of order b gets its first past values.
    #[serde(default)]
    pub start: TimeStart,
    /// Ratio of successive steps, which alternate about `step`.
    #[serde(default = "default_alternate", skip_serializing_if = "is_one")]
    #[schemars(transform = TimeTable::ALTERNATE.said(), extend("default" = default_alternate()))]
    pub alternate: f64,
    /// Most accepted steps, those before a `--resume` included.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::SOME.said())]
    pub max_steps: Option<usize>,
    /// After halvings `Δt` grows by this factor, up to `step`, …
    #[serde(default = "default_growth")]
    #[schemars(transform = TimeTable::GROWTH.said())]
    pub growth: f64,
    /// … after `⌈growth_wait · Δt_0/Δt⌉` good steps in a row, …
    #[serde(default = "default_growth_wait")]
    #[schemars(transform = Range::POSITIVE.said())]
    pub growth_wait: f64,
    /// … good if their rate `η_k` is above this.
    #[serde(default = "default_growth_rate")]
    pub growth_rate: f64,
    /// Endings before `end`.
    #[serde(default, skip_serializing_if = "StopTable::is_empty")]
    pub stop: StopTable,
}

impl TimeTable {
    /// Beyond, a step takes a lower order.
    pub const ALTERNATE: Range = Range::within(1.0, 5.0);
    pub const GROWTH: Range = Range::at_least(1.0);
}

/// `time.start`
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TimeStart {
    /// Step n has order min(n, b).
    #[default]
    LowOrder,
    /// The first b − 1 steps take the polarity of the exact fields.
    Exact,
}

fn default_alternate() -> f64 {
    1.0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

/// Those of the step control, whatever the step.
fn default_control() -> ControlSettings {
    ControlSettings::new(1.0)
}

fn default_growth() -> f64 {
    default_control().growth
}

fn default_growth_wait() -> f64 {
    default_control().growth_wait
}

fn default_growth_rate() -> f64 {
    default_control().growth_rate
}

/// BDF of order 1 to 6 on the polarity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Scheme {
    Bdf1,
    Bdf2,
    Bdf3,
    Bdf4,
    Bdf5,
    Bdf6,
}

impl Scheme {
    pub fn order(self) -> usize {
        match self {
            Scheme::Bdf1 => 1,
            Scheme::Bdf2 => 2,
            Scheme::Bdf3 => 3,
            Scheme::Bdf4 => 4,
            Scheme::Bdf5 => 5,
            Scheme::Bdf6 => 6,
        }
    }
}

/// `time.density_scheme`
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DensityScheme {
    /// A-BDF(θ*) wherever its coefficients are positive and it is stable, else BDF.
    #[default]
    Abdf,
    /// Always the implicit BDF.
    Bdf,
}

/// `time.stop`: endings before `time.end`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct StopTable {
    /// Ends the run when the stationary residual [9.8–9.10] is below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::POSITIVE.said())]
    pub residual: Option<f64>,
    /// … when `|dF/dt|` was below this ten steps in a row; needs `B > 0` or `c_0 > 0`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::POSITIVE.said())]
    pub energy_rate: Option<f64>,
}

impl StopTable {
    fn is_empty(&self) -> bool {
        self.residual.is_none() && self.energy_rate.is_none()
    }
}
