//! Eigenvalues of the linearisation about a steady state: how small disturbances grow or decay.
//!
//! A disturbance `δy e^{λt}` of a steady state obeys `λ N δy + R′ δy = 0` with `N = Pe M` and `R′ = J_pp + D S⁻¹ F′` in
//! the incompressible sheet; in a compressible one `N` also has the density. Arnoldi's method is applied to
//! `T = (R′ + σ N)⁻¹ N`, whose eigenvalues are `1/(σ − λ)`: it finds those λ first that are nearest to the real shift
//! σ. A small shift finds the slow modes, a large one fast oscillations that grow.

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::Complex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::pseudo::{Stall, Work};
use crate::model::State;
use crate::model::fields::VELOCITY;
use crate::model::lagged::Lagged;
use crate::model::momentum::MomentumError;
use crate::solve::arnoldi::Arnoldi;
use crate::solve::krylov::gmres;
use crate::solve::{SolveError, axpy, dot, norm, root};
use crate::time::equations::Equations;
use crate::time::sheet::Tangent;
use crate::time::{Phases, Sheet, StepFailure, Weights};

/// An eigenvalue with its mode; of a complex pair the one with positive imaginary part.
#[derive(Debug, Clone)]
pub struct Mode {
    /// `λ`: growth rate and angular frequency.
    pub value: Complex<f64>,
    /// Real and imaginary part of `δy`.
    pub vector: [Vec<f64>; 2],
    /// `‖M⁻¹(λ N + R′) δy‖/(|λ| + |σ|) Pe ‖δy‖`
    pub residual: f64,
}

/// A disc of the complex plane in which all eigenvalues were found.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Disc {
    /// Its centre σ.
    pub shift: f64,
    /// Its radius.
    pub radius: f64,
    /// Dimension of the Krylov space.
    pub dimension: usize,
    /// Ritz values with positive real part that have not converged.
    pub doubtful: usize,
}

/// What a disturbance does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stability {
    /// All eigenvalues that were found have negative real parts, and the search reached past the imaginary axis.
    Stable,
    /// Some eigenvalue has a positive real part.
    Unstable,
    /// Eigenvalues did not converge, or one is zero to rounding.
    NotKnown,
}

impl Stability {
    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            Stability::Stable => "stable",
            Stability::Unstable => "unstable",
            Stability::NotKnown => "not-known",
        }
    }
}

/// The leading eigenvalues about a state.
#[derive(Debug, Clone)]
pub struct Spectrum {
    /// Largest real part first.
    pub modes: Vec<Mode>,
    /// Where no eigenvalue can have been missed.
    pub searched: Vec<Disc>,
}

/// Shifts σ: about slow modes, and about fast ones.
pub const SHIFTS: [f64; 2] = [0.2, 2.0];

/// Smallest and largest dimension of a Krylov space.
pub const DIMENSION: [usize; 2] = [60, 160];

/// Vectors that are added before Ritz values are looked at again.
const BATCH: usize = 20;

/// Ritz values with smaller relative residuals have converged.
const CONVERGED: f64 = 1e-8;

/// Eigenpairs whose own residual is larger decide nothing.
const EXACT: f64 = 1e-4;

/// Real parts nearer to zero decide nothing.
const NEUTRAL: f64 = 1e-7;

impl Spectrum {
    /// What the eigenvalues say.
    pub fn stability(&self) -> Stability {
        let exact = self.modes.iter().all(|mode| mode.residual < EXACT);
        let near = self.searched.first().is_some_and(|disc| disc.radius >= disc.shift);
        let searched = near && exact && self.searched.iter().all(|disc| disc.doubtful == 0);
        match self.modes.first() {
            Some(mode) if mode.value.re > NEUTRAL && mode.residual < EXACT => Stability::Unstable,
            Some(mode) if mode.value.re < -NEUTRAL && searched => Stability::Stable,
            None if searched => Stability::Stable,
            Some(_) | None => Stability::NotKnown,
        }
    }

    /// Modes that grow.
    pub fn growing(&self) -> impl Iterator<Item = &Mode> {
        self.modes.iter().filter(|mode| mode.value.re > NEUTRAL && mode.residual < EXACT)
    }

    /// Dimension of the space of growing disturbances.
    pub fn unstable_dimension(&self) -> usize {
        self.growing().map(|mode| if mode.value.im == 0.0 { 1 } else { 2 }).sum()
    }
}

/// What a search for eigenvalues has to bring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectrumSettings {
    /// Eigenvalues, a pair counted twice, that must converge about the first shift.
    pub wanted: usize,
    /// Whether a mode that grows is all that is asked for.
    pub growing_suffices: bool,
    /// Whether fast modes are searched for, too.
    pub fast: bool,
}

/// Finds the eigenvalues about a steady state that are nearest to the [`SHIFTS`].
///
/// # Errors
/// A factorisation that fails; an interrupt.
pub fn spectrum(model: &dyn Sheet, state: &State, ask: SpectrumSettings, work: &mut Work) -> Result<Spectrum, Stall> {
    let mut found = Spectrum { modes: Vec::new(), searched: Vec::new() };
    let shifts = if ask.fast { &SHIFTS[..] } else { &SHIFTS[..1] };
    for &shift in shifts {
        // the later ones are to show that nothing fast grows, not to find more of what decays
        let wanted = if shift == SHIFTS[0] { Some(ask.wanted) } else { None };
        let (modes, disc) = near(model, state, shift, wanted, ask.growing_suffices, work)?;
        for mode in modes {
            if is_new(model, &found.modes, &mode) {
                found.modes.push(mode);
            }
        }
        found.searched.push(disc);
        if ask.growing_suffices && found.modes.iter().any(|mode| mode.value.re > NEUTRAL) {
            break;
        }
    }
    found.modes.sort_by(|a, b| b.value.re.total_cmp(&a.value.re).then(a.value.im.total_cmp(&b.value.im)));
    Ok(found)
}

/// The converged eigenvalues nearest to a shift.
fn near(
    model: &dyn Sheet,
    state: &State,
    shift: f64,
    wanted: Option<usize>,
    growing_suffices: bool,
    work: &mut Work,
) -> Result<(Vec<Mode>, Disc), Stall> {
    let equations = Equations::stationary(model, &state[VELOCITY], 0.0)?;
    let at = equations.evaluate(state.carried(), work.phases)?;
    let tangent = work.phases.measure("tangent", || model.tangent(&equations, &at, Weights::both(shift)));
    work.kept.borrow_for(model, &*tangent, work.phases)?;
    let lagged = work.kept.factors().expect("just made");
    let krylov = Krylov { model, state, lagged, tangent: &*tangent, shift };
    let (mut modes, disc) = krylov.search(1, wanted, growing_suffices, work.phases, work.interrupt)?;
    // of a multiple eigenvalue a Krylov space shows one mode, that of another start another one
    let growing = modes.iter().filter(|mode| mode.value.re > NEUTRAL).count();
    if growing > 0 && !growing_suffices {
        for mode in krylov.search(2, Some(growing), false, work.phases, work.interrupt)?.0 {
            if is_new(model, &modes, &mode) {
                modes.push(mode);
            }
        }
    }
    Ok((modes, disc))
}

/// What makes `T` at a state.
struct Krylov<'k> {
    model: &'k dyn Sheet,
    state: &'k State,
    tangent: &'k dyn Tangent,
    lagged: &'k Lagged,
    shift: f64,
}

impl Krylov<'_> {
    /// The converged eigenvalues from one start.
    fn search(
        &self,
        seed: u64,
        wanted: Option<usize>,
        growing_suffices: bool,
        phases: &mut Phases,
        interrupt: &AtomicBool,
    ) -> Result<(Vec<Mode>, Disc), Stall> {
        let (model, shift) = (self.model, self.shift);
        let gram = |x: &[f64]| model.mass_times(x);
        // the mode of what is conserved has the eigenvalue zero in every state: it is kept out
        let mut begin = any_direction(model.carried_len(), seed);
        model.without_conserved(&mut begin);
        let mut arnoldi = Arnoldi::new(&begin, &gram);
        let mut apply = |x: &[f64]| -> Result<Vec<f64>, StepFailure> {
            let mut image = self.solve(model.inertia_times(self.state, x))?;
            model.without_conserved(&mut image);
            Ok(image)
        };
        let (count, radius, doubtful) = loop {
            if interrupt.load(Ordering::Relaxed) {
                return Err(Stall::Interrupted);
            }
            let len = arnoldi.len() + BATCH;
            phases.measure("eigenvalues", || arnoldi.extend(len, &mut apply, &gram))?;
            let values = arnoldi.values().map_err(StepFailure::from)?;
            // the eigenvalues nearest to the shift, as far as every one of them has converged
            let count = values.iter().take_while(|(theta, residual)| *residual < CONVERGED * theta.norm()).count();
            let outer = values.get(count).map_or(f64::INFINITY, |(theta, _)| 1.0 / theta.norm());
            let grows = |theta: &Complex<f64>| shift - theta.inv().re > NEUTRAL;
            let doubtful = values[count..].iter().filter(|(theta, _)| grows(theta)).count();
            let enough = match wanted {
                Some(wanted) => count >= wanted && outer >= shift,
                None => len >= DIMENSION[0],
            };
            let grown = growing_suffices && values[..count].iter().any(|(theta, _)| grows(theta));
            let enough = grown || (enough && doubtful == 0);
            if enough || len >= DIMENSION[1] || arnoldi.is_closed() {
                break (count, outer, doubtful);
            }
        };
        let mut modes = Vec::new();
        for ritz in arnoldi.pairs(count).map_err(StepFailure::from)? {
            let value = Complex::new(shift, 0.0) - ritz.value.inv();
            // of a pair, T and A exchange the signs of the imaginary parts
            if value.im >= 0.0 {
                let residual = self.defect(value, &ritz.vector)?;
                modes.push(Mode { value, vector: ritz.vector, residual });
            }
        }
        Ok((modes, Disc { shift, radius, dimension: arnoldi.len(), doubtful }))
    }
}

impl Krylov<'_> {
    /// `(R′ + σ N)⁻¹ b`: the factors invert it exactly, but for the energy-consistent force.
    fn solve(&self, right: Vec<f64>) -> Result<Vec<f64>, StepFailure> {
        if self.tangent.factors_are_exact() {
            let mut x = right;
            self.lagged.solve(&mut x);
            return match x.iter().all(|v| v.is_finite()) {
                true => Ok(x),
                false => Err(SolveError::NotFinite { system: "coupled".into(), hint: "shift it".into() }.into()),
            };
        }
        let failure: RefCell<Option<MomentumError>> = RefCell::new(None);
        let product = |x: &[f64], y: &mut [f64]| {
            if let Err(error) = self.tangent.times(x, y) {
                failure.borrow_mut().get_or_insert(error);
                y.fill(f64::NAN);
            }
        };
        let (mut x, target) = (vec![0.0; right.len()], 1e-10 * norm(&right));
        let outcome = gmres(&product, &|x: &mut [f64]| self.lagged.solve(x), &right, &mut x, target, 100);
        match failure.into_inner() {
            Some(error) => Err(error.into()),
            None if outcome.converged => Ok(x),
            None => {
                let residual = outcome.residual / norm(&right);
                let hint = "the energy-consistent force is far from the factors' there".to_owned();
                Err(SolveError::Inaccurate { system: "eigenvalue".into(), residual, hint }.into())
            }
        }
    }

    /// The relative residual of an eigenpair.
    fn defect(&self, value: Complex<f64>, vector: &[Vec<f64>; 2]) -> Result<f64, Stall> {
        let (model, shift) = (self.model, self.shift);
        let (mut square, mut size) = (0.0, 0.0);
        // the tangent has the weight σ: (R′ + σ N) φ = (σ − λ) N φ
        let factor = Complex::new(shift, 0.0) - value;
        let inertia: Vec<Vec<f64>> = vector.iter().map(|x| model.inertia_times(self.state, x)).collect();
        for part in 0..2 {
            let mut r = vec![0.0; vector[part].len()];
            self.tangent.times(&vector[part], &mut r).map_err(StepFailure::from)?;
            axpy(-factor.re, &inertia[part], &mut r);
            axpy(if part == 0 { factor.im } else { -factor.im }, &inertia[1 - part], &mut r);
            square += dot(&r, &model.mass_solve(&r));
            size += dot(&vector[part], &model.mass_times(&vector[part]));
        }
        Ok(square.max(0.0).sqrt() / (model.parameters().peclet * (value.norm() + shift) * size.sqrt()))
    }
}

/// Eigenvalues nearer to each other, relative to 1 and themselves, may be one.
const SAME: f64 = 1e-5;

/// Then a mode is another one if more than this share of it is independent of the others.
const INDEPENDENT: f64 = 0.02;

/// Whether a mode is none of the known ones, nor a combination of those with its eigenvalue.
fn is_new(model: &dyn Sheet, known: &[Mode], mode: &Mode) -> bool {
    let product = |a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]| -> Complex<f64> {
        let [re, im] = [&b[0], &b[1]].map(|part| model.mass_times(part));
        Complex::new(dot(&a[0], &re) + dot(&a[1], &im), dot(&a[0], &im) - dot(&a[1], &re))
    };
    // what is left of b without its share of the unit vector a
    let without = |a: &[Vec<f64>; 2], b: &mut [Vec<f64>; 2]| {
        let share = product(a, b);
        let [re, im] = b;
        axpy(-share.re, &a[0], re);
        axpy(share.im, &a[1], re);
        axpy(-share.re, &a[1], im);
        axpy(-share.im, &a[0], im);
    };
    let same = |m: &&Mode| (m.value - mode.value).norm() < SAME * (1.0 + mode.value.norm());
    let mut basis: Vec<[Vec<f64>; 2]> = Vec::new();
    // the unit vector of what the basis has not of a vector, if that is anything
    let rest_of = |basis: &[[Vec<f64>; 2]], vector: &[Vec<f64>; 2]| {
        let (mut rest, before) = (vector.clone(), root(product(vector, vector).re));
        basis.iter().for_each(|unit| without(unit, &mut rest));
        let left = root(product(&rest, &rest).re);
        rest.iter_mut().flatten().for_each(|v| *v /= left);
        (left > INDEPENDENT * before).then_some(rest)
    };
    for other in known.iter().filter(same) {
        basis.extend(rest_of(&basis, &other.vector));
    }
    rest_of(&basis, &mode.vector).is_some()
}

/// A start that favours no symmetry; the same in every run.
pub(super) fn any_direction(len: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..len).map(|_| random.random_range(-1.0..1.0)).collect()
}
