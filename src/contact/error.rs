//! Why a contact problem has no answer.

/// An error of contact; `at` is empty or names the time. Bodies are named, walls numbered from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message of an error says what its parts are")]
pub enum ContactError {
    #[error(
        "Δt = {dt}: a step must be finite and greater than 0; hint: end the run one step earlier instead of making an \
         empty step"
    )]
    Step { dt: f64 },
    #[error(
        "the {what} of body \"{body}\" is {value}{at}: it must be finite; hint: a formula must be finite wherever it \
         is used"
    )]
    NotFinite { body: String, what: &'static str, value: f64, at: String },
    #[error(
        "body \"{body}\" has {what} = {value}: it must be finite and greater than 0; hint: give it a density (and, \
         overdamped, a drag) above 0"
    )]
    Inertia { body: String, what: &'static str, value: f64 },
    #[error("body \"{first}\" and {second} have the same centre; hint: place the bodies without overlap")]
    Coincident { first: String, second: String },
    #[error("body \"{first}\" and {second} overlap by {depth:.3e}; hint: place the bodies without overlap")]
    Overlap { first: String, second: String, depth: f64 },
    #[error(
        "the bodies cannot move without overlap, \"{first}\" and {second} least of all (missed by {miss:.1e} after \
         {iterations} iterations); hint: {hint}"
    )]
    Caught { first: String, second: String, miss: f64, iterations: usize, hint: String },
    #[error(
        "\"{first}\" and {second} move by {travel:.2e} past each other in one step of {dt:.2e}, and could pass \
         through each other: no more than {limit:.2e} is followed; hint: take a smaller step"
    )]
    TooFar { first: String, second: String, travel: f64, limit: f64, dt: f64 },
    #[error(
        "\"{first}\" and {second} overlap by {miss:.1e} after a step of {dt:.2e} in which they turn, and no small \
         displacement parts them; hint: take a smaller step"
    )]
    Unrepaired { first: String, second: String, miss: f64, dt: f64 },
    #[error(
        "the friction between \"{first}\" and {second} does not settle in a step of {dt:.2e}: their sliding still \
         changes by {miss:.1e}; hint: take a smaller step, or a smaller `contact.friction`"
    )]
    Unsettled { first: String, second: String, miss: f64, dt: f64 },
    #[error("the flow does not tell how contact moves the bodies: {reason}")]
    Flow { reason: String },
    #[error("`{key}` = {value}: {rule}; hint: {hint}")]
    Setting { key: &'static str, value: f64, rule: &'static str, hint: &'static str },
}

impl ContactError {
    /// Whether a shorter step can be what this one could not.
    pub fn is_cured_by_a_smaller_step(&self) -> bool {
        match self {
            Self::TooFar { .. } | Self::Unrepaired { .. } | Self::Unsettled { .. } => true,
            Self::Step { .. } | Self::NotFinite { .. } | Self::Inertia { .. } | Self::Coincident { .. } => false,
            Self::Overlap { .. } | Self::Caught { .. } | Self::Setting { .. } | Self::Flow { .. } => false,
        }
    }
}
