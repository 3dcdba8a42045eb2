//! Why a contact problem has no answer.

/// An error of contact. Bodies are named, walls numbered from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ContactError {
    #[error(
        "Δt = {dt}: a step must be finite and greater than 0; hint: end the run one step earlier instead of making an empty step"
    )]
    Step { dt: f64 },
    #[error(
        "the {what} of body \"{body}\" is {value} at t = {t}: it must be finite; hint: look at the formulas of its force and torque"
    )]
    NotFinite { body: String, what: &'static str, value: f64, t: f64 },
    #[error(
        "body \"{body}\" has {what} = {value}: it must be finite and greater than 0; hint: give it a density (and, overdamped, a drag) above 0"
    )]
    Inertia { body: String, what: &'static str, value: f64 },
    #[error("body \"{first}\" and {second} have the same centre; hint: place the bodies without overlap")]
    Coincident { first: String, second: String },
    #[error("body \"{first}\" and {second} overlap by {depth:.3e}; hint: place the bodies without overlap")]
    Overlap { first: String, second: String, depth: f64 },
    #[error(
        "the bodies cannot move without overlap, \"{first}\" and {second} least of all (missed by {miss:.1e} after {iterations} iterations); hint: \
         a body may be caught between moving obstacles or walls; or take a smaller step"
    )]
    Caught { first: String, second: String, miss: f64, iterations: usize },
    #[error("`{key}` = {value}: {rule}; hint: {hint}")]
    Setting { key: &'static str, value: f64, rule: &'static str, hint: &'static str },
}
