//! Parameters of the model, and the terms that they switch on.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::ModelError;
use super::beside::Beside;
use super::terms::{Factors, factor};
use crate::form::compression::Compression;
use crate::names;

/// The table `[model]` of a scene. Everything is dimensionless.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub struct ModelScene {
    /// Which equations: `incompressible` or `compressible`.
    pub kind: String,
    /// `C_F ≥ 0`, friction with the substrate; exactly one of `friction` and `beta`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// `β = C_F/(1+C_F)` in [0, 1), the share of friction in the dissipation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beta: Option<f64>,
    /// `T_a`, traction force along the polarity (default `C_F`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub traction: Option<f64>,
    /// `S_a`, anisotropic active stress (default 0).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub active_stress: Option<f64>,
    /// `Pe > 0`, relaxation time of the polarity over the time of the flow.
    pub peclet: f64,
    /// `κ > 0`, coherence length of the polarity.
    pub coherence: f64,
    /// `B ≥ 0`, polar elasticity over viscosity (default 0).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elasticity: Option<f64>,
    /// `a ∈ [−1, 1]`, alignment of the polarity with the flow's stretching, in the objective derivative (default 1).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alignment: Option<f64>,
    /// How the elastic force is discretised: `"stress"` (default) or `"energy-consistent"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elastic_force: Option<ElasticForce>,
    /// `S_a'`, isotropic active stress (default 0); compressible only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub active_stress_iso: Option<f64>,
    /// What the density does to the pressure and the polarity; compressible only, and needed there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<DensityScene>,
    /// Factors of terms that have one of their own, by key; see [`factor`].
    #[serde(flatten, skip_deserializing)]
    pub factors: BTreeMap<String, f64>,
}

/// The table `[model.density]` of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DensityScene {
    /// `c_0 ≥ 0`, density penalty.
    pub penalty: f64,
    /// `γ ≥ 0`, its exponent (default 1).
    #[serde(default = "default_exponent")]
    pub exponent: f64,
    /// `ρ_min ≥ 0`, density below which the polarity vanishes (default 0).
    #[serde(default)]
    pub critical: f64,
}

fn default_exponent() -> f64 {
    1.0
}

/// How the elastic force of polarity gradients is discretised.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ElasticForce {
    /// `κ²B c_h(p,p,w)` [7.11a]: more accurate pressure and velocity.
    #[default]
    Stress,
    /// `X(w)`, the power of advection: the discrete energy law holds to rounding, the multiplier is `Π + Ψ`.
    #[serde(rename = "energy-consistent")]
    Energy,
}

/// Kinds of scenes.
const KINDS: [&str; 4] = ["incompressible", "compressible", "stokes", "particles"];

/// Which equations are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// `v`, `Π`, `p` with `div v = 0`   [5.47–5.48]
    Incompressible,
    /// `v`, `ρ`, `p`; the pressure follows from the density.
    Compressible,
}

/// What only a sheet of varying density has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DensityLaw {
    /// `c_0`
    pub penalty: f64,
    /// `γ`
    pub exponent: f64,
    /// `ρ_min`
    pub critical: f64,
    /// `S_a'`
    pub active_stress_iso: f64,
}

/// Checked parameters of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// `C_F`
    pub friction: f64,
    /// `T_a`
    pub traction: f64,
    /// `S_a`
    pub active_stress: f64,
    /// `Pe`
    pub peclet: f64,
    /// `κ`
    pub coherence: f64,
    /// `B`
    pub elasticity: f64,
    /// `a`
    pub alignment: f64,
    /// How the elastic force is discretised.
    pub elastic_force: ElasticForce,
    /// `c_0`, `γ`, `ρ_min` and `S_a'`; `None` in the incompressible sheet, whose density is 1.
    pub density: Option<DensityLaw>,
    /// Of the terms that have one of their own.
    pub factors: Factors,
}

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
                let hint =
                    "the kinds that exist are \"incompressible\", \"compressible\", \"stokes\" and \"particles\"";
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
        let elasticity = self.elasticity.unwrap_or(0.0);
        let alignment = self.alignment.unwrap_or(1.0);
        let stationary = "Pe = 0 would leave the polarity without a time derivative; use a small value such as 0.01";
        let smooth = "κ is the length over which the polarity varies; about 0.1 disc radii is usual";
        let elastic = "B = 0 switches the elastic stress off";
        let objective = "a = 1 is the upper-convected derivative, 0 the corotational, −1 the lower-convected";
        Ok(Parameters {
            friction,
            traction: finite("traction", self.traction.unwrap_or(friction))?,
            active_stress: finite("active_stress", self.active_stress.unwrap_or(0.0))?,
            peclet: require("peclet", pe, pe > 0.0, "must be greater than 0", stationary)?,
            coherence: require("coherence", kappa, kappa > 0.0, "must be greater than 0", smooth)?,
            elasticity: require("elasticity", elasticity, elasticity >= 0.0, "must not be negative", elastic)?,
            alignment: require("alignment", alignment, alignment.abs() <= 1.0, "must lie in [-1, 1]", objective)?,
            elastic_force: self.elastic_force.unwrap_or_default(),
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
            require(&format!("density.{key}"), value, value >= 0.0, "must be finite and not negative", hint)
        };
        let iso = self.active_stress_iso.unwrap_or(0.0);
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
                require("density.exponent", exponent, exponent <= LARGEST_EXPONENT, rule, hint)
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
            (Some(friction), None) if friction >= 0.0 && friction.is_finite() => {
                require("friction", friction, true, "must be finite and not negative", "C_F is about 1 to 100")
            }
            (Some(friction), None) => {
                let hint = "C_F = 0 is tissue without substrate; or give `beta` in [0, 1)";
                Err(ModelError::new("friction", format!("{friction:?}"), "must be finite and not negative", hint))
            }
            (None, Some(beta)) if (0.0..1.0).contains(&beta) => {
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
/// Exponents above this make pressures of moderate densities as large.
const LARGEST_EXPONENT: f64 = 50.0;

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

impl Default for Parameters {
    fn default() -> Self {
        Self::PLAIN
    }
}

impl Parameters {
    /// An incompressible sheet with friction and traction 1, `Pe = κ = a = 1`, and nothing else.
    pub const PLAIN: Self = Self {
        friction: 1.0,
        traction: 1.0,
        active_stress: 0.0,
        peclet: 1.0,
        coherence: 1.0,
        elasticity: 0.0,
        alignment: 1.0,
        elastic_force: ElasticForce::Stress,
        density: None,
        factors: Factors::NONE,
    };

    /// Which equations these are the parameters of.
    pub fn kind(&self) -> ModelKind {
        match self.density {
            None => ModelKind::Incompressible,
            Some(_) => ModelKind::Compressible,
        }
    }

    /// `β = C_F/(1+C_F)`
    pub fn beta(&self) -> f64 {
        self.friction / (1.0 + self.friction)
    }

    /// The isotropic stress of a sheet with a density.
    ///
    /// # Panics
    /// Without a density.
    pub fn compression(&self) -> Compression {
        let DensityLaw { penalty, exponent, critical, active_stress_iso } = self.density.expect("a density law");
        Compression { penalty, exponent, elasticity: self.elasticity, critical, active: active_stress_iso }
    }

    /// Names and values that formulas may use.
    pub fn symbols(&self) -> Vec<(&'static str, f64)> {
        let mut symbols = vec![
            ("friction", self.friction),
            ("beta", self.beta()),
            ("traction", self.traction),
            ("active_stress", self.active_stress),
            ("peclet", self.peclet),
            ("coherence", self.coherence),
            ("elasticity", self.elasticity),
            ("alignment", self.alignment),
        ];
        if let Some(law) = self.density {
            symbols.extend([
                ("density_penalty", law.penalty),
                ("density_exponent", law.exponent),
                ("density_critical", law.critical),
                ("active_stress_iso", law.active_stress_iso),
            ]);
        }
        symbols.extend(factor::of_kind(self.kind()).map(|factor| (factor.key, self.factors.of(factor.key))));
        symbols
    }

    /// Whether the molecular field `ℓ` acts on the flow; it is not computed otherwise.
    pub fn has_molecular_field(&self) -> bool {
        self.elasticity > 0.0
    }

    /// Whether the free energy is more than zero: of polar elasticity or of the density.
    pub fn has_free_energy(&self) -> bool {
        self.elasticity > 0.0 || self.density.is_some_and(|law| law.penalty > 0.0)
    }
}
