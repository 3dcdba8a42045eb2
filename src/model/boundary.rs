//! Conditions on a boundary tag [5.45]: one for the velocity, one for the polarity, and the density of what flows in.

mod given;
mod named;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ModelError;
use super::manufactured::Exact;
use super::parameters::ModelKind;
use crate::body::leaving::Passage;
use crate::expression::{Expression, Formula, VectorFormula, parse_vector};
use crate::mesh::Point;
use crate::names;
use crate::schema;
pub use given::{NamedCondition, Values};
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
    /// `v·n = 0`, `(n·σ)·t = −β_w v·t` with `β_w ≥ 0`   [N.1]
    Friction(Expression),
    /// `v·t = 0`, `n·σ·n = 0`
    NoTangential,
}

/// Which components of the velocity a condition prescribes; of the others it prescribes the stress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Held {
    /// No component.
    Nothing,
    /// `v·n = 0`
    Normal,
    /// `v·t = 0`
    Tangent,
    /// Both components.
    Both,
}

/// What the rest of the program asks a condition.
impl VelocityCondition {
    /// As a scene names it.
    pub fn name(&self) -> &'static str {
        match self {
            VelocityCondition::Dirichlet(_) => "dirichlet",
            VelocityCondition::Traction(_) => "traction",
            VelocityCondition::Slip => "slip",
            VelocityCondition::Friction(_) => "friction",
            VelocityCondition::NoTangential => "no-tangential",
        }
    }

    /// Which components of the velocity it prescribes.
    pub fn holds(&self) -> Held {
        match self {
            VelocityCondition::Dirichlet(_) => Held::Both,
            VelocityCondition::Traction(_) => Held::Nothing,
            VelocityCondition::Slip | VelocityCondition::Friction(_) => Held::Normal,
            VelocityCondition::NoTangential => Held::Tangent,
        }
    }

    /// Its formulas.
    pub fn formulas(&self) -> &[Expression] {
        match self {
            VelocityCondition::Dirichlet(pair) | VelocityCondition::Traction(pair) => pair,
            VelocityCondition::Friction(beta) => std::slice::from_ref(beta),
            VelocityCondition::Slip | VelocityCondition::NoTangential => &[],
        }
    }

    /// `v_D`, where the whole velocity is prescribed.
    pub fn value(&self) -> Option<&[Expression; 2]> {
        match self {
            VelocityCondition::Dirichlet(value) => Some(value),
            VelocityCondition::Traction(_)
            | VelocityCondition::Slip
            | VelocityCondition::Friction(_)
            | VelocityCondition::NoTangential => None,
        }
    }

    /// The whole traction, where it is prescribed.
    pub fn traction(&self) -> Option<&[Expression; 2]> {
        match self {
            VelocityCondition::Traction(traction) => Some(traction),
            VelocityCondition::Dirichlet(_)
            | VelocityCondition::Slip
            | VelocityCondition::Friction(_)
            | VelocityCondition::NoTangential => None,
        }
    }

    /// `β_w ≥ 0` of a tangential traction `(n·σ)·t = −β_w v·t`, constant in time; `None` where there is none.
    pub fn resistance(&self) -> Option<&Expression> {
        match self {
            VelocityCondition::Friction(beta) => Some(beta).filter(|beta| !beta.is_zero()),
            VelocityCondition::Dirichlet(_)
            | VelocityCondition::Traction(_)
            | VelocityCondition::Slip
            | VelocityCondition::NoTangential => None,
        }
    }

    /// Whether nothing passes while the tissue may move along the wall.
    pub fn is_impermeable(&self) -> bool {
        self.holds() == Held::Normal
    }

    /// Whether the condition prescribes a normal stress; where none does, Π is only determined up to a constant.
    pub fn fixes_pressure(&self) -> bool {
        matches!(self.holds(), Held::Nothing | Held::Tangent)
    }

    /// Whether nothing passes, and nothing slows the tissue down along the wall.
    pub fn slips_freely(&self) -> bool {
        self.is_impermeable() && self.resistance().is_none()
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
    /// One of the velocity.
    pub velocity: VelocityCondition,
    /// One of the polarity.
    pub polarity: PolarityCondition,
    /// `ρ_in`, the density of what flows in; `None` where nothing passes and in the incompressible sheet.
    pub density: Option<Expression>,
}

impl Conditions {
    /// A condition of the velocity, a polarity that is free, and no inflow.
    pub fn new(velocity: VelocityCondition) -> Self {
        Self { velocity, polarity: PolarityCondition::Neumann, density: None }
    }

    /// A wall along which tissue slides: `v·n = 0`, `(n·σ)·t = 0`.
    pub fn slip() -> Self {
        Self::new(VelocityCondition::Slip)
    }

    /// A wall to which tissue sticks: `v = 0`.
    pub fn no_slip() -> Self {
        Self::flow([0.0, 0.0].map(Expression::constant))
    }

    /// A given velocity: `v = v_D`.
    pub fn flow(velocity: [Expression; 2]) -> Self {
        Self::new(VelocityCondition::Dirichlet(velocity))
    }

    /// An end through which tissue passes as it likes: `n·σ = 0`.
    pub fn open() -> Self {
        Self::new(VelocityCondition::Traction([0.0, 0.0].map(Expression::constant)))
    }

    /// The same with a given polarity: `p = p_D`.
    #[must_use]
    pub fn with_polarity(self, polarity: [Expression; 2]) -> Self {
        Self { polarity: PolarityCondition::Dirichlet(polarity), ..self }
    }

    /// The same with the density of what flows in, `ρ_in`.
    #[must_use]
    pub fn with_density(self, density: Expression) -> Self {
        Self { density: Some(density), ..self }
    }

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
            VelocityCondition::Friction(beta) => {
                VelocityCondition::Friction(beta.given_at(&place("velocity.friction")))
            }
            other @ (VelocityCondition::Slip | VelocityCondition::NoTangential) => other,
        };
        let polarity = match self.polarity {
            PolarityCondition::Dirichlet(values) => PolarityCondition::Dirichlet(pair(values, "polarity.dirichlet")),
            PolarityCondition::Neumann => PolarityCondition::Neumann,
        };
        let density = self.density.map(|density| density.given_at(&place("density")));
        Self { velocity, polarity, density }
    }

    /// The same with rest where a wall resists: the essential conditions that hold as many rigid motions.
    #[must_use]
    pub fn at_rest_where_resisted(&self) -> Self {
        let rest = || VelocityCondition::Dirichlet([0.0, 0.0].map(Expression::constant));
        let velocity = self.velocity.resistance().map_or_else(|| self.velocity.clone(), |_| rest());
        Self { velocity, ..self.clone() }
    }

    /// The formulas of the conditions, by key.
    pub fn formulas(&self) -> [(&'static str, Vec<&Expression>); 3] {
        let velocity = self.velocity.formulas().iter().collect();
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
    /// `ρ` where `v·n < 0`; needed on every tag but those with `"slip"` or `friction`, which must not have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "compressible", "x-rule" = "≥ 0", "x-default" = "that of `[exact]`"))]
    pub density: Option<Formula>,
    /// What rigid bodies meet here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "incompressible", "x-default" = PASSAGE))]
    pub bodies: Option<Passage>,
}

/// What bodies meet where a scene does not say it.
pub const PASSAGE: &str =
    "`\"wall\"` where a `[[wall]]` has the tag; `\"leave\"` where the flow may pass and some body moves; else –";

const VELOCITY_HINT: &str = "the choices are \"slip\", { friction = b }, \"no-tangential\", \"traction\", { traction = [s_1, s_2] }, \
                             { dirichlet = [v_1, v_2] }";
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
        let velocity = self.velocity.of_velocity(parameters, exact)?;
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
        Self { velocity: self.velocity.resolved(), ..self.clone() }
    }
}

/// `β_w`, which a matrix that is made once depends on.
fn wall_friction(given: &Formula, parameters: &[(&str, f64)]) -> Result<Expression, ModelError> {
    let key = "velocity.friction";
    let refuse = |rule: &str, hint: &str| Err(ModelError::new(key, format!("\"{given}\""), rule, hint));
    let beta = given.parse(parameters).map_err(|error| ModelError::of_expression(key, &error))?;
    if beta.depends_on_time() {
        return refuse("must not depend on t", "a formula of x and y: a wall resists as much at all times");
    }
    if beta.is_constant() && beta.eval(Point::zeros(), 0.0) < 0.0 {
        return refuse("must not be negative", "0 is a wall that slips; large values hold the tissue");
    }
    Ok(beta)
}

fn polarity_condition(
    given: &NamedCondition,
    parameters: &[(&str, f64)],
    exact: Option<&Exact>,
) -> Result<PolarityCondition, ModelError> {
    let wrong = |rule: String| ModelError::new("polarity", given, rule, POLARITY_HINT);
    match (given.name.as_str(), &given.values) {
        ("neumann", None) => Ok(PolarityCondition::Neumann),
        ("dirichlet", Some(Values::Pair(values))) => {
            Ok(PolarityCondition::Dirichlet(vector("polarity.dirichlet", values, parameters)?))
        }
        ("dirichlet", None) => match exact {
            Some(exact) => Ok(PolarityCondition::Dirichlet(exact.polarity().clone())),
            None => Err(wrong(
                "`dirichlet` needs its two components, because there is no [exact] to take them from".to_owned(),
            )),
        },
        ("dirichlet", Some(Values::One(_))) => Err(wrong("`dirichlet` takes two components".to_owned())),
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
    match (velocity.is_impermeable(), given) {
        (true, None) => Ok(None),
        (true, Some(given)) => {
            let hint = "remove it; only what flows in has a density to be given";
            let rule = format!("nothing passes a boundary that is \"{}\"", velocity.name());
            Err(ModelError::new("density", format!("\"{given}\""), rule, hint))
        }
        (false, Some(given)) => Ok(Some(ModelError::parse_density("density", given, parameters)?)),
        (false, None) => {
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

impl NamedCondition {
    /// As a condition of the velocity, with `parameters` bound in the formulas; a `dirichlet` without values takes
    /// those of the exact fields.
    ///
    /// # Errors
    /// An unknown condition, values where none belong or none where they are needed, a bad formula.
    pub fn of_velocity(
        &self,
        parameters: &[(&str, f64)],
        exact: Option<&Exact>,
    ) -> Result<VelocityCondition, ModelError> {
        let wrong = |rule: String| ModelError::new("velocity", self, rule, VELOCITY_HINT);
        match (self.name.as_str(), &self.values) {
            ("slip", None) => Ok(VelocityCondition::Slip),
            ("no-tangential", None) => Ok(VelocityCondition::NoTangential),
            ("traction", None) => Ok(VelocityCondition::Traction([0.0, 0.0].map(Expression::constant))),
            ("traction", Some(Values::Pair(values))) => {
                Ok(VelocityCondition::Traction(vector("velocity.traction", values, parameters)?))
            }
            ("dirichlet", Some(Values::Pair(values))) => {
                Ok(VelocityCondition::Dirichlet(vector("velocity.dirichlet", values, parameters)?))
            }
            ("dirichlet", None) => match exact {
                Some(exact) => Ok(VelocityCondition::Dirichlet(exact.velocity().clone())),
                None => Err(wrong(
                    "`dirichlet` needs its two components, because there is no [exact] to take them from".to_owned(),
                )),
            },
            ("friction", Some(Values::One(beta))) => wall_friction(beta, parameters).map(VelocityCondition::Friction),
            ("friction", None) => {
                Err(wrong("`friction` needs a number or a formula, as in { friction = 3 }".to_owned()))
            }
            ("friction", Some(Values::Pair(_))) => Err(wrong("`friction` takes one number or formula".to_owned())),
            ("traction" | "dirichlet", Some(Values::One(_))) => {
                Err(wrong(format!("`{}` takes two components", self.name)))
            }
            ("slip" | "no-tangential", Some(_)) => Err(wrong(format!("`{}` takes no values", self.name))),
            (other, _) => Err(wrong(format!(
                "no such velocity condition{}",
                names::did_you_mean(other, &VELOCITY.map(|one| one.name))
            ))),
        }
    }

    /// The condition of the velocity with its default filled in.
    #[must_use]
    pub fn resolved(&self) -> Self {
        let mut full = self.clone();
        if full.name == "traction" && full.values.is_none() {
            full.values = Some(Values::Pair([0, 0].map(Formula::Integer)));
        }
        full
    }

    /// Whether it is a condition of the velocity under which tissue can turn in a round domain.
    pub fn lets_turn(&self) -> bool {
        matches!(self.name.as_str(), "slip" | "friction")
    }
}
