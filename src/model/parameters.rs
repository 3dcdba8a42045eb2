//! Parameters of the incompressible model, and the terms that they switch on.

use serde::{Deserialize, Serialize};

use super::ModelError;

/// The table `[model]` of a scene. Everything is dimensionless.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelScene {
    /// Which equations: `incompressible`.
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
    /// `a ∈ [−1, 1]`, slip parameter of the objective derivative (default 1).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slip: Option<f64>,
    /// How the elastic force is discretised: `"stress"` (default) or `"energy-consistent"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elastic_force: Option<ElasticForce>,
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

/// Which equations are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// [5.47–5.48]
    Incompressible,
}

/// Checked parameters of the incompressible model.
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
    pub slip: f64,
    /// How the elastic force is discretised.
    pub elastic_force: ElasticForce,
}

/// A term of the equations, and whether a scene has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Term {
    /// Short name, e.g. `friction`.
    pub name: &'static str,
    /// As the weak form has it, e.g. `C_F (v|w)`.
    pub formula: &'static str,
    /// A term that is off is neither assembled nor stored.
    pub on: bool,
    /// Why it is on or off, e.g. `friction = 3`.
    pub reason: String,
}

impl ModelScene {
    /// Which equations the table asks for.
    ///
    /// # Errors
    /// A kind that does not exist, or not yet.
    pub fn kind(&self) -> Result<ModelKind, ModelError> {
        const LATER: [&str; 1] = ["compressible"];
        let hint = "the kinds that exist are `incompressible`";
        match self.kind.as_str() {
            "incompressible" => Ok(ModelKind::Incompressible),
            later if LATER.contains(&later) => {
                Err(ModelError::new("kind", format!("\"{later}\""), "this model is not built yet", hint))
            }
            other => Err(ModelError::new("kind", format!("\"{other}\""), "no such model", hint)),
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
            slip: Some(p.slip),
            elastic_force: Some(p.elastic_force),
            ..self.clone()
        })
    }

    /// The parameters, checked one by one.
    ///
    /// # Errors
    /// A value that is not finite or out of range; neither or both of `friction` and `beta`.
    pub fn check(&self) -> Result<Parameters, ModelError> {
        match self.kind()? {
            ModelKind::Incompressible => {}
        }
        let friction = self.check_friction()?;
        let require = |key: &str, value: f64, holds: bool, rule: &str, hint: &str| {
            if value.is_finite() && holds { Ok(value) } else { Err(ModelError::new(key, value, rule, hint)) }
        };
        let finite = |key: &str, value: f64| require(key, value, true, "must be finite", "give a plain number");
        let (pe, kappa) = (self.peclet, self.coherence);
        let elasticity = self.elasticity.unwrap_or(0.0);
        let slip = self.slip.unwrap_or(1.0);
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
            slip: require("slip", slip, slip.abs() <= 1.0, "must lie in [-1, 1]", objective)?,
            elastic_force: self.elastic_force.unwrap_or_default(),
        })
    }

    /// `C_F`, given as such or by `β = C_F/(1+C_F)`.
    fn check_friction(&self) -> Result<f64, ModelError> {
        match (self.friction, self.beta) {
            (Some(friction), None) if friction >= 0.0 && friction.is_finite() => Ok(friction),
            (Some(friction), None) => {
                let hint = "C_F = 0 is tissue without substrate; or give `beta` in [0, 1)";
                Err(ModelError::new("friction", friction, "must be finite and not negative", hint))
            }
            (None, Some(beta)) if (0.0..1.0).contains(&beta) => Ok(beta / (1.0 - beta)),
            (None, Some(beta)) => {
                let hint = "beta = C_F/(1+C_F) is the share of friction in the dissipation; beta = 0.75 is C_F = 3";
                Err(ModelError::new("beta", beta, "must lie in [0, 1)", hint))
            }
            (None, None) => {
                let rule = "exactly one of `friction` and `beta` is needed";
                Err(ModelError::new("friction", "(missing)", rule, "add `friction = 3.0` or `beta = 0.75`"))
            }
            (Some(_), Some(beta)) => {
                let rule = "exactly one of `friction` and `beta` may be given, here are both";
                Err(ModelError::new("beta", beta, rule, "remove one; on the command line, `--set model.beta=` does it"))
            }
        }
    }
}

impl Parameters {
    /// `β = C_F/(1+C_F)`
    pub fn beta(&self) -> f64 {
        self.friction / (1.0 + self.friction)
    }

    /// Names and values that formulas may use.
    pub fn symbols(&self) -> [(&'static str, f64); 8] {
        [
            ("friction", self.friction),
            ("beta", self.beta()),
            ("traction", self.traction),
            ("active_stress", self.active_stress),
            ("peclet", self.peclet),
            ("coherence", self.coherence),
            ("elasticity", self.elasticity),
            ("slip", self.slip),
        ]
    }

    /// Whether the molecular field `ℓ` acts on the flow; it is not computed otherwise.
    pub fn has_molecular_field(&self) -> bool {
        self.elasticity > 0.0
    }

    /// The terms of the semi-discrete system [7.11] in their order there, on and off.
    pub fn terms(&self) -> Vec<Term> {
        let always = |name, formula| Term { name, formula, on: true, reason: "always on".to_owned() };
        let by = |name, formula, key: &str, value: f64| Term {
            name,
            formula,
            on: value != 0.0,
            reason: format!("{key} = {value}"),
        };
        let elastic = |name, formula| by(name, formula, "elasticity", self.elasticity);
        let stretching = if self.elasticity == 0.0 {
            elastic("elastic stretching", "−a δ(p,L_h,w)")
        } else {
            by("elastic stretching", "−a δ(p,L_h,w)", "slip", self.slip)
        };
        vec![
            always("viscosity", "2(D(v)|D(w))"),
            by("friction", "C_F (v|w)", "friction", self.friction),
            always("pressure", "b(w,Π), b(v,ξ)"),
            by("traction", "T_a (p|w)", "traction", self.traction),
            elastic("elastic rotation", "−ω(p,L_h,w)"),
            stretching,
            match self.elastic_force {
                ElasticForce::Stress => elastic("elastic stress", "κ²B c_h(p,p,w)"),
                ElasticForce::Energy => elastic("elastic force", "X(w), energy-consistent"),
            },
            by("active stress", "S_a δ(p,p,w)", "active_stress", self.active_stress),
            elastic("molecular field", "L_h by the block-diagonal mass matrix"),
            always("polarity rate", "Pe (∂_t p|q)"),
            always("polarity advection", "Pe a_upw(p,q;v)"),
            always("polarity rotation", "−Pe ω(p,q,v)"),
            by("polarity stretching", "−Pe a δ(p,q,v)", "slip", self.slip),
            always("polarity relaxation", "((|p|²−1)p|q)"),
            always("polarity coherence", "κ² a_swip(p,q)"),
        ]
    }
}
