//! The tables of rigid bodies, walls and contact as the file has them.

use std::fmt;

use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Deserializer, Serialize, de};

use crate::contact::{MOST_FRICTION, Method};
use crate::expression::{Formula, VectorFormula};
use crate::model::immersed::flow::{Settings, Strength};
use crate::schema::{self, IN_A_FLOW, Range};
use crate::shape::{LENGTHS, ShapeTable};

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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct RigidTable {
    /// What a body is to the flow.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "`\"nitsche\"`; in tissue or beside keys of the penalty `\"penalty\"`"))]
    pub method: Option<MethodName>,
    /// Penalty: `ε` of `(2/ε) ∫_B D(v):D(w)`; a body is 1/ε times as viscous as what is around it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = RigidTable::EPSILON.said(), extend("x-default" = "1e-8"))]
    pub epsilon: Option<f64>,
    /// Penalty: in cells that a body cuts, θ the share of the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = "harmonic"))]
    pub strength: Option<Strength>,
    /// Order of the motion in time.
    #[schemars(transform = RigidTable::ORDER.said())]
    pub order: usize,
}

impl RigidTable {
    pub const EPSILON: Range = Range::inside(0.0, 1.0);
    pub const ORDER: Range = Range::within(1.0, 2.0);
}

impl Default for RigidTable {
    fn default() -> Self {
        Self { method: None, epsilon: None, strength: None, order: Settings::default().order }
    }
}

/// `rigid.method`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MethodName {
    /// A fluid that is very viscous.
    Penalty,
    /// A boundary of the fluid, in the cells that it cuts.
    #[schemars(extend("x-kinds" = "stokes"))]
    Nitsche,
}

/// `[[body]]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct BodyTable {
    /// In tables, messages and `--set`; no number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = schema::file_name, extend("x-default" = "`body-1`, …"))]
    pub name: Option<String>,
    /// Shape and size.
    #[schemars(extend("x-values" = "one of the [shapes](#shapes)"))]
    pub shape: ShapeTable,
    /// Of the centre of area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "–; of a polygon, where its vertices are"))]
    pub position: Option<[f64; 2]>,
    /// Counterclockwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "radians", "default" = 0))]
    pub angle: Option<f64>,
    /// At `t = 0`, with inertia, of what is free or pinned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = [0, 0], "x-kinds" = "particles"))]
    pub velocity: Option<[f64; 2]>,
    /// At `t = 0`, with inertia, of what is free or pinned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = 0, "x-kinds" = "particles"))]
    pub spin: Option<f64>,
    /// Mass per area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::POSITIVE.said(), extend("default" = 1))]
    pub density: Option<f64>,
    /// What decides about the motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = "free", "x-values" = "one of the [motions](#motions)"))]
    pub motion: Option<MotionTable>,
    /// Total force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = [0, 0]))]
    pub force: Option<VectorFormula>,
    /// About the centre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = 0))]
    pub torque: Option<Formula>,
    /// With the substrate, per area; tissue and Stokes flow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = BodyTable::FRICTION.said(), extend("default" = 0, "x-kinds" = IN_A_FLOW))]
    pub friction: Option<f64>,
}

impl BodyTable {
    /// Beyond, a body's friction leaves no digits to the flow.
    pub const FRICTION: Range = Range::within(0.0, 1e12);
}

/// `body.motion`: a name, or `{ pinned = … }`, `{ held = … }`, `{ path = … }`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MotionTable {
    /// Goes where forces, flow and contact take it.
    Free,
    /// Stays.
    Fixed,
    /// Turns about a point of it, given in space at `t = 0`.
    Pinned([f64; 2]),
    /// Moves at this velocity; formulas of `t`, `x`, `y`, `theta`.
    Held(HeldTable),
    /// Is there; formulas of `t`, and then there is no `position` and `angle`.
    Path(PathTable),
}

/// `{ held = { velocity = [f, g], spin = h } }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct HeldTable {
    /// Of the centre.
    pub velocity: VectorFormula,
    /// Counterclockwise.
    #[serde(default = "zero")]
    pub spin: Formula,
}

/// `{ path = { position = [f, g], angle = h } }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct PathTable {
    /// Of the centre.
    pub position: VectorFormula,
    /// Counterclockwise, in radians.
    #[serde(default = "zero")]
    pub angle: Formula,
}

pub(in crate::scene) fn zero() -> Formula {
    Formula::Integer(0)
}

/// At most so many bodies.
pub const MOST: usize = 1_000_000;

/// `[[bodies]]`: many discs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>, transform = one_place)]
pub struct BodiesTable {
    /// What their names begin with: `NAME-1`, `NAME-2`, …
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = schema::file_name, extend("x-default" = "`disc`, `disc2`, …"))]
    pub name: Option<String>,
    /// How many; not beside `at`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = BodiesTable::COUNT.said(), extend("x-default" = "–"))]
    pub count: Option<usize>,
    /// Of all, or uniform between two.
    #[schemars(transform = LENGTHS.said(), extend("x-values" = "length 1e-9 to 1e9, or `[r_1, r_2]`"))]
    pub radius: Radii,
    /// At random in a box: lower left and upper right corner.
    #[serde(default, rename = "box", skip_serializing_if = "Option::is_none")]
    pub in_box: Option<[[f64; 2]; 2]>,
    /// At random in a disc.
    #[serde(default, rename = "disc", skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-values" = "`{ centre = [x, y], radius = r }`"))]
    pub in_disc: Option<CircleTable>,
    /// At equal angles on a circle; with `angle`, a formula of `t`, the ring is turned by it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-values" = "`{ centre, radius, angle }`"))]
    pub ring: Option<RingTable>,
    /// At these centres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = schema::not_empty)]
    pub at: Option<Vec<[f64; 2]>>,
    /// Of radii and places.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = 1))]
    pub seed: Option<u64>,
    /// Of all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = "free"))]
    pub motion: Option<GroupMotion>,
    /// Mass per area.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::POSITIVE.said(), extend("default" = 1))]
    pub density: Option<f64>,
    /// Total force on each.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = [0, 0]))]
    pub force: Option<VectorFormula>,
    /// On each, about its centre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = 0))]
    pub torque: Option<Formula>,
    /// With the substrate, per area; tissue and Stokes flow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = BodyTable::FRICTION.said(), extend("default" = 0, "x-kinds" = IN_A_FLOW))]
    pub friction: Option<f64>,
}

impl BodiesTable {
    pub const COUNT: Range = Range::within(1.0, MOST as f64);
}

/// Exactly one key tells where they are.
fn one_place(schema: &mut Schema) {
    let places = ["box", "disc", "ring", "at"].map(|key| serde_json::json!({ "required": [key] }));
    schema.insert("oneOf".to_owned(), places.into());
}

/// `bodies.motion`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GroupMotion {
    /// They go where forces, flow and contact take them.
    Free,
    /// They stay.
    Fixed,
}

/// `bodies.radius`: one number, or the ends of a range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>, transform = schema::centre_or_center)]
pub struct CircleTable {
    /// Centre; also spelled `center`.
    #[serde(alias = "center")]
    pub centre: [f64; 2],
    /// Radius.
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "length"))]
    pub radius: f64,
}

/// `{ centre, radius, angle }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>, transform = schema::centre_or_center)]
pub struct RingTable {
    /// Centre; also spelled `center`.
    #[serde(alias = "center")]
    pub centre: [f64; 2],
    /// Of the circle on which the centres lie.
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "length"))]
    pub radius: f64,
    /// Formula of t: how far the ring has turned; without it the bodies do not move by themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<Formula>,
}

/// `[[wall]]`: exactly one of `segment`, `disc`, `hollow`, `tag`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>, extend("minProperties" = 1, "maxProperties" = 1))]
pub struct WallTable {
    /// Bodies stay on its left, seen from the first to the second point, or touch its ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub segment: Option<[[f64; 2]; 2]>,
    /// Bodies stay outside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-values" = "`{ centre = [x, y], radius = r }`"))]
    pub disc: Option<CircleTable>,
    /// Bodies stay inside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-values" = "`{ centre = [x, y], radius = r }`"))]
    pub hollow: Option<CircleTable>,
    /// Bodies stay on the inner side of this part of the mesh's boundary; tissue and Stokes flow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-values" = "a tag", "x-kinds" = IN_A_FLOW))]
    pub tag: Option<String>,
}

/// `[contact]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct ContactTable {
    /// How bodies that meet part again.
    pub law: LawName,
    /// Gluey: threshold of roughness, `γ ≥ γ_min`; 0 is inelastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("maximum" = 0, "x-default" = "`-inf`"))]
    pub gamma_min: Option<f64>,
    /// Gap that is kept, `η`: `D + Δt G·V ≥ η`.
    #[schemars(transform = Range::NOT_NEGATIVE.said(), extend("x-unit" = "length"))]
    pub margin: f64,
    /// Coefficient `μ` of Coulomb's friction, `|λ_t| ≤ μ λ`; with `law = "inelastic"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = ContactTable::FRICTION.said(), extend("default" = 0, "x-kinds" = "particles"))]
    pub friction: Option<f64>,
    /// Restitution `e`: what touches at the speed `u` parts at `e u`; with `law = "inelastic"` and inertia.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(transform = ContactTable::RESTITUTION.said(), extend("default" = 0, "x-kinds" = "particles"))]
    pub restitution: Option<f64>,
    /// Of gaps and complementarity.
    #[schemars(transform = ContactTable::TOLERANCE.said())]
    pub tolerance: f64,
    /// How the projection is computed.
    pub solver: Method,
}

impl ContactTable {
    pub const TOLERANCE: Range = Range::within(1e-14, 1e-3);
    pub const FRICTION: Range = Range::within(0.0, MOST_FRICTION);
    pub const RESTITUTION: Range = Range::within(0.0, 1.0);
}

impl Default for ContactTable {
    fn default() -> Self {
        let (law, solver) = (LawName::Inelastic, Method::Newton);
        Self { law, gamma_min: None, margin: 0.0, friction: None, restitution: None, tolerance: 1e-12, solver }
    }
}

/// `contact.law`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LawName {
    /// They stay together as long as they are pressed.
    Inelastic,
    /// They stick.
    Gluey,
}
