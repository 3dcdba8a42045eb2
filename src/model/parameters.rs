//! Parameters of the model, and the terms that they switch on.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::fields::{DENSITY, FieldId, POLARITY, PRESSURE, VELOCITY};
pub use super::table::{DensityScene, ElasticForce, ModelScene};
use super::terms::{self, Factors, MOLECULAR, MOMENTUM, Sum, factor};
use crate::form::compression::Compression;

/// Which equations are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// `v`, `Π`, `p` with `div v = 0`   [5.47–5.48]
    Incompressible,
    /// `v`, `ρ`, `p`; the pressure follows from the density.
    Compressible,
}

impl ModelKind {
    /// The fields that are solved for.
    pub fn fields(self) -> &'static [FieldId] {
        match self {
            ModelKind::Incompressible => &[VELOCITY, PRESSURE, POLARITY],
            ModelKind::Compressible => &[VELOCITY, DENSITY, POLARITY],
        }
    }
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

/// How the cells of the polarity see one another.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PolarityForm {
    /// By values on their faces, which leaves a third of the factors of the coupled matrix.
    #[default]
    Hybrid,
    /// By jumps and means of their own values.
    Direct,
}

impl PolarityForm {
    /// As in a scene.
    pub fn name(self) -> &'static str {
        match self {
            PolarityForm::Hybrid => "hybrid",
            PolarityForm::Direct => "direct",
        }
    }
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
    /// How the polarity is discretised.
    pub form: PolarityForm,
    /// `c_0`, `γ`, `ρ_min` and `S_a'`; `None` in the incompressible sheet, whose density is 1.
    pub density: Option<DensityLaw>,
    /// Of the terms that have one of their own.
    pub factors: Factors,
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
        form: PolarityForm::Hybrid,
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

    /// Whether the polarity of a sheet without bodies is in hybrid form.
    pub fn is_hybrid(&self) -> bool {
        self.form == PolarityForm::Hybrid && self.keeps_direct().is_none()
    }

    /// Why the polarity cannot be in hybrid form; `None` where it can. Bodies in the tissue are another reason.
    pub fn keeps_direct(&self) -> Option<&'static str> {
        let wide = Sum::of(&[MOMENTUM]).is_wide(self) || Sum::of(&[terms::POLARITY, MOLECULAR]).is_wide(self);
        match self.kind() {
            ModelKind::Compressible => Some("a compressible sheet weighs diffusion with its density"),
            ModelKind::Incompressible if wide => Some("a term sees the polarities of both cells of a face"),
            ModelKind::Incompressible if self.coherence == 0.0 => Some("without coherence nothing is on the faces"),
            ModelKind::Incompressible => None,
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
