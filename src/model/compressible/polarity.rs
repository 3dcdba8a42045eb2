//! The polarity equation of a sheet with density   [7.34]

use super::{Compressible, VACUUM};
use crate::form::density::Density as Weight;
use crate::form::upwind::Carrier;
use crate::form::{FacePoint, elastic, mass, polarity as forms, swip, upwind};
use crate::model::incompressible::Inputs;
use crate::model::polarity::FORMULA_DEGREE;
use crate::solve::axpy;
use crate::solve::blocks::VectorBlocks;
use crate::space::Field;

impl Compressible {
    /// The flow ρv, its directions those of v.
    pub(super) fn carrier<'a>(&self, v: &'a Field, rho: &'a Field) -> Carrier<'a> {
        Carrier { density: Weight::Of(rho), ..Carrier::from(v) }
    }

    /// `∫ [ρ|p|² − (ρ − ρ_min)] p·q + κ² [a_swip(p,q;ρ) − l_swip(q;ρ)] = (1/B)(L_h|q)` as a functional   [7.34]
    pub fn molecular_functional(&self, rho: &Field, p: &Field, t: f64) -> Vec<f64> {
        let space = &*self.polarity.space;
        let mut out = self.loops.vector(&elastic::double_well(space, p, Weight::Of(rho), self.law().critical), space);
        axpy(self.parameters.coherence.powi(2), &self.diffusion(rho, p, t), &mut out);
        out
    }

    /// `a_swip(p,q;ρ) − l_swip(q;ρ)` as a functional   [6.24], [6.25]
    fn diffusion(&self, rho: &Field, p: &Field, t: f64) -> Vec<f64> {
        let (space, dirichlet) = (&*self.polarity.space, self.polarity.dirichlet);
        let data = move |s: &FacePoint| self.polarity.data(s, t);
        let mut form = swip::diffusion(p, dirichlet, Weight::Of(rho), FORMULA_DEGREE, data);
        if let Some((faces, exact)) = self.polarity.slopes() {
            let exact = exact.at_time(t);
            let slope = move |s: &FacePoint| exact.polarity_slope(s.minus.x, t, s.n) * rho.scalar(&s.minus);
            form = form - mass::face_load(space, faces, FORMULA_DEGREE + rho.space.degree, slope);
        }
        self.loops.vector(&form, space)
    }

    /// `div_h(ρ∇p) = M⁻¹ [l_swip(q;ρ) − a_swip(p,q;ρ)]`
    pub fn diffused(&self, rho: &Field, p: &Field, t: f64) -> Field {
        let values = self.polarity.mass_solve(&self.diffusion(rho, p, t)).into_iter().map(|v| -v).collect();
        Field::new(&self.polarity.space, values)
    }

    /// `Pe a_upw(p,q;ρv) − Pe [ω(p,ρq,v) + a δ(p,ρq,v)] + (1/B)(L_h|q) − Pe ∫_ΓDp ρ(v·n)⊖ p_D·q − (f_p|q)`   [7.34]
    pub fn polarity_residual(&self, rho: &Field, p: &Field, v: &Field, well: &[f64], inputs: &Inputs) -> Vec<f64> {
        let m = &self.parameters;
        let data = |s: &FacePoint| self.polarity.data(s, inputs.t);
        let advection = upwind::advection(p, self.carrier(v, rho), self.polarity.dirichlet, data);
        let form = m.peclet * advection - m.peclet * forms::turning(p, v, m.alignment, Weight::Of(rho));
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

    /// Adds `w Pe (ρp|q) + Pe a_upw(p,q;ρv) − Pe [ω(p,ρq,v) + a δ(p,ρq,v)]`, trial p   [7.34]
    pub(super) fn add_carried(&self, rho: &Field, v: &Field, w: f64, out: &mut VectorBlocks) {
        let (space, pe) = (&*self.polarity.space, self.parameters.peclet);
        let inertia = mass::weighted_mass(space, rho.space.degree, |x| w * (rho.scalar(&x.site) + VACUUM));
        let advection = upwind::a_upw(space, self.carrier(v, rho), self.polarity.dirichlet);
        self.add_alike(&(pe * (inertia + advection)), out);
        let turning = -pe * forms::objective(space, v, self.parameters.alignment, Weight::Of(rho));
        self.loops.add_cell_blocks(&turning, space, space, &mut out.diagonal);
    }

    /// The linear equation of the polarity in one pass   [8.38]: `|p|²` and the `−ρp` term are those of `last`.
    pub fn relaxed(
        &self,
        rho: &Field,
        v: &Field,
        (w, history): (f64, &Field),
        last: &Field,
        inputs: &Inputs,
    ) -> (VectorBlocks, Vec<f64>) {
        let (space, critical) = (&*self.polarity.space, self.law().critical);
        let degree = 2 * last.space.degree + rho.space.degree;
        let frozen = mass::weighted_mass(space, degree, |x| {
            rho.scalar(&x.site) * last.vector(&x.site).norm_squared() + critical
        });
        let kappa2 = self.parameters.coherence.powi(2);
        let diffusion = kappa2 * swip::a_swip(space, self.polarity.dirichlet, Weight::Of(rho));
        let mut operator = self.polarity.empty_operator();
        self.add_alike(&(frozen + diffusion), &mut operator);
        self.add_carried(rho, v, w, &mut operator);
        // what is left of the residual without polarity: inflow, boundary data and sources
        let none = Field::zero(&self.polarity.space);
        let well = self.molecular_functional(rho, &none, inputs.t);
        let mut right: Vec<f64> = self.polarity_residual(rho, &none, v, &well, inputs).iter().map(|r| -r).collect();
        axpy(-1.0, &self.inertia(rho, history), &mut right);
        let pushed =
            mass::load(space, rho.space.degree + last.space.degree, |x| last.vector(&x.site) * rho.scalar(&x.site));
        axpy(1.0, &self.loops.vector(&pushed, space), &mut right);
        (operator, right)
    }

    /// Adds a form that acts on both components alike.
    pub(super) fn add_alike(
        &self,
        form: &crate::form::Bilinear<crate::form::words::Scalar, crate::form::words::Scalar>,
        out: &mut VectorBlocks,
    ) {
        let space = &*self.polarity.space;
        let mut diagonal = vec![0.0; out.diagonal.len() / 4];
        self.loops.add_rows(form, (space, space), &mut diagonal, &mut out.off);
        out.add_alike(&diagonal);
    }
}
