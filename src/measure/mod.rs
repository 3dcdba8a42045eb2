//! Numbers and curves from fields.

pub mod asymmetry;
pub mod bodies;
pub mod budget;
pub mod cut;
pub mod defects;
pub mod errors;
pub mod fields;
pub mod list;
pub mod measured;
pub mod overshoot;
pub mod strain;
pub mod stream;

pub use asymmetry::Mirror;
pub use budget::Budget;
pub use cut::{Circle, Line, Sample, Section};
pub use defects::{Census, Defects};
pub use fields::OutputField;
pub use list::Measure;
pub use overshoot::{Inlet, Overshoot};
pub use strain::{Strain, Tensor};
pub use stream::StreamFunction;

/// Why a measure cannot be taken.
#[derive(Debug, Clone, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum MeasureError {
    #[error(
        "the measure `asymmetry` needs a domain that is its own mirror image in x₂ = {axis}: ({x:.4}, {y:.4}) has no \
         image; hint: remove the measure"
    )]
    NoMirror { axis: f64, x: f64, y: f64 },
    #[error(
        "the measure `{measure}` needs a disc (boundary tag `disc`) with tissue behind it, at x₁ > {behind}; hint: \
         remove the measure, or give `mesh.centre` and `mesh.radius`"
    )]
    NoDisc { measure: &'static str, behind: f64 },
    #[error(
        "the measure `{measure}` counts from what flows in on the axis x₂ = {axis}, and {what}; hint: remove the \
         measure, or give the boundary at the left end of the axis a velocity and a polarity whose first component is \
         not 0"
    )]
    NoInflow { measure: &'static str, axis: f64, what: String },
    #[error("the cut `{name}` meets no cell; hint: check its ends, or the place of the disc that axes refer to")]
    CutOutside { name: String },
    #[error(
        "the {what} meets no cell between x₁ = {from:.4} and {to:.4} at x₂ = {y:.4}; hint: check `mesh.centre` and \
         `mesh.length`"
    )]
    Outside { what: &'static str, from: f64, to: f64, y: f64 },
    #[error(
        "the flux-keeping correction needs cells at x₁ = {x1}: no bin there holds any; hint: shorten `window`, or look \
         at `box`, `centre` and `length`"
    )]
    NoCells { x1: f64 },
    #[error(
        "the flux-keeping correction needs a flux: the mean velocity across the band is {minus:e} at x₁ = −{window} \
         and {plus:e} at x₁ = {window}; hint: leave `window` out"
    )]
    NoFlux { window: f64, minus: f64, plus: f64 },
    #[error(transparent)]
    Solve(#[from] crate::solve::SolveError),
    #[error(transparent)]
    Momentum(#[from] crate::model::momentum::MomentumError),
}
