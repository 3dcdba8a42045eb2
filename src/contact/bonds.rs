//! What contact remembers from step to step: the bonds of gluey pairs (Lefebvre 2009).

use serde::{Deserialize, Serialize};

use super::Partner;
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

    /// Those of the places of one pair.
    pub fn of_pair(&self, pair: Pair) -> &[(Key, Bond)] {
        let start = self.list.partition_point(|(key, _)| key.pair() < pair);
        let end = start + self.list[start..].partition_point(|(key, _)| key.pair() == pair);
        &self.list[start..end]
    }

    /// The bonds of a pair for the places where it touches now. A corner that has taken over from another one takes
    /// over its γ as well.
    pub fn shared(&self, pair: Pair, slots: &[u32]) -> Vec<Bond> {
        let mut bonds = vec![Bond::default(); slots.len()];
        for (key, bond) in self.of_pair(pair) {
            let heir = slots.iter().position(|slot| *slot == key.slot);
            match heir {
                Some(k) => {
                    bonds[k].gamma += bond.gamma;
                    bonds[k].multiplier = bond.multiplier;
                }
                None => {
                    if let Some(first) = bonds.first_mut() {
                        first.gamma += bond.gamma;
                    }
                }
            }
        }
        bonds
    }
}
