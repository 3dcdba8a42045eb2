//! The terms of the semi-discrete equations, on and off.

use serde::Serialize;

use super::parameters::{DensityLaw, ElasticForce, Parameters};

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

fn always(name: &'static str, formula: &'static str) -> Term {
    Term { name, formula, on: true, reason: "always on".to_owned() }
}

fn by(name: &'static str, formula: &'static str, key: &str, value: f64) -> Term {
    Term { name, formula, on: value != 0.0, reason: format!("{key} = {value}") }
}

impl Parameters {
    /// The terms of the semi-discrete system in their order there, on and off: [7.11], or that of the compressible sheet.
    pub fn terms(&self) -> Vec<Term> {
        match &self.density {
            None => self.incompressible_terms(),
            Some(law) => self.compressible_terms(law),
        }
    }

    fn incompressible_terms(&self) -> Vec<Term> {
        let elastic = |name, formula| by(name, formula, "elasticity", self.elasticity);
        vec![
            always("viscosity", "2(D(v)|D(w))"),
            by("friction", "C_F (v|w)", "friction", self.friction),
            always("pressure", "b(w,Π), b(v,ξ)"),
            by("traction", "T_a (p|w)", "traction", self.traction),
            elastic("elastic rotation", "−ω(p,L_h,w)"),
            self.elastic_stretching(),
            match self.elastic_force {
                ElasticForce::Stress => elastic("elastic stress", "κ²B c_h(p,p,w)"),
                ElasticForce::Energy => elastic("elastic force", "X(w), energy-consistent"),
            },
            by("active stress", "S_a δ(p,p,w)", "active_stress", self.active_stress),
            elastic("molecular field", "L_h by the block-diagonal mass matrix"),
            always("polarity rate", "Pe (∂_t p|q)"),
            always("polarity advection", "Pe a_upw(p,q;v)"),
            always("polarity rotation", "−Pe ω(p,q,v)"),
            by("polarity stretching", "−Pe a δ(p,q,v)", "alignment", self.alignment),
            always("polarity relaxation", "((|p|²−1)p|q)"),
            always("polarity coherence", "κ² a_swip(p,q)"),
        ]
    }

    fn compressible_terms(&self, law: &DensityLaw) -> Vec<Term> {
        let elastic = |name, formula| by(name, formula, "elasticity", self.elasticity);
        vec![
            always("viscosity", "2(ρD(v)|D(w))"),
            always("divergence viscosity", "2(ρ div v|div w)"),
            by("friction", "C_F (v|w)", "friction", self.friction),
            by("traction", "T_a (p|w)", "traction", self.traction),
            self.density_pressure(law),
            elastic("elastic rotation", "−ω(p,L_h,w)"),
            self.elastic_stretching(),
            elastic("elastic stress", "κ²B c_h(p,p,w;ρ)"),
            by("active stress", "S_a δ(ρp,p,w)", "active_stress", self.active_stress),
            by("isotropic active stress", "−S_a' b(w,ρ|p|²)", "active_stress_iso", law.active_stress_iso),
            elastic("molecular field", "L_h by the block-diagonal mass matrix"),
            always("density rate", "(∂_t ρ|z)"),
            always("density transport", "a_mass(ρ,z;v)"),
            always("polarity rate", "Pe (ρ∂_t p|q)"),
            always("polarity advection", "Pe a_upw(p,q;ρv)"),
            always("polarity rotation", "−Pe ω(p,ρq,v)"),
            by("polarity stretching", "−Pe a δ(p,ρq,v)", "alignment", self.alignment),
            always("polarity relaxation", "([ρ|p|²−(ρ−ρ_min)]p|q)"),
            always("polarity coherence", "κ² a_swip(p,q;ρ)"),
        ]
    }

    fn elastic_stretching(&self) -> Term {
        let (name, formula) = ("elastic stretching", "−a δ(p,L_h,w)");
        match self.elasticity == 0.0 {
            true => by(name, formula, "elasticity", self.elasticity),
            false => by(name, formula, "alignment", self.alignment),
        }
    }

    /// `ρΠ = c_0 ρ^(γ+1) − ½Bρ_min|p|²` has two parts, each of which may be off.
    fn density_pressure(&self, law: &DensityLaw) -> Term {
        let (name, formula) = ("pressure", "−b(w,ρΠ)");
        let polar = self.elasticity * law.critical;
        match law.penalty == 0.0 && polar != 0.0 {
            true => by(name, formula, "elasticity*density.critical", polar),
            false => by(name, formula, "density.penalty", law.penalty),
        }
    }
}
