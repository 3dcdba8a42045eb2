//! Factors of terms: keys of `[model]` that are 0 unless they are given.

use super::{MASS, MOLECULAR, MOMENTUM, POLARITY, Term};
use crate::form::words::Jet;
use crate::model::parameters::ModelKind;

/// The factor of a term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factor {
    /// In `[model]`.
    pub key: &'static str,
    pub symbol: &'static str,
    /// What it does, for the docs.
    pub help: &'static str,
}

/// Most terms with a factor of their own.
const MOST: usize = 16;

/// The factors of all terms, 0 where they are not given.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Factors([f64; MOST]);

/// All factors that there are, in the order of the lists.
pub fn all() -> impl Iterator<Item = (Factor, [bool; 2])> {
    list(MOMENTUM).chain(list(MASS)).chain(list(POLARITY)).chain(list(MOLECULAR))
}

/// The factors of a list, and whether the incompressible and the compressible sheet have them.
fn list<V: Jet>(terms: &'static [Term<V>]) -> impl Iterator<Item = (Factor, [bool; 2])> {
    let kinds = [ModelKind::Incompressible, ModelKind::Compressible];
    terms.iter().filter_map(move |term| Some((term.factor?, kinds.map(|kind| term.formula.of(kind).is_some()))))
}

/// Those of a kind.
pub fn of_kind(kind: ModelKind) -> impl Iterator<Item = Factor> {
    let place = match kind {
        ModelKind::Incompressible => 0,
        ModelKind::Compressible => 1,
    };
    all().filter(move |(_, has)| has[place]).map(|(factor, _)| factor)
}

impl Factors {
    /// None given.
    pub const NONE: Self = Self([0.0; MOST]);

    /// The value under a key; 0 where it was not given.
    ///
    /// # Panics
    /// A key that no term has.
    pub fn of(&self, key: &str) -> f64 {
        self.0[place(key)]
    }

    /// With another value under a key.
    ///
    /// # Panics
    /// A key that no term has.
    #[must_use]
    pub fn with(mut self, key: &str, value: f64) -> Self {
        self.0[place(key)] = value;
        self
    }
}

fn place(key: &str) -> usize {
    let place = all().position(|(factor, _)| factor.key == key);
    place.filter(|place| *place < MOST).unwrap_or_else(|| panic!("no term has the factor `{key}`"))
}
