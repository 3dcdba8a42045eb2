//! Wall time by phase of the computation.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Seconds spent in each named phase.
#[derive(Debug, Default, Clone)]
pub struct Phases {
    spent: BTreeMap<&'static str, (Duration, usize)>,
}

impl Phases {
    /// Runs `work` and books its time under `name`.
    pub fn measure<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        let (spent, calls) = self.spent.entry(name).or_default();
        *spent += start.elapsed();
        *calls += 1;
        result
    }

    /// Adds what another clock has measured.
    pub fn add(&mut self, other: &Phases) {
        for (name, (spent, calls)) in &other.spent {
            let entry = self.spent.entry(name).or_default();
            *entry = (entry.0 + *spent, entry.1 + calls);
        }
    }

    /// How often a phase ran.
    pub fn calls(&self, name: &str) -> usize {
        self.spent.get(name).map_or(0, |(_, calls)| *calls)
    }

    /// Seconds by phase.
    pub fn seconds(&self) -> BTreeMap<&'static str, f64> {
        self.spent.iter().map(|(name, (d, _))| (*name, d.as_secs_f64())).collect()
    }
}
