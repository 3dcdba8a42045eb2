//! The velocity of a given density: friction and ρ-weighted viscosity, factorised anew for every density.

use crate::form::Density;
use crate::model::DensityLaw;
use crate::model::compressible::Compressible;
use crate::model::lagged::{Elements, Lagged, Layout, add_velocity_block};
use crate::model::momentum::MomentumError;
use crate::model::terms::FlowTerms;
use crate::solve::multifrontal::Precision;
use crate::solve::rows::Rows;
use crate::solve::symbolic::Element;
use crate::solve::{DIRECT_TOLERANCE, SolveError, axpy, norm};
use crate::space::Field;

/// `2(ρD(v)|D(w)) + 2(ρ div v|div w) + C_F(v|w)` at a density, factorised   [7.34]
#[derive(Debug)]
pub struct Viscous {
    /// Blocks of the velocities of a cell.
    pub blocks: Rows,
    factors: Lagged,
    /// The least and the largest nodal value of the density.
    range: [f64; 2],
}

/// The blocks of the free velocities.
struct Free<'v> {
    layout: Layout<'v>,
    blocks: &'v Rows,
}

impl Elements for Free<'_> {
    fn fill(&self, e: usize, out: &mut Element) {
        let places = self.layout.unknowns(e, out);
        let columns = out.columns.len();
        out.values.clear();
        out.values.resize(out.rows.len() * columns, 0.0);
        add_velocity_block(self.blocks.own_of(e), &places, columns, &mut out.values);
    }
}

impl Viscous {
    /// Assembles and factorises for the density `rho`.
    ///
    /// # Errors
    /// A matrix that is singular: nothing holds tissue of vanishing density without friction.
    pub fn new(model: &Compressible, rho: &Field) -> Result<Self, MomentumError> {
        let (loops, velocity) = (&model.loops, &*model.velocity);
        let form = FlowTerms::of(&model.parameters).matrix(velocity, Density::Of(rho));
        let form = form + model.walls.form(velocity);
        let m = velocity.cell_dof_count();
        let mut blocks = Rows::zero(model.polarity.neighbours(), (m, m), false);
        loops.add_own_rows(&form, (velocity, velocity), &mut blocks.own);
        let free = Free { layout: model.flow_layout(), blocks: &blocks };
        let range = rho.values.iter().fold([f64::INFINITY, 0.0], |[low, high], &r| [r.min(low), r.max(high)]);
        let factors =
            Lagged::new(model.flow_structure(), &free, Precision::Double).map_err(|error| weighted(model, error))?;
        Ok(Self { blocks, factors, range })
    }

    /// `K v`, a functional on the velocity space.
    pub fn times(&self, model: &Compressible, v: &[f64]) -> Vec<f64> {
        let local = model.velocity.by_cell(v);
        let mut out = vec![0.0; local.len()];
        self.blocks.times_add(&local, &mut out);
        model.velocity.assembled(&out)
    }

    /// The velocity under the force `f` with the prescribed nodal values.
    ///
    /// # Errors
    /// A force or a velocity that is not finite; a residual that refinement does not make small.
    pub fn solve(&self, model: &Compressible, f: &[f64], prescribed: &[f64]) -> Result<Vec<f64>, MomentumError> {
        let frames = &model.frames;
        let mut force = f.to_vec();
        if prescribed.iter().any(|v| *v != 0.0) {
            axpy(-1.0, &self.times(model, prescribed), &mut force);
        }
        let right = frames.restrict(&force);
        let system = || "momentum".to_owned();
        if let Some(index) = right.iter().position(|r| !r.is_finite()) {
            return Err(SolveError::NotFiniteInput { system: system(), index }.into());
        }
        let rest = vec![0.0; prescribed.len()];
        let mut free = right.clone();
        self.factors.solve_flow(&mut free);
        for refined in [false, true] {
            let mut residual = frames.restrict(&self.times(model, &frames.expand(&free, &rest)));
            residual.iter_mut().zip(&right).for_each(|(k, r)| *k = r - *k);
            let relative = norm(&residual) / norm(&right).max(f64::MIN_POSITIVE);
            if relative <= 1e-12 || (refined && relative <= DIRECT_TOLERANCE) {
                return Ok(frames.expand(&free, prescribed));
            }
            if refined || relative.is_nan() {
                let hint = culprit(model, self.range);
                return Err(weighted(model, SolveError::Inaccurate { system: system(), residual: relative, hint }));
            }
            self.factors.solve_flow(&mut residual);
            axpy(1.0, &residual, &mut free);
        }
        unreachable!("the second look returns")
    }
}

/// What makes a balance hard to solve whose density has this range.
fn culprit(model: &Compressible, [low, high]: [f64; 2]) -> String {
    let law = model.parameters.density.unwrap_or(DensityLaw {
        penalty: 0.0,
        exponent: 0.0,
        critical: 0.0,
        active_stress_iso: 0.0,
    });
    let pressure = |rho: f64| law.penalty * rho.powf(law.exponent + 1.0);
    if low < 1e-6 * high {
        format!(
            "the density goes from {low:.1e} to {high:.1e}, and where it almost vanishes friction alone holds the tissue: raise \
             `model.friction`, or start and let in densities that differ less"
        )
    } else if law.penalty > 0.0 && (pressure(high) > 1e6 * pressure(low) || pressure(high) > 1e9) {
        format!(
            "`model.density.exponent` = {} and `model.density.penalty` = {} make pressures from {:.1e} to {:.1e} of densities from \
             {low:.3} to {high:.3}: lower them",
            law.exponent,
            law.penalty,
            pressure(low),
            pressure(high)
        )
    } else {
        "the forces differ too much from place to place: look for the extreme one among the parameters of [model]"
            .to_owned()
    }
}

/// The conditions hold the tissue, or the model would not have been built: without friction it is the density that is
/// missing.
fn weighted(model: &Compressible, error: SolveError) -> MomentumError {
    if model.parameters.friction == 0.0 { MomentumError::Vacuum } else { MomentumError::Weighted(error) }
}
