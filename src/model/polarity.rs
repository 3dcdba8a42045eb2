//! The polarity equation of a given flow, and the molecular field.

mod hybrid;

use std::sync::Arc;

use nalgebra::DMatrix;
use rayon::prelude::*;

pub use self::hybrid::Hybrid;
use super::boundary::{Conditions, PolarityCondition};
use super::manufactured::Exact;
use super::parameters::{ModelKind, Parameters};
use super::passive::{Around, Passive};
use super::terms::{At, Given, MOLECULAR, POLARITY, Sum};
use crate::expression::Expression;
use crate::form::{Faces, Integrator, mass};
use crate::mesh::Mesh;
use crate::solve::blocks::{Incomplete, Neighbours, ScalarBlocks, VectorBlocks, neighbours};
use crate::solve::krylov::gmres;
use crate::solve::rows::times_each;
use crate::solve::sparse::Factored;
use crate::solve::{SolveError, norm};
use crate::space::{Field, Skeleton, Space, Traces};

/// Degree with which formulas are integrated.
pub const FORMULA_DEGREE: usize = 6;

/// A GMRES solve gives up after this many products.
const KRYLOV_LIMIT: usize = 600;

/// Where GMRES gave up, systems up to this size are factorised; larger ones would take minutes, and a smaller time step
/// is the better cure.
const DIRECT_LIMIT: usize = 30_000;

/// What never changes in the polarity equation.
#[derive(Debug)]
pub struct Polarity {
    /// Discontinuous, with two components.
    pub space: Arc<Space>,
    /// Faces where the polarity is prescribed.
    pub dirichlet: Faces,
    parameters: Parameters,
    conditions: Vec<Conditions>,
    /// The constant terms of a sheet without density: `κ² a_swip`; none in hybrid form.
    constant: ScalarBlocks,
    /// What stands in their stead in hybrid form.
    hybrid: Option<Hybrid>,
    /// `(φ|χ)`, `n × n` per cell.
    mass: Vec<f64>,
    mass_inverse: Vec<f64>,
    neighbours: Neighbours,
    order: Arc<Vec<usize>>,
    rank: Arc<Vec<usize>>,
    /// What the boundary gives to them, where it does not depend on time.
    steady_data: Option<Vec<f64>>,
    /// Neumann faces with the slope `∂_np` of exact fields.
    slopes: Option<(Faces, Arc<Exact>)>,
    /// What bodies in the tissue change.
    around: Option<Around>,
}

impl Polarity {
    /// Assembles mass and diffusion.
    ///
    /// # Errors
    /// A degenerate cell.
    pub fn new(
        loops: &Integrator,
        space: &Arc<Space>,
        conditions: &[Conditions],
        parameters: &Parameters,
        slopes: Option<Arc<Exact>>,
    ) -> Result<Self, SolveError> {
        Self::around(loops, space, conditions, parameters, slopes, None)
    }

    /// As [`Polarity::new`] around bodies: `loops` are those over the tissue alone.
    ///
    /// # Errors
    /// As [`Polarity::new`].
    pub fn around(
        loops: &Integrator,
        space: &Arc<Space>,
        conditions: &[Conditions],
        parameters: &Parameters,
        slopes: Option<Arc<Exact>>,
        passive: Option<&Passive>,
    ) -> Result<Self, SolveError> {
        let mesh = &space.mesh;
        let of_kind = |dirichlet: bool| {
            let tags = conditions.iter().enumerate().filter(move |(_, c)| data_of(c).is_some() == dirichlet);
            tags.fold(Faces::NONE, |faces, (tag, _)| faces | Faces::tag(tag))
        };
        let dirichlet = of_kind(true);
        let slopes = slopes.map(|exact| (of_kind(false), exact));
        let neighbours = neighbours(mesh);
        // that of a sheet with density changes with it
        let fixed = parameters.kind() == ModelKind::Incompressible;
        let hybrid = parameters.is_hybrid() && passive.is_none();
        let mut constant = ScalarBlocks::zero(&neighbours, if fixed && !hybrid { space.n } else { 0 });
        let (given, none) = (Given::new(mesh, conditions, dirichlet, None, 0.0), Field::zero(space));
        let at = At::new(parameters, &none, &given);
        let hybrid = hybrid.then(|| {
            let traces = Traces::zero(&Arc::new(Skeleton::new(mesh, space.degree)));
            Hybrid::new(loops, space, traces.skeleton.clone(), &at.with_traces(Some(&traces)))
        });
        if fixed && hybrid.is_none() {
            let form = Sum::of(&[MOLECULAR]).constant().by_components(&at);
            loops.add_rows(&form, (space, space), &mut constant.diagonal, &mut constant.off);
        }
        let whole = passive.map_or(loops, |passive| &passive.whole);
        let mass = whole.cell_blocks(&mass::mass(space), space, space);
        let around = passive.map(|passive| {
            passive.add_to(space, dirichlet, parameters.coherence.powi(2), &mut constant);
            Around::new(loops, space, passive, &mass)
        });
        let mass_inverse = invert_blocks(&mass, space.n)?;
        let (order, rank) = downstream_order(mesh);
        let mut this = Self {
            space: space.clone(),
            dirichlet,
            parameters: *parameters,
            conditions: conditions.to_vec(),
            constant,
            hybrid,
            mass,
            mass_inverse,
            neighbours,
            order,
            rank,
            steady_data: None,
            slopes,
            around: around.transpose()?,
        };
        let moving =
            this.slopes.is_some() || conditions.iter().filter_map(data_of).flatten().any(Expression::depends_on_time);
        if fixed && !moving {
            this.steady_data = Some(this.constant_data(loops, 0.0));
        }
        Ok(this)
    }

    /// What the boundary gives at time `t`.
    pub fn given(&self, t: f64) -> Given<'_> {
        let sloped = self.slopes.as_ref().map(|(faces, exact)| (*faces, &**exact));
        Given::new(&self.space.mesh, &self.conditions, self.dirichlet, sloped, t)
    }

    /// What the boundary gives to the terms whose matrix is constant, as a functional: `κ² l_swip(q)` at time `t`  
    /// [6.25]
    pub fn constant_data(&self, loops: &Integrator, t: f64) -> Vec<f64> {
        if let Some(known) = &self.steady_data {
            return known.clone();
        }
        let (given, none) = (self.given(t), Field::zero(&self.space));
        let at = At::new(&self.parameters, &none, &given);
        loops.vector(&-Sum::of(&[MOLECULAR]).constant().pass(&at).rest, &self.space)
    }

    /// What stands between the cells in hybrid form; `None` where they see one another directly.
    pub fn hybrid(&self) -> Option<&Hybrid> {
        self.hybrid.as_ref()
    }

    /// The constant terms of polarity and traces.
    fn constant_times(&self, p: &Field, traces: Option<&Traces>) -> Vec<f64> {
        match (&self.hybrid, traces) {
            (Some(hybrid), Some(traces)) => hybrid.times(&p.values, traces),
            (Some(_), None) => panic!("the hybrid form has values on the faces"),
            (None, _) => self.constant.times(&p.values),
        }
    }

    /// `∫ (|p|²−1) p·q + κ² [a_swip(p,q) − l_swip(q)] = (1/B)(L_h|q)` as a functional   [7.10]
    ///
    /// # Panics
    /// In hybrid form without values on the faces.
    pub fn molecular_functional(&self, loops: &Integrator, p: &Field, traces: Option<&Traces>, t: f64) -> Vec<f64> {
        let given = self.given(t);
        let varying = Sum::of(&[MOLECULAR]).varying().value(&At::new(&self.parameters, p, &given));
        let mut out = loops.vector(&varying, &self.space);
        let constant = self.constant_times(p, traces);
        let data = self.constant_data(loops, t);
        for ((out, d), g) in out.iter_mut().zip(constant).zip(data) {
            *out += d - g;
        }
        out
    }

    /// The function whose products with the polarity space are `f`: `M⁻¹ f`, in a cell that a body cuts as in
    /// [`super::passive`], and zero inside of bodies.
    pub fn project(&self, f: &[f64]) -> Vec<f64> {
        match &self.around {
            None => self.mass_solve(f),
            Some(around) => times_each(&around.projection, self.space.n, 2, f),
        }
    }

    /// What multiplies `Pe ∂_t p`: `M y`, in a cell that a body cuts as in [`super::passive`], and zero inside of
    /// bodies.
    pub fn inertia_times(&self, y: &[f64]) -> Vec<f64> {
        times_each(self.inertia(), self.space.n, 2, y)
    }

    pub(super) fn inertia(&self) -> &[f64] {
        self.around.as_ref().map_or(&self.mass, |around| &around.inertia)
    }

    /// `½ κ² γ Σ g_S(p,p)`: what the ghost penalty adds to the free energy over B.
    pub fn ghost_energy(&self, p: &Field) -> f64 {
        let kappa2 = self.parameters.coherence.powi(2);
        self.around.as_ref().map_or(0.0, |around| 0.5 * kappa2 * around.ghost_energy(p))
    }

    /// `M⁻¹ f` on whole cells: for norms.
    pub fn mass_solve(&self, f: &[f64]) -> Vec<f64> {
        times_each(&self.mass_inverse, self.space.n, 2, f)
    }

    /// The order in which incomplete factors sweep over the cells, and the place of every cell in it.
    pub(super) fn sweep(&self) -> (&Arc<Vec<usize>>, &Arc<Vec<usize>>) {
        (&self.order, &self.rank)
    }

    /// The cells next to each cell.
    pub fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }

    /// The inverse that [`Polarity::project`] takes, of one component on `cell`.
    pub fn projection_of(&self, cell: usize) -> DMatrix<f64> {
        DMatrix::from_row_slice(self.space.n, self.space.n, self.projection_block(cell))
    }

    /// As [`Polarity::projection_of`], row-major.
    pub fn projection_block(&self, cell: usize) -> &[f64] {
        let size = self.space.n * self.space.n;
        let inverse = self.around.as_ref().map_or(&self.mass_inverse, |around| &around.projection);
        &inverse[cell * size..(cell + 1) * size]
    }

    /// `M x` on whole cells: for norms.
    pub fn mass_times(&self, x: &[f64]) -> Vec<f64> {
        times_each(&self.mass, self.space.n, 2, x)
    }

    /// The linear equation of one pass of the fixed point at `at.p`, the last iterate; `w = α₀/Δt`: the operator in
    /// `out`, and what does not depend on the new polarity but for [`Polarity::constant_data`], on the left side:
    ///
    /// `w Pe (p|q) + Pe a_upw(p,q;v) − Pe [ω(p,q,v) + a δ(p,q,v)] + (|p*|²p|q) + κ² a_swip(p,q)` and
    /// `−(p*|q) − Pe ∫_ΓDp (v·n)⊖ p_D·q`, and so on   [7.11c], [8.35]
    pub fn pass(&self, loops: &Integrator, w: f64, at: &At, out: &mut VectorBlocks) -> Vec<f64> {
        let space = &*self.space;
        let forms = Sum::of(&[POLARITY, MOLECULAR]).varying().pass(at);
        if let Some(hybrid) = &self.hybrid {
            out.restart(&[]);
            let mut blocks = hybrid.with_constant(loops, &forms.components, space);
            hybrid.add_cells(self.inertia(), self.parameters.peclet * w, &mut blocks);
            hybrid.add_primal(&blocks, out);
        } else {
            let mut diagonal = self.constant.diagonal.clone();
            self.add_inertia(w, &mut diagonal);
            out.restart(&self.constant.off);
            loops.add_rows(&forms.components, (space, space), &mut diagonal, &mut out.off);
            out.add_alike(&diagonal);
        }
        loops.add_mixed(&forms.full, space, out);
        loops.vector(&forms.rest, space)
    }

    /// Adds `w Pe (p|q)` of one component.
    fn add_inertia(&self, w: f64, diagonal: &mut [f64]) {
        let scale = self.parameters.peclet * w;
        diagonal.par_iter_mut().zip(self.inertia()).for_each(|(a, mass)| *a += scale * mass);
    }

    /// Derivative of `(1/B)(L_h|q)` along p: `∫ q·[(|p|²−1) I + 2 p⊗p]·φ + κ² a_swip(φ,q)`   [7.10]
    pub fn molecular_tangent(&self, loops: &Integrator, p: &Field) -> VectorBlocks {
        let (space, given) = (&*self.space, self.given(0.0));
        let (at, sum) = (At::new(&self.parameters, p, &given), Sum::of(&[MOLECULAR]).varying());
        let mut out = self.empty_operator();
        let mut diagonal = self.constant.diagonal.clone();
        out.off.copy_from_slice(&self.constant.off);
        loops.add_rows(&sum.by_components(&at), (space, space), &mut diagonal, &mut out.off);
        out.add_alike(&diagonal);
        loops.add_mixed(&sum.by_polarity(&at), space, &mut out);
        out
    }

    /// Derivative of the equation of one step along p, `w = α₀/Δt`; `well` is that of `(1/B)(L_h|q)`:
    ///
    /// `w Pe (φ|q) + Pe a_upw(φ,q;v) − Pe [ω(φ,q,v) + a δ(φ,q,v)] + (1/B)(L_h'φ|q)`   [7.11c]
    pub fn tangent(&self, loops: &Integrator, w: f64, at: &At, well: &VectorBlocks) -> VectorBlocks {
        let (space, sum) = (&*self.space, Sum::of(&[POLARITY]));
        let mut out = well.clone();
        let mut diagonal = vec![0.0; self.mass.len()];
        self.add_inertia(w, &mut diagonal);
        loops.add_rows(&sum.by_components(at), (space, space), &mut diagonal, &mut out.off);
        out.add_alike(&diagonal);
        loops.add_mixed(&sum.by_polarity(at), space, &mut out);
        out
    }

    /// `Δ_h p = M⁻¹ [l_swip(q) − a_swip(p,q)]`, the discrete Laplacian   [7.2]
    ///
    /// # Panics
    /// As [`Polarity::molecular_functional`].
    pub fn laplacian(&self, loops: &Integrator, p: &Field, traces: Option<&Traces>, t: f64) -> Field {
        let mut r = self.constant_data(loops, t);
        crate::solve::axpy(-1.0, &self.constant_times(p, traces), &mut r);
        let kappa2 = self.parameters.coherence.powi(2);
        Field::new(&self.space, self.project(&r).into_iter().map(|v| v / kappa2).collect())
    }

    /// Room for an operator.
    pub fn empty_operator(&self) -> VectorBlocks {
        VectorBlocks::zero(&self.neighbours, self.space.n)
    }

    /// Incomplete factors of an operator, for [`Polarity::solve`].
    ///
    /// # Errors
    /// A singular pivot block.
    pub fn precondition(&self, operator: &VectorBlocks) -> Result<Incomplete, SolveError> {
        Incomplete::new(operator, &self.order, &self.rank)
    }

    /// Solves `A p = b` from the guess in `p` to a residual of `reduction` times the first one, or to rounding. Systems
    /// of moderate size are factorised when the iteration stalls. Returns the number of iterations.
    ///
    /// # Errors
    /// A solution that is not finite, or an iteration that stalled where no factorisation can help.
    pub fn solve(
        &self,
        operator: &VectorBlocks,
        factors: &Incomplete,
        b: &[f64],
        p: &mut Vec<f64>,
        reduction: f64,
    ) -> Result<usize, SolveError> {
        let system = "polarity".to_owned();
        if let Some(index) = b.iter().position(|v| !v.is_finite()) {
            return Err(SolveError::NotFiniteInput { system, index });
        }
        let mut first = vec![0.0; b.len()];
        operator.times(p, &mut first);
        first.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
        let target = (reduction * norm(&first)).max(1e-13 * norm(b));
        let apply = |x: &[f64], y: &mut [f64]| operator.times(x, y);
        let precondition = |x: &mut [f64]| factors.solve(operator, x);
        let outcome = gmres(&apply, &precondition, b, p, target, KRYLOV_LIMIT);
        if outcome.converged && p.iter().all(|v| v.is_finite()) {
            return Ok(outcome.iterations);
        }
        if b.len() > DIRECT_LIMIT {
            let residual = outcome.residual / norm(b).max(f64::MIN_POSITIVE);
            return Err(SolveError::Inaccurate { system, residual, hint: "take a smaller time step".into() });
        }
        *p = Factored::new("polarity", operator.to_sparse())?.solve(b)?;
        Ok(outcome.iterations)
    }
}

/// The polarity's Dirichlet data on a tag.
pub fn data_of(conditions: &Conditions) -> Option<&[Expression; 2]> {
    match &conditions.polarity {
        PolarityCondition::Dirichlet(value) => Some(value),
        PolarityCondition::Neumann => None,
    }
}

/// Cells from left to right: tissue mostly flows that way, and then the incomplete factors are nearly exact.
/// Gives the place of every cell in that order, too.
pub fn downstream_order(mesh: &Mesh) -> (Arc<Vec<usize>>, Arc<Vec<usize>>) {
    let mut order: Vec<usize> = (0..mesh.cells.len()).collect();
    order.sort_by(|&a, &b| mesh.centroid(a).x.total_cmp(&mesh.centroid(b).x).then(a.cmp(&b)));
    let mut rank = vec![0; order.len()];
    order.iter().enumerate().for_each(|(r, &cell)| rank[cell] = r);
    (Arc::new(order), Arc::new(rank))
}

pub(super) fn invert_blocks(blocks: &[f64], n: usize) -> Result<Vec<f64>, SolveError> {
    let mut out = Vec::with_capacity(blocks.len());
    for (cell, block) in blocks.chunks(n * n).enumerate() {
        out.extend(invert_block(cell, block, n)?.iter());
    }
    Ok(out)
}

/// The inverse of a mass block.
pub(super) fn invert_block(cell: usize, block: &[f64], n: usize) -> Result<DMatrix<f64>, SolveError> {
    let inverse = DMatrix::from_row_slice(n, n, block).cholesky().map(|c| c.inverse());
    inverse.ok_or_else(|| SolveError::Factorise {
        system: "mass".into(),
        reason: format!("the mass matrix of cell {cell} is not positive definite"),
        hint: "the cell is degenerate".into(),
    })
}
