//! The tables of a scene file. What depends on no other key is filled in by serde, so that writing a table back shows
//! every default.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::bodies::tables::{BodiesTable, BodyTable, ContactTable, RigidTable, WallTable};
use super::output::OutputTable;
use super::start::InitialTable;
use crate::expression::{Formula, VectorFormula};
use crate::mesh::generate::MeshScene;
use crate::model::boundary::BoundaryScene;
use crate::model::parameters::ModelScene;
use crate::scheme::ControlSettings;
use crate::steady::{SteadySettings, Want};
use crate::time::CouplingSettings;

/// The whole file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// One line for reports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Preset that fills in what the scene leaves out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<super::presets::Accuracy>,
    pub model: ModelScene,
    pub mesh: MeshScene,
    #[serde(default)]
    pub space: SpaceTable,
    /// Conditions by boundary tag.
    #[serde(default)]
    pub boundary: BTreeMap<String, BoundaryScene>,
    pub initial: InitialTable,
    #[serde(default, skip_serializing_if = "SourceTable::is_empty")]
    pub source: SourceTable,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact: Option<ExactTable>,
    pub time: TimeTable,
    /// A steady state is searched for instead of marching.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steady: Option<SteadyTable>,
    #[serde(default)]
    pub coupling: CouplingTable,
    /// The elastic strain that the flow carries.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strain: Option<StrainTable>,
    /// How the tissue carries rigid bodies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rigid: Option<RigidTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub body: Vec<BodyTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<BodiesTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wall: Vec<WallTable>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactTable>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub output: Vec<OutputTable>,
}

/// `[space]`: polynomial degrees, and how `v·n = 0` is imposed on slip walls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SpaceTable {
    /// 1 to 3 (default 1): velocity k+1, pressure k, polarity k+2; compressible: velocity k+1, density k, polarity k+1.
    pub k: usize,
    /// Single degrees in place of those that `k` gives.
    pub degree: DegreeTable,
    /// How slip walls are imposed: `"rotated"` (default) or `"penalty"`.
    pub walls: WallsName,
    /// `ε_r` of [10.3], used by `walls = "penalty"` (default 1e-8).
    pub penalty: f64,
}

impl Default for SpaceTable {
    fn default() -> Self {
        Self { k: 1, degree: DegreeTable::default(), walls: WallsName::Rotated, penalty: 1e-8 }
    }
}

/// `space.degree`
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DegreeTable {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<usize>,
    /// Incompressible only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure: Option<usize>,
    /// Compressible only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polarity: Option<usize>,
}

/// How `v·n = 0` is imposed on curved boundaries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WallsName {
    Rotated,
    Penalty,
}

/// `[source]`: manufactured sources, zero in a physical scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SourceTable {
    /// `f_v`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<[Formula; 2]>,
    /// `f_p`
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polarity: Option<[Formula; 2]>,
    /// `f_ρ`; compressible only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<Formula>,
}

impl SourceTable {
    fn is_empty(&self) -> bool {
        self.force.is_none() && self.polarity.is_none() && self.density.is_none()
    }
}

/// `[exact]`: fields that solve the equations with the sources that follow from them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExactTable {
    /// `v`, in an incompressible sheet with `div v = 0`.
    pub velocity: VectorFormula,
    /// `Π`; incompressible only, and needed there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<Formula>,
    /// `ρ`; compressible only, and needed there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<Formula>,
    /// `p`
    pub polarity: VectorFormula,
    /// Where the data of natural boundary conditions come from (default `"exact"`).
    #[serde(default)]
    pub boundary: ExactBoundary,
}

/// `exact.boundary`
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExactBoundary {
    /// `n·σ` (on slip its tangential part) and `∂p/∂n` are those of the exact fields.
    #[default]
    Exact,
    /// They are what the scene says: zero, or the given traction.
    Scene,
}

/// `[time]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeTable {
    pub scheme: Scheme,
    /// How the density is marched (default `"abdf"`); compressible only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density_scheme: Option<DensityScheme>,
    /// Largest and first step `Δt_0 > 0`.
    pub step: f64,
    /// The run ends when a failure would halve Δt below this (default `1e-6 step`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_min: Option<f64>,
    /// End time.
    pub end: f64,
    /// How a scheme of order b gets its first past values (default `"low-order"`).
    #[serde(default)]
    pub start: TimeStart,
    /// Ratio in which successive steps alternate about `step` (default 1), to try the variable-step formulas.
    #[serde(default = "default_alternate", skip_serializing_if = "is_one")]
    pub alternate: f64,
    /// Most accepted steps `n_max` (default no limit).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_steps: Option<usize>,
    /// Δt grows by this factor (default 1.25), never above `step`,
    #[serde(default = "default_growth")]
    pub growth: f64,
    /// after `⌈growth_wait Δt_0/Δt⌉` steps in a row without a halving (default 50)
    #[serde(default = "default_growth_wait")]
    pub growth_wait: f64,
    /// and with a rate `η_k` above this (default 0.55).
    #[serde(default = "default_growth_rate")]
    pub growth_rate: f64,
    #[serde(default, skip_serializing_if = "StopTable::is_empty")]
    pub stop: StopTable,
}

/// `time.start`
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DensityScheme {
    /// A-BDF(θ*) wherever its coefficients are positive and it is stable, else BDF.
    #[default]
    Abdf,
    /// Always the implicit BDF.
    Bdf,
}

/// `time.stop`: endings before `time.end`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StopTable {
    /// Total residual of the stationary equations [9.8–9.10] below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual: Option<f64>,
    /// `|dF/dt|` below this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy_rate: Option<f64>,
}

impl StopTable {
    fn is_empty(&self) -> bool {
        self.residual.is_none() && self.energy_rate.is_none()
    }
}

/// `[steady]`: how a steady state is searched for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SteadyTable {
    /// Bound on the total residual of the stationary equations [9.8–9.10] (default 1e-9).
    pub residual: f64,
    /// First pseudo-step, in units of time (default 1).
    pub step: f64,
    /// Most pseudo-steps of each try (default 300).
    pub max_steps: usize,
    /// `"stable"` (default): an unstable state is left along the mode that grows; `"any"`: the first that is found.
    pub want: Want,
    /// Leading eigenvalues to find (default 6); 0 asks for none, and then nothing is known of the stability.
    pub eigenvalues: usize,
    /// Time that the last resort, marching with `time.step`, may cover (default `time.end`); 0 does without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub march: Option<f64>,
}

impl Default for SteadyTable {
    fn default() -> Self {
        let SteadySettings { residual, step, max_steps, want, eigenvalues, .. } = SteadySettings::default();
        Self { residual, step, max_steps, want, eigenvalues, march: None }
    }
}

/// `[strain]`: the elastic strain that the flow carries [12.3].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StrainTable {
    /// `We > 0`, the time in which the strain relaxes.
    pub weissenberg: f64,
    /// Polynomial degree (default that of the velocity less one).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degree: Option<usize>,
}

/// `[coupling]`: how velocity and polarity are iterated within a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CouplingTable {
    /// `"newton"` (default), `"anderson"` or `"fixed-point"`.
    pub kind: CouplingName,
    /// `δ_fp`: converged when `e_k` is below (default 1e-8).
    pub tolerance: f64,
    /// At `k_max` accepted when `e_k` is below this (default `sqrt(tolerance)`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accept: Option<f64>,
    /// Failed when `e_k` is above this (default 1e4).
    pub diverged: f64,
    /// `k_max` (default 100).
    pub max_iterations: usize,
    /// Iterates that `anderson` combines (default 10).
    pub depth: usize,
}

impl Default for CouplingTable {
    fn default() -> Self {
        let CouplingSettings { tolerance, diverged, max_iterations, .. } = CouplingSettings::default();
        Self { kind: CouplingName::Newton, tolerance, accept: None, diverged, max_iterations, depth: 10 }
    }
}

/// `coupling.kind`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CouplingName {
    FixedPoint,
    Anderson,
    Newton,
}
