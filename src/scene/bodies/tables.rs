//! The tables of rigid bodies, walls and contact as the file has them.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, de};

use crate::contact::Method;
use crate::expression::{Formula, VectorFormula};
use crate::model::immersed::flow::Settings;
use crate::shape::ShapeTable;

/// What a scene of any kind may say about bodies.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BodyTables {
    pub rigid: Option<RigidTable>,
    pub body: Vec<BodyTable>,
    pub bodies: Vec<BodiesTable>,
    pub wall: Vec<WallTable>,
    pub contact: Option<ContactTable>,
}

impl BodyTables {
    /// Whether nothing is said.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// `[rigid]`: how a flow carries bodies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RigidTable {
    /// `ε ∈ (0, 1)` of the penalty `(2/ε) ∫_B D(v):D(w)` (default 1e-8).
    pub epsilon: f64,
    /// Order of the motion, 1 or 2 (default 2).
    pub order: usize,
}

impl Default for RigidTable {
    fn default() -> Self {
        let Settings { epsilon, order } = Settings::default();
        Self { epsilon, order }
    }
}

/// `[[body]]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyTable {
    /// Default `body-1`, `body-2`, …
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    pub shape: ShapeTable,
    /// Centre of area; without it a polygon lies where its vertices say, and a path gives it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 2]>,
    /// Counterclockwise, in radians (default 0); a path gives it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<f64>,
    /// At t = 0 (default 0); inertial particles only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<[f64; 2]>,
    /// At t = 0 (default 0); inertial particles only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spin: Option<f64>,
    /// Mass per area (default 1).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// What decides about the motion (default `"free"`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionTable>,
    /// Total external force (default 0).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<VectorFormula>,
    /// External torque about the centre (default 0).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque: Option<Formula>,
    /// With the substrate, per area (default 0); in a flow only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
}

/// `body.motion`: a name, or `{ pinned = … }`, `{ held = … }`, `{ path = … }`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MotionTable {
    Free,
    Fixed,
    /// A point of space that stays where it is while the body turns about it.
    Pinned([f64; 2]),
    Held(HeldTable),
    Path(PathTable),
}

/// `{ held = { velocity = [f, g], spin = h } }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldTable {
    pub velocity: VectorFormula,
    /// Default 0.
    #[serde(default = "zero")]
    pub spin: Formula,
}

/// `{ path = { position = [f, g], angle = h } }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathTable {
    pub position: VectorFormula,
    /// Default 0.
    #[serde(default = "zero")]
    pub angle: Formula,
}

pub(in crate::scene) fn zero() -> Formula {
    Formula::Integer(0)
}

/// `[[bodies]]`: many discs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodiesTable {
    /// What their names begin with: `NAME-1`, `NAME-2`, … (default `disc`, of further tables `disc2`, …).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// How many; not beside `at`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub count: Option<usize>,
    pub radius: Radii,
    /// At random in a box: lower left and upper right corner.
    #[serde(default, rename = "box", skip_serializing_if = "Option::is_none")]
    pub in_box: Option<[[f64; 2]; 2]>,
    /// At random in a disc.
    #[serde(default, rename = "disc", skip_serializing_if = "Option::is_none")]
    pub in_disc: Option<CircleTable>,
    /// At equal angles on a circle, which may turn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ring: Option<RingTable>,
    /// At these centres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<Vec<[f64; 2]>>,
    /// Of radii and places (default 1).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// `"free"` (default) or `"fixed"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<GroupMotion>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<VectorFormula>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque: Option<Formula>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
}

/// `bodies.motion`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GroupMotion {
    Free,
    Fixed,
}

/// `bodies.radius`: one number, or the ends of a range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Radii {
    Equal(f64),
    Between([f64; 2]),
}

impl<'de> Deserialize<'de> for Radii {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RadiiVisitor)
    }
}

/// By hand, because serde's untagged enums lose line and reason.
struct RadiiVisitor;

impl<'de> de::Visitor<'de> for RadiiVisitor {
    type Value = Radii;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a radius or a range [smallest, largest]")
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Radii, E> {
        Ok(Radii::Equal(value as f64))
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Radii, E> {
        Ok(Radii::Equal(value))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, sequence: A) -> Result<Radii, A::Error> {
        <[f64; 2]>::deserialize(de::value::SeqAccessDeserializer::new(sequence)).map(Radii::Between)
    }
}

/// `{ centre, radius }`
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CircleTable {
    #[serde(alias = "center")]
    pub centre: [f64; 2],
    pub radius: f64,
}

/// `{ centre, radius, angle }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RingTable {
    #[serde(alias = "center")]
    pub centre: [f64; 2],
    /// Of the circle on which the centres lie.
    pub radius: f64,
    /// Formula of t: how far the ring has turned; without it the bodies do not move by themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<Formula>,
}

/// `[[wall]]`: exactly one of `segment`, `disc`, `hollow`, `tag`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WallTable {
    /// Bodies stay on the left of the segment from the first to the second point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub segment: Option<[[f64; 2]; 2]>,
    /// Bodies stay outside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disc: Option<CircleTable>,
    /// Bodies stay inside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hollow: Option<CircleTable>,
    /// The part of the mesh's boundary that has this tag; in a flow only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag: Option<String>,
}

/// `[contact]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ContactTable {
    /// `"inelastic"` (default) or `"gluey"`.
    pub law: LawName,
    /// `γ_min ≤ 0`, the threshold of roughness (default −∞); gluey only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gamma_min: Option<f64>,
    /// `η ≥ 0`, the gap that is kept (default 0).
    pub margin: f64,
    /// Of gaps and complementarity (default 1e-12).
    pub tolerance: f64,
    /// How the projection is computed (default `"newton"`).
    pub solver: Method,
}

impl Default for ContactTable {
    fn default() -> Self {
        let (law, solver) = (LawName::Inelastic, Method::Newton);
        Self { law, gamma_min: None, margin: 0.0, tolerance: 1e-12, solver }
    }
}

/// `contact.law`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LawName {
    Inelastic,
    Gluey,
}
