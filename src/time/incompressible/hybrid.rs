//! The incompressible sheet with its polarity in hybrid form: residual and linear systems.

use std::sync::{Arc, OnceLock};

use crate::model::State;
use crate::model::condensed::{Condensed, Eliminated};
use crate::model::fields::VELOCITY;
use crate::model::incompressible::{Incompressible, PASSES, Settling};
use crate::model::lagged::{Elements, Lagged};
use crate::model::momentum::MomentumError;
use crate::model::polarity::Hybrid;
use crate::model::tangent::HybridTangent;
use crate::solve::krylov::gmres;
use crate::solve::symbolic::Element;
use crate::solve::{SolveError, axpy, norm};
use crate::space::{Field, Traces};
use crate::time::Phases;
use crate::time::coupling::StepFailure;
use crate::time::equations::{Equations, Trial};
use crate::time::sheet::{KRYLOV_LIMIT, Solved, Tangent};

impl Incompressible {
    /// Adds `Pe ∂_t p` by the formula of the step.
    pub(super) fn add_rate(&self, equations: &Equations, p: &Field, r: &mut [f64]) {
        let mut rate = equations.history.clone();
        axpy(equations.weights.polarity, &p.values, &mut rate);
        axpy(self.parameters.peclet, &self.polarity.inertia_times(&rate), r);
    }

    /// As `evaluate` of a sheet: flow and traces in turn, from the flow before the step until they agree, or once from
    /// the flow of the last iterate.
    pub(super) fn evaluate_hybrid(
        &self,
        hybrid: &Hybrid,
        equations: &Equations,
        p: Field,
        near: Option<&Field>,
        phases: &mut Phases,
    ) -> Result<Trial, StepFailure> {
        let (inputs, loops, elastic) = (&equations.inputs, self.tissue(), self.parameters.elasticity != 0.0);
        let (v0, t) = (near.unwrap_or(&equations.before).clone(), inputs.t);
        let mut traces = phases.measure("traces", || self.traces(&p, &v0, t)).expect("in hybrid form");
        let mut well = phases.measure("residual", || self.polarity.molecular_functional(loops, &p, Some(&traces), t));
        let (mut v, mut pi);
        let mut last = v0;
        let (mut passes, mut settling) = (0, Settling::new());
        loop {
            let force = phases.measure("force", || {
                let l = elastic.then(|| self.projected(&well));
                self.force_of(&p, l.as_ref(), &last, inputs)
            });
            (v, pi) = phases.measure("stokes", || self.flow_of(&force, inputs))?;
            let next = phases.measure("traces", || self.traces(&p, &v, t)).expect("in hybrid form");
            phases.measure("residual", || {
                let change: Vec<f64> = next.values.iter().zip(&traces.values).map(|(a, b)| a - b).collect();
                hybrid.add_change(&Traces { values: change, ..next.clone() }, &mut well);
            });
            traces = next;
            passes += 1;
            // from the last iterate one pass is enough: what is left is a small share of the change of the flow, and
            // falls with it from iterate to iterate
            let enough = near.is_some() || passes == PASSES;
            if !elastic || enough || settling.is_over(&last.values, &v.values) {
                break;
            }
            last = v;
        }
        let residual = phases.measure("residual", || {
            let polarity = (&p, Some(&traces));
            let mut r = self.polarity_residual_of((&v).into(), polarity, &well, &inputs.source, t);
            self.add_rate(equations, &p, &mut r);
            r
        });
        let trial = equations.trial(p.values.clone(), State::incompressible(v, pi, p), residual)?;
        Ok(Trial { near: near.map_or_else(Vec::new, |near| near.values.clone()), ..trial })
    }
}

/// The derivative, and the condensed matrix once somebody asks.
pub(super) struct InHybridForm<'m> {
    tangent: HybridTangent<'m>,
    condensed: OnceLock<Result<Condensed, SolveError>>,
}

impl<'m> InHybridForm<'m> {
    pub fn new(model: &'m Incompressible, state: &State, w: f64, t: f64) -> Self {
        debug_assert!(state.get(VELOCITY).is_some());
        Self { tangent: HybridTangent::new(model, state, w, t), condensed: OnceLock::new() }
    }

    fn condensed(&self) -> Result<&Condensed, SolveError> {
        let new = || Condensed::new(self.tangent.model.frame(), &self.tangent);
        self.condensed.get_or_init(new).as_ref().map_err(Clone::clone)
    }
}

impl Tangent for InHybridForm<'_> {
    fn times(&self, y: &[f64], out: &mut [f64]) -> Result<(), MomentumError> {
        self.tangent.times(y, out)
    }

    fn solve(&self, lagged: &Lagged, right: &[f64], reduction: f64) -> Result<Solved, MomentumError> {
        let condensed = self.condensed()?;
        let b = condensed.eliminated().forward(right);
        let (mut x, size) = (vec![0.0; b.len()], norm(&b));
        let apply = |x: &[f64], y: &mut [f64]| condensed.times(x, y);
        let outcome = gmres(&apply, &|x| lagged.solve_all(x), &b, &mut x, reduction * size, KRYLOV_LIMIT);
        let mut delta = right.to_vec();
        condensed.eliminated().backward(&x, &mut delta);
        Ok(Solved::new(delta, &outcome, size))
    }

    fn elements(&self) -> Box<dyn Elements + '_> {
        Box::new(self)
    }

    fn factors_are_exact(&self) -> bool {
        true
    }
}

impl Elements for &InHybridForm<'_> {
    /// A cell whose derivative is singular gives NaN, which the factorisation tells of.
    fn fill(&self, e: usize, out: &mut Element) {
        match self.condensed() {
            Ok(condensed) => condensed.fill(e, out),
            Err(_) => {
                self.tangent.model.layout().unknowns(e, out);
                out.values.clear();
                out.values.resize(out.rows.len() * out.columns.len(), f64::NAN);
            }
        }
    }

    fn eliminated(&self) -> Option<Arc<Eliminated>> {
        self.condensed().ok().map(|condensed| condensed.eliminated().clone())
    }
}
