//! Factors of terms: keys of `[model]` that are 0 unless they are given.

use super::{MASS, MOLECULAR, MOMENTUM, POLARITY, Term};
use crate::form::words::Jet;
use crate::model::parameters::ModelKind;

/// The factor of a term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factor {
    /// In `[model]`.
    pub key: &'static str,
    /// As in formulas, such as `γ_v`.
    pub symbol: &'static str,
    /// What it does, for the docs.
    pub help: &'static str,
}

/// Most factors that a scene may give.
const MOST: usize = 16;

/// The factors that are given, by key; all others are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    given: [(&'static str, f64); MOST],
    count: usize,
}

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
    pub const NONE: Self = Self { given: [("", 0.0); MOST], count: 0 };

    /// The value under a key; 0 where it is not given.
    #[inline]
    pub fn of(&self, key: &str) -> f64 {
        self.given[..self.count].iter().find(|(name, _)| *name == key).map_or(0.0, |(_, value)| *value)
    }

    /// With another value under a key.
    ///
    /// # Panics
    /// A key that no term has, or more than 16 of them.
    #[must_use]
    pub fn with(mut self, key: &str, value: f64) -> Self {
        let (factor, _) = all().find(|(factor, _)| factor.key == key).expect("the factor of a term");
        match self.given[..self.count].iter_mut().find(|(name, _)| *name == key) {
            Some((_, old)) => *old = value,
            None => {
                self.given[self.count] = (factor.key, value);
                self.count += 1;
            }
        }
        self
    }
}

impl Default for Factors {
    fn default() -> Self {
        Self::NONE
    }
}
