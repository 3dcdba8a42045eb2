//! What contact remembers from step to step: the bonds of gluey pairs (Lefebvre 2009).

use serde::{Deserialize, Serialize};

use super::Partner;
use super::gap::Touch;
use super::pairs::Pair;
use crate::body::leaving::Remaining;

/// A place where a body touches something: pairs of flat sides have two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Key {
    /// The first body of the pair, of the lower index.
    pub body: usize,
    /// What it touches.
    pub partner: Partner,
    /// Which of these two.
    pub slot: u32,
}

impl Key {
    fn pair(&self) -> Pair {
        Pair { body: self.body, partner: self.partner }
    }
}

/// What is kept of it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Bond {
    /// `γ ≤ 0`: how much the pair has been pressed, and not yet pulled.
    pub gamma: f64,
    /// The last multiplier beyond its bound, from which the next projection starts.
    pub multiplier: f64,
}

/// Bonds in the order of their keys; those without γ and multiplier are left out.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Bonds {
    list: Vec<(Key, Bond)>,
}

impl Bonds {
    /// Sorts bonds by their keys.
    pub fn new(mut list: Vec<(Key, Bond)>) -> Self {
        list.retain(|(_, bond)| bond.gamma != 0.0 || bond.multiplier != 0.0);
        list.sort_unstable_by_key(|(key, _)| *key);
        Self { list }
    }

    /// Those between bodies that are left, and of these with walls.
    #[must_use]
    pub fn of(&self, remaining: &Remaining) -> Self {
        let of = |(key, bond): &(Key, Bond)| {
            let (body, partner) = (remaining.number(key.body)?, key.partner.of(remaining)?);
            Some((Key { body, partner, slot: key.slot }, *bond))
        };
        Self { list: self.list.iter().filter_map(of).collect() }
    }

    /// All of them, in order.
    pub fn all(&self) -> &[(Key, Bond)] {
        &self.list
    }

    /// To read them in the order of pairs.
    pub(super) fn in_order(&self) -> InOrder<'_> {
        InOrder { rest: &self.list }
    }
}

/// The bonds of pairs that ascend.
pub(super) struct InOrder<'a> {
    rest: &'a [(Key, Bond)],
}

impl InOrder<'_> {
    /// The bonds of a pair for the places where it touches now; no later pair has been asked for. A corner that has
    /// taken over from another one takes over its γ as well.
    pub fn share(&mut self, pair: Pair, touches: &[Touch], out: &mut Vec<Bond>) {
        let before = self.rest.iter().take_while(|(key, _)| key.pair() < pair).count();
        let count = self.rest[before..].iter().take_while(|(key, _)| key.pair() == pair).count();
        let (own, rest) = self.rest[before..].split_at(count);
        self.rest = rest;
        out.clear();
        out.resize(touches.len(), Bond::default());
        for (key, bond) in own {
            let heir = touches.iter().position(|touch| touch.slot == key.slot);
            match heir {
                Some(k) => {
                    out[k].gamma += bond.gamma;
                    out[k].multiplier = bond.multiplier;
                }
                None => {
                    if let Some(first) = out.first_mut() {
                        first.gamma += bond.gamma;
                    }
                }
            }
        }
    }
}
