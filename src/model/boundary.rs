//! Conditions on a boundary tag [5.45]: one for the velocity, one for the polarity, and the density of what flows in.

mod named;

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de, ser::SerializeMap};

use super::ModelError;
use super::manufactured::Exact;
use super::parameters::ModelKind;
use crate::expression::{Expression, Formula, VectorFormula, parse_vector};
use crate::mesh::Point;
use crate::names;
use crate::schema;
pub use named::{Form, Named, POLARITY, VELOCITY, polarity_schema, rows, velocity_schema};

/// What holds for the velocity on a tag.
#[derive(Debug, Clone, PartialEq)]
pub enum VelocityCondition {
    /// `v = v_D`
    Dirichlet([Expression; 2]),
    /// `n·σ = given`
    Traction([Expression; 2]),
    /// `v·n = 0`, `(n·σ)·t = 0`
    Slip,
    /// `v·t = 0`, `n·σ·n = 0`
    NoTangential,
}

impl VelocityCondition {
    /// Whether the condition prescribes a normal stress; where none does, Π is only determined up to a constant.
    pub fn fixes_pressure(&self) -> bool {
        match self {
            VelocityCondition::Traction(_) | VelocityCondition::NoTangential => true,
            VelocityCondition::Dirichlet(_) | VelocityCondition::Slip => false,
        }
    }
}

/// What holds for the polarity on a tag.
#[derive(Debug, Clone, PartialEq)]
pub enum PolarityCondition {
    /// `p = p_D`, imposed weakly
    Dirichlet([Expression; 2]),
    /// `κ² ∂p/∂n = 0`
    Neumann,
}

/// The conditions of a tag.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditions {
    pub velocity: VelocityCondition,
    pub polarity: PolarityCondition,
    /// `ρ_in`, the density of what flows in; `None` on slip and in the incompressible sheet.
    pub density: Option<Expression>,
}

impl Conditions {
    /// `ρ_in(x, t)`; 0 where nothing flows in.
    pub fn inflow(&self, x: Point, t: f64) -> f64 {
        self.density.as_ref().map_or(0.0, |density| density.eval(x, t))
    }

    /// The same conditions, whose formulas know where they were given: `place` makes the beginning of a message from a
    /// key.
    #[must_use]
    pub fn given_at(self, place: &dyn Fn(&str) -> String) -> Self {
        let pair = |pair: [Expression; 2], key: &str| pair.map(|formula| formula.given_at(&place(key)));
        let velocity = match self.velocity {
            VelocityCondition::Dirichlet(values) => VelocityCondition::Dirichlet(pair(values, "velocity.dirichlet")),
            VelocityCondition::Traction(values) => VelocityCondition::Traction(pair(values, "velocity.traction")),
            other @ (VelocityCondition::Slip | VelocityCondition::NoTangential) => other,
        };
        let polarity = match self.polarity {
            PolarityCondition::Dirichlet(values) => PolarityCondition::Dirichlet(pair(values, "polarity.dirichlet")),
            PolarityCondition::Neumann => PolarityCondition::Neumann,
        };
        let density = self.density.map(|density| density.given_at(&place("density")));
        Self { velocity, polarity, density }
    }

    /// The formulas of the conditions, by key.
    pub fn formulas(&self) -> [(&'static str, Vec<&Expression>); 3] {
        let velocity = match &self.velocity {
            VelocityCondition::Dirichlet(pair) | VelocityCondition::Traction(pair) => pair.iter().collect(),
            VelocityCondition::Slip | VelocityCondition::NoTangential => Vec::new(),
        };
        let polarity = match &self.polarity {
            PolarityCondition::Dirichlet(pair) => pair.iter().collect(),
            PolarityCondition::Neumann => Vec::new(),
        };
        [("velocity", velocity), ("polarity", polarity), ("density", self.density.iter().collect())]
    }
}

/// The table `[boundary.TAG]` of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct BoundaryScene {
    /// What holds for the velocity.
    #[schemars(schema_with = "velocity_schema")]
    pub velocity: NamedCondition,
    /// What holds for the polarity.
    #[schemars(schema_with = "polarity_schema")]
    pub polarity: NamedCondition,
    /// `ρ` where `v·n < 0`; needed on every tag but those with `"slip"`, which must not have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "compressible", "x-rule" = "≥ 0", "x-default" = "that of `[exact]`"))]
    pub density: Option<Formula>,
}

const VELOCITY_HINT: &str =
    "the choices are \"slip\", \"no-tangential\", \"traction\", { traction = [s_1, s_2] }, { dirichlet = [v_1, v_2] }";
const POLARITY_HINT: &str = "the choices are \"neumann\", { dirichlet = [p_1, p_2] }";

impl BoundaryScene {
    /// The conditions, with `parameters` bound in the formulas. A `dirichlet` without values takes those of the exact
    /// fields, and so does a compressible sheet without `density`.
    ///
    /// # Errors
    /// An unknown condition, values where none belong or none where they are needed, a bad formula.
    pub fn check(
        &self,
        kind: ModelKind,
        parameters: &[(&str, f64)],
        exact: Option<&Exact>,
    ) -> Result<Conditions, ModelError> {
        let velocity = velocity_condition(&self.velocity, parameters, exact)?;
        let polarity = polarity_condition(&self.polarity, parameters, exact)?;
        let density = match (kind, &self.density) {
            (ModelKind::Incompressible, None) => None,
            (ModelKind::Incompressible, Some(given)) => {
                let hint = "remove it, or take kind = \"compressible\"";
                let rule = "the density of an incompressible sheet is 1 everywhere";
                return Err(ModelError::new("density", format!("\"{given}\""), rule, hint));
            }
            (ModelKind::Compressible, given) => inflow_density(&velocity, given.as_ref(), parameters, exact)?,
        };
        Ok(Conditions { velocity, polarity, density })
    }

    /// The table with every default filled in.
    #[must_use]
    pub fn resolved(&self) -> Self {
        let mut full = self.clone();
        if full.velocity.name == "traction" && full.velocity.values.is_none() {
            full.velocity.values = Some([0, 0].map(crate::expression::Formula::Integer));
        }
        full
    }
}

fn velocity_condition(
    given: &NamedCondition,
    parameters: &[(&str, f64)],
    exact: Option<&Exact>,
) -> Result<VelocityCondition, ModelError> {
    let wrong = |rule: String| ModelError::new("velocity", given, rule, VELOCITY_HINT);
    match (given.name.as_str(), &given.values) {
        ("slip", None) => Ok(VelocityCondition::Slip),
        ("no-tangential", None) => Ok(VelocityCondition::NoTangential),
        ("traction", None) => Ok(VelocityCondition::Traction([0.0, 0.0].map(Expression::constant))),
        ("traction", Some(values)) => Ok(VelocityCondition::Traction(vector("velocity.traction", values, parameters)?)),
        ("dirichlet", Some(values)) => {
            Ok(VelocityCondition::Dirichlet(vector("velocity.dirichlet", values, parameters)?))
        }
        ("dirichlet", None) => match exact {
            Some(exact) => Ok(VelocityCondition::Dirichlet(exact.velocity().clone())),
            None => Err(wrong(
                "`dirichlet` needs its two components, because there is no [exact] to take them from".to_owned(),
            )),
        },
        ("slip" | "no-tangential", Some(_)) => Err(wrong(format!("`{}` takes no values", given.name))),
        (other, _) => Err(wrong(format!(
            "no such velocity condition{}",
            names::did_you_mean(other, &VELOCITY.map(|one| one.name))
        ))),
    }
}

fn polarity_condition(
    given: &NamedCondition,
    parameters: &[(&str, f64)],
    exact: Option<&Exact>,
) -> Result<PolarityCondition, ModelError> {
    let wrong = |rule: String| ModelError::new("polarity", given, rule, POLARITY_HINT);
    match (given.name.as_str(), &given.values) {
        ("neumann", None) => Ok(PolarityCondition::Neumann),
        ("dirichlet", Some(values)) => {
            Ok(PolarityCondition::Dirichlet(vector("polarity.dirichlet", values, parameters)?))
        }
        ("dirichlet", None) => match exact {
            Some(exact) => Ok(PolarityCondition::Dirichlet(exact.polarity().clone())),
            None => Err(wrong(
                "`dirichlet` needs its two components, because there is no [exact] to take them from".to_owned(),
            )),
        },
        ("neumann", Some(_)) => Err(wrong("`neumann` takes no values".to_owned())),
        (other, _) => Err(wrong(format!(
            "no such polarity condition{}",
            names::did_you_mean(other, &POLARITY.map(|one| one.name))
        ))),
    }
}

fn inflow_density(
    velocity: &VelocityCondition,
    given: Option<&Formula>,
    parameters: &[(&str, f64)],
    exact: Option<&Exact>,
) -> Result<Option<Expression>, ModelError> {
    match (velocity, given) {
        (VelocityCondition::Slip, None) => Ok(None),
        (VelocityCondition::Slip, Some(given)) => {
            let hint = "remove it; only what flows in has a density to be given";
            Err(ModelError::new("density", format!("\"{given}\""), "nothing passes a boundary that is \"slip\"", hint))
        }
        (
            VelocityCondition::Dirichlet(_) | VelocityCondition::Traction(_) | VelocityCondition::NoTangential,
            Some(given),
        ) => Ok(Some(ModelError::parse_density("density", given, parameters)?)),
        (VelocityCondition::Dirichlet(_) | VelocityCondition::Traction(_) | VelocityCondition::NoTangential, None) => {
            let from_exact = exact.and_then(|exact| exact.volume().density()).cloned();
            let rule = "tissue may flow in here, and its density is not known";
            let hint = "add `density = 1.0` or a formula, the density of what flows in";
            from_exact.map(Some).ok_or_else(|| ModelError::new("density", "(missing)", rule, hint))
        }
    }
}

fn vector(key: &str, values: &VectorFormula, parameters: &[(&str, f64)]) -> Result<[Expression; 2], ModelError> {
    parse_vector(values, parameters).map_err(|error| ModelError::of_expression(key, &error))
}

/// A condition as the file has it: a name, or a table of one name with two formulas.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCondition {
    pub name: String,
    pub values: Option<VectorFormula>,
}

impl fmt::Display for NamedCondition {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.values {
            None => write!(out, "\"{}\"", self.name),
            Some([first, second]) => write!(out, "{{ {} = [\"{first}\", \"{second}\"] }}", self.name),
        }
    }
}

impl Serialize for NamedCondition {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.values {
            None => serializer.serialize_str(&self.name),
            Some(values) => {
                let mut map = serializer.serialize_map(Some(1))?;
                map.serialize_entry(&self.name, values)?;
                map.end()
            }
        }
    }
}

impl<'de> Deserialize<'de> for NamedCondition {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ConditionVisitor)
    }
}

/// By hand, because serde's untagged enums lose line and reason.
struct ConditionVisitor;

impl<'de> de::Visitor<'de> for ConditionVisitor {
    type Value = NamedCondition;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a condition such as \"slip\" or { dirichlet = [\"1\", \"0\"] }")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<NamedCondition, E> {
        Ok(NamedCondition { name: name.to_owned(), values: None })
    }

    fn visit_map<A: de::MapAccess<'de>>(self, mut map: A) -> Result<NamedCondition, A::Error> {
        let one = || de::Error::custom("a condition has exactly one name, as in { dirichlet = [\"1\", \"0\"] }");
        let (name, values) = map.next_entry::<String, VectorFormula>()?.ok_or_else(one)?;
        if map.next_key::<String>()?.is_some() {
            return Err(one());
        }
        Ok(NamedCondition { name, values: Some(values) })
    }
}
