//! The table `[model]` of a scene: its keys, and the parameters that they give.

use std::collections::BTreeMap;

use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::ModelError;
use super::beside::Beside;
use super::parameters::{DensityLaw, ModelKind, Parameters, PolarityForm};
use super::terms::{Factors, factor};
use crate::names;
use crate::schema::{self, Range};

/// The table `[model]` of a scene. Everything is dimensionless.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, remote = "Self")]
#[schemars(transform = schema::in_order::<Self>, transform = kinds, transform = factors)]
#[schemars(extend("oneOf" = [{ "required": ["friction"] }, { "required": ["beta"] }]))]
pub struct ModelScene {
    /// Which equations.
    pub kind: String,
    /// Friction with the substrate, `C_F`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::NOT_NEGATIVE.said(), extend("x-default" = "this or `beta`"))]
    pub friction: Option<f64>,
    /// The same as a share of the dissipation, `β = C_F/(1+C_F)`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = ModelScene::BETA.said(), extend("x-default" = "this or `friction`"))]
    pub beta: Option<f64>,
    /// Traction force along the polarity, `T_a`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "`C_F`"))]
    pub traction: Option<f64>,
    /// Active stress along the polarity, `S_a`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = ModelScene::ACTIVE_STRESS))]
    pub active_stress: Option<f64>,
    /// Relaxation time of the polarity over that of the flow, `Pe`.
    #[schemars(transform = Range::POSITIVE.said())]
    pub peclet: f64,
    /// Length over which the polarity is coherent, `κ`.
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "length"))]
    pub coherence: f64,
    /// Polar elasticity over viscosity, `B`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::NOT_NEGATIVE.said(), extend("default" = ModelScene::ELASTICITY))]
    pub elasticity: Option<f64>,
    /// Alignment of the polarity with the flow's stretching, `a` of the objective derivative.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = ModelScene::ALIGNMENT.said(), extend("default" = ModelScene::USUAL_ALIGNMENT))]
    pub alignment: Option<f64>,
    /// Form of the elastic force, see below.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = ElasticForce::default()))]
    pub elastic_force: Option<ElasticForce>,
    /// How the cells of the polarity see one another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-default" = "`\"hybrid\"` where the model has that"))]
    pub polarity_form: Option<PolarityForm>,
    /// Isotropic active stress, `S_a'`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "compressible", "default" = ModelScene::ACTIVE_STRESS))]
    pub active_stress_iso: Option<f64>,
    /// What the density does to the pressure and the polarity; needed there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = "compressible"))]
    pub density: Option<DensityScene>,
    /// Factors of terms that have one of their own, by key; see [`factor`].
    #[serde(flatten, skip_deserializing)]
    #[schemars(skip)]
    pub factors: BTreeMap<String, f64>,
}

/// The kinds that the table is for.
fn kinds(schema: &mut Schema) {
    let kind = |name: &str, help: &str| {
        let mut kind = schema::choice(name, help);
        kind["x-kinds"] = name.into();
        kind
    };
    let both = [kind("incompressible", "`v`, `Π`, `p` with `div v = 0`"), kind("compressible", "`v`, `ρ`, `p`")];
    if let Some(one) = schema.pointer_mut("/properties/kind").and_then(|one| one.as_object_mut()) {
        one.remove("type");
        one.insert("oneOf".to_owned(), both.into());
    }
}

/// The keys of the terms that have a factor of their own.
fn factors(schema: &mut Schema) {
    let Some(keys) = schema.get_mut("properties").and_then(|properties| properties.as_object_mut()) else { return };
    for (factor, has) in factor::all() {
        let about = format!("{}, `{}`", factor.help, factor.symbol);
        let mut key = serde_json::json!({ "type": "number", "description": about, "default": 0 });
        match has {
            [true, true] | [false, false] => {}
            [true, false] => key["x-kinds"] = "incompressible".into(),
            [false, true] => key["x-kinds"] = "compressible".into(),
        }
        keys.insert(factor.key.to_owned(), key);
    }
}

/// The table `[model.density]` of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub struct DensityScene {
    /// Density penalty, `c_0`; the pressure `ρΠ` is `c_0 ρ^(γ+1)`.
    #[schemars(transform = Range::NOT_NEGATIVE.said())]
    pub penalty: f64,
    /// Its exponent, `γ`.
    #[serde(default = "default_exponent")]
    #[schemars(transform = DensityScene::EXPONENT.said())]
    pub exponent: f64,
    /// Density below which the polarity vanishes, `ρ_min`.
    #[serde(default)]
    #[schemars(transform = Range::NOT_NEGATIVE.said())]
    pub critical: f64,
}

impl DensityScene {
    /// Larger exponents make pressures of moderate densities that leave the range of numbers.
    pub const EXPONENT: Range = Range::within(0.0, 50.0);
}

fn default_exponent() -> f64 {
    1.0
}

/// How the elastic force of polarity gradients is discretised.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ElasticForce {
    /// `κ²B c_h(p,p,w)` [7.11a]: more accurate pressure and velocity.
    #[default]
    Stress,
    /// `X(w)`, the power of advection: the discrete energy law holds to rounding, the multiplier is `Π + Ψ`.
    #[serde(rename = "energy-consistent")]
    #[schemars(extend("x-kinds" = "incompressible"))]
    Energy,
}

/// Kinds of scenes.
const KINDS: [&str; 5] = ["incompressible", "compressible", "stokes", "particles", "advection"];

impl<'de> Deserialize<'de> for ModelScene {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut factors = BTreeMap::new();
        let keys: Vec<&str> = factor::all().map(|(factor, _)| factor.key).collect();
        let table = Self::deserialize(Beside { inner: deserializer, keys: &keys, found: &mut factors })?;
        Ok(Self { factors, ..table })
    }
}

impl Serialize for ModelScene {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl ModelScene {
    /// Of `β`: at 1 there would be nothing but friction.
    pub const BETA: Range = Range::below(0.0, 1.0);
    /// Of `a`: from the lower-convected to the upper-convected derivative.
    pub const ALIGNMENT: Range = Range::within(-1.0, 1.0);
    const ACTIVE_STRESS: f64 = 0.0;
    const ELASTICITY: f64 = 0.0;
    /// The upper-convected derivative.
    const USUAL_ALIGNMENT: f64 = 1.0;

    /// Which equations the table asks for.
    ///
    /// # Errors
    /// A kind that does not exist.
    pub fn kind(&self) -> Result<ModelKind, ModelError> {
        match self.kind.as_str() {
            "incompressible" => Ok(ModelKind::Incompressible),
            "compressible" => Ok(ModelKind::Compressible),
            other => {
                let rule = format!("no such model{}", names::did_you_mean(other, &KINDS));
                let names = KINDS.map(|name| format!("\"{name}\"")).join(", ");
                let hint = format!("the kinds that exist are {names}");
                Err(ModelError::new("kind", format!("\"{other}\""), rule, hint))
            }
        }
    }

    /// The table with every default filled in; `friction` or `beta` stays as it was given.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn resolved(&self) -> Result<Self, ModelError> {
        let p = self.check()?;
        Ok(Self {
            traction: Some(p.traction),
            active_stress: Some(p.active_stress),
            elasticity: Some(p.elasticity),
            alignment: Some(p.alignment),
            elastic_force: Some(p.elastic_force),
            active_stress_iso: p.density.map(|law| law.active_stress_iso),
            ..self.clone()
        })
    }

    /// The parameters, checked one by one.
    ///
    /// # Errors
    /// A value that is not finite or out of range; neither or both of `friction` and `beta`; a key of the other kind.
    pub fn check(&self) -> Result<Parameters, ModelError> {
        let kind = self.kind()?;
        let friction = self.check_friction()?;
        let (pe, kappa) = (self.peclet, self.coherence);
        let elasticity = self.elasticity.unwrap_or(Self::ELASTICITY);
        let alignment = self.alignment.unwrap_or(Self::USUAL_ALIGNMENT);
        let stationary = "Pe = 0 would leave the polarity without a time derivative; use a small value such as 0.01";
        let smooth = "κ is the length over which the polarity varies; about 0.1 disc radii is usual";
        let elastic = "B = 0 switches the elastic stress off";
        let objective = "a = 1 is the upper-convected derivative, 0 the corotational, −1 the lower-convected";
        Ok(Parameters {
            friction,
            traction: finite("traction", self.traction.unwrap_or(friction))?,
            active_stress: finite("active_stress", self.active_stress.unwrap_or(Self::ACTIVE_STRESS))?,
            peclet: require("peclet", pe, Range::POSITIVE.has(pe), "must be greater than 0", stationary)?,
            coherence: require("coherence", kappa, Range::POSITIVE.has(kappa), "must be greater than 0", smooth)?,
            elasticity: require(
                "elasticity",
                elasticity,
                Range::NOT_NEGATIVE.has(elasticity),
                "must not be negative",
                elastic,
            )?,
            alignment: require(
                "alignment",
                alignment,
                Self::ALIGNMENT.has(alignment),
                "must lie in [-1, 1]",
                objective,
            )?,
            elastic_force: self.elastic_force.unwrap_or_default(),
            form: self.polarity_form.unwrap_or_default(),
            density: match kind {
                ModelKind::Incompressible => self.check_no_density()?,
                ModelKind::Compressible => Some(self.check_density()?),
            },
            factors: self.check_factors(kind)?,
        })
    }

    /// The factors of terms, each of a term that the kind has.
    fn check_factors(&self, kind: ModelKind) -> Result<Factors, ModelError> {
        let known = |key: &str| factor::of_kind(kind).any(|factor| factor.key == key);
        self.factors.iter().try_fold(Factors::NONE, |all, (key, value)| match known(key) {
            true => Ok(all.with(key, finite(key, *value)?)),
            false => Err(ModelError::new(key, value, "this kind of sheet has no such term", "remove it")),
        })
    }

    /// The incompressible sheet has none of the keys about its density.
    fn check_no_density(&self) -> Result<Option<DensityLaw>, ModelError> {
        let hint = "remove it, or take kind = \"compressible\"";
        if self.density.is_some() {
            let rule = "the density of an incompressible sheet is 1 everywhere";
            return Err(ModelError::new("density", "(a table)", rule, hint));
        }
        self.active_stress_iso.map_or(Ok(None), |value| {
            let rule = "in an incompressible sheet the pressure takes up an isotropic stress";
            Err(ModelError::new("active_stress_iso", value, rule, hint))
        })
    }

    fn check_density(&self) -> Result<DensityLaw, ModelError> {
        let Some(DensityScene { penalty, exponent, critical }) = self.density else {
            let hint = "add the table [model.density] with `penalty`, such as penalty = 1.0";
            return Err(ModelError::new(
                "density",
                "(missing)",
                "a compressible sheet needs its density penalty",
                hint,
            ));
        };
        if self.elastic_force == Some(ElasticForce::Energy) {
            let rule = "this form is not available for a sheet that is squeezed";
            let hint = "take elastic_force = \"stress\", or kind = \"incompressible\"";
            return Err(ModelError::new("elastic_force", "\"energy-consistent\"", rule, hint));
        }
        let positive = |key: &str, value: f64, hint: &str| {
            require(
                &format!("density.{key}"),
                value,
                Range::NOT_NEGATIVE.has(value),
                "must be finite and not negative",
                hint,
            )
        };
        let iso = self.active_stress_iso.unwrap_or(Self::ACTIVE_STRESS);
        Ok(DensityLaw {
            penalty: positive(
                "penalty",
                penalty,
                "c_0 makes the pressure c_0 ρ^γ; 0 lets the sheet be squeezed freely",
            )?,
            exponent: positive(
                "exponent",
                exponent,
                "γ = 1, the default, makes the pressure proportional to the density",
            )
            .and_then(|exponent| {
                let rule = "must be at most 50: the pressure c_0 ρ^γ would leave the range of numbers";
                let hint = "γ = 1 to 7 is usual; for a sheet that is hardly squeezed raise `penalty`, c_0";
                require("density.exponent", exponent, DensityScene::EXPONENT.has(exponent), rule, hint)
            })?,
            critical: positive(
                "critical",
                critical,
                "below ρ_min the polarity vanishes; 0 lets it live at any density",
            )?,
            active_stress_iso: finite("active_stress_iso", iso)?,
        })
    }

    /// `C_F`, given as such or by `β = C_F/(1+C_F)`.
    fn check_friction(&self) -> Result<f64, ModelError> {
        match (self.friction, self.beta) {
            (Some(friction), None) if Range::NOT_NEGATIVE.has(friction) => {
                require("friction", friction, true, "must be finite and not negative", "C_F is about 1 to 100")
            }
            (Some(friction), None) => {
                let hint = "C_F = 0 is tissue without substrate; or give `beta` in [0, 1)";
                Err(ModelError::new("friction", format!("{friction:?}"), "must be finite and not negative", hint))
            }
            (None, Some(beta)) if Self::BETA.has(beta) => {
                require("beta", beta, true, "must lie in [0, 1)", "beta = 0.75 is C_F = 3")
                    .map(|beta| beta / (1.0 - beta))
            }
            (None, Some(beta)) => {
                let hint = "beta = C_F/(1+C_F) is the share of friction in the dissipation; beta = 0.75 is C_F = 3";
                Err(ModelError::new("beta", format!("{beta:?}"), "must lie in [0, 1)", hint))
            }
            (None, None) => {
                let rule = "exactly one of `friction` and `beta` is needed";
                Err(ModelError::new("friction", "(missing)", rule, "add `friction = 3.0` or `beta = 0.75`"))
            }
            (Some(_), Some(beta)) => {
                let rule = "exactly one of `friction` and `beta` may be given, here are both";
                Err(ModelError::new(
                    "beta",
                    format!("{beta:?}"),
                    rule,
                    "remove one; on the command line, `--set model.beta=` does it",
                ))
            }
        }
    }
}

/// Parameters beyond these powers of ten, or below their inverses, leave the range of numbers where they are
/// multiplied.
const LARGEST: f64 = 1e40;

fn require(key: &str, value: f64, holds: bool, rule: &str, hint: &str) -> Result<f64, ModelError> {
    if !(value.is_finite() && holds) {
        return Err(ModelError::new(key, format!("{value:?}"), rule, hint));
    }
    let size = value.abs();
    if size > LARGEST || (size > 0.0 && size < 1.0 / LARGEST) {
        let rule = "its size must lie between 1e-40 and 1e40, or be 0 where that is allowed";
        return Err(ModelError::new(
            key,
            format!("{value:?}"),
            rule,
            "choose units in which lengths and times are near 1",
        ));
    }
    Ok(value)
}

fn finite(key: &str, value: f64) -> Result<f64, ModelError> {
    require(key, value, true, "must be finite", "give a plain number")
}
