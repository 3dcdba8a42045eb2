//! Why a march ends, and what to do about it.

use crate::model::momentum::MomentumError;
use crate::scheme::adaptive::SmallestStep;
use crate::solve::SolveError;
use crate::time::coupling::{CouplingKind, StepFailure};

/// Why the march cannot go on; the last good state is kept.
#[derive(Debug, Clone, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum MarchError {
    #[error(
        "step {step} from t = {t} failed and Δt would fall below {step_min}: {}; hint: {hint}",
        without_hint(cause)
    )]
    StepTooSmall { step: usize, t: f64, step_min: SmallestStep, cause: Box<StepFailure>, hint: String },
    #[error("stopped from outside during step {step} from t = {t}")]
    Interrupted { step: usize, t: f64 },
    #[error("step {step} from t = {t} failed: {cause}")]
    Failed { step: usize, t: f64, cause: Box<StepFailure> },
}

/// What to do where no step is small enough.
pub(super) fn hint(cause: &StepFailure, kind: CouplingKind) -> String {
    let hint = match cause {
        // fluxes leave no mean negative
        StepFailure::Density(_) => "a `source.density` may take no more than there is; else take a finer mesh there",
        StepFailure::Momentum(MomentumError::Vacuum) => "give a friction, or keep the density away from 0",
        StepFailure::Momentum(MomentumError::Weighted(SolveError::Inaccurate { hint, .. })) => hint.as_str(),
        StepFailure::Bodies(_) => "take a smaller `time.step`, or milder forces on bodies",
        StepFailure::Slow { .. }
        | StepFailure::Diverged { .. }
        | StepFailure::Polarity(_)
        | StepFailure::Momentum(_)
        | StepFailure::Formula(_)
        | StepFailure::Interrupted => kind.hint(),
    };
    hint.to_owned()
}

/// What went wrong, where another hint follows.
fn without_hint(cause: &StepFailure) -> String {
    let text = cause.to_string();
    text.split_once("; hint: ").map_or(text.clone(), |(what, _)| what.to_owned())
}
