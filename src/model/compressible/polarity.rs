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
        let mut out = self.loops.vector(&elastic::double_well(space, p, Weight::Of(rho), self.law.critical), space);
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
        let form = m.peclet * advection - m.peclet * forms::turning(p, v, m.slip, Weight::Of(rho));
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

    /// `w Pe (ρp|q) + Pe a_upw(p,q;ρv) − Pe [ω(p,ρq,v) + a δ(p,ρq,v)] + κ² a_swip(p,q;ρ)`, trial p, and `([…]p|q)` with what `well`
    /// gives   [7.34]
    pub(super) fn operator(
        &self,
        rho: &Field,
        v: &Field,
        w: f64,
        well: impl Fn(f64, crate::mesh::Point) -> f64 + Sync,
        last: &Field,
    ) -> VectorBlocks {
        let m = &self.parameters;
        let (space, weight) = (&*self.polarity.space, Weight::Of(rho));
        let carrier = self.carrier(v, rho);
        let frozen = mass::weighted_mass(space, 2 * last.space.degree + rho.space.degree, |x| {
            let density = rho.scalar(&x.site);
            m.peclet * w * (density + VACUUM) + well(density, last.vector(&x.site))
        });
        let alike = m.peclet * upwind::a_upw(space, carrier, self.polarity.dirichlet)
            + m.coherence.powi(2) * swip::a_swip(space, self.polarity.dirichlet, weight)
            + frozen;
        let mut out = self.polarity.empty_operator();
        self.add_alike(&alike, &mut out);
        let turning = -m.peclet * forms::objective(space, v, m.slip, weight);
        self.loops.add_cell_blocks(&turning, space, space, &mut out.diagonal);
        out
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
        let critical = self.law.critical;
        let operator = self.operator(rho, v, w, |density, p| density * p.norm_squared() + critical, last);
        // what is left of the residual without polarity: inflow, boundary data and sources
        let none = Field::zero(&self.polarity.space);
        let well = self.molecular_functional(rho, &none, inputs.t);
        let mut right: Vec<f64> = self.polarity_residual(rho, &none, v, &well, inputs).iter().map(|r| -r).collect();
        axpy(-1.0, &self.inertia(rho, history), &mut right);
        let (space, degree) = (&self.polarity.space, rho.space.degree + last.space.degree);
        let pushed = mass::load(space, degree, |x| last.vector(&x.site) * rho.scalar(&x.site));
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
        let n = space.n;
        let mut diagonal = vec![0.0; out.diagonal.len() / 4];
        self.loops.add_rows(form, (space, space), &mut diagonal, &mut out.off);
        for (block, alike) in out.diagonal.chunks_exact_mut(4 * n * n).zip(diagonal.chunks_exact(n * n)) {
            for (k, a) in alike.iter().enumerate() {
                let (i, j) = (k / n, k % n);
                block[i * 2 * n + j] += a;
                block[(n + i) * 2 * n + n + j] += a;
            }
        }
    }
}
