//! `[steady]`, `[strain]` and `[coupling]`: how states are found, and what is carried beside them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::DegreeTable;
use crate::schema::{self, Range};
use crate::steady::{SteadySettings, Want};
use crate::time::CouplingSettings;

/// `[steady]`: how a steady state is searched for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct SteadyTable {
    /// Bound on the stationary residual [9.8–9.10].
    #[schemars(transform = Range::POSITIVE.said())]
    pub residual: f64,
    /// First pseudo-step.
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "time"))]
    pub step: f64,
    /// Most pseudo-steps of each try.
    #[schemars(transform = Range::SOME.said())]
    pub max_steps: usize,
    /// Which steady state.
    pub want: Want,
    /// Leading eigenvalues to find; 0 finds none, and the stability is not known.
    #[schemars(transform = SteadyTable::EIGENVALUES.said())]
    pub eigenvalues: usize,
    /// What the last resort, marching with `time.step`, may cover; 0 does without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::NOT_NEGATIVE.said(), extend("x-unit" = "time", "x-default" = "`time.end`"))]
    pub march: Option<f64>,
}

impl SteadyTable {
    pub const EIGENVALUES: Range = Range::within(0.0, 60.0);
}

impl Default for SteadyTable {
    fn default() -> Self {
        let SteadySettings { residual, step, max_steps, want, eigenvalues, .. } = SteadySettings::default();
        Self { residual, step, max_steps, want, eigenvalues, march: None }
    }
}

/// `[strain]`: the elastic strain that the flow carries [12.3].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct StrainTable {
    /// `We`, in which the strain relaxes.
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "time"))]
    pub weissenberg: f64,
    /// Polynomial degree of ε, discontinuous.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = DegreeTable::ANY.said(), extend("x-default" = "velocity's less one"))]
    pub degree: Option<usize>,
}

/// `[coupling]`: how velocity and polarity are iterated within a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct CouplingTable {
    /// How a step's v, Π, p are made to agree.
    pub kind: CouplingName,
    /// `δ_fp`: converged when the increment `e_k`, relative to the fields, is below this.
    #[schemars(transform = CouplingTable::TOLERANCE.said())]
    pub tolerance: f64,
    /// At the last iteration an `e_k` below this will do.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::POSITIVE.said())]
    #[schemars(extend("x-rule" = "at least `tolerance`, less than `diverged`", "x-default" = "√`tolerance`"))]
    pub accept: Option<f64>,
    /// Failed when `e_k` reaches this.
    #[schemars(transform = Range::POSITIVE.said(), extend("x-rule" = "more than `accept`"))]
    pub diverged: f64,
    /// `k_max`, most iterations.
    #[schemars(transform = Range::SOME.said())]
    pub max_iterations: usize,
    /// Iterates that `anderson` combines.
    #[schemars(transform = CouplingTable::DEPTH.said())]
    pub depth: usize,
}

impl CouplingTable {
    pub const TOLERANCE: Range = Range::inside(0.0, 1.0);
    pub const DEPTH: Range = Range::within(1.0, 100.0);
}

impl Default for CouplingTable {
    fn default() -> Self {
        let CouplingSettings { tolerance, diverged, max_iterations, .. } = CouplingSettings::default();
        Self { kind: CouplingName::Newton, tolerance, accept: None, diverged, max_iterations, depth: 10 }
    }
}

/// `coupling.kind`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CouplingName {
    /// In turn, until nothing changes; the cheapest for small steps.
    FixedPoint,
    /// The same, accelerated.
    Anderson,
    /// Together, with the factors of the coupled matrix.
    Newton,
}
