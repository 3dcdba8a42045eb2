//! The linear systems of Newton's method: GMRES with the exact derivative, preconditioned by the factors of the whole
//! coupled matrix at an earlier state, which are made anew only when GMRES has become slow.

use serde::{Deserialize, Serialize};

use super::Phases;
use super::coupling::StepFailure;
use super::equations::{Equations, Trial};
use super::sheet::{Sheet, Tangent, Weights};
use crate::model::fields::VELOCITY;
use crate::model::lagged::{Lagged, Structure};
use crate::solve::SolveError;
use crate::solve::multifrontal::Precision;
use crate::space::Field;

/// What is kept from step to step: factors of an earlier derivative.
#[derive(Debug, Default)]
pub struct KeptFactors {
    structure: Option<Structure>,
    lagged: Option<Lagged>,
    origin: Option<Origin>,
    /// Whether single precision has shown to be too little.
    needs_double: bool,
}

/// Where the factors come from: enough to make them anew, bit for bit, and to know when they are worn out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// The carried vector that the derivative was taken at.
    y: Vec<f64>,
    /// The velocity before the step.
    before: Vec<f64>,
    /// What the earlier levels gave to the time derivative.
    history: Vec<f64>,
    /// Those of the newest level, and the time.
    weights: Weights,
    t: f64,
    needed_double: bool,
    /// GMRES iterations of the first solve with the factors (0 before it), and the surplus over it since.
    fresh: usize,
    surplus: usize,
    /// The flow of the iterate before, if the trial was found from that.
    near: Vec<f64>,
}

impl Origin {
    /// Whether it has so many unknowns of velocity and of what is carried.
    pub fn fits(&self, velocity: usize, carried: usize) -> bool {
        let near = self.near.is_empty() || self.near.len() == velocity;
        near && self.before.len() == velocity && self.y.len() == carried && self.history.len() == carried
    }
}

impl KeptFactors {
    /// Makes factors in single precision where they are large; in double precision where that is too little.
    fn factorise(&mut self, model: &dyn Sheet, tangent: &dyn Tangent, phases: &mut Phases) -> Result<(), StepFailure> {
        let precision = match self.needs_double {
            true => Precision::Double,
            false => self.structure(model, phases)?.precision(),
        };
        let made = self.factorise_in(precision, model, tangent, phases);
        if made.is_err() && precision == Precision::Single {
            // numbers out of its range, or pivots that are lost in its rounding
            self.needs_double = true;
            return self.factorise_in(Precision::Double, model, tangent, phases);
        }
        made
    }

    fn factorise_in(
        &mut self,
        precision: Precision,
        model: &dyn Sheet,
        tangent: &dyn Tangent,
        phases: &mut Phases,
    ) -> Result<(), StepFailure> {
        self.structure(model, phases)?;
        let structure = self.structure.as_ref().expect("just found");
        let made = phases.measure("factors", || {
            let elements = tangent.elements();
            // others make room before
            match self.lagged.take().filter(|lagged| lagged.precision() == precision) {
                Some(mut lagged) => lagged.renew(&*elements).map(|()| lagged),
                None => Lagged::new(structure, &*elements, precision),
            }
        });
        self.lagged = Some(made?);
        Ok(())
    }

    fn structure(&mut self, model: &dyn Sheet, phases: &mut Phases) -> Result<&Structure, StepFailure> {
        if self.structure.is_none() {
            self.structure = Some(phases.measure("dissection", || model.structure().cloned())?);
        }
        Ok(self.structure.as_ref().expect("just found"))
    }

    /// Whether there are factors that still serve.
    fn serves(&self) -> bool {
        self.lagged.is_some() && self.origin.as_ref().is_some_and(|origin| origin.surplus <= SURPLUS)
    }

    /// The factors, where they are near enough to those of the weight `w = α₀/Δt` that their correction measures the
    /// error.
    pub(super) fn near(&self, w: f64) -> Option<&Lagged> {
        let near = |origin: &Origin| w <= 2.0 * origin.weights.polarity && origin.weights.polarity <= 2.0 * w;
        self.lagged.as_ref().filter(|_| self.serves() && self.origin.as_ref().is_some_and(near))
    }

    /// The factors, whatever they belong to.
    pub(crate) fn factors(&self) -> Option<&Lagged> {
        self.lagged.as_ref()
    }

    /// Makes factors in double precision, which solve without refinement and which no time step may use.
    pub(crate) fn borrow_for(
        &mut self,
        model: &dyn Sheet,
        tangent: &dyn Tangent,
        phases: &mut Phases,
    ) -> Result<(), StepFailure> {
        self.origin = None;
        self.factorise_in(Precision::Double, model, tangent, phases)
    }

    /// Books a solve of so many iterations.
    fn book(&mut self, iterations: usize) {
        if let Some(origin) = &mut self.origin {
            if origin.fresh == 0 {
                origin.fresh = iterations.max(1);
            }
            origin.surplus += iterations.saturating_sub(origin.fresh);
        }
    }

    /// Goes back to factors of an earlier origin; they are made anew when they are needed.
    pub fn rewind(&mut self, origin: Option<Origin>) {
        self.needs_double = origin.as_ref().is_some_and(|origin| origin.needed_double);
        (self.lagged, self.origin) = (None, origin);
    }

    /// What a checkpoint has to keep.
    pub fn origin(&self) -> Option<&Origin> {
        self.origin.as_ref()
    }

    /// The factors that a checkpoint tells of, made anew; none where that fails.
    pub fn restore(model: &dyn Sheet, origin: Origin) -> Self {
        let (mut kept, mut phases) =
            (Self { needs_double: origin.needed_double, ..Self::default() }, Phases::default());
        let Ok(inputs) = model.inputs(origin.t) else { return kept };
        let before = Field::new(model.space(VELOCITY), origin.before.clone());
        let (weights, history) = (origin.weights, origin.history.clone());
        let equations = Equations { model, inputs, before, weights, history };
        let near = (!origin.near.is_empty()).then(|| Field::new(model.space(VELOCITY), origin.near.clone()));
        let Ok(trial) = model.evaluate(&equations, origin.y.clone(), near.as_ref(), &mut phases) else { return kept };
        let tangent = model.tangent(&equations, &trial, weights);
        if kept.factorise(model, &*tangent, &mut phases).is_ok() {
            kept.origin = Some(origin);
        }
        kept
    }
}

/// Factors are made anew when the iterations in excess of those that fresh factors need reach this number.
const SURPLUS: usize = 40;

/// Products that fresh factors in single precision may need; those in double precision need one or few.
const CLOSE: usize = 8;

/// Solves `(R′ + (w − w₀) N) δ = −R` with the exact derivative of the equations of weight w₀ and `N` what multiplies
/// `∂_t y`; and the GMRES products that it took.
pub(crate) fn correction(
    equations: &Equations,
    kept: &mut KeptFactors,
    (now, weights): (&Trial, Weights),
    reduction: f64,
    phases: &mut Phases,
) -> Result<(Vec<f64>, usize), StepFailure> {
    let right: Vec<f64> = now.residual.iter().map(|r| -r).collect();
    Linearised::new(equations, now, weights, phases).solve(kept, &right, reduction, phases)
}

/// The equations linearised at a trial: their exact derivative `R′ + (w − w₀) N`, with weights w of its own.
pub(crate) struct Linearised<'e> {
    equations: &'e Equations<'e>,
    at: &'e Trial,
    weights: Weights,
    tangent: Box<dyn Tangent + 'e>,
}

impl<'e> Linearised<'e> {
    pub(crate) fn new(equations: &'e Equations, at: &'e Trial, weights: Weights, phases: &mut Phases) -> Self {
        let tangent = phases.measure("tangent", || equations.model.tangent(equations, at, weights));
        Self { equations, at, weights, tangent }
    }

    /// Solves for a right-hand side until the residual is `reduction` times as large; makes factors anew where there
    /// are none or GMRES has become slow. The solution, and the products that it took.
    pub(crate) fn solve(
        &self,
        kept: &mut KeptFactors,
        right: &[f64],
        reduction: f64,
        phases: &mut Phases,
    ) -> Result<(Vec<f64>, usize), StepFailure> {
        let (mut products, mut renewed) = (0, false);
        loop {
            if !kept.serves() || renewed {
                self.renew(kept, phases)?;
                renewed = true;
            }
            let lagged = kept.lagged.as_ref().expect("just made");
            let precision = lagged.precision();
            let found = phases.measure("newton solve", || self.tangent.solve(lagged, right, reduction))?;
            products += found.products;
            kept.book(found.products);
            let solved = found.converged;
            let far = found.products > CLOSE && self.tangent.factors_are_exact();
            // fresh factors that are this far off have lost too many digits
            kept.needs_double |= renewed && precision == Precision::Single && (far || !solved);
            if solved {
                return Ok((found.delta, products));
            }
            if renewed && precision == Precision::Double {
                let residual = found.residual;
                let (system, hint) = ("Newton".to_owned(), "take a smaller time step".to_owned());
                return Err(SolveError::Inaccurate { system, residual, hint }.into());
            }
            renewed = true;
        }
    }

    /// Makes the factors of this derivative.
    fn renew(&self, kept: &mut KeptFactors, phases: &mut Phases) -> Result<(), StepFailure> {
        kept.origin = None;
        kept.factorise(self.equations.model, &*self.tangent, phases)?;
        kept.origin = Some(Origin {
            y: self.at.y.clone(),
            before: self.equations.before.values.clone(),
            history: self.equations.history.clone(),
            weights: self.weights,
            t: self.equations.inputs.t,
            needed_double: kept.needs_double,
            fresh: 0,
            surplus: 0,
            near: self.at.near.clone(),
        });
        Ok(())
    }
}
