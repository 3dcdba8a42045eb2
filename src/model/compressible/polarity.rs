//! The polarity equation of a sheet with density   [7.34]

use super::{Compressible, VACUUM};
use crate::form::words::Scalar;
use crate::form::{Bilinear, mass};
use crate::model::incompressible::Inputs;
use crate::model::terms::{MOLECULAR, POLARITY, Sum};
use crate::solve::axpy;
use crate::solve::blocks::VectorBlocks;
use crate::space::Field;

impl Compressible {
    /// `∫ [ρ|p|² − (ρ − ρ_min)] p·q + κ² [a_swip(p,q;ρ) − l_swip(q;ρ)] = (1/B)(L_h|q)` as a functional   [7.34]
    pub fn molecular_functional(&self, rho: &Field, p: &Field, t: f64) -> Vec<f64> {
        let (given, rest) = (self.given(t), Field::zero(&self.velocity));
        let form = Sum::of(&[MOLECULAR]).value(&self.at(rho, p, &rest, &given));
        self.loops.vector(&form, &self.polarity.space)
    }

    /// `div_h(ρ∇p) = M⁻¹ [l_swip(q;ρ) − a_swip(p,q;ρ)]`
    pub fn diffused(&self, rho: &Field, p: &Field, t: f64) -> Field {
        let (given, rest) = (self.given(t), Field::zero(&self.velocity));
        let form = Sum::of(&[MOLECULAR]).constant().value(&self.at(rho, p, &rest, &given));
        let kappa2 = self.parameters.coherence.powi(2);
        let values = self.polarity.mass_solve(&self.loops.vector(&form, &self.polarity.space));
        Field::new(&self.polarity.space, values.into_iter().map(|v| -v / kappa2).collect())
    }

    /// `Pe a_upw(p,q;ρv) − Pe [ω(p,ρq,v) + a δ(p,ρq,v)] + (1/B)(L_h|q) − Pe ∫_ΓDp ρ(v·n)⊖ p_D·q − (f_p|q)`   [7.34]
    pub fn polarity_residual(&self, rho: &Field, p: &Field, v: &Field, well: &[f64], inputs: &Inputs) -> Vec<f64> {
        let given = self.given(inputs.t);
        let form = Sum::of(&[POLARITY]).value(&self.at(rho, p, v, &given));
        let mut out = self.loops.vector(&form, &self.polarity.space);
        axpy(1.0, well, &mut out);
        axpy(-1.0, &inputs.source, &mut out);
        out
    }

    /// `Pe (ρ r|q)` for a given r, ρ with a trace of [`VACUUM`]   [7.34]
    pub fn inertia(&self, rho: &Field, r: &Field) -> Vec<f64> {
        let degree = r.space.degree + rho.space.degree;
        let load = mass::load(&r.space, degree, |x| r.vector(&x.site) * (rho.scalar(&x.site) + VACUUM));
        self.loops.vector(&(self.parameters.peclet * load), &r.space)
    }

    /// `w Pe (ρp|q)`, of one component   [7.34]
    pub(super) fn inertia_form<'a>(&self, rho: &'a Field, w: f64) -> Bilinear<'a, Scalar, Scalar> {
        let (space, w) = (&*self.polarity.space, w * self.parameters.peclet);
        mass::weighted_mass(space, rho.space.degree, move |x| w * (rho.scalar(&x.site) + VACUUM))
    }

    /// The linear equation of the polarity in one pass   [8.38]: what is not linear is that of `last`.
    pub fn relaxed(
        &self,
        rho: &Field,
        v: &Field,
        (w, history): (f64, &Field),
        last: &Field,
        inputs: &Inputs,
    ) -> (VectorBlocks, Vec<f64>) {
        let (space, given) = (&*self.polarity.space, self.given(inputs.t));
        let forms = Sum::of(&[POLARITY, MOLECULAR]).pass(&self.at(rho, last, v, &given));
        let mut operator = self.polarity.empty_operator();
        self.add_alike(&(forms.components + self.inertia_form(rho, w)), &mut operator);
        self.loops.add_mixed(&forms.full, space, &mut operator);
        let mut right = inputs.source.clone();
        axpy(-1.0, &self.loops.vector(&forms.rest, space), &mut right);
        axpy(-1.0, &self.inertia(rho, history), &mut right);
        (operator, right)
    }

    /// Adds a form that acts on both components alike.
    pub(super) fn add_alike(&self, form: &Bilinear<Scalar, Scalar>, out: &mut VectorBlocks) {
        let space = &*self.polarity.space;
        let mut diagonal = vec![0.0; out.diagonal.len() / 4];
        self.loops.add_rows(form, (space, space), &mut diagonal, &mut out.off);
        out.add_alike(&diagonal);
    }
}
