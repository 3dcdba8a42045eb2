//! Pseudo-arclength continuation: steady states `R(p, μ) = 0` along a curve that may turn back in μ (Keller 1977).

use super::pseudo::{Stall, Work};
use super::spectrum::any_direction;
use crate::model::State;
use crate::model::fields::VELOCITY;
use crate::solve::{SolveError, axpy, dot, root};
use crate::time::equations::{Equations, Trial};
use crate::time::kept_factors::{Linearised, correction};
use crate::time::{Sheet, StepFailure, Weights};

/// One tissue for every value of a parameter.
pub struct Family<'f> {
    /// The model at a value of the parameter.
    pub model: &'f dyn Fn(f64) -> Result<Box<dyn Sheet>, Stall>,
    /// The values between which the parameter moves: `ξ = 0` and `ξ = 1`.
    pub range: [f64; 2],
    /// Whether ξ is linear in the logarithm of the parameter, not in the parameter.
    pub logarithmic: bool,
}

impl std::fmt::Debug for Family<'_> {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Family").field("range", &self.range).finish_non_exhaustive()
    }
}

impl Family<'_> {
    /// The parameter at ξ.
    pub fn parameter(&self, xi: f64) -> f64 {
        let [a, b] = self.range;
        if self.logarithmic { a * (b / a).powf(xi) } else { a + xi * (b - a) }
    }

    fn at(&self, xi: f64) -> Result<Box<dyn Sheet>, Stall> {
        (self.model)(self.parameter(xi))
    }
}

/// A direction `(ẏ, ξ̇)` in the space of carried vectors and parameters, of length 1 in `‖ẏ‖²/P² + ξ̇²`.
#[derive(Debug, Clone)]
pub struct Direction {
    /// Of the carried vector.
    pub y: Vec<f64>,
    /// Of the parameter.
    pub xi: f64,
}

/// A steady state on a branch.
#[derive(Debug, Clone)]
pub struct Place {
    /// The parameter, on the scale of the branch.
    pub xi: f64,
    /// The steady state.
    pub state: State,
}

/// The measure of lengths along a branch.
#[derive(Debug, Clone, Copy)]
pub struct Metric {
    /// `P`: the change of what is carried, L², that counts as much as the whole range of the parameter.
    pub scale: f64,
    /// Bound on the residual of the stationary equations.
    pub residual: f64,
}

/// Most corrections of a point.
const CORRECTIONS: usize = 12;

/// Half of the difference of ξ that gives `∂R/∂ξ`.
const DIFFERENCE: f64 = 1e-4;

/// How accurately the linear systems are solved.
const REDUCTION: f64 = 1e-4;

impl Metric {
    /// `(a|b)_M/P² + ξ_a ξ_b`
    pub fn product(&self, model: &dyn Sheet, a: &Direction, b: &Direction) -> f64 {
        dot(&a.y, &model.mass_times(&b.y)) / self.scale.powi(2) + a.xi * b.xi
    }

    /// The direction of length 1.
    pub fn unit(&self, model: &dyn Sheet, mut d: Direction) -> Direction {
        let length = root(self.product(model, &d, &d));
        d.y.iter_mut().for_each(|v| *v /= length);
        d.xi /= length;
        d
    }

    /// From one place to another.
    pub fn between(&self, a: &Place, b: &Place) -> Direction {
        let y = b.state.carried().iter().zip(&a.state.carried()).map(|(b, a)| b - a).collect();
        Direction { y, xi: b.xi - a.xi }
    }
}

/// The place on the branch at distance `s` from `base` along `ahead`, and the corrections it took.
///
/// Solves `R(p, ξ) = 0`, `⟨ahead, (p, ξ) − base⟩ = s` by Newton's method with bordering, `∂R/∂ξ` as at the first guess.
///
/// # Errors
/// [`Stall::Step`] where the corrections do not converge.
pub fn correct(
    family: &Family,
    metric: &Metric,
    base: &Place,
    ahead: &Direction,
    s: f64,
    work: &mut Work,
) -> Result<(Place, usize), Stall> {
    let mut xi = base.xi + s * ahead.xi;
    let model = family.at(xi)?;
    let from = base.state.carried();
    let mut y = from.clone();
    axpy(s, &ahead.y, &mut y);
    let mut before = base.state[VELOCITY].clone();
    let guess = model.with_carried(&base.state, &y).ok_or_else(|| impossible(s))?;
    drop(model);
    let slope = slope(family, &Place { xi, state: guess }, work)?;
    let (mut last, mut worse) = (f64::INFINITY, 0);
    for corrections in 0..=CORRECTIONS {
        work.check_interrupt()?;
        let model = family.at(xi)?;
        let scale = model.area().sqrt();
        let equations = Equations::stationary(&*model, &before, 0.0)?;
        let trial = equations.evaluate(y.clone(), work.phases)?;
        if trial.size < metric.residual * scale {
            return Ok((Place { xi, state: trial.state }, corrections));
        }
        worse += usize::from(trial.size > 0.5 * last);
        if corrections == CORRECTIONS || worse > 3 || trial.size.is_nan() || trial.size > scale {
            let residual = trial.size / scale;
            return Err(Stall::Step { dt: s, residual, cause: "the corrections did not converge".into() });
        }
        last = trial.size;
        let (a, b) = bordered(&equations, &trial, &slope, work)?;
        // the step along b makes up for what a and the guess miss in the constraint
        let weigh = |x: &[f64]| dot(&ahead.y, &model.mass_times(x)) / metric.scale.powi(2);
        let moved: Vec<f64> = y.iter().zip(&from).map(|(y, from)| y - from).collect();
        let missing = s - weigh(&moved) - ahead.xi * (xi - base.xi);
        let dxi = (missing - weigh(&a)) / (weigh(&b) + ahead.xi);
        axpy(1.0, &a, &mut y);
        axpy(dxi, &b, &mut y);
        xi += dxi;
        before = trial.state.into_field(VELOCITY);
    }
    unreachable!("the last correction returns")
}

/// A step to where there can be no sheet.
fn impossible(s: f64) -> Stall {
    Stall::Step { dt: s, residual: f64::NAN, cause: "the density would be negative".into() }
}

/// `−J⁻¹R` and `−J⁻¹ ∂R/∂ξ`.
fn bordered(
    equations: &Equations,
    trial: &Trial,
    slope: &[f64],
    work: &mut Work,
) -> Result<(Vec<f64>, Vec<f64>), StepFailure> {
    let (a, _) = correction(equations, work.kept, (trial, Weights::default()), REDUCTION, work.phases)?;
    let b = along(equations, trial, slope, work)?;
    Ok((a, b))
}

/// `−J⁻¹ ∂R/∂ξ`
fn along(equations: &Equations, trial: &Trial, slope: &[f64], work: &mut Work) -> Result<Vec<f64>, StepFailure> {
    let right: Vec<f64> = slope.iter().map(|r| -r).collect();
    if right.iter().all(|r| *r == 0.0) {
        return Ok(right);
    }
    let linearised = Linearised::new(equations, trial, Weights::default(), work.phases);
    Ok(linearised.solve(work.kept, &right, REDUCTION, work.phases)?.0)
}

/// `∂R/∂ξ` at a place, by a central difference, at the ends of the range a one-sided one.
///
/// # Errors
/// A model that cannot be set up there.
pub fn slope(family: &Family, at: &Place, work: &mut Work) -> Result<Vec<f64>, Stall> {
    let mut residual = |xi: f64| -> Result<Vec<f64>, Stall> {
        let model = family.at(xi)?;
        let equations = Equations::stationary(&*model, &at.state[VELOCITY], 0.0)?;
        Ok(equations.evaluate(at.state.carried(), work.phases)?.residual)
    };
    let (above, below) =
        ((at.xi + DIFFERENCE).clamp(DIFFERENCE, 1.0), (at.xi - DIFFERENCE).clamp(0.0, 1.0 - DIFFERENCE));
    let (up, down) = (residual(above)?, residual(below)?);
    Ok(up.iter().zip(&down).map(|(u, d)| (u - d) / (above - below)).collect())
}

/// A disturbance that decays or grows slower than this, per time, stays for rounding.
const STANDS_STILL: f64 = 1e-9;

/// Refuses a derivative that is singular to rounding: an inverse-power step from a direction that favours nothing.
///
/// # Errors
/// As [`Linearised::solve`], and where a disturbance neither decays nor grows.
fn check_regular(equations: &Equations, trial: &Trial, work: &mut Work) -> Result<(), StepFailure> {
    let model = equations.model;
    let any = any_direction(model.carried_len(), 1);
    let right = model.inertia_times(&trial.state, &any);
    let linearised = Linearised::new(equations, trial, Weights::default(), work.phases);
    let (image, _) = linearised.solve(work.kept, &right, REDUCTION, work.phases)?;
    let size = |y: &[f64]| root(dot(y, &model.mass_times(y)));
    let growth = size(&image) / size(&any);
    if growth < 1.0 / STANDS_STILL {
        return Ok(());
    }
    let (system, hint) = ("Newton".to_owned(), "choose another state".to_owned());
    Err(SolveError::Inaccurate { system, residual: growth * f64::EPSILON, hint }.into())
}

/// The direction of the branch at a place, on the side of `ahead` or of growing ξ, not yet of length 1; where a branch
/// `begins`, the derivative must not be singular, but for what is conserved.
///
/// # Errors
/// A model that cannot be set up there; a linear system that cannot be solved.
pub fn direction(
    family: &Family,
    at: &Place,
    slope: &[f64],
    begins: bool,
    work: &mut Work,
) -> Result<(Direction, Box<dyn Sheet>), Stall> {
    let model = family.at(at.xi)?;
    let y = {
        let equations = Equations::stationary(&*model, &at.state[VELOCITY], 0.0)?;
        let trial = equations.evaluate(at.state.carried(), work.phases)?;
        if begins && !model.conserves() {
            check_regular(&equations, &trial, work)?;
        }
        along(&equations, &trial, slope, work)?
    };
    Ok((Direction { y, xi: 1.0 }, model))
}
